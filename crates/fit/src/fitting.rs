//! From a scenario and a record to fitted parameters.

use std::collections::HashSet;
use std::time::Instant;

use fmi2_import::description::{Type, Value};
use master::Setup;
use master::simulation::Pool;
use measured::{Alignment, Offset, Record, RecordSpec, Units};
use scenario::{Recorded, Scenario};
use serde::Serialize;

use crate::FitError;
use crate::least_squares::{Bounded, Data, Settings, Solution, solve};
use crate::simulator::{Simulator, Wanted, table};
use crate::statistics::{Whiteness, autocorrelation, student_95, whiteness};
use crate::varied::Varied;

/// Fewest values of a column during the run.
const FEWEST: usize = 8;
/// Correlation coefficients from here on are a warning.
const CORRELATED: f64 = 0.95;
/// Lags of the picture of the autocorrelation, at most.
const LAGS: usize = 200;

/// What should be fitted to what.
#[derive(Debug, Clone, Copy)]
pub struct Order<'a> {
    /// The scenario, with the values that do not vary.
    pub scenario: &'a Scenario,
    /// The record.
    pub spec: &'a RecordSpec,
    /// What varies.
    pub varied: &'a [Varied],
    /// Trials and iterations.
    pub settings: Settings,
    /// Threads that run the scenario.
    pub threads: usize,
}

/// How far a fit is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Runs so far.
    pub runs: usize,
    /// Least root mean square of the differences so far, over the standard deviation of the record; in the second pass over the noise of
    /// the first.
    pub best: f64,
}

/// Fitted parameters.
#[derive(Debug, Clone, Serialize)]
pub struct Fit {
    /// Path of the record.
    pub file: String,
    /// What was added to the times of the record; without a fitted offset.
    pub alignment: Alignment,
    /// In the order in which they were given.
    pub parameters: Vec<FittedParameter>,
    /// Correlation coefficients of the estimates; none where a parameter is at a bound or has no influence.
    pub correlations: Vec<Vec<Option<f64>>>,
    /// One for each column of the record.
    pub signals: Vec<FittedSignal>,
    /// Runs of the scenario.
    pub runs: usize,
    /// Iterations of Levenberg-Marquardt.
    pub iterations: usize,
    /// Whether the iterations converged.
    pub converged: bool,
    /// Wall time (s).
    pub seconds: f64,
    /// What limits the result.
    pub warnings: Vec<String>,
    /// The record.
    #[serde(skip)]
    pub record: Option<Record>,
}

/// One fitted parameter.
#[derive(Debug, Clone, Serialize)]
pub struct FittedParameter {
    /// `instance.variable`, or `offset`.
    pub target: String,
    /// Its unit of measure.
    pub unit: Option<String>,
    /// Bounds of the fit.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// Value of the scenario; of a pattern, of the first variable that matches.
    pub before: Option<f64>,
    /// Fitted value.
    pub value: f64,
    /// Standard error if the residuals are white.
    pub standard_error: Option<f64>,
    /// Half the 95 % confidence interval if the residuals are white.
    pub half_width: Option<f64>,
    /// Half the 95 % confidence interval for residuals that are correlated in time (autoregressive).
    pub half_width_correlated: Option<f64>,
    /// Whether the fitted value is at a bound.
    pub at_bound: bool,
    /// Whether the record determines it: its interval is narrower than the bounds.
    pub determined: bool,
}

impl FittedParameter {
    /// Half the 95 % interval that holds: that for correlated residuals if they are not white.
    #[must_use]
    pub fn interval(&self, white: bool) -> Option<f64> {
        if white { self.half_width } else { self.half_width_correlated }
    }
}

/// Residuals of one signal: fitted run minus record.
#[derive(Debug, Clone, Serialize)]
pub struct FittedSignal {
    /// `instance.variable`.
    pub signal: String,
    /// Column of the record.
    pub column: String,
    /// Unit of the signal.
    pub unit: Option<String>,
    /// Fitted values of the record.
    pub samples: usize,
    /// Values of the record outside of the run.
    pub outside: usize,
    /// Root mean square of the differences with the scenario's values; none if these do not run.
    pub rms_before: Option<f64>,
    /// Root mean square of the residuals.
    pub rms_after: f64,
    /// Test for whiteness.
    pub whiteness: Whiteness,
    /// Autocorrelation of the residuals, from lag 0.
    pub autocorrelation: Vec<f64>,
    /// Times of the residuals (s), in the run's time.
    pub times: Vec<f64>,
    /// The residuals.
    pub residuals: Vec<f64>,
}

