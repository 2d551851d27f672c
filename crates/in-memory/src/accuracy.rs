//! Chooses communication step and algorithm for the accuracy that a scenario asks for.
//!
//! The first part of the run is simulated with steps that are halved until the difference from the run with half
//! the step is within the accuracy: with the scenario's own algorithm, and with `iterated` of order 6 if all
//! units can save their states. Of the two, the one that took less wall time is chosen; the scenario's own one
//! unless the other is clearly cheaper. [`choose_step`] keeps the scenario's algorithm, so that its choice depends
//! on no clock and is the same each time.

use std::ops::ControlFlow;

use master::simulation::Pool;
use master::{Error, Setup};
use results::Table;
use results::summary::{AccuracyReport, AccuracyTrial};
use scenario::{AlgorithmName, AlgorithmSettings, IterationSettings, Record, Recorded, Scenario};

use crate::run;

/// Time that is simulated for the choice (s), unless the scenario says otherwise.
const OVER: f64 = 5.0;
/// The first step is at most this many times that of the scenario, a power of two …
const MOST: u32 = 32;
/// … and at most this part of the time that is simulated.
const FEWEST_STEPS: f64 = 20.0;
/// The last step is at least the scenario's over this.
const LEAST: f64 = 64.0;
/// `iterated` must take less than this part of the time of the scenario's algorithm.
const CHEAPER: f64 = 0.8;
/// Deviations of a signal below this part of its largest value count as that part: rounding is no motion.
const STILL: f64 = 1e-6;
/// Tolerance of the iterations, relative to the accuracy.
const ITERATION: f64 = 1e-3;

/// Why no step could be chosen.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the messages say it")]
pub enum AccuracyError {
    #[error(transparent)]
    Master(#[from] Error),
    #[error("cannot choose a step for \"accuracy\": {0}")]
    Unsuitable(String),
    #[error("no step gives the accuracy {wanted}: {tried}")]
    NotReached { wanted: f64, tried: String },
    #[error("interrupted while choosing a step for \"accuracy\"")]
    Interrupted,
}

impl AccuracyError {
    /// Whether runs failed or were not exact enough, rather than the scenario being invalid.
    #[must_use]
    pub fn is_failed_run(&self) -> bool {
        match self {
            Self::Master(error) => error.is_failed_run(),
            Self::Unsuitable(_) => false,
            Self::NotReached { .. } | Self::Interrupted => true,
        }
    }

    /// What to do.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Master(error) => error.help(),
            Self::Unsuitable(_) => None,
            Self::NotReached { .. } => Some(
                "give a larger accuracy or a smaller experiment.step; record only signals that are smooth (noise \
                 and sampled signals have no accuracy in this sense)",
            ),
            Self::Interrupted => None,
        }
    }
}

/// The scenario with the chosen step and algorithm, and how they were chosen.
#[derive(Debug, Clone)]
pub struct Choice {
    /// The scenario to run.
    pub scenario: Scenario,
    /// How it was chosen.
    pub report: AccuracyReport,
}

/// Chooses step and algorithm; `None` if the scenario asks for no accuracy. `tell` gets each trial,
/// `interrupted` is asked after each step.
///
/// # Errors
/// The scenario is invalid, or no step gives the accuracy.
pub fn choose(
    scenario: &Scenario,
    tell: &mut dyn FnMut(&str),
    interrupted: &mut dyn FnMut() -> bool,
) -> Result<Option<Choice>, AccuracyError> {
    among(algorithms, scenario, tell, interrupted)
}

/// As [`choose`], but keeps the scenario's algorithm: the same scenario and units lead to the same step each time.
///
/// # Errors
/// As [`choose`].
pub fn choose_step(
    scenario: &Scenario,
    tell: &mut dyn FnMut(&str),
    interrupted: &mut dyn FnMut() -> bool,
) -> Result<Option<Choice>, AccuracyError> {
    let mut choice = among(only_own, scenario, tell, interrupted)?;
    for trial in choice.iter_mut().flat_map(|it| &mut it.report.trials) {
        trial.cost = None;
    }
    Ok(choice)
}

