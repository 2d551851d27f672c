//! Searches for the best set of values: COBYLA from several starts.
//!
//! The worst of several conditions, each with several modes, is not smooth. COBYLA (Powell 1994) takes every part of the
//! objective and every constraint as a function of its own: with a further variable t it maximises t under
//! "part − t ≥ 0". Each search is sequential and depends on nothing but its start, so that results do not depend on
//! the number of threads.

use std::cell::RefCell;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use cobyla::{Func, RhoBeg, StopTols, minimize};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::error::TuneError;
use crate::figures::Figures;
use crate::goal::Goal;

/// First and last change of a parameter, as fractions of its range.
const FIRST: f64 = 0.15;
const LAST: f64 = 1e-4;
/// First change of t.
const FIRST_PART: f64 = 0.05;

/// A set of values, as places between 0 and 1, with its figures under each condition.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    pub places: Vec<f64>,
    pub figures: Vec<Figures>,
}

/// Computes the figures of places.
pub(crate) type Evaluate<'a> = dyn Fn(&[f64]) -> Result<Vec<Figures>, TuneError> + Sync + 'a;

/// Random places, the same for the same seed.
pub(crate) fn random(seed: u64, dimension: usize, count: usize) -> Vec<Vec<f64>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut unit = || (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (0..count).map(|_| (0..dimension).map(|_| unit()).collect()).collect()
}

/// Does some work for many items on several threads; results are in the order of the items.
pub(crate) fn for_all<I: Sync, T: Send>(
    items: &[I],
    threads: usize,
    work: impl Fn(&I) -> Result<T, TuneError> + Sync,
) -> Result<Vec<T>, TuneError> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<T, TuneError>)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(k) else { return };
                    let result = work(item);
                    if let Ok(mut done) = done.lock() {
                        done.push((k, result));
                    }
                }
            });
        }
    });
    let mut all = match done.into_inner() {
        Ok(all) => all,
        Err(poisoned) => poisoned.into_inner(),
    };
    all.sort_by_key(|it| it.0);
    all.into_iter().map(|it| it.1).collect()
}

/// One search: all points that it computed.
pub(crate) fn search(
    evaluate: &Evaluate<'_>,
    goal: &Goal,
    start: &[f64],
    evaluations: usize,
) -> Result<Vec<Point>, TuneError> {
    let dimension = start.len();
    let state = State {
        evaluate,
        goal,
        points: RefCell::new(Vec::new()),
        last: RefCell::new((Vec::new(), Vec::new())),
        failure: RefCell::new(None),
    };
    let parts = state.at(start);
    if let Some(error) = state.failure.take() {
        return Err(error);
    }
    // the first numbers are the parts of the objective
    let objective = state.parts_at_start();
    let least = parts[..objective].iter().copied().fold(f64::INFINITY, f64::min);
    let mut x = start.to_vec();
    x.push(least);
    let mut bounds = vec![(0.0, 1.0); dimension];
    bounds.push((-1e3, 1e3));
    let constraint = |k: usize| {
        let state = &state;
        move |x: &[f64], (): &mut ()| {
            let t = if k < objective { x[dimension] } else { 0.0 };
            state.at(&x[..dimension]).get(k).map_or(0.0, |it| it - t)
        }
    };
    let owned: Vec<_> = (0..parts.len()).map(constraint).collect();
    let constraints: Vec<&dyn Func<()>> = owned.iter().map(|it| it as &dyn Func<()>).collect();
    let mut steps = vec![FIRST; dimension];
    steps.push(FIRST_PART);
    let mut tolerances = vec![LAST; dimension];
    tolerances.push(1e-6);
    let stop = StopTols { xtol_abs: tolerances, ..StopTols::default() };
    let outcome = minimize(
        |x: &[f64], (): &mut ()| -x[dimension],
        &x,
        &bounds,
        &constraints,
        (),
        evaluations,
        RhoBeg::Set(steps),
        Some(stop),
    );
    if let Some(error) = state.failure.take() {
        return Err(error);
    }
    let points = state.points.into_inner();
    match outcome {
        Err((status, _, _)) if points.len() <= dimension => {
            Err(TuneError::Search { status: format!("{status:?}") })
        }
        // one that ends by rounding errors has its points
        _ => Ok(points),
    }
}

