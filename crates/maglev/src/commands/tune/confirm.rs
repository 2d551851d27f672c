//! Runs before and after, and what their free motion says.

use std::ops::ControlFlow;
use std::str::FromStr;

use in_memory::run;
use maglev::Error;
use master::Setup;
use master::simulation::Pool;
use scenario::{Override, Recorded, Scenario};
use serde::Serialize;
use tune::{TuneResult, oscillations};

/// A signal between two times.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    signal: String,
    from: f64,
    to: f64,
}

impl FromStr for Window {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("\"{text}\" is not of the form instance.variable=FROM:TO, with times in s");
        let (signal, times) = text.split_once('=').ok_or_else(wrong)?;
        let (from, to) = times.split_once(':').ok_or_else(wrong)?;
        let number = |it: &str| it.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        let (from, to) = (number(from).ok_or_else(wrong)?, number(to).ok_or_else(wrong)?);
        if from >= to {
            return Err(format!("\"{text}\": the first time must be before the second"));
        }
        Ok(Self { signal: signal.trim().to_owned(), from, to })
    }
}

/// The strongest oscillation of a run, and the mode that is nearest to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Confirmation {
    /// The condition.
    pub condition: String,
    /// Whether the values are those found.
    pub tuned: bool,
    /// Why there is nothing to compare, if so.
    pub failure: Option<String>,
    /// Re λ and Im λ (1/s) in the run.
    pub run: Option<(f64, f64)>,
    /// Fraction of the motion that it makes up.
    pub share: f64,
    /// Re λ and Im λ (1/s) as predicted.
    pub predicted: Option<(f64, f64)>,
}

/// Runs the scenario under every condition, before and after.
pub fn confirm(
    scenario: &Scenario,
    result: &TuneResult,
    window: &Window,
) -> Result<Vec<Confirmation>, Error> {
    let mut all = Vec::new();
    for condition in &result.conditions {
        for tuned in [false, true] {
            let mut changed = scenario.clone();
            let set = |target: &String, value: String| Override { target: target.clone(), value };
            changed
                .overrides
                .extend(condition.set.iter().map(|(target, value)| set(target, value.clone())));
            if tuned {
                let patch = result.patch();
                changed
                    .overrides
                    .extend(patch.iter().map(|(target, value)| set(target, value.to_string())));
            }
            changed.experiment.stop = window.to;
            changed.record.interval = None;
            changed.record.signals = vec![Recorded::Signal(window.signal.clone())];
            changed.plots.clear();
            changed.checkpoint = None;
            changed.ride_quality.clear();
            let eigenvalues = &condition.eigenvalues[usize::from(tuned)];
            let mut found = Confirmation {
                condition: condition.name.clone(),
                tuned,
                failure: None,
                run: None,
                share: 0.0,
                predicted: None,
            };
            let setup = Setup::new(&changed)?;
            let run = run(&setup, &mut Pool::default(), &mut |_| ControlFlow::Continue(()));
            if let Some(error) = run.error {
                found.failure = Some(results::causes(&error).join(": "));
            } else if let Some(values) = run.table.columns.first() {
                let inside = |t: &f64| *t >= window.from && *t <= window.to;
                let samples: Vec<f64> = run
                    .table
                    .time
                    .iter()
                    .zip(values)
                    .filter(|(t, _)| inside(t))
                    .map(|it| *it.1)
                    .collect();
                match oscillations(&samples, changed.experiment.step).first() {
                    Some(it) => {
                        let place = (it.real, it.imaginary);
                        found.run = Some(place);
                        found.share = it.share;
                        let distance = |s: &&(f64, f64)| (s.0 - place.0).hypot(s.1 - place.1);
                        found.predicted = eigenvalues
                            .iter()
                            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                            .copied();
                    }
                    None => found.failure = Some("the signal does not oscillate there".to_owned()),
                }
            }
            all.push(found);
        }
    }
    Ok(all)
}
