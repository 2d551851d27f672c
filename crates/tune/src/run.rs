//! The whole tuning.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use maps::Watch;
use master::Setup;
use scenario::Scenario;
use stability_map::damping;

use crate::condition::{Parameter, Prepared, parameters, setup, text};
use crate::counting::{Mode, Role};
use crate::error::TuneError;
use crate::figures::Figures;
use crate::file::{Objective, Tuning};
use crate::goal::{Goal, Limit};
use crate::result::{Active, ConditionResult, FrontPoint, TuneResult, Tuned};
use crate::search::{Evaluate, Point, for_all, random, search};
use crate::sensitivity::{self, Cause};
use crate::store::Store;
use crate::verify::verify;

/// Significant digits of the values found.
const DIGITS: i32 = 4;
/// Eigenvalues that are listed.
const LISTED: usize = 60;
/// Least modulus margin of the front.
const FRONT_FROM: f64 = 0.1;

/// What to tune.
#[derive(Debug, Clone)]
pub struct Request {
    /// The scenario, with all `--set`.
    pub scenario: Scenario,
    /// What may change, for what.
    pub tuning: Tuning,
    /// Threads. The result does not depend on them.
    pub threads: usize,
}

/// Tunes. With a folder, evaluations are kept there until the end: an interrupted tuning continues.
///
/// # Errors
/// A value is not allowed, the scenario does not start under a condition, a unit refuses a value or cannot be tuned, no
/// stable set of values is found, or a file cannot be written.
pub fn tune(
    request: &Request,
    folder: Option<&Path>,
    watch: &dyn Watch,
) -> Result<TuneResult, TuneError> {
    let begin = Instant::now();
    let Request { scenario, tuning, threads } = request;
    tuning.check()?;
    watch.stage("starting the scenario under each condition");
    let parameters = parameters(scenario, tuning)?;
    let own = own_values(&parameters)?;
    let sets = conditions(tuning);
    let inside = |name: &str, source: TuneError| TuneError::Condition {
        name: name.to_owned(),
        source: Box::new(source),
    };
    let setups: Vec<Setup> = sets
        .iter()
        .map(|(name, set)| setup(scenario, set).map_err(|error| inside(name, error)))
        .collect::<Result<_, _>>()?;
    let start: Vec<f64> =
        parameters.iter().zip(&own).map(|(it, own)| it.value(it.place(*own))).collect();
    let prepared: Vec<Prepared<'_>> = sets
        .iter()
        .zip(&setups)
        .map(|((name, _), setup)| {
            Prepared::new(name, setup, &parameters, tuning, &own, &start)
                .map_err(|error| inside(name, error))
        })
        .collect::<Result<_, _>>()?;
    let store = Store::open(folder, &task(request))?;
    let done = AtomicUsize::new(0);
    let most = tuning.samples
        + tuning.evaluations
            * (tuning.starts + 1 + if tuning.front > 0 { tuning.front + 1 } else { 0 });
    let figures = |values: &[f64], exact: bool| -> Result<Vec<Figures>, TuneError> {
        prepared.iter().map(|it| it.figures(&parameters, values, exact)).collect()
    };
    let evaluate = |places: &[f64]| -> Result<Vec<Figures>, TuneError> {
        let found = store.get(places, || figures(&values(&parameters, places), false));
        watch.progress(done.fetch_add(1, Ordering::Relaxed) + 1, most);
        found
    };
    let before = figures(&own, true)?;
    let goal =
        Goal { objective: tuning.objective, limits: tuning.constraints.clone(), reserved: true };
    let mut archive = Vec::new();
    watch.stage("searching");
    let best = best(&evaluate, &goal, &parameters, &start, tuning, *threads, &mut archive)?;
    if !best.figures.iter().all(Figures::stable) {
        return Err(TuneError::Unstable { tried: store.len() });
    }
    watch.stage("computing the front of damping against modulus margin");
    let front = if tuning.front > 0 {
        front(&evaluate, &goal, &parameters, &mut archive, tuning, *threads)?
    } else {
        Vec::new()
    };
    watch.stage("finding out what is active");
    let active = active(&evaluate, &goal, &best, &parameters, &prepared)?;
    let found: Vec<f64> =
        parameters.iter().zip(&best.places).map(|(it, place)| rounded(it, *place)).collect();
    let after = figures(&found, true)?;
    watch.stage("starting the scenario anew with the values found");
    let exact = Goal { reserved: false, ..goal.clone() };
    let mut results = Vec::new();
    for (k, it) in prepared.iter().enumerate() {
        let mut set = sets[k].1.clone();
        set.extend(
            parameters.iter().zip(&found).map(|(it, value)| (it.target.clone(), value.to_string())),
        );
        let modes = it.modes(&parameters, &found)?;
        let verified =
            verify(scenario, &set, it, &modes).map_err(|error| inside(&it.name, error))?;
        results.push(ConditionResult {
            name: it.name.clone(),
            set: sets[k].1.iter().cloned().collect(),
            before: before[k].clone(),
            after: after[k].clone(),
            eigenvalues: [listed(&it.modes(&parameters, &own)?), listed(&modes)],
            method: it.method(),
            ignored: it.rule.left_out.clone(),
            ignored_after: left_out(&modes, tuning.band),
            verified,
        });
    }
    // margins of the whole system count where they are known
    let after: Vec<Figures> = after
        .into_iter()
        .zip(&mut results)
        .map(|(mut figures, result)| {
            if let Some([one, delay_one, all, delay_all]) = result.verified.margins {
                (figures.modulus_one, figures.modulus_all) = (one, all);
                (figures.delay_one, figures.delay_all) = (delay_one, delay_all);
                result.after = figures.clone();
            }
            figures
        })
        .collect();
    let kept = exact.violation(&after) == 0.0;
    let title = if tuning.title.is_empty() { &scenario.title } else { &tuning.title };
    let mut result = TuneResult {
        title: title.clone(),
        objective: tuning.objective,
        influence: tuning.influence,
        band: tuning.band,
        constraints: tuning.constraints.clone(),
        kept,
        parameters: parameters
            .iter()
            .zip(own.iter().zip(&found))
            .map(|(it, (before, after))| Tuned {
                target: it.target.clone(),
                instances: instances(it, &setups),
                unit: it.unit.clone(),
                bounds: (it.bounds.from, it.bounds.to),
                before: *before,
                after: *after,
            })
            .collect(),
        conditions: results,
        active,
        front,
        notes: Vec::new(),
        evaluations: store.len(),
        seconds: begin.elapsed().as_secs_f64(),
    };
    result.notes = notes(&result, &exact, &after, tuning, &own);
    store.remove();
    Ok(result)
}

