//! Nonlinear least squares within bounds: Levenberg-Marquardt (MINPACK's, as MPFIT extends it by bounds), over
//! parameters that are scaled by their bounds, with central differences that a model may compute in parallel.

use std::ops::Range;

use rmpfit::{MPConfig, MPError, MPFitter, MPMaxFev, MPPar, MPResult, MPSide, MPSuccess};

use crate::covariance::Information;

/// Central differences over twice this fraction of the range between the bounds.
const STEP: f64 = 1e-4;
/// A scaled residual of a point where the model has no value: far above any other.
const NO_VALUE: f64 = 1e3;
/// Most searches with other weights of the groups.
const PASSES: usize = 6;
/// Weights that change by less than this are settled.
const SETTLED: f64 = 0.01;
/// A parameter that is this close to a bound, as a fraction of the range, is at it.
const AT_BOUND: f64 = 1e-6;

/// What is fitted.
pub trait Model {
    /// The values at the points of the data for several sets of parameters, in their order. A set for which there are no
    /// values gives the reason.
    fn evaluate(&mut self, sets: &[Vec<f64>]) -> Vec<Result<Vec<f64>, String>>;
}

/// What the model should give.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Measured values.
    pub values: Vec<f64>,
    /// Ranges of them with the same unknown noise, which cover all in order.
    pub groups: Vec<Range<usize>>,
}

/// A parameter's bounds and first value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounded {
    /// Lower bound.
    pub low: f64,
    /// Upper bound.
    pub high: f64,
    /// First value, within the bounds.
    pub start: f64,
}

/// How it is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// Sets of parameters, evenly spread between the bounds, that are tried before the search begins at the best one.
    pub trials: usize,
    /// Most iterations.
    pub iterations: usize,
}

/// What was found.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The parameters.
    pub values: Vec<f64>,
    /// Whether each is at a bound.
    pub at_bound: Vec<bool>,
    /// Model minus data at the solution.
    pub residuals: Vec<f64>,
    /// The same at the start that was given; empty if the model has no values there.
    pub first_residuals: Vec<f64>,
    /// What the data know about the parameters.
    pub information: Information,
    /// Degrees of freedom: values minus free parameters.
    pub freedom: usize,
    /// Iterations.
    pub iterations: usize,
    /// Evaluated sets of parameters.
    pub evaluations: usize,
    /// Whether the search converged, within the iterations.
    pub converged: bool,
    /// The start of the search, if a trial was better than that given.
    pub better_start: Option<Vec<f64>>,
    /// Why sets of parameters had no values: the first reason.
    pub failure: Option<String>,
}

/// Why nothing was found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Fewer values than parameters, and one more.
    #[error("{values} values cannot determine {parameters} parameters")]
    TooFew {
        /// Values.
        values: usize,
        /// Parameters.
        parameters: usize,
    },
    /// No set of parameters has values.
    #[error(
        "the model has no values at any of the {tried} sets of parameters that were tried: {reason}"
    )]
    NoValues {
        /// Sets.
        tried: usize,
        /// Why the first has none.
        reason: String,
    },
    /// The derivatives cannot be computed.
    #[error("the model has no values beside the solution: {reason}")]
    NoDerivatives {
        /// Why.
        reason: String,
    },
    /// The library refused.
    #[error("the search ended without a result: {reason}")]
    Search {
        /// What it reported.
        reason: String,
    },
}