/// Algorithms to try, and a sentence about those that are left out.
type Candidates = (Vec<AlgorithmSettings>, String);

fn among(
    candidates: fn(&Scenario, &Setup, f64) -> Candidates,
    scenario: &Scenario,
    tell: &mut dyn FnMut(&str),
    interrupted: &mut dyn FnMut() -> bool,
) -> Result<Option<Choice>, AccuracyError> {
    let Some(wanted) = scenario.accuracy else { return Ok(None) };
    let setup = Setup::new(scenario)?;
    let mut search = Search::new(scenario, &setup, wanted)?;
    let mut found: Vec<(AlgorithmSettings, AccuracyTrial)> = Vec::new();
    let (algorithms, left_out) = candidates(scenario, &setup, wanted);
    for algorithm in algorithms {
        let most = found.first().and_then(|(_, trial)| trial.cost).map(|cost| 2.0 * cost);
        let trial = search.descend(&algorithm, most, tell, interrupted)?;
        found.extend(trial.map(|trial| (algorithm, trial)));
    }
    let cost = |it: &(AlgorithmSettings, AccuracyTrial)| it.1.cost.unwrap_or(f64::INFINITY);
    let chosen = match &found[..] {
        [] => return Err(search.not_reached()),
        [own, other] if cost(other) < CHEAPER * cost(own) => other,
        [own, ..] => own,
    };
    let (algorithm, trial) = chosen.clone();
    let Search { over, trials, .. } = search;
    let (estimate, signal) = (trial.error.unwrap_or(0.0), trial.signal.unwrap_or_default());
    let explanation = format!(
        "{}, steps of {} s: the estimated error is {estimate:.1e} ({signal}; {wanted:e} is allowed). It is the RMS of \
         the difference from half the step, relative to the RMS of the signal's deviation from its mean, of the worst \
         recorded signal, over the first {over} s only; later parts of the run were not tried.{left_out}",
        full_name(&algorithm),
        trial.step,
    );
    let mut chosen = scenario.clone();
    chosen.accuracy = None;
    chosen.accuracy_over = None;
    chosen.experiment.step = trial.step;
    chosen.algorithm = algorithm;
    let report = AccuracyReport { wanted, estimate, signal, over, explanation, trials };
    Ok(Some(Choice { scenario: chosen, report }))
}

fn full_name(algorithm: &AlgorithmSettings) -> String {
    match algorithm.iteration.order {
        6 if algorithm.name == AlgorithmName::Iterated => "iterated of order 6".to_owned(),
        _ => algorithm.name.as_str().to_owned(),
    }
}

fn only_own(scenario: &Scenario, _: &Setup, _: f64) -> Candidates {
    let text = " The algorithm is that of the scenario; no other one was tried, so that the choice is the same each \
                time.";
    (vec![scenario.algorithm.clone()], text.to_owned())
}

fn algorithms(scenario: &Scenario, setup: &Setup, wanted: f64) -> Candidates {
    let own = scenario.algorithm.clone();
    let mut iterated = own.clone();
    iterated.name = AlgorithmName::Iterated;
    let tolerance = (ITERATION * wanted).min(own.iteration.tolerance);
    iterated.iteration = IterationSettings { order: 6, tolerance, ..own.iteration };
    let unable = setup
        .system()
        .instances
        .iter()
        .find(|instance| !instance.description().co_simulation.can_get_and_set_fmu_state);
    let why = if let Some(unit) = unable {
        format!("{} cannot save its state (canGetAndSetFMUstate)", unit.name)
    } else if !own.groups.is_empty() {
        "the scenario has groups".to_owned()
    } else if own == iterated {
        return (vec![own], String::new());
    } else {
        return (vec![own, iterated], String::new());
    };
    (vec![own], format!(" iterated was not tried: {why}."))
}

/// Runs of the first part of a scenario.
struct Search<'a> {
    scenario: &'a Scenario,
    wanted: f64,
    over: f64,
    /// The largest step (s).
    largest: f64,
    trials: Vec<AccuracyTrial>,
}

/// The signals of a run and its wall time per simulated time, or why it failed.
type Outcome = Result<(Table, f64), String>;

