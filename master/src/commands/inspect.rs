//! `maglev inspect`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use master::description::{Causality, Description, Variability, Variable};
use master::error::Error;
use master::package::Package;

/// Arguments of `maglev inspect`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu).
    unit: PathBuf,
    /// Print the whole description as JSON.
    #[arg(long)]
    json: bool,
}

/// Prints a page about the unit.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let package = Package::open(&arguments.unit)?;
    let text = if arguments.json {
        serde_json::to_string_pretty(package.description()).unwrap_or_default() + "\n"
    } else {
        page(&package)
    };
    super::print(&text)
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(package: &Package) -> String {
    let description = package.description();
    let mut text = identity(package);
    text += &capabilities(description);
    text += &counts(description);
    text += &constants(description);
    let all = &description.variables;
    let of = |causality| {
        move |variable: &&Variable| {
            variable.causality == causality && variable.variability != Variability::Constant
        }
    };
    table(&mut text, "Parameters", all.iter().filter(of(Causality::Parameter)), |_, variable| {
        let tunable = variable.variability == Variability::Tunable;
        let kind = if tunable { " (tunable)" } else { "" };
        vec![start(variable), unit(variable), range(variable) + kind]
    });
    table(&mut text, "Inputs", all.iter().filter(of(Causality::Input)), |_, variable| {
        vec![start(variable), unit(variable), range(variable)]
    });
    table(&mut text, "Outputs", all.iter().filter(of(Causality::Output)), |name, variable| {
        let inputs = description
            .find(name)
            .map(|index| description.step_dependencies(index).len())
            .unwrap_or_default();
        vec![String::new(), unit(variable), format!("depends on {inputs} inputs")]
    });
    text
}

fn identity(package: &Package) -> String {
    let description = package.description();
    let mut text = description.model_name.clone();
    if let Some(version) = &description.version {
        let _ = write!(text, " {version}");
    }
    if let Some(what) = &description.description {
        let _ = write!(text, ": {what}");
    }
    text.push('\n');
    let or_none = |value: &Option<String>| value.clone().unwrap_or_else(|| "-".to_owned());
    let platforms = match package.platforms() {
        list if list.is_empty() => "none".to_owned(),
        list => list.join(", "),
    };
    for (name, value) in [
        ("file", package.path().display().to_string()),
        ("identifier", description.co_simulation.model_identifier.clone()),
        ("guid", description.guid.clone()),
        ("author", or_none(&description.author)),
        ("licence", or_none(&description.license)),
        ("made by", or_none(&description.generation_tool)),
        ("binaries", platforms),
    ] {
        let _ = writeln!(text, "  {name:<12}{value}");
    }
    let experiment = &description.default_experiment;
    if let (Some(stop), Some(step)) = (experiment.stop_time, experiment.step_size) {
        let begin = experiment.start_time.unwrap_or(0.0);
        let _ = writeln!(text, "  {:<12}{begin} s to {stop} s, step {step} s", "experiment");
    }
    text
}

fn capabilities(description: &Description) -> String {
    let co = &description.co_simulation;
    let mut text = "\nCapabilities\n".to_owned();
    let yes = |flag: bool| if flag { "yes" } else { "no" };
    for (name, flag) in [
        ("any communication step", co.can_handle_variable_communication_step_size),
        ("interpolates inputs", co.can_interpolate_inputs),
        ("saves and restores its state", co.can_get_and_set_fmu_state),
        ("serializes its state", co.can_serialize_fmu_state),
        ("directional derivatives", co.provides_directional_derivative),
        ("several instances per process", !co.can_be_instantiated_only_once_per_process),
        ("runs on its own", !co.needs_execution_tool),
    ] {
        let _ = writeln!(text, "  {name:<32}{}", yes(flag));
    }
    let _ = writeln!(
        text,
        "  {:<32}{}",
        "output derivatives up to order", co.max_output_derivative_order
    );
    text
}

fn counts(description: &Description) -> String {
    let mut text = "\nVariables\n".to_owned();
    for (name, causality) in [
        ("parameters", Causality::Parameter),
        ("calculated parameters", Causality::CalculatedParameter),
        ("inputs", Causality::Input),
        ("outputs", Causality::Output),
        ("local", Causality::Local),
    ] {
        let count = description.with_causality(causality).count();
        let _ = writeln!(text, "  {name:<32}{count}");
    }
    text
}

fn constants(description: &Description) -> String {
    let mut text = String::new();
    let constants =
        description.variables.iter().filter(|it| it.variability == Variability::Constant);
    table(&mut text, "Constants", constants, |_, variable| vec![start(variable), unit(variable)]);
    text
}

fn start(variable: &Variable) -> String {
    variable.start.as_ref().map(ToString::to_string).unwrap_or_default()
}

fn unit(variable: &Variable) -> String {
    variable.unit.clone().unwrap_or_default()
}

fn range(variable: &Variable) -> String {
    match (variable.min, variable.max) {
        (None, None) => String::new(),
        (Some(min), None) => format!("≥ {min}"),
        (None, Some(max)) => format!("≤ {max}"),
        (Some(min), Some(max)) => format!("[{min} … {max}]"),
    }
}

/// Rows that differ only by a running number are shown as one.
fn table<'a>(
    text: &mut String,
    title: &str,
    variables: impl Iterator<Item = &'a Variable>,
    columns: impl Fn(&str, &Variable) -> Vec<String>,
) {
    let mut rows: Vec<Row> = Vec::new();
    for variable in variables {
        let mut cells = columns(&variable.name, variable);
        cells.push(variable.description.clone().unwrap_or_default());
        match rows.last_mut().filter(|row| row.continues(&variable.name, &cells)) {
            Some(row) => row.last = Some(variable.name.clone()),
            None => rows.push(Row { first: variable.name.clone(), last: None, cells }),
        }
    }
    if rows.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n{title}");
    let mut widths = vec![0; rows.iter().map(|row| row.cells.len()).max().unwrap_or(0) + 1];
    for row in &rows {
        for (width, cell) in widths.iter_mut().zip(std::iter::once(&row.name()).chain(&row.cells)) {
            *width = cell.chars().count().max(*width);
        }
    }
    for row in &rows {
        let mut line = String::from(" ");
        for (width, cell) in widths.iter().zip(std::iter::once(&row.name()).chain(&row.cells)) {
            if *width > 0 {
                let _ = write!(line, " {cell:<width$} ");
            }
        }
        let _ = writeln!(text, "{}", line.trim_end());
    }
}

struct Row {
    first: String,
    last: Option<String>,
    cells: Vec<String>,
}

impl Row {
    fn name(&self) -> String {
        match &self.last {
            Some(last) => format!("{} … {last}", self.first),
            None => self.first.clone(),
        }
    }

    fn continues(&self, name: &str, cells: &[String]) -> bool {
        let plain = |text: &str| text.chars().filter(|c| !c.is_ascii_digit()).collect::<String>();
        let numbered = |text: &str| text.ends_with(|c: char| c.is_ascii_digit());
        numbered(name)
            && numbered(&self.first)
            && plain(name) == plain(&self.first)
            && match (cells.split_last(), self.cells.split_last()) {
                // values must be equal, descriptions may count along
                (Some((text, values)), Some((first, same))) => {
                    values == same && plain(text) == plain(first)
                }
                _ => false,
            }
    }
}