impl Fit {
    /// Whether the residuals of all signals are white.
    #[must_use]
    pub fn is_white(&self) -> bool {
        self.signals.iter().all(|it| it.whiteness.white)
    }

    /// Offset of the record (s), fitted or not.
    #[must_use]
    pub fn offset(&self) -> f64 {
        let fitted = self.parameters.iter().find(|it| it.target == crate::varied::OFFSET);
        fitted.map_or(self.alignment.offset, |it| it.value)
    }
}

/// Fits parameters. `watch` is called after each group of runs.
///
/// # Errors
/// The scenario, the record or the bounds cannot be used, or no set of parameters runs.
pub fn fit(order: &Order<'_>, watch: &mut dyn FnMut(Progress)) -> Result<Fit, FitError> {
    let begin = Instant::now();
    check(order.varied)?;
    let mut pool = Pool::default();
    let mut scenario = bare(order.scenario);
    if !order.spec.columns.is_empty() {
        let signals = order.spec.columns.iter().map(|it| Recorded::Signal(it.signal.clone()));
        scenario.record.signals = signals.collect();
    }
    let setup = pool.setup(&scenario).map_err(FitError::Setup)?;
    let record = load(&setup, order.spec)?;
    let signals = record.columns.iter().map(|it| Recorded::Signal(it.signal.clone()));
    scenario.record.signals = signals.collect();
    let known = variables(&mut pool, &scenario, &setup, order.varied)?;
    let alignment = match order.spec.offset {
        Offset::Given(offset) => Alignment { offset, found: None },
        Offset::Find => {
            let run =
                table(&mut pool, &scenario).map_err(|reason| FitError::FirstRun { reason })?;
            measured::align(&record, &run, order.spec.offset)?
        }
    };
    let (wanted, data, outside) = wanted(&scenario, &record, order.varied, alignment.offset)?;
    shorten(&mut scenario, &wanted, order.varied);
    let once = setup
        .system()
        .instances
        .iter()
        .any(|it| it.description().co_simulation.can_be_instantiated_only_once_per_process);
    let threads = if once { 1 } else { order.threads };
    let bounded: Vec<Bounded> = order
        .varied
        .iter()
        .zip(&known)
        .map(|(it, Known { before, .. })| {
            let own = if it.is_offset() { Some(alignment.offset) } else { *before };
            let inside = own.filter(|value| (it.low..=it.high).contains(value));
            let start = it.start.or(inside).unwrap_or(f64::midpoint(it.low, it.high));
            Bounded { low: it.low, high: it.high, start }
        })
        .collect();
    let mut simulator =
        Simulator::new(scenario.clone(), order.varied.to_vec(), wanted.clone(), threads)
            .map_err(FitError::Threads)?;
    let before = first_residuals(&mut pool, &scenario, &wanted, &data);
    let solution = solve(&mut simulator, &data, &bounded, order.settings, &mut |runs, best| {
        watch(Progress { runs, best });
    })
    .map_err(FitError::Solve)?;
    drop(simulator);
    let mut fit = Fit {
        file: record.file.display().to_string(),
        alignment,
        parameters: parameters(order.varied, &known, &solution),
        correlations: correlations(&solution),
        signals: Vec::new(),
        runs: solution.evaluations + 1,
        iterations: solution.iterations,
        converged: solution.converged,
        seconds: begin.elapsed().as_secs_f64(),
        warnings: Vec::new(),
        record: None,
    };
    let offset = fit.offset();
    for (k, (column, group)) in record.columns.iter().zip(&data.groups).enumerate() {
        let residuals = &solution.residuals[group.clone()];
        let size = |it: &[f64]| (it.iter().map(|it| it * it).sum::<f64>() / it.len() as f64).sqrt();
        fit.signals.push(FittedSignal {
            signal: column.signal.clone(),
            column: column.column.clone(),
            unit: column.unit.clone(),
            samples: group.len(),
            outside: outside[k],
            rms_before: before.as_ref().map(|it| size(&it[group.clone()])),
            rms_after: size(residuals),
            whiteness: whiteness(residuals),
            autocorrelation: autocorrelation(residuals, LAGS.min(group.len() / 4)),
            times: wanted.columns[k].1.iter().map(|time| time + offset).collect(),
            residuals: residuals.to_vec(),
        });
    }
    fit.warnings = warnings(&fit, &solution);
    fit.record = Some(record);
    Ok(fit)
}