impl<'a> Search<'a> {
    fn new(scenario: &'a Scenario, setup: &Setup, wanted: f64) -> Result<Self, AccuracyError> {
        let unsuitable = |why: &str| AccuracyError::Unsuitable(why.to_owned());
        if setup.signals().next().is_none() {
            return Err(unsuitable("no signals are recorded, and so nothing can be compared"));
        }
        if scenario.algorithm.variable.is_some() {
            return Err(unsuitable("algorithm.variable chooses the steps already"));
        }
        let experiment = scenario.experiment;
        let span = experiment.stop - experiment.start;
        let over = scenario.accuracy_over.unwrap_or(OVER).min(span);
        // what the step has to divide
        let intervals = scenario.record.signals.iter().filter_map(|entry| match entry {
            Recorded::Group(group) => Some(group.interval),
            Recorded::Signal(_) => None,
        });
        let mut whole: Vec<f64> = intervals.chain(scenario.record.interval).collect();
        whole.extend(scenario.checkpoint.map(|it| it.every));
        whole.push(span);
        let divides = |step: f64| {
            whole.iter().all(|it| (it / step - (it / step).round()).abs() < 1e-9 * (it / step))
        };
        let mut largest = experiment.step;
        let mut factor = 2;
        while factor <= MOST {
            let step = experiment.step * f64::from(factor);
            if step * FEWEST_STEPS <= over && divides(step) {
                largest = step;
            }
            factor *= 2;
        }
        let over = ((over / largest).ceil() * largest).min(span);
        Ok(Self { scenario, wanted, over, largest, trials: Vec::new() })
    }

