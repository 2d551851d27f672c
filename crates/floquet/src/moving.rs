//! A train at constant speed on an endless row of equal spans.

use std::collections::HashMap;
use std::f64::consts::TAU;

use faer::Mat;
use faer::prelude::c64;
use rayon::prelude::*;
use scenario::Scenario;
use serde::{Deserialize, Serialize};

use crate::{
    FloquetError, Girders, Modal, Monodromy, Multipliers, Passage, Reduction, Row, Train,
    directions, multipliers, reduced,
};

/// Largest phase (rad) of the girders' fastest mode in a step, to begin with.
const PHASE: f64 = 2.0;
/// Fewest steps per period, so that the girders' shapes are resolved.
const FEWEST: usize = 48;
/// Times that the number of steps is doubled at most.
const DOUBLINGS: u32 = 7;
/// A train with at most so many states is not reduced.
const SMALL: usize = 100;
/// Sums of forces that are watched.
const WATCHED: usize = 6;
/// Places at which shapes are sampled for the reduction.
const PLACES: usize = 100;

/// How exactly to compute.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Change of the critical growth rate (1/s) when the number of steps is doubled.
    pub tolerance: f64,
    /// Hankel singular values of the train below this share of the largest are truncated. 0 keeps all states.
    pub reduction: f64,
    /// Frequency (Hz) below which motions are not the critical one.
    pub above: f64,
}

impl Default for Accuracy {
    fn default() -> Self {
        Self { tolerance: 1e-3, reduction: 1e-6, above: 0.0 }
    }
}

/// The result at one speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Speed (m/s).
    pub speed: f64,
    /// Time to pass a period of the row (s).
    pub period: f64,
    /// Steps of the integration.
    pub steps: usize,
    /// Change of the critical growth rate with half the steps (1/s).
    pub error: f64,
    /// Multipliers.
    pub multipliers: Multipliers,
}

/// Places of the magnets over the spans.
struct Magnets<'a> {
    row: &'a Row,
    places: &'a [f64],
    blocks: usize,
}

impl Magnets<'_> {
    /// Calls `see(magnet, block, mode, sight)`.
    fn each(&self, x: f64, mut see: impl FnMut(usize, usize, usize, crate::shapes::Sight)) {
        for (magnet, place) in self.places.iter().enumerate() {
            for block in 0..self.blocks {
                // at x = 0 the front of the first pole is at the beginning of the fresh span
                let local = x + place - self.row.reach + block as f64 * self.row.period;
                self.row.at(local, |mode, sight| see(magnet, block, mode, sight));
            }
        }
    }
}

impl Passage for Magnets<'_> {
    fn period(&self) -> f64 {
        self.row.period
    }

    fn at(&self, x: f64, p: &mut Mat<f64>, q: &mut Mat<f64>) {
        p.fill(0.0);
        q.fill(0.0);
        let (modes, magnets) = (self.row.modes(), self.places.len());
        self.each(x, |magnet, block, mode, it| {
            let i = block * modes + mode;
            p[(magnet, i)] = it.sight;
            q[(i, magnet)] = it.push;
            q[(i, magnets + magnet)] = it.push_slope;
        });
    }
}

/// A train with its row of spans.
#[derive(Debug, Clone)]
pub struct MovingTrain {
    /// The train.
    pub train: Train,
    /// The row.
    pub row: Row,
    /// The reduced train, if it is reduced.
    pub reduction: Option<Reduction>,
    /// How exactly to compute.
    pub accuracy: Accuracy,
}

impl MovingTrain {
    /// Reads both from a scenario.
    ///
    /// # Errors
    /// See [`Train::read`] and [`Row::read`]; the reduction fails.
    pub fn read(scenario: &Scenario, accuracy: Accuracy) -> Result<Self, FloquetError> {
        let train = Train::read(scenario)?;
        let row = Row::read(scenario, &train.guideway)?;
        Self::new(train, row, accuracy)
    }

