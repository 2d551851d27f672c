//! `maglev reference`

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use fmi2_conformance::reference::{self, files};
use fmi2_import::package::Package;
use maglev::Error;

/// Arguments of `maglev reference`.
#[derive(Args)]
pub struct Arguments {
    /// The unit (.fmu), with experiments as FMI-LS-REF.
    unit: PathBuf,
}

/// Repeats the unit's reference experiments. The exit status is 1 if a signal is outside its tolerance.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let package = Arc::new(Package::open(&arguments.unit)?);
    let mut text = String::new();
    let mut outside = 0;
    for experiment in files::experiments(&package)? {
        let found = reference::simulate(&package, &experiment)?;
        // writing to a String cannot fail
        let _ = writeln!(
            text,
            "experiment {}: {} to {} s in steps of {} s, tolerance {:e}",
            experiment.name,
            experiment.start,
            experiment.stop,
            experiment.step,
            experiment.tolerance
        );
        for deviation in reference::compare(&experiment.reference, &found) {
            // written so that NaN is outside
            let within = deviation.relative <= experiment.tolerance;
            outside += usize::from(!within);
            let place = if deviation.relative == 0.0 {
                "identical".to_owned()
            } else if deviation.relative.is_nan() {
                format!("NaN at {} s", deviation.time)
            } else {
                format!("{:.1e} of its largest value, at {} s", deviation.relative, deviation.time)
            };
            let verdict = if within { "" } else { "  OUTSIDE THE TOLERANCE" };
            let _ = writeln!(text, "  {:<32}{place}{verdict}", deviation.signal);
        }
    }
    super::print(&text)?;
    Ok(if outside > 0 { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}