    /// Halves the step until the accuracy is reached. `None` if it is not, or if a run takes more than `most`
    /// wall time per simulated time.
    fn descend(
        &mut self,
        algorithm: &AlgorithmSettings,
        most: Option<f64>,
        tell: &mut dyn FnMut(&str),
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<Option<AccuracyTrial>, AccuracyError> {
        let least = self.scenario.experiment.step / LEAST;
        let mut step = self.largest;
        let mut coarse = self.run(algorithm, step, interrupted)?;
        while step >= least {
            let fine = self.run(algorithm, 0.5 * step, interrupted)?;
            let mut trial = AccuracyTrial {
                algorithm: full_name(algorithm),
                step,
                error: None,
                signal: None,
                cost: coarse.as_ref().ok().map(|it| it.1),
                failure: None,
            };
            match (&coarse, &fine) {
                (Ok((coarse, _)), Ok((fine, _))) => {
                    let (error, signal) = difference(coarse, fine);
                    trial.error = Some(error);
                    trial.signal = Some(signal);
                    tell(&format!(
                        "accuracy: {}, {step} s against half of it: {error:.1e}",
                        trial.algorithm
                    ));
                }
                (Err(why), _) | (_, Err(why)) => {
                    tell(&format!("accuracy: {}, {step} s: {why}", trial.algorithm));
                    trial.failure = Some(why.clone());
                }
            }
            self.trials.push(trial.clone());
            // false for NaN too
            if trial.error.is_some_and(|error| error <= self.wanted) {
                return Ok(Some(trial));
            }
            if fine.as_ref().ok().is_some_and(|(_, cost)| most.is_some_and(|most| *cost > most)) {
                return Ok(None);
            }
            (step, coarse) = (0.5 * step, fine);
        }
        Ok(None)
    }

    /// Runs the first part of the scenario.
    fn run(
        &self,
        algorithm: &AlgorithmSettings,
        step: f64,
        interrupted: &mut dyn FnMut() -> bool,
    ) -> Result<Outcome, AccuracyError> {
        let mut pilot = self.scenario.clone();
        pilot.experiment.stop = pilot.experiment.start + self.over;
        pilot.experiment.step = step;
        pilot.algorithm = algorithm.clone();
        let signals =
            std::mem::take(&mut pilot.record.signals).into_iter().flat_map(|it| match it {
                Recorded::Signal(signal) => vec![signal],
                Recorded::Group(group) => group.signals,
            });
        pilot.record = Record {
            interval: Some(self.largest),
            signals: signals.map(Recorded::Signal).collect(),
            ..Record::default()
        };
        pilot.plots.clear();
        pilot.ride_quality.clear();
        pilot.objectives.clear();
        pilot.limits.clear();
        (pilot.checkpoint, pilot.real_time, pilot.trace) = (None, None, None);
        let setup = Setup::new(&pilot)?;
        let mut ended = false;
        let run = run(&setup, &mut Pool::default(), &mut |_| {
            ended = interrupted();
            if ended { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        if ended {
            return Err(AccuracyError::Interrupted);
        }
        if let Some(error) = run.error {
            return Ok(Err(results::causes(&error).join(": ")));
        }
        Ok(Ok((run.table, run.step_time.as_secs_f64() / self.over)))
    }

    fn not_reached(self) -> AccuracyError {
        let best = self.trials.iter().filter(|trial| trial.error.is_some());
        let best = best.min_by(|a, b| {
            let error = |it: &AccuracyTrial| it.error.unwrap_or(f64::INFINITY);
            error(a).total_cmp(&error(b))
        });
        let tried = match (best, self.trials.last()) {
            (Some(AccuracyTrial { algorithm, step, error: Some(error), signal, .. }), _) => {
                format!(
                    "the best estimate is {error:.1e} ({}), with {algorithm} and steps of {step} s",
                    signal.as_deref().unwrap_or_default()
                )
            }
            (_, Some(AccuracyTrial { failure: Some(why), .. })) => {
                format!("all runs failed, the last because: {why}")
            }
            _ => "no step can be tried".to_owned(),
        };
        AccuracyError::NotReached { wanted: self.wanted, tried }
    }
}

/// The largest error of a signal, and the signal: RMS of the difference relative to the RMS of the deviation from
/// the mean.
fn difference(coarse: &Table, fine: &Table) -> (f64, String) {
    let mut worst = (0.0, String::new());
    for (k, name) in fine.names.iter().enumerate() {
        let Some(values) = coarse.column(name) else { continue };
        let exact = &fine.columns[k];
        if values.len() != exact.len() {
            // one of them has ended early
            return (f64::INFINITY, name.clone());
        }
        #[expect(clippy::cast_precision_loss, reason = "a number of rows")]
        let count = exact.len().max(1) as f64;
        let rms = |sum: f64| (sum / count).sqrt();
        let mean = exact.iter().sum::<f64>() / count;
        let size = rms(exact.iter().map(|x| (x - mean).powi(2)).sum());
        let largest = exact.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let error = rms(exact.iter().zip(values).map(|(x, y)| (x - y).powi(2)).sum());
        let error = if error == 0.0 { 0.0 } else { error / size.max(STILL * largest) };
        // a NaN is worse than everything
        if error > worst.0 || error.is_nan() || worst.1.is_empty() {
            let error = if error.is_nan() { f64::INFINITY } else { error };
            worst = (error, name.clone());
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(columns: [Vec<f64>; 2]) -> Table {
        let names = vec!["a.x".to_owned(), "a.y".to_owned()];
        Table { names, time: vec![0.0, 1.0, 2.0, 3.0], columns: columns.to_vec() }
    }

    /// A deviation of ±1 about 10, off by 1e-3; and a constant, off by rounding.
    #[test]
    fn analytic_errors_are_relative_to_deviations_from_the_mean() {
        let fine = table([vec![9.0, 11.0, 9.0, 11.0], vec![5.0; 4]]);
        let coarse = table([vec![9.001, 11.001, 9.001, 11.001], vec![5.0 + 1e-15; 4]]);
        let (error, signal) = difference(&coarse, &fine);
        assert!((error - 1e-3).abs() < 1e-12 && signal == "a.x", "{error} {signal}");
        let (error, signal) = difference(&fine, &fine);
        assert!(error == 0.0 && !signal.is_empty());
        let lost = table([vec![9.0, f64::NAN, 9.0, 11.0], vec![5.0; 4]]);
        assert_eq!(difference(&lost, &fine), (f64::INFINITY, "a.x".to_owned()));
    }
}