struct State<'a> {
    evaluate: &'a Evaluate<'a>,
    goal: &'a Goal,
    points: RefCell<Vec<Point>>,
    /// The latest places and the numbers there: COBYLA asks for one function after the other.
    last: RefCell<(Vec<f64>, Vec<f64>)>,
    failure: RefCell<Option<TuneError>>,
}

impl State<'_> {
    fn at(&self, places: &[f64]) -> Vec<f64> {
        if self.last.borrow().0 == places {
            return self.last.borrow().1.clone();
        }
        if self.failure.borrow().is_some() {
            return self.last.borrow().1.clone();
        }
        match (self.evaluate)(places) {
            Ok(figures) => {
                let mut numbers = self.goal.parts(&figures);
                numbers
                    .extend(figures.iter().flat_map(|it| self.goal.constraints(it)).map(|it| it.1));
                self.points.borrow_mut().push(Point { places: places.to_vec(), figures });
                *self.last.borrow_mut() = (places.to_vec(), numbers.clone());
                numbers
            }
            Err(error) => {
                *self.failure.borrow_mut() = Some(error);
                self.last.borrow().1.clone()
            }
        }
    }

    fn parts_at_start(&self) -> usize {
        self.points.borrow().first().map_or(0, |it| self.goal.parts(&it.figures).len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::file::{Constraints, Objective};

    /// The largest least of x, y under x + y ≤ 1 (as a modulus margin): ½ at x = y = ½.
    #[test]
    fn analytic_the_largest_least_is_found_under_a_constraint() {
        let limits = Constraints { damping: None, modulus: Some(0.3), delay: None, voltage: None };
        let goal = Goal { objective: Objective::Damping, limits, reserved: false };
        let evaluate = |x: &[f64]| {
            let of = |least: f64| Figures {
                damping: least,
                outside: 1.0,
                least: vec![least],
                modulus_one: 1.3 - x[0] - x[1],
                modulus_all: 1.0,
                ..Figures::default()
            };
            Ok(vec![of(x[0]), of(x[1])])
        };
        let points = search(&evaluate, &goal, &[0.1, 0.9], 300).unwrap();
        let feasible = points.iter().filter(|it| goal.violation(&it.figures) < 1e-4);
        let best = feasible.map(|it| goal.value(&it.figures)).fold(0.0, f64::max);
        assert!((best - 0.5).abs() < 1e-3, "{best}");
        // the same bits again
        assert_eq!(search(&evaluate, &goal, &[0.1, 0.9], 300).unwrap(), points);
    }

    #[test]
    fn invariant_results_do_not_depend_on_the_number_of_threads() {
        let items: Vec<u32> = (0..50).collect();
        let work = |it: &u32| Ok(f64::from(*it).sqrt());
        assert_eq!(for_all(&items, 1, work).unwrap(), for_all(&items, 3, work).unwrap());
        assert_eq!(random(7, 3, 5), random(7, 3, 5));
        assert_ne!(random(7, 3, 5), random(8, 3, 5));
        assert!(random(7, 3, 500).iter().flatten().all(|x| (0.0..1.0).contains(x)));
    }

    #[test]
    fn refusal_an_error_of_the_evaluation_ends_the_search() {
        let goal =
            Goal { objective: Objective::Damping, limits: Constraints::default(), reserved: false };
        let evaluate = |x: &[f64]| {
            if x[0] > 0.5 {
                return Err(TuneError::value("x", "too large"));
            }
            Ok(vec![Figures {
                damping: x[0],
                outside: 1.0,
                least: vec![x[0]],
                modulus_one: 1.0,
                modulus_all: 1.0,
                delay_one: 1.0,
                delay_all: 1.0,
                ..Figures::default()
            }])
        };
        let error = search(&evaluate, &goal, &[0.2], 300).unwrap_err();
        assert!(error.to_string().contains("too large"));
    }
}