/// Names of the instances that a parameter changes.
fn instances(parameter: &Parameter, setups: &[Setup]) -> Vec<String> {
    let Some(setup) = setups.first() else { return Vec::new() };
    let mut all: Vec<String> =
        parameter.changes.iter().map(|(k, _)| setup.system().instances[*k].name.clone()).collect();
    all.dedup();
    all
}

/// The first eigenvalues of a list, least damped first.
fn listed(modes: &[Mode]) -> Vec<(f64, f64)> {
    modes.iter().take(LISTED).map(|it| (it.value.re, it.value.im)).collect()
}

/// Frequency and damping ratio of modes left out, those in the band first.
fn left_out(modes: &[Mode], band: Option<[f64; 2]>) -> Vec<(f64, f64)> {
    let all = modes.iter().filter(|it| it.role == Role::LeftOut);
    let mut all: Vec<(f64, f64)> =
        all.map(|it| (it.value.norm() / TAU, damping(it.value))).collect();
    // stable: still by damping within each
    all.sort_by_key(|it| band.is_some_and(|[low, high]| !(low..=high).contains(&it.0)));
    all
}

/// The scenario's own values, which must be the same for all instances of a pattern.
fn own_values(parameters: &[Parameter]) -> Result<Vec<f64>, TuneError> {
    let own = |it: &Parameter| {
        it.own.ok_or_else(|| {
            let problem = "the instances have different values: give them one with --set, or tune them one by one";
            TuneError::value(format!("vary.{}", it.target), problem)
        })
    };
    parameters.iter().map(own).collect()
}

type Set = Vec<(String, String)>;

fn conditions(tuning: &Tuning) -> Vec<(String, Set)> {
    if tuning.conditions.is_empty() {
        return vec![("as it is".to_owned(), Vec::new())];
    }
    let of = |(name, set): (&String, &indexmap::IndexMap<String, scenario::Setting>)| {
        (name.clone(), set.iter().map(|(target, value)| (target.clone(), text(value))).collect())
    };
    tuning.conditions.iter().map(of).collect()
}

