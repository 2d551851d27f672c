//! `maglev bundle`: a scenario with its units and the master as one unit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use super::system::Opened;
use bundle::{Bundled, Expose, Library, Order};
use clap::Args;
use maglev::Error;
use scenario::{GivenTimes, Override};

const EXAMPLES: &str = "\
Examples:
  maglev bundle scenarios/low-speed.json --out train.fmu
  maglev bundle scenarios/one-magnet.json --out magnet.fmu \\
      --expose 'ems_01.gain_gap=gain' --expose guideway.midspan_displacement_01=deflection
  maglev bundle scenarios/one-bogie.json --out bogie.fmu --only-exposed \\
      --expose 'vehicle.gap_*' --expose vehicle.travel_speed=speed

By default the unit has all inputs without a source, all parameters (equal ones of a row of
instances as one), and the recorded signals as outputs, each as INSTANCE_VARIABLE.";

/// Arguments of `maglev bundle`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The scenario, or a system (.ssp). Its experiment is the unit's default; other start and stop
    /// times work too. If it asks for an accuracy, the step inside is chosen now.
    scenario: PathBuf,
    /// The new unit (.fmu).
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Expose these variables too, as one variable if a name is given. Can be repeated.
    #[arg(long, value_name = "PATTERN[=NAME]")]
    expose: Vec<Expose>,
    /// Expose only what --expose names.
    #[arg(long, requires = "expose")]
    only_exposed: bool,
    /// Set a parameter or start value, as for `maglev run`.
    #[arg(long, value_name = "INSTANCE.VARIABLE=VALUE")]
    set: Vec<Override>,
    /// Communication step inside (s), instead of the scenario's.
    #[arg(long, value_name = "H")]
    step: Option<f64>,
    /// The library of bundles, if it is not where `cargo xtask package` puts it.
    #[arg(long, value_name = "FILE")]
    library: Option<PathBuf>,
}

/// Packs the unit and prints what it has.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let given = GivenTimes { step: arguments.step, ..GivenTimes::default() };
    let opened = Opened::new(&arguments.scenario, None)?;
    let mut scenario = opened.load(given)?;
    scenario.overrides.clone_from(&arguments.set);
    let library = Library::find(arguments.library.as_deref())?;
    let name = arguments.out.file_stem().unwrap_or_default().to_string_lossy();
    let order = Order {
        scenario: &scenario,
        name: &name,
        expose: &arguments.expose,
        defaults: !arguments.only_exposed,
        library: &library,
    };
    let bundled = super::at_home(|| bundle::bundle(&order, &mut |text| eprintln!("note: {text}")))?;
    bundled.write(&arguments.out)?;
    super::print(&summary(&bundled, &arguments.out))
}

fn summary(bundled: &Bundled, out: &Path) -> String {
    let Bundled { table, notes, platforms, .. } = bundled;
    let count = |role| table.variables.iter().filter(|it| it.role == role).count();
    let mut text = format!(
        "{}: {}, for {}\n{} inputs, {} parameters ({} tunable), {} outputs\n",
        out.display(),
        table.model_name,
        platforms.join(", "),
        count(bundle::Role::Input),
        count(bundle::Role::Parameter) + count(bundle::Role::Tunable),
        count(bundle::Role::Tunable),
        count(bundle::Role::Output),
    );
    for note in notes {
        // writing to a String cannot fail
        let _ = writeln!(text, "note: {note}");
    }
    text
}
