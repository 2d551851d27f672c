//! Reference results: the outputs of a single FMU for given inputs, and whether it still reproduces them.
//!
//! An experiment has inputs over time, the outputs for them, and a tolerance. FMUs contain theirs in the form of the
//! layered standard FMI-LS-REF ([`files`]). At each communication point an input is set to its value there, which is
//! linear between the rows of the file. Of two rows at the same time the later one counts. Inputs are held during a
//! step, as by importers that send no input derivatives.

mod error;
pub mod files;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

pub use error::ReferenceError;
pub use files::{ReferenceExperiment, ReferenceTable};

use fmi2_import::description::Type;
use fmi2_import::instance::Instance;
use fmi2_import::library::Functions;
use fmi2_import::package::Package;
use fmi2_import::span::between;

/// The largest deviation of a signal from its reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Deviation {
    /// Name of the compared output.
    pub signal: String,
    /// Largest difference, as a fraction of the largest absolute value of the reference.
    pub relative: f64,
    /// Time of the largest difference (s).
    pub time: f64,
}

/// Runs an experiment. The result has the columns and times of its reference.
///
/// # Errors
/// A column is unknown, the times are not whole numbers of steps, or the FMU fails.
pub fn simulate(
    package: &Arc<Package>,
    experiment: &ReferenceExperiment,
) -> Result<ReferenceTable, ReferenceError> {
    let inputs = references(package, &experiment.inputs)?;
    let outputs = references(package, &experiment.reference)?;
    let steps = points(experiment)?;
    let functions = Functions::load(package)?;
    let dead = Arc::new(AtomicBool::new(false));
    let name = package.description().co_simulation.model_identifier.clone();
    let mut unit = Instance::new(package, functions, &dead, &name)?;
    let (start, stop) = (experiment.start, experiment.stop);
    unit.setup_experiment(None, start, stop)?;
    unit.enter_initialization_mode()?;
    let mut values = vec![0.0; inputs.len()];
    experiment.inputs.at(start, &mut values);
    unit.set_real(&inputs, &values)?;
    unit.exit_initialization_mode()?;
    let mut result =
        ReferenceTable { names: experiment.reference.names.clone(), ..ReferenceTable::default() };
    let mut row = vec![0.0; outputs.len()];
    let mut done = 0;
    for (&step, &recorded) in steps.iter().zip(&experiment.reference.times) {
        for k in done..step {
            let time = experiment.time(k);
            experiment.inputs.at(time, &mut values);
            unit.set_real(&inputs, &values)?;
            unit.do_step(time, between(time, experiment.time(k + 1)))?;
        }
        done = step;
        unit.get_real(&outputs, &mut row)?;
        result.times.push(recorded);
        result.rows.push(row.clone());
    }
    unit.terminate()?;
    Ok(result)
}

/// Value references of a table's columns.
fn references(package: &Package, table: &ReferenceTable) -> Result<Vec<u32>, ReferenceError> {
    let description = package.description();
    let find = |name: &String| {
        let found = description.find(name).map(|index| &description.variables[index]);
        found
            .filter(|variable| variable.kind == Type::Real)
            .map(|variable| variable.value_reference)
            .ok_or_else(|| ReferenceError::Unknown { variable: name.clone() })
    };
    table.names.iter().map(find).collect()
}

/// The number of the communication point of each row of the reference.
fn points(experiment: &ReferenceExperiment) -> Result<Vec<u64>, ReferenceError> {
    let point = |&time: &f64| {
        let count = ((time - experiment.start) / experiment.step).round();
        let near = (experiment.start + count * experiment.step - time).abs();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in 0..2^32")]
        if (0.0..4e9).contains(&count) && near <= 1e-9 * experiment.step.max(time.abs()) {
            Ok(count as u64)
        } else {
            Err(ReferenceError::Times(format!(
                "experiment {}: the time {time} s of the reference is not a whole number of steps of {} s \
                 after the start at {} s",
                experiment.name, experiment.step, experiment.start
            )))
        }
    };
    experiment.reference.times.iter().map(point).collect()
}

/// The largest deviation of each signal.
///
/// Both tables must have the same columns and times, as the result of [`simulate`] has.
#[must_use]
pub fn compare(reference: &ReferenceTable, found: &ReferenceTable) -> Vec<Deviation> {
    let deviation = |(column, signal): (usize, &String)| {
        let scale = reference.rows.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        let scale = if scale > 0.0 { scale } else { 1.0 };
        let mut worst = Deviation { signal: signal.clone(), relative: 0.0, time: f64::NAN };
        for ((time, expected), row) in reference.times.iter().zip(&reference.rows).zip(&found.rows)
        {
            let relative = (row[column] - expected[column]).abs() / scale;
            // a NaN must not count as small
            if relative.is_nan() || relative > worst.relative {
                worst = Deviation { relative, time: *time, ..worst };
            }
        }
        worst
    };
    reference.names.iter().enumerate().map(deviation).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_a_deviation_is_seen_and_a_nan_is_one() {
        let table = |values: [f64; 3]| ReferenceTable {
            names: vec!["x".into()],
            times: vec![0.0, 1.0, 2.0],
            rows: values.iter().map(|&x| vec![x]).collect(),
        };
        let reference = table([1.0, -4.0, 2.0]);
        assert_eq!(compare(&reference, &reference)[0].relative, 0.0);
        let found = &compare(&reference, &table([1.0, -4.0, 2.4]))[0];
        assert!((found.relative - 0.1).abs() < 1e-15 && found.time == 2.0, "{found:?}");
        assert!(compare(&reference, &table([1.0, f64::NAN, 2.0]))[0].relative.is_nan());
    }

    #[test]
    fn issue_times_between_the_steps_are_refused() {
        let experiment = |times: Vec<f64>| ReferenceExperiment {
            name: "e".into(),
            start: 1.0,
            stop: 2.0,
            step: 0.25,
            tolerance: 1e-6,
            inputs: ReferenceTable::default(),
            reference: ReferenceTable { times, ..ReferenceTable::default() },
        };
        assert_eq!(points(&experiment(vec![1.0, 1.5, 2.0])).unwrap(), [0, 2, 4]);
        for wrong in [vec![1.1], vec![0.5]] {
            assert!(matches!(points(&experiment(wrong)), Err(ReferenceError::Times(_))));
        }
    }
}