/// Minimises Σ ((model - data)/noise)². The noise of a group is that of its residuals, in passes until it settles; with one group its
/// size does not matter. `watch` is called with the number of evaluated sets and the best root mean square of scaled
/// residuals so far.
///
/// # Errors
/// The data are too few, or the model has no values.
pub fn solve(
    model: &mut dyn Model,
    data: &Data,
    parameters: &[Bounded],
    settings: Settings,
    watch: &mut dyn FnMut(usize, f64),
) -> Result<Solution, SolveError> {
    let (values, count) = (data.values.len(), parameters.len());
    if values <= count {
        return Err(SolveError::TooFew { values, parameters: count });
    }
    let scales = data.groups.iter().map(|group| spread(&data.values[group.clone()]));
    let mut search = Search {
        model,
        data,
        parameters,
        weights: scales.map(|it| 1.0 / it).collect(),
        limits: parameters.iter().map(|_| limits()).collect(),
        config: MPConfig {
            max_iter: settings.iterations,
            max_fev: MPMaxFev::NoLimit,
            ..MPConfig::new()
        },
        evaluations: 0,
        best: f64::INFINITY,
        failure: None,
        watch,
    };
    let given: Vec<f64> =
        parameters.iter().map(|it| (it.start - it.low) / (it.high - it.low)).collect();
    let (mut place, first_residuals) = search.begin(&given, settings.trials)?;
    let better_start = (place != given).then(|| search.actual(&place));
    // with one group a common factor changes nothing
    let passes = if data.groups.len() > 1 { PASSES } else { 1 };
    let (mut iterations, mut converged) = (0, false);
    for pass in 0..passes {
        // parameters that a poor group has spoiled make a good one look poor, so a second time
        if pass > 0 && search.reweigh(&place)? < SETTLED {
            break;
        }
        let status = search.mpfit(&mut place).map_err(|error| SolveError::Search {
            reason: search.failure.clone().unwrap_or_else(|| error.to_string()),
        })?;
        iterations += status.n_iter;
        converged = !matches!(status.success, MPSuccess::MaxIter | MPSuccess::NotDone);
    }
    let no_values = |reason| SolveError::NoDerivatives { reason };
    let (residuals, derivatives) = search.derivatives(&place).map_err(no_values)?;
    let at_bound: Vec<bool> =
        place.iter().map(|it| *it < AT_BOUND || *it > 1.0 - AT_BOUND).collect();
    let ranges: Vec<f64> = parameters.iter().map(|it| it.high - it.low).collect();
    let free = at_bound.iter().filter(|it| !**it).count();
    let information = Information::new(&residuals, &derivatives, &data.groups, &at_bound, &ranges);
    let unweighted = |residuals: Vec<f64>| {
        let mut plain = residuals;
        for (group, weight) in data.groups.iter().zip(&search.weights) {
            plain[group.clone()].iter_mut().for_each(|it| *it /= weight);
        }
        plain
    };
    Ok(Solution {
        values: search.actual(&place),
        at_bound,
        residuals: unweighted(residuals),
        first_residuals,
        information,
        freedom: values - free,
        iterations,
        evaluations: search.evaluations,
        converged,
        better_start,
        failure: search.failure.take(),
    })
}

/// Standard deviation, or 1 of what is constant.
fn spread(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let power = values.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / count;
    if power > 0.0 { power.sqrt() } else { 1.0 }
}

fn limits() -> MPPar {
    MPPar {
        limited_low: true,
        limited_up: true,
        limit_low: 0.0,
        limit_up: 1.0,
        side: MPSide::User,
        ..MPPar::new()
    }
}

struct Search<'a> {
    model: &'a mut dyn Model,
    data: &'a Data,
    parameters: &'a [Bounded],
    weights: Vec<f64>,
    limits: Vec<MPPar>,
    config: MPConfig,
    evaluations: usize,
    best: f64,
    failure: Option<String>,
    watch: &'a mut dyn FnMut(usize, f64),
}