fn check(varied: &[Varied]) -> Result<(), FitError> {
    let mut seen = HashSet::new();
    match varied.iter().find(|it| !seen.insert(it.target.as_str())) {
        Some(it) => Err(FitError::Twice { target: it.target.clone() }),
        None if varied.is_empty() => Err(FitError::NothingVaried),
        None => Ok(()),
    }
}

/// A scenario without what a fit does not need.
fn bare(scenario: &Scenario) -> Scenario {
    let mut bare = scenario.clone();
    (bare.checkpoint, bare.trace, bare.real_time) = (None, None, None);
    bare.record.interval = None;
    bare.plots.clear();
    bare.ride_quality.clear();
    bare.objectives.clear();
    bare.limits.clear();
    bare
}

fn load(setup: &Setup, spec: &RecordSpec) -> Result<Record, FitError> {
    let columns = setup.selection().columns(setup.system());
    let signals: Vec<(String, Option<String>)> =
        columns.into_iter().map(|it| (it.name, it.unit)).collect();
    let units = Units::defined_by(setup.system().instances.iter().map(|it| it.description()));
    Ok(Record::load(spec, &signals, &units)?)
}

/// What the scenario and the unit say of a varied variable.
#[derive(Debug, Clone, Default)]
struct Known {
    before: Option<f64>,
    unit: Option<String>,
}

/// Value in the scenario and unit of each varied variable; of a pattern, of the first one that it matches.
fn variables(
    pool: &mut Pool,
    scenario: &Scenario,
    setup: &Setup,
    varied: &[Varied],
) -> Result<Vec<Known>, FitError> {
    let mut found = Vec::new();
    for it in varied {
        if it.is_offset() {
            found.push(Known { before: None, unit: Some("s".to_owned()) });
            continue;
        }
        // the master says which variables the target means
        let middle = f64::midpoint(it.low, it.high);
        let trial = crate::simulator::with_values(scenario, std::slice::from_ref(it), &[middle]);
        let trial = pool.setup(&trial).map_err(FitError::Setup)?;
        // after those that the scenario itself overrides
        let others = setup.system().overridden.len();
        let mut first = None;
        for change in trial.system().overridden.iter().skip(others) {
            let variable = trial.system().variable(change.port);
            if variable.kind != Type::Real {
                return Err(FitError::NotReal { target: it.target.clone() });
            }
            let (min, max) =
                (variable.min.unwrap_or(f64::NEG_INFINITY), variable.max.unwrap_or(f64::INFINITY));
            if it.low < min || it.high > max {
                let (target, low, high) = (it.target.clone(), it.low, it.high);
                return Err(FitError::Bounds { target, low, high, min, max });
            }
            let instance = &setup.system().instances[change.port.instance];
            let set = instance.parameters.get(&change.port.variable);
            let set = set.or_else(|| instance.inputs.get(&change.port.variable));
            let value = match set.or(variable.start.as_ref()) {
                Some(Value::Real(value)) => Some(*value),
                _ => None,
            };
            first.get_or_insert(Known { before: value, unit: variable.unit.clone() });
        }
        found.push(first.unwrap_or_default());
    }
    Ok(found)
}

/// The times at which the run is compared, the record there, and how many values of each column are not compared.
fn wanted(
    scenario: &Scenario,
    record: &Record,
    varied: &[Varied],
    offset: f64,
) -> Result<(Wanted, Data, Vec<usize>), FitError> {
    let own = varied.iter().find(|it| it.is_offset());
    let (low, high) = own.map_or((offset, offset), |it| (it.low, it.high));
    let (start, stop) = (scenario.experiment.start, scenario.experiment.stop);
    let slack = 1e-9 * start.abs().max(stop.abs());
    let mut columns = Vec::new();
    let (mut values, mut groups, mut outside) = (Vec::new(), Vec::new(), Vec::new());
    for column in &record.columns {
        // the same values for every offset
        let inside = |time: f64| time + low >= start - slack && time + high <= stop + slack;
        let pairs = column.times.iter().zip(&column.values).filter(|(time, _)| inside(**time));
        let (times, own): (Vec<f64>, Vec<f64>) = pairs.map(|(a, b)| (*a, *b)).unzip();
        if times.len() < FEWEST {
            return Err(FitError::TooFew { column: column.column.clone(), count: times.len() });
        }
        outside.push(column.times.len() - times.len());
        groups.push(values.len()..values.len() + own.len());
        values.extend(own);
        columns.push((column.signal.clone(), times));
    }
    Ok((Wanted { columns, offset }, Data { values, groups }, outside))
}