    /// Of both parts.
    ///
    /// # Errors
    /// The reduction fails.
    pub fn new(train: Train, row: Row, accuracy: Accuracy) -> Result<Self, FloquetError> {
        let reduction = if accuracy.reduction > 0.0 && train.states > SMALL {
            Some(reduce(&train, &row, accuracy.reduction)?)
        } else {
            None
        };
        Ok(Self { train, row, reduction, accuracy })
    }

    /// The same train on other girders of the same shapes. The reduced train is kept: it depends on the girders only
    /// by the weights of places.
    #[must_use]
    pub fn on(&self, row: Row) -> Self {
        Self { row, ..self.clone() }
    }

    /// The train as it is integrated.
    #[must_use]
    pub fn modal(&self) -> &Modal {
        self.reduction.as_ref().map_or(&self.train.modal, |it| &it.modal)
    }

    /// The multipliers at a speed (m/s).
    ///
    /// # Errors
    /// The integration overflows or does not converge.
    pub fn at(&self, speed: f64) -> Result<Motion, FloquetError> {
        let girders = self.row.girders(self.train.length());
        let compute =
            |steps: usize| multipliers(&self.monodromy(self.modal(), &girders, speed, steps)?);
        let growth = |it: &Multipliers| {
            it.critical(self.accuracy.above).map_or(it.floor, |critical| critical.growth)
        };
        let period = self.row.period / speed;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "bounded below"
        )]
        let wanted = (self.row.fastest * period / PHASE).ceil() as usize;
        let mut steps = wanted.max(FEWEST);
        let mut before = compute(steps)?;
        let mut error = f64::INFINITY;
        for _ in 0..DOUBLINGS {
            steps *= 2;
            let now = compute(steps)?;
            error = (growth(&now) - growth(&before)).abs();
            if error <= self.accuracy.tolerance {
                return Ok(Motion { speed, period, steps, error, multipliers: now });
            }
            before = now;
        }
        Err(FloquetError::Tolerance { speed, error, steps })
    }

    /// The growth rate (1/s) without reduction, with the steps of a result: of the multiplier that is nearest to
    /// `value`.
    ///
    /// # Errors
    /// The integration overflows.
    pub fn unreduced(&self, motion: &Motion, value: c64) -> Result<f64, FloquetError> {
        let girders = self.row.girders(self.train.length());
        let modal = &self.train.modal;
        let found = self.monodromy(modal, &girders, motion.speed, motion.steps)?.matrix;
        let all =
            found.eigenvalues().map_err(|_| FloquetError::Eigenvalues("Floquet multipliers"))?;
        let nearest = all.iter().min_by(|a, b| (*a - value).norm().total_cmp(&(*b - value).norm()));
        Ok(nearest.map_or(f64::NEG_INFINITY, |it| it.norm().ln() / motion.period))
    }

    fn monodromy(
        &self,
        modal: &Modal,
        girders: &Girders,
        speed: f64,
        steps: usize,
    ) -> Result<Monodromy, FloquetError> {
        let magnets =
            Magnets { row: &self.row, places: &self.train.places, blocks: girders.blocks };
        Monodromy::new(modal, girders, &magnets, &self.watch(), speed, steps)
    }

    /// Sums of the magnets' forces by which the frequency of a motion is found: weighted by powers of the place.
    fn watch(&self) -> Mat<f64> {
        let (count, half) = (self.train.places.len(), 0.5 * self.train.length().max(1e-9));
        Mat::from_fn(count.min(WATCHED), self.train.modal.outputs(), |i, j| {
            let place = self.train.places.get(j).map_or(0.0, |place| place / half + 1.0);
            if j < count { place.powi(i32::try_from(i).unwrap_or(0)) } else { 0.0 }
        })
    }

    /// The coupled system at standstill: the matrix of all states with the magnets at a place of the period.
    /// Its eigenvalues are the modes of the standing train.
    #[must_use]
    pub fn standing(&self, x: f64) -> Mat<f64> {
        let girders = self.row.girders(self.train.length());
        let magnets =
            Magnets { row: &self.row, places: &self.train.places, blocks: girders.blocks };
        let modal = self.modal();
        let (mut p, mut q) = (
            Mat::zeros(modal.inputs(), girders.seen()),
            Mat::zeros(girders.forces(), modal.outputs()),
        );
        magnets.at(x, &mut p, &mut q);
        let (n, states) = (modal.modes(), girders.a.nrows());
        let (moved, pressed, direct) = (&modal.g * &p, &q * &modal.h, &q * &modal.d * &p);
        let (modes, size) = (self.row.modes(), 2 * n + girders.states());
        let mut matrix = Mat::<f64>::zeros(size, size);
        for (k, value) in modal.values.iter().enumerate() {
            (matrix[(k, k)], matrix[(n + k, n + k)]) = (value.re, value.re);
            (matrix[(k, n + k)], matrix[(n + k, k)]) = (-value.im, value.im);
        }
        for block in 0..girders.blocks {
            let first = 2 * n + block * states;
            for i in 0..states {
                (0..states).for_each(|j| matrix[(first + i, first + j)] = girders.a[(i, j)]);
            }
            for mode in 0..modes {
                let (seen, row) = (block * modes + mode, first + modes + mode);
                for k in 0..2 * n {
                    matrix[(k, first + mode)] += moved[(k, seen)];
                    matrix[(row, k)] += pressed[(seen, k)];
                }
                for other in 0..girders.blocks * modes {
                    let column = 2 * n + other / modes * states + other % modes;
                    matrix[(row, column)] += direct[(seen, other)];
                }
            }
        }
        matrix
    }
}