/// What is computed, in one line.
fn task(request: &Request) -> String {
    let mut scenario = request.scenario.clone();
    let set: Vec<String> =
        std::mem::take(&mut scenario.overrides).iter().map(ToString::to_string).collect();
    let all = serde_json::json!({ "scenario": scenario, "set": set, "tuning": request.tuning, "version": 2 });
    all.to_string()
}

fn values(parameters: &[Parameter], places: &[f64]) -> Vec<f64> {
    parameters.iter().zip(places).map(|(it, place)| it.value(*place)).collect()
}

/// A value with few digits, within its bounds.
fn rounded(parameter: &Parameter, place: f64) -> f64 {
    let value = parameter.value(place);
    if value == 0.0 {
        return value;
    }
    #[expect(clippy::cast_possible_truncation, reason = "a small number")]
    let power = DIGITS - 1 - value.abs().log10().floor() as i32;
    // by the text, which has no rounding errors of its own
    let digits = usize::try_from(power).unwrap_or(0);
    let short = if power >= 0 {
        format!("{value:.digits$}").parse().unwrap_or(value)
    } else {
        value.round()
    };
    short.clamp(parameter.bounds.from, parameter.bounds.to)
}

/// The best of all searches, and once more from there.
fn best(
    evaluate: &Evaluate<'_>,
    goal: &Goal,
    parameters: &[Parameter],
    start: &[f64],
    tuning: &Tuning,
    threads: usize,
    archive: &mut Vec<Point>,
) -> Result<Point, TuneError> {
    let own: Vec<f64> = parameters.iter().zip(start).map(|(it, value)| it.place(*value)).collect();
    let samples = random(tuning.seed, own.len(), tuning.samples);
    let sampled = for_all(&samples, threads, |places| {
        Ok(Point { places: places.clone(), figures: evaluate(places)? })
    })?;
    let mut order: Vec<&Point> = sampled.iter().collect();
    order.sort_by(|a, b| {
        let (one, other) = (goal.violation(&a.figures), goal.violation(&b.figures));
        one.total_cmp(&other).then(goal.value(&b.figures).total_cmp(&goal.value(&a.figures)))
    });
    let mut starts = vec![own];
    starts.extend(order.into_iter().take(tuning.starts - 1).map(|it| it.places.clone()));
    archive.extend(sampled.iter().cloned());
    let found =
        for_all(&starts, threads, |start| search(evaluate, goal, start, tuning.evaluations))?;
    archive.extend(found.into_iter().flatten());
    let first = chosen(archive, goal)?;
    archive.extend(search(evaluate, goal, &first.places, tuning.evaluations)?);
    chosen(archive, goal)
}

fn chosen(archive: &[Point], goal: &Goal) -> Result<Point, TuneError> {
    let best =
        archive.iter().reduce(|a, b| if goal.better(&b.figures, &a.figures) { b } else { a });
    best.cloned().ok_or(TuneError::Unstable { tried: 0 })
}

/// Points that no other is better than in both damping and modulus margin. Searches at several margins find them.
fn front(
    evaluate: &Evaluate<'_>,
    goal: &Goal,
    parameters: &[Parameter],
    archive: &mut Vec<Point>,
    tuning: &Tuning,
    threads: usize,
) -> Result<Vec<FrontPoint>, TuneError> {
    let mut limits = goal.limits.clone();
    (limits.modulus, limits.damping) = (None, None);
    let widest = Goal { objective: Objective::Modulus, limits: limits.clone(), reserved: true };
    let first = chosen(archive, &widest)?;
    archive.extend(search(evaluate, &widest, &first.places, tuning.evaluations)?);
    let most = widest.value(&chosen(archive, &widest)?.figures);
    let level = |k: usize| FRONT_FROM + (most - FRONT_FROM) * k as f64 / tuning.front as f64;
    let levels: Vec<f64> = (0..tuning.front).map(level).filter(|it| *it > 0.0).collect();
    let at = |level: &f64| {
        let limits = crate::file::Constraints { modulus: Some(*level), ..limits.clone() };
        Goal { objective: Objective::Damping, limits, reserved: true }
    };
    let starts: Vec<(f64, Vec<f64>)> = levels
        .iter()
        .map(|it| Ok((*it, chosen(archive, &at(it))?.places)))
        .collect::<Result<_, TuneError>>()?;
    let found = for_all(&starts, threads, |(level, start)| {
        search(evaluate, &at(level), start, tuning.evaluations)
    })?;
    archive.extend(found.into_iter().flatten());
    let others = Goal { objective: Objective::Damping, limits, reserved: true };
    let mut all: Vec<FrontPoint> = archive
        .iter()
        .filter(|it| others.violation(&it.figures) == 0.0)
        .map(|it| FrontPoint {
            damping: others.value(&it.figures),
            modulus: widest.value(&it.figures),
            values: values(parameters, &it.places),
        })
        .collect();
    all.sort_by(|a, b| b.modulus.total_cmp(&a.modulus).then(b.damping.total_cmp(&a.damping)));
    let mut kept: Vec<FrontPoint> = Vec::new();
    for it in all {
        if kept.last().is_none_or(|last| it.damping > last.damping + 1e-4) {
            kept.push(it);
        }
    }
    kept.reverse();
    Ok(kept)
}

