//! What iterating algorithms have in common: the feedback signals as unknowns, and sweeps.
//!
//! In a sweep the members step one after the other, as in Gauss-Seidel. Signals of members that
//! have stepped in the sweep are interpolated. Those of members that have not, the *feedback
//! signals*, are assumed: the vector x holds value y and first derivative h·y' of each at the end of
//! the step (with order 6 also h²·y''), which with the data at the step's beginning make a Hermite
//! polynomial. The ends of the
//! sweep itself are the image G(x), and the step is solved when x = G(x). The first sweep is a
//! Gauss-Seidel step with the extrapolated signals as x. For later ones the units return to the
//! states saved at the step's beginning.
//!
//! A unit that cannot save its state steps in the first sweep only, with extrapolated feedback: its
//! inputs keep the order of the extrapolation, and so does the coupling.

use std::sync::Arc;

use results::summary::Iteration;

use super::exchange::Exchange;
use super::index::{SignalIndex, UnitIndex};
use super::unit::{ITERATION, Unit};
use super::workers::{Phase, Task, Workers};
use scenario::algorithm::IterationSettings;

/// Error that is allowed of y, h·y' and h²·y'' at the end of a step, relative to that of the signal.
/// An error of h²·y'' moves the polynomial by at most a sixtieth of it.
const WEIGHTS: [f64; 3] = [1.0, 1.0, 10.0];

/// y, h·y' and h²·y''.
pub(super) fn in_steps([value, rate, bend]: [f64; 3], size: f64) -> [f64; 3] {
    [value, size * rate, size * size * bend]
}

/// Sweeps over some units.
pub(super) struct Sweeps {
    pub(super) order: Vec<UnitIndex>,
    rank: Vec<usize>,
    first: Vec<Phase>,
    /// phases of the units that can repeat a step; set when the capabilities are known
    again: Option<Vec<Phase>>,
    /// feedback signals, and the highest derivative of each that is an unknown too
    pub(super) feedback: Vec<(SignalIndex, usize)>,
    workers: Arc<Workers>,
    pub(super) x: Vec<f64>,
    pub(super) image: Vec<f64>,
    pub(super) scales: Vec<f64>,
    pub(super) settings: IterationSettings,
    pub(super) iteration: Iteration,
}

impl Sweeps {
    pub(super) fn new(
        exchange: &Exchange,
        order: Vec<UnitIndex>,
        settings: IterationSettings,
        workers: Arc<Workers>,
    ) -> Self {
        let mut rank = vec![usize::MAX; exchange.len()];
        for (place, &unit) in order.iter().enumerate() {
            rank[unit] = place;
        }
        let first = Phase::divide(exchange, &order);
        Self {
            first,
            again: None,
            feedback: Vec::new(),
            workers,
            x: Vec::new(),
            image: Vec::new(),
            scales: Vec::new(),
            settings,
            iteration: Iteration::default(),
            order,
            rank,
        }
    }

    /// Whether a unit is a member.
    pub(super) fn is_member(&self, unit: UnitIndex) -> bool {
        self.rank[unit] != usize::MAX
    }

    /// Whether sweeps move a signal: a member's, unless it is held over the step.
    pub(super) fn is_moved(&self, exchange: &Exchange, signal: SignalIndex) -> bool {
        self.is_member(exchange.origin(signal).0) && !exchange.signal(signal).is_held()
    }

    /// Whether a member's signal is assumed when the target takes it.
    pub(super) fn feeds_back(
        &self,
        exchange: &Exchange,
        signal: SignalIndex,
        target: UnitIndex,
    ) -> bool {
        let (source, _) = exchange.origin(signal);
        self.is_member(source) && self.rank[source] >= self.rank[target]
    }