/// The train, reduced for what the girders can do to it.
fn reduce(train: &Train, row: &Row, tolerance: f64) -> Result<Reduction, FloquetError> {
    let girders = row.girders(train.length());
    let magnets = Magnets { row, places: &train.places, blocks: girders.blocks };
    let (seen, outputs) = (girders.seen(), train.modal.outputs());
    let mut inputs = Mat::zeros(train.places.len(), PLACES * seen);
    let mut pressed = Mat::zeros(outputs, PLACES * seen);
    let (mut p, mut q) = (Mat::zeros(train.places.len(), seen), Mat::zeros(seen, outputs));
    for k in 0..PLACES {
        magnets.at(row.period * (k as f64 + 0.5) / PLACES as f64, &mut p, &mut q);
        for j in 0..seen {
            (0..train.places.len()).for_each(|i| inputs[(i, k * seen + j)] = p[(i, j)]);
            (0..outputs).for_each(|i| pressed[(i, k * seen + j)] = q[(j, i)]);
        }
    }
    let band = (0.3 * row.slowest.max(0.05 * TAU), 2.0 * row.fastest);
    reduced(&train.modal, &directions(&inputs)?, &directions(&pressed)?, tolerance, band)
}

/// A point of a map: which train, and which speed.
pub type Place = (usize, usize);

/// Computes all speeds for all trains, on all processors, but for those that are known. `done` is called after each
/// point that was computed. A point that cannot be computed does not end the others.
pub fn map(
    trains: &[MovingTrain],
    speeds: &[f64],
    known: &HashMap<Place, Motion>,
    done: &(dyn Fn(Place, &Result<Motion, FloquetError>) + Sync),
) -> Vec<Vec<Result<Motion, FloquetError>>> {
    let at = |place: Place| {
        if let Some(motion) = known.get(&place) {
            return Ok(motion.clone());
        }
        let motion = trains[place.0].at(speeds[place.1]);
        done(place, &motion);
        motion
    };
    // slow ones take longest, and come first
    let mut order: Vec<Place> =
        (0..speeds.len()).flat_map(|v| (0..trains.len()).map(move |k| (k, v))).collect();
    order.sort_by(|a, b| speeds[a.1].total_cmp(&speeds[b.1]));
    let mut found: Vec<(Place, _)> = order.into_par_iter().map(|it| (it, at(it))).collect();
    found.sort_by_key(|it| it.0);
    let mut all = found.into_iter().map(|(_, motion)| motion);
    trains.iter().map(|_| all.by_ref().take(speeds.len()).collect()).collect()
}
