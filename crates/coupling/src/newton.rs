//! Newton on the interface Jacobian: as [`Iterated`](super::Iterated), but the next iterate solves
//! x = G(x) linearised.
//!
//! x ← x + (1 − G')⁻¹ (G(x) − x), where G' follows by the chain rule through the sweep from one
//! block ∂(ends of outputs)/∂(ends of inputs) per unit. This is the interface Jacobian-based
//! co-simulation algorithm (Sicklinger, Belsky, Engelmann, Elmqvist, Olsson, Wüchner & Bletzinger
//! 2014, "Interface Jacobian-based co-simulation", IJNME 98) with the unknowns reduced to the
//! feedback signals. Two sources of the blocks:
//!
//! - `directional`: `fmi2GetDirectionalDerivative` at the end of the step, ∂y/∂u at fixed states.
//!   That is the direct feed-through, which is all that remains as h → 0. The effect of the input
//!   through the states during the step, of order h, is left to the iteration. For units without
//!   directional derivatives, differences of steps are used.
//! - `steps`: the unit's step is repeated from the saved state for each input, with the end of the
//!   input changed a little: the whole effect, for one step per input and component.
//!
//! The Jacobian is kept until the step size changes by a fifth or an iteration gains less than a
//! factor of four. If a new one does not help, the next is computed after 2, 4, 8 … steps. The method
//! needs saved states. It converges where fixed-point iteration does not, such as in algebraic loops
//! and stiff couplings of light parts.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::algorithm::Algorithm;
use super::exchange::Exchange;
use super::index::{SignalIndex, UnitIndex};
use super::links::UnitValues;
use super::sweeps::{Sweeps, in_steps};
use super::unit::{ITERATION, Unit};
use super::workers::Workers;
use results::summary::Iteration;
use scenario::algorithm::{IterationSettings, JacobianSource};

/// Relative change of the end of an input for differences: with outputs exact to 1e-15 and bends of
/// order one, the quotients are exact to 1e-6 at worst.
const NUDGE: f64 = 1e-6;
/// An iteration that leaves more than this fraction of the residual requires a new Jacobian.
const SLOW: f64 = 0.25;
/// Largest number of steps to wait before a new Jacobian.
const PATIENCE: u32 = 1024;
/// Relative change of the step size that requires a new Jacobian.
const RESIZED: f64 = 0.2;

/// Newton iterations until the step's inputs agree with its outputs.
pub struct Newton {
    sweeps: Sweeps,
    jacobian: Option<Jacobian>,
    pause: Pause,
}

/// When the next Jacobian may be computed.
#[derive(Debug, Clone, Copy, Default)]
struct Pause {
    /// steps to wait after the next Jacobian that does not help
    length: u32,
    /// steps still to wait
    left: u32,
}

/// 1 − G' relative to the scales, factorised.
struct Jacobian {
    size: f64,
    scales: Vec<f64>,
    matrix: DMatrix<f64>,
    factors: LU<f64, Dyn, Dyn>,
}

/// ∂(ends of outputs)/∂(end of one input) of a unit.
struct Column {
    input: Component,
    outputs: Vec<(Component, f64)>,
}

/// A component of a signal's end: the derivative of that order times as many steps.
type Component = (SignalIndex, usize);

impl Jacobian {
    fn new(size: f64, scales: Vec<f64>, matrix: DMatrix<f64>) -> Self {
        let factors = matrix.clone().lu();
        Self { size, scales, matrix, factors }
    }

    fn fits(&self, size: f64) -> bool {
        (size / self.size - 1.0).abs() <= RESIZED
    }
}

impl Newton {
    /// Sweeps over the units in the order given.
    #[must_use]
    pub fn new(
        exchange: &Exchange,
        order: Vec<UnitIndex>,
        settings: IterationSettings,
        workers: Arc<Workers>,
    ) -> Self {
        Self {
            sweeps: Sweeps::new(exchange, order, settings, workers),
            jacobian: None,
            pause: Pause::default(),
        }
    }