    /// Finds the units that can repeat a step, and the signals that feed back between them.
    fn lay_out<U: Unit>(&mut self, exchange: &Exchange, units: &[U]) {
        let again: Vec<UnitIndex> =
            self.order.iter().copied().filter(|&k| units[k].capabilities().restore).collect();
        let mut repeats = vec![false; exchange.len()];
        again.iter().for_each(|&k| repeats[k] = true);
        let mut known = vec![false; exchange.signal_count()];
        let mut feedback: Vec<(SignalIndex, usize)> = Vec::new();
        for &target in &again {
            for (_, signal, _) in exchange.sources(target) {
                let (source, _) = exchange.origin(signal);
                let wanted = repeats[source]
                    && self.is_moved(exchange, signal)
                    && self.feeds_back(exchange, signal, target);
                if wanted && !std::mem::replace(&mut known[signal], true) {
                    feedback.push((signal, exchange.signal(signal).ends()));
                }
            }
        }
        let size = feedback.iter().map(|(_, highest)| 1 + highest).sum();
        self.x = vec![0.0; size];
        self.image = vec![0.0; size];
        self.scales = vec![1.0; size];
        self.feedback = feedback;
        self.again = Some(Phase::divide(exchange, &again));
    }

    /// The first sweep.
    pub(super) fn begin<U: Unit>(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        if self.again.is_none() {
            self.lay_out(exchange, units);
        }
        if self.settings.sweeps > 1 {
            for phase in self.again.iter().flatten() {
                for &k in &phase.members {
                    units[k].save(ITERATION)?;
                }
            }
        }
        for phase in &self.first {
            self.workers.step(exchange, units, phase, Task { time, size, again: false })?;
            for &k in &phase.members {
                exchange.accept(k, size);
                exchange.interpolate(k, size);
            }
        }
        let mut i = 0;
        for &(signal, highest) in &self.feedback {
            let predicted = in_steps(exchange.signal(signal).predicted(), size);
            let scale = exchange.allowed_error(signal, self.settings.tolerance);
            for (value, weight) in predicted.into_iter().zip(WEIGHTS).take(1 + highest) {
                self.x[i] = value;
                self.scales[i] = weight * scale;
                i += 1;
            }
        }
        self.read_image(exchange, size);
        self.iteration.steps += 1;
        self.iteration.sweeps += 1;
        Ok(())
    }

    /// Another sweep, from the present x.
    pub(super) fn repeat<U: Unit>(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        let mut i = 0;
        for &(signal, highest) in &self.feedback {
            let x = &self.x[i..=i + highest];
            let bend = x.get(2).map_or(0.0, |bend| bend / (size * size));
            exchange.assume(signal, [x[0], x.get(1).map_or(0.0, |rate| rate / size), bend], size);
            i += 1 + highest;
        }
        for phase in self.again.iter().flatten() {
            self.workers.step(exchange, units, phase, Task { time, size, again: true })?;
            for &k in &phase.members {
                exchange.accept_again(k);
                exchange.interpolate(k, size);
            }
        }
        self.read_image(exchange, size);
        self.iteration.sweeps += 1;
        Ok(())
    }

    fn read_image(&mut self, exchange: &Exchange, size: f64) {
        let mut i = 0;
        for &(signal, highest) in &self.feedback {
            let now = exchange.signal(signal).now();
            let now = in_steps([now[0], now[1], now[2]], size);
            self.image[i..=i + highest].copy_from_slice(&now[..=highest]);
            i += 1 + highest;
        }
    }

    /// The largest residual relative to the allowed error.
    pub(super) fn residual(&self) -> f64 {
        let parts = self.x.iter().zip(&self.image).zip(&self.scales);
        parts.map(|((x, image), scale)| (image - x).abs() / scale).fold(0.0, f64::max)
    }

    /// Counts a finished step.
    pub(super) fn end(&mut self, sweeps: u32, residual: f64) {
        let iteration = &mut self.iteration;
        iteration.most = iteration.most.max(sweeps);
        iteration.settled = residual <= 1.0;
        if !iteration.settled {
            iteration.unsettled += 1;
            iteration.worst = iteration.worst.max(residual);
        }
    }
}
