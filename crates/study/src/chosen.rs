//! One step for all points of a study whose scenario asks for an accuracy.
//!
//! All points have the same step, so that their figures differ by their factors only; and the scenario's algorithm, so
//! that no clock decides: every process, on every machine, chooses the same. The first, the middle and the last point
//! are tried, and the smallest step that one of them needs is taken.

use in_memory::accuracy::{AccuracyError, choose_step};
use results::summary::AccuracyReport;
use scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::{Study, StudyError, Target, plan};

/// Keys that a factor cannot vary beside an accuracy: they are what is chosen, or what the step must divide.
const CHOSEN: [&str; 7] = [
    "accuracy",
    "accuracy_over",
    "algorithm",
    "experiment.start",
    "experiment.step",
    "experiment.stop",
    "record",
];

/// The step of all points, and how it was chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChosenStep {
    /// Communication step (s).
    pub step: f64,
    /// How it was chosen, at the point that needs it.
    pub accuracy: AccuracyReport,
}

impl ChosenStep {
    /// What study.json says about it.
    pub(crate) fn of_results(as_run: Option<&Value>) -> Option<Self> {
        serde_json::from_value(as_run?.get("chosen")?.clone()).ok()
    }

    /// Gives it to the scenario of a point.
    pub(crate) fn give(&self, scenario: &mut Scenario) {
        scenario.experiment.step = self.step;
        (scenario.accuracy, scenario.accuracy_over) = (None, None);
    }
}

/// Refuses factors of what is chosen, or of the accuracy itself.
pub(crate) fn check(study: &Study) -> Result<(), StudyError> {
    let asks = study.base()?.accuracy.is_some();
    for (name, factor) in &study.file.factors {
        for target in factor.target.all() {
            let Target::Key(target) = target else { continue };
            let within = |key: &&&str| {
                let rest = target.key.strip_prefix(**key);
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
            };
            let Some(key) = CHOSEN.iter().find(within) else { continue };
            if asks || key.starts_with("accuracy") {
                let problem = format!(
                    "\"{key}\" cannot be a factor: the step is chosen once for all points by the scenario's \"accuracy\"; \
                     remove the factor, or \"accuracy\" from the scenario"
                );
                let at = format!("factors.{name}.target");
                return Err(StudyError::Key { path: study.path.clone(), at, problem });
            }
        }
    }
    Ok(())
}

/// Chooses the step; `None` if the scenario asks for no accuracy.
pub(crate) fn choose(
    study: &Study,
    tell: &mut dyn FnMut(&str),
    interrupted: &mut dyn FnMut() -> bool,
) -> Result<Option<ChosenStep>, StudyError> {
    if study.base()?.accuracy.is_none() {
        return Ok(None);
    }
    let count = study.count();
    let mut numbers = vec![1, count.div_ceil(2), count];
    numbers.dedup();
    let mut found: Vec<(u64, ChosenStep)> = Vec::new();
    let mut failed: Option<(u64, AccuracyError)> = None;
    let mut left_out = String::new();
    for &number in &numbers {
        let scenario = plan::varied(study, &study.point(number)?)?;
        let mut tell = |text: &str| tell(&format!("point {number}: {text}"));
        match choose_step(&scenario, &mut tell, interrupted) {
            Ok(None) => {}
            Ok(Some(choice)) => {
                let (step, accuracy) = (choice.scenario.experiment.step, choice.report);
                found.push((number, ChosenStep { step, accuracy }));
            }
            Err(error @ AccuracyError::Interrupted) => {
                return Err(StudyError::Accuracy { number, source: error });
            }
            Err(error) => {
                // a point that is unstable has no accuracy
                left_out += &format!(
                    " Point {number} is left out: {}.",
                    results::causes(&error).join(": ")
                );
                failed.get_or_insert((number, error));
            }
        }
    }
    let strictest = found.into_iter().min_by(|a, b| a.1.step.total_cmp(&b.1.step));
    let Some((number, mut chosen)) = strictest else {
        return match failed {
            Some((number, source)) => Err(StudyError::Accuracy { number, source }),
            None => Ok(None),
        };
    };
    let listed: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    chosen.accuracy.explanation = format!(
        "One step for all points; tried at {} {} only, and the smallest step that one of them needs is taken: \
         that of point {number}. {}{left_out}",
        if numbers.len() == 1 { "point" } else { "points" },
        listed.join(", "),
        chosen.accuracy.explanation,
    );
    Ok(Some(chosen))
}