    fn linearize<U: Unit>(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        let mut blocks = Vec::new();
        for &k in &self.sweeps.order {
            let able = units[k].capabilities();
            if !able.restore {
                continue;
            }
            let directional =
                able.directional && self.sweeps.settings.jacobian == JacobianSource::Directional;
            let columns = if directional {
                self.feed_through(exchange, &mut units[k], k)?
            } else {
                self.differences(exchange, &mut units[k], k, time, size)?
            };
            blocks.push((k, columns));
        }
        let matrix = self.chain(exchange, &blocks);
        self.jacobian = Some(Jacobian::new(size, self.sweeps.scales.clone(), matrix));
        self.sweeps.iteration.jacobians += 1;
        Ok(())
    }

    /// Signals from members that feed unit k, each once.
    fn inputs(&self, exchange: &Exchange, k: UnitIndex) -> Vec<SignalIndex> {
        let mut inputs = Vec::new();
        for (_, signal, _) in exchange.sources(k) {
            let moves = self.sweeps.is_moved(exchange, signal);
            if moves && !inputs.contains(&signal) {
                inputs.push(signal);
            }
        }
        inputs
    }

    fn feed_through<U: Unit>(
        &self,
        exchange: &Exchange,
        unit: &mut U,
        k: UnitIndex,
    ) -> Result<Vec<Column>, U::Error> {
        let mut columns = Vec::new();
        let mut gains = vec![0.0; exchange.outputs(k).reals.len()];
        for (input, signal, factor) in exchange.sources(k) {
            if !self.sweeps.is_moved(exchange, signal) {
                continue;
            }
            unit.directional(input, &mut gains)?;
            for component in 0..components(exchange, signal) {
                let outputs = exchange
                    .signals(k)
                    .filter(|&output| component < components(exchange, output))
                    .map(|output| ((output, component), factor * gains[exchange.origin(output).1]))
                    .filter(|(_, gain)| *gain != 0.0)
                    .collect();
                columns.push(Column { input: (signal, component), outputs });
            }
        }
        Ok(columns)
    }

    fn differences<U: Unit>(
        &self,
        exchange: &mut Exchange,
        unit: &mut U,
        k: UnitIndex,
        time: f64,
        size: f64,
    ) -> Result<Vec<Column>, U::Error> {
        let mut step = |exchange: &mut Exchange, outputs: &mut UnitValues| {
            exchange.fill(k, size);
            unit.restore(ITERATION)?;
            unit.send(&exchange.inputs[k])?;
            unit.begin_step(time, size)?;
            unit.step(time, size)?;
            unit.receive(time + size, outputs)
        };
        let (mut base, mut moved) = (exchange.outputs(k).clone(), exchange.outputs(k).clone());
        step(exchange, &mut base)?;
        let mut columns = Vec::new();
        for signal in self.inputs(exchange, k) {
            let now = exchange.signal(signal).now();
            let end = [now[0], now[1], now[2]];
            let nudge = exchange.allowed_error(signal, NUDGE);
            for component in 0..components(exchange, signal) {
                let mut other = end;
                other[component] += nudge / in_steps([1.0; 3], size)[component];
                exchange.assume(signal, other, size);
                step(exchange, &mut moved)?;
                let mut outputs = Vec::new();
                for output in exchange.signals(k) {
                    let (_, place) = exchange.origin(output);
                    let (before, after) = (&base.reals[place], &moved.reals[place]);
                    for c in 0..components(exchange, output) {
                        let unit = in_steps([1.0; 3], size)[c];
                        let gain = unit * (after[c] - before[c]) / nudge;
                        if gain != 0.0 {
                            outputs.push(((output, c), gain));
                        }
                    }
                }
                columns.push(Column { input: (signal, component), outputs });
            }
            exchange.assume(signal, end, size);
        }
        Ok(columns)
    }

    /// 1 − G', by propagating a change of each unknown through the sweep.
    fn chain(&self, exchange: &Exchange, blocks: &[(UnitIndex, Vec<Column>)]) -> DMatrix<f64> {
        let unknowns: Vec<Component> = self
            .sweeps
            .feedback
            .iter()
            .flat_map(|&(signal, highest)| (0..=highest).map(move |c| (signal, c)))
            .collect();
        let place = |(signal, component): Component| 3 * signal.0 + component;
        let count = 3 * exchange.signal_count();
        let scales = &self.sweeps.scales;
        let mut matrix = DMatrix::identity(unknowns.len(), unknowns.len());
        let mut changed = vec![0.0; count];
        for (j, &unknown) in unknowns.iter().enumerate() {
            changed.fill(0.0);
            for (k, columns) in blocks {
                for column in columns {
                    let change = if self.sweeps.feeds_back(exchange, column.input.0, *k) {
                        f64::from(u8::from(column.input == unknown))
                    } else {
                        changed[place(column.input)]
                    };
                    if change != 0.0 {
                        for &(output, gain) in &column.outputs {
                            changed[place(output)] += gain * change;
                        }
                    }
                }
            }
            for (i, &unknown) in unknowns.iter().enumerate() {
                matrix[(i, j)] -= changed[place(unknown)] * scales[j] / scales[i];
            }
        }
        matrix
    }