/// Ends the run with the step after the last value of the record.
fn shorten(scenario: &mut Scenario, wanted: &Wanted, varied: &[Varied]) {
    let own = varied.iter().find(|it| it.is_offset());
    let latest = own.map_or(wanted.offset, |it| it.high);
    let ends = wanted.columns.iter().filter_map(|(_, times)| times.last());
    let last = ends.fold(f64::NEG_INFINITY, |most, it| most.max(it + latest));
    let it = &mut scenario.experiment;
    let stop = it.start + ((last - it.start) / it.step - 1e-6).ceil().max(1.0) * it.step;
    it.stop = it.stop.min(stop);
}

/// Differences with the scenario's own values.
fn first_residuals(
    pool: &mut Pool,
    scenario: &Scenario,
    wanted: &Wanted,
    data: &Data,
) -> Option<Vec<f64>> {
    let table = table(pool, scenario).ok()?;
    let mut values = Vec::new();
    for (signal, times) in &wanted.columns {
        let k = table.names.iter().position(|it| it == signal)?;
        let (own, run) = table.points(k);
        let run = measured::Interpolated::new(own, run).ok()?;
        values.extend(times.iter().map(|time| run.at(time + wanted.offset)));
    }
    Some(values.iter().zip(&data.values).map(|(a, b)| a - b).collect())
}

fn parameters(varied: &[Varied], known: &[Known], solution: &Solution) -> Vec<FittedParameter> {
    let factor = student_95(solution.freedom);
    let finite = |it: f64| it.is_finite().then_some(it);
    let information = &solution.information;
    let one = |(k, (it, Known { before, unit })): (usize, (&Varied, &Known))| {
        let (error, robust) = (information.errors[k], information.correlated_errors[k]);
        let half = (0.5 * (it.high - it.low)) / factor;
        FittedParameter {
            target: it.target.clone(),
            unit: unit.clone(),
            low: it.low,
            high: it.high,
            before: *before,
            value: solution.values[k],
            standard_error: finite(error),
            half_width: finite(factor * error),
            half_width_correlated: finite(factor * robust),
            at_bound: solution.at_bound[k],
            determined: !information.undetermined[k] && error < half && !solution.at_bound[k],
        }
    };
    varied.iter().zip(known).enumerate().map(one).collect()
}

fn correlations(solution: &Solution) -> Vec<Vec<Option<f64>>> {
    let finite = |it: &f64| it.is_finite().then_some(*it);
    solution.information.correlations.iter().map(|row| row.iter().map(finite).collect()).collect()
}

fn warnings(fit: &Fit, solution: &Solution) -> Vec<String> {
    let mut found = Vec::new();
    if !fit.converged {
        found.push(format!("the search did not converge within {} iterations", fit.iterations));
    }
    for it in &fit.parameters {
        if it.at_bound {
            found.push(format!(
                "{} is at its bound {}: the best value may lie beyond, and there is no interval",
                it.target, it.value
            ));
        } else if !it.determined {
            found.push(format!(
                "the record does not determine {}: any value between {} and {} may fit as well",
                it.target, it.low, it.high
            ));
        }
    }
    for (j, row) in fit.correlations.iter().enumerate() {
        for (k, value) in row.iter().enumerate().skip(j + 1) {
            let Some(value) = value.filter(|it| it.abs() > CORRELATED) else { continue };
            found.push(format!(
                "{} and {} can hardly be separated: the correlation of their estimates is {value:.4}",
                fit.parameters[j].target, fit.parameters[k].target
            ));
        }
    }
    for it in fit.signals.iter().filter(|it| !it.whiteness.white) {
        found.push(format!(
            "the residual of {} is not white (correlation of neighbours {:.2}, Ljung-Box probability {:.1e}): the model lacks \
             something that the record has, or the noise is coloured. The intervals allow for the correlation, but not for a \
             wrong model",
            it.signal, it.whiteness.first_lag, it.whiteness.probability
        ));
    }
    if let Some(place) = &solution.better_start {
        let texts: Vec<String> = fit
            .parameters
            .iter()
            .zip(place)
            .map(|(it, value)| format!("{} = {value:.6}", it.target))
            .collect();
        found.push(format!(
            "the search began at a trial that fits better than the given start, {}: there may be other minima",
            texts.join(", ")
        ));
    }
    if let Some(reason) = &solution.failure {
        found.push(format!("some sets of parameters did not run to the end; the first: {reason}"));
    }
    found
}