impl Search<'_> {
    /// From fractions of the ranges to parameters.
    fn actual(&self, place: &[f64]) -> Vec<f64> {
        let pairs = self.parameters.iter().zip(place);
        pairs.map(|(it, u)| (it.low + u * (it.high - it.low)).clamp(it.low, it.high)).collect()
    }

    /// Weighted residuals of several places.
    fn residuals(&mut self, places: &[Vec<f64>]) -> Vec<Result<Vec<f64>, String>> {
        let sets: Vec<Vec<f64>> = places.iter().map(|it| self.actual(it)).collect();
        let found = self.model.evaluate(&sets);
        self.evaluations += sets.len();
        let weighted = |values: Vec<f64>| {
            let mut residuals: Vec<f64> =
                values.iter().zip(&self.data.values).map(|(a, b)| a - b).collect();
            for (group, weight) in self.data.groups.iter().zip(&self.weights) {
                residuals[group.clone()].iter_mut().for_each(|it| *it *= weight);
            }
            let finite = residuals.iter().all(|it| it.is_finite());
            if finite { Ok(residuals) } else { Err("a value is not finite".to_owned()) }
        };
        let found: Vec<Result<Vec<f64>, String>> =
            found.into_iter().map(|it| it.and_then(weighted)).collect();
        for it in &found {
            match it {
                Ok(residuals) => self.best = self.best.min(size(residuals)),
                Err(reason) if self.failure.is_none() => self.failure = Some(reason.clone()),
                Err(_) => {}
            }
        }
        (self.watch)(self.evaluations, self.best);
        found
    }

    /// The best of the given place and of trials, and the unweighted residuals at the given place.
    fn begin(&mut self, given: &[f64], trials: usize) -> Result<(Vec<f64>, Vec<f64>), SolveError> {
        let mut places = vec![given.to_vec()];
        places.extend((1..=trials).map(|k| halton(k, given.len())));
        let found = self.residuals(&places);
        let mut first = found[0].clone().unwrap_or_default();
        for (group, weight) in self.data.groups.iter().zip(&self.weights) {
            if let Some(part) = first.get_mut(group.clone()) {
                part.iter_mut().for_each(|it| *it /= weight);
            }
        }
        let sizes = found.iter().map(|it| it.as_ref().map_or(f64::INFINITY, |it| size(it)));
        let best =
            sizes.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|it| it.1.is_finite());
        match best {
            Some((k, _)) => Ok((places.swap_remove(k), first)),
            None => Err(SolveError::NoValues {
                tried: places.len(),
                reason: self.failure.clone().unwrap_or_default(),
            }),
        }
    }

    /// Weighs groups by the size of their residuals. Returns the largest relative change of a weight to another.
    fn reweigh(&mut self, place: &[f64]) -> Result<f64, SolveError> {
        let found = self.residuals(&[place.to_vec()]).remove(0);
        let residuals = found.map_err(|reason| SolveError::NoDerivatives { reason })?;
        let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
        for (group, weight) in self.data.groups.iter().zip(&mut self.weights) {
            // of a perfect fit there is nothing to weigh
            let own = size(&residuals[group.clone()]).max(1e-12);
            *weight /= own;
            (least, most) = (least.min(own), most.max(own));
        }
        self.best = f64::INFINITY;
        Ok(most / least - 1.0)
    }

    /// Weighted residuals and their derivatives by central differences, one-sided at a bound.
    fn derivatives(&mut self, place: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), String> {
        let mut places = vec![place.to_vec()];
        for k in 0..place.len() {
            for side in [STEP, -STEP] {
                let mut beside = place.to_vec();
                beside[k] = (beside[k] + side).clamp(0.0, 1.0);
                places.push(beside);
            }
        }
        let mut found = self.residuals(&places).into_iter();
        let here = found.next().unwrap_or_else(|| Err(String::new()))?;
        let mut columns = Vec::new();
        for k in 0..place.len() {
            let (above, below) = (found.next(), found.next());
            let distance = places[1 + 2 * k][k] - places[2 + 2 * k][k];
            let (above, below) = (
                above.unwrap_or_else(|| Ok(here.clone()))?,
                below.unwrap_or_else(|| Ok(here.clone()))?,
            );
            columns.push(above.iter().zip(&below).map(|(a, b)| (a - b) / distance).collect());
        }
        Ok((here, columns))
    }
}

impl MPFitter for Search<'_> {
    fn eval(&mut self, params: &[f64], deviates: &mut [f64]) -> MPResult<()> {
        match self.residuals(&[params.to_vec()]).remove(0) {
            Ok(residuals) => deviates.copy_from_slice(&residuals),
            // no step is accepted that leads here
            Err(_) => deviates.fill(NO_VALUE),
        }
        Ok(())
    }

    fn number_of_points(&self) -> usize {
        self.data.values.len()
    }

    fn config(&self) -> &MPConfig {
        &self.config
    }

    fn parameters(&self) -> &[MPPar] {
        &self.limits
    }

    fn jacobian(
        &mut self,
        params: &[f64],
        deviates: &mut [f64],
        derivs: &mut [Option<Vec<f64>>],
    ) -> MPResult<()> {
        let (residuals, columns) = self.derivatives(params).map_err(|_| MPError::Eval)?;
        deviates.copy_from_slice(&residuals);
        for (to, column) in derivs.iter_mut().zip(columns) {
            if let Some(to) = to {
                to.copy_from_slice(&column);
            }
        }
        Ok(())
    }
}

/// Root mean square.
fn size(values: &[f64]) -> f64 {
    (values.iter().map(|it| it * it).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Point k of the Halton sequence in the unit cube: the digits of k in a prime base, mirrored at the point.
fn halton(k: usize, dimensions: usize) -> Vec<f64> {
    let primes = (2..).filter(|n: &usize| (2..*n).all(|divisor| !n.is_multiple_of(divisor)));
    let mirrored = |base: usize| {
        let (mut rest, mut digit, mut value) = (k, 1.0, 0.0);
        while rest > 0 {
            digit /= base as f64;
            value += digit * (rest % base) as f64;
            rest /= base;
        }
        value
    };
    primes.take(dimensions).map(mirrored).collect()
}