    /// Replaces x by the next iterate, or by G(x) if the equations have no solution.
    fn update(&mut self) {
        let sweeps = &mut self.sweeps;
        let residual = |i: usize| sweeps.image[i] - sweeps.x[i];
        let step = self.jacobian.as_ref().and_then(|jacobian| {
            let scaled = DVector::from_fn(sweeps.x.len(), |i, _| residual(i) / jacobian.scales[i]);
            let solution = jacobian.factors.solve(&scaled)?;
            let finite = solution.iter().all(|x| x.is_finite());
            finite.then(|| solution.component_mul(&DVector::from_column_slice(&jacobian.scales)))
        });
        match step {
            Some(step) => sweeps.x.iter_mut().zip(&step).for_each(|(x, dx)| *x += dx),
            None => sweeps.x.copy_from_slice(&sweeps.image),
        }
    }
}

fn components(exchange: &Exchange, signal: SignalIndex) -> usize {
    1 + exchange.signal(signal).ends()
}

impl<U: Unit> Algorithm<U> for Newton {
    fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        self.sweeps.begin(exchange, units, time, size)?;
        let mut residual = self.sweeps.residual();
        let (mut count, mut fresh, mut slow) = (1, false, false);
        while residual > 1.0 && count < self.sweeps.settings.sweeps {
            let usable = self.jacobian.as_ref().is_some_and(|jacobian| jacobian.fits(size));
            if !usable || (slow && !fresh && self.pause.left == 0) {
                self.linearize(exchange, units, time, size)?;
                fresh = true;
            }
            self.update();
            self.sweeps.repeat(exchange, units, time, size)?;
            let last = std::mem::replace(&mut residual, self.sweeps.residual());
            slow = residual > SLOW * last;
            count += 1;
        }
        self.pause.left = self.pause.left.saturating_sub(1);
        if fresh {
            let length = if slow { (2 * self.pause.length).clamp(2, PATIENCE) } else { 0 };
            self.pause = Pause { length, left: length };
        }
        self.sweeps.end(count, residual);
        Ok(())
    }

    fn members(&self) -> &[UnitIndex] {
        &self.sweeps.order
    }

    fn iteration(&self) -> Option<&Iteration> {
        Some(&self.sweeps.iteration)
    }

    fn state(&self) -> Vec<u8> {
        let Some(jacobian) = &self.jacobian else { return Vec::new() };
        let Pause { length, left } = self.pause;
        let numbers = [f64::from(length), f64::from(left), jacobian.size].into_iter();
        let numbers = numbers.chain(jacobian.scales.iter().copied());
        numbers.chain(jacobian.matrix.iter().copied()).flat_map(f64::to_le_bytes).collect()
    }

    fn restore(&mut self, state: &[u8]) -> bool {
        let (words, rest) = state.as_chunks::<8>();
        let numbers: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
        // 3 + n + n² numbers
        let n = numbers.len().saturating_sub(3).isqrt();
        match numbers.split_first_chunk() {
            None if state.is_empty() => self.jacobian = None,
            Some((&[length, left, size], others))
                if rest.is_empty() && others.len() == n + n * n =>
            {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "whole numbers up to 1024 in a valid state; casts saturate"
                )]
                let whole = |x: f64| (x as u32).min(PATIENCE);
                self.pause = Pause { length: whole(length), left: whole(left) };
                let (scales, matrix) = others.split_at(n);
                let matrix = DMatrix::from_column_slice(n, n, matrix);
                self.jacobian = Some(Jacobian::new(size, scales.to_vec(), matrix));
            }
            _ => return false,
        }
        true
    }
}