fn active(
    evaluate: &Evaluate<'_>,
    goal: &Goal,
    best: &Point,
    parameters: &[Parameter],
    prepared: &[Prepared<'_>],
) -> Result<Vec<Active>, TuneError> {
    let found = sensitivity::active(evaluate, goal, best)?;
    let shown = |(cause, gain): (Cause, f64)| {
        let what = match cause {
            Cause::Limit(condition, limit) => {
                let limits = &goal.limits;
                let value = match limit {
                    Limit::Damping => limits.damping.unwrap_or(0.0),
                    Limit::Outside => 0.0,
                    Limit::ModulusOne | Limit::ModulusAll => limits.modulus.unwrap_or(0.0),
                    Limit::DelayOne | Limit::DelayAll => limits.delay.unwrap_or(0.0),
                    Limit::Voltage => limits.voltage.unwrap_or(0.0),
                };
                format!(
                    "{} at its limit of {value}, condition {}",
                    limit.name(),
                    prepared[condition].name
                )
            }
            Cause::Bound(k, upper) => {
                let it = &parameters[k];
                let (side, value) =
                    if upper { ("upper", it.bounds.to) } else { ("lower", it.bounds.from) };
                format!("{} at its {side} bound of {value}", it.target)
            }
        };
        Active { what, gain_per_percent: Some(gain) }
    };
    Ok(found.into_iter().map(shown).collect())
}

fn notes(
    result: &TuneResult,
    goal: &Goal,
    after: &[Figures],
    tuning: &Tuning,
    own: &[f64],
) -> Vec<String> {
    let mut notes = Vec::new();
    for (it, own) in result.parameters.iter().zip(own) {
        if !(it.bounds.0..=it.bounds.1).contains(own) {
            notes.push(format!("{} = {own} of the scenario is outside its bounds: the search starts at the nearest one.", it.target));
        }
    }
    for (it, figures) in result.conditions.iter().zip(after) {
        for (limit, value) in goal.constraints(figures) {
            if value < 0.0 {
                notes.push(format!("Not kept under {}: {}.", it.name, limit.name()));
            }
        }
        if it.verified.distance > 1e-5 {
            notes.push(format!(
                "Under {} the least damped modes differ by {:.1e} from those of a new start: the operating point \
                 depends on the parameters.",
                it.name, it.verified.distance
            ));
        }
        if let Some((hz, ratio)) = it.verified.unknown.first() {
            notes.push(format!(
                "Under {} the new start has a mode that no list has: {hz:.3} Hz, damping {ratio:.4}. It does not count.",
                it.name
            ));
        }
        if let Some((hz, ratio)) = it.verified.untouched.iter().find(|it| it.1 < 0.0) {
            notes.push(format!("Under {} a mode grows that the varied units do not reach: {hz:.3} Hz, damping {ratio:.4}.", it.name));
        }
    }
    if !tuning.has_noise() {
        notes.push(
            "No noise of sensors and no irregularity was given: nothing limits the voltage, and searches tend to run \
             into bounds."
                .to_owned(),
        );
    }
    if tuning.irregularity.is_some() {
        notes.push(
            "The irregularity moves under a train that stays where it is: the girders do not pass."
                .to_owned(),
        );
    }
    notes
}
