//! A linear unit that the real coupling algorithms can step.

use std::convert::Infallible;

use super::unit::LinearUnit;
use coupling::{Capabilities, InputIndex, PLACES, Taylor, Unit, UnitValues};

/// Largest number of terms of the series, to avoid endless loops.
const MOST_TERMS: usize = 400;
/// Largest |λ|h at which one series covers a step: rounding grows with exp(|λ|h).
const WHOLE: f64 = 8.0;

/// A linear unit. It is exact for inputs that are cubic over a step, and provides the same derivatives of
/// outputs as the real unit.
#[derive(Debug, Clone)]
pub struct SteppedUnit<'a> {
    linear: &'a LinearUnit,
    /// Size of the largest eigenvalue of A (1/s).
    rate: f64,
    /// Highest derivative that is provided, per output.
    offered: &'a [usize],
    /// x.
    pub states: Vec<f64>,
    /// Inputs over the step; afterwards, from its end on.
    inputs: Vec<Taylor>,
    /// What [`Unit::receive`] returns instead of the outputs, if set.
    pub preset_outputs: Option<Vec<Taylor>>,
    saved: [(Vec<f64>, Vec<Taylor>); PLACES],
}

impl<'a> SteppedUnit<'a> {
    /// At rest. `rate` is the size of the largest eigenvalue of A (1/s).
    pub fn new(linear: &'a LinearUnit, rate: f64, inputs: usize, offered: &'a [usize]) -> Self {
        let nothing = || (vec![0.0; linear.states.len()], vec![Taylor::ZERO; inputs]);
        let (states, inputs) = nothing();
        Self {
            linear,
            rate,
            offered,
            states,
            inputs,
            preset_outputs: None,
            saved: std::array::from_fn(|_| nothing()),
        }
    }

    /// At rest again.
    pub fn clear(&mut self) {
        self.states.fill(0.0);
        self.inputs.fill(Taylor::ZERO);
        self.preset_outputs = None;
    }

    /// Sets one input from now on.
    pub fn force(&mut self, input: usize, course: Taylor) {
        self.inputs[input] = course;
    }

    /// Number of equal parts in which a step is computed, exact as the whole step is.
    pub fn parts(rate: f64, size: f64) -> f64 {
        let reach = rate * size;
        if reach <= WHOLE { 1.0 } else { reach.ceil() }
    }

    /// x(h) = Σ x⁽ᵏ⁾ hᵏ/k!, until three terms in a row no longer change the sum.
    fn advance(&mut self, size: f64) {
        let (mut term, mut factor, mut small) = (self.states.clone(), 1.0, 0);
        let mut sum = self.states.clone();
        for k in 0..MOST_TERMS {
            term = self.derivative(&term, k);
            factor *= size / (k as f64 + 1.0);
            let mut counts = false;
            for (sum, term) in sum.iter_mut().zip(&term) {
                let before = *sum;
                *sum += factor * term;
                counts |= (*sum).to_bits() != before.to_bits();
            }
            small = if counts { 0 } else { small + 1 };
            if k > 3 && small >= 3 {
                break;
            }
        }
        self.states = sum;
        self.inputs.iter_mut().for_each(|u| *u = u.shifted(size));
    }

    /// x⁽ᵏ⁺¹⁾ = A x⁽ᵏ⁾ + B u⁽ᵏ⁾ from x⁽ᵏ⁾.
    fn derivative(&self, x: &[f64], k: usize) -> Vec<f64> {
        let LinearUnit { states, a, b, .. } = self.linear;
        let order = |j: usize| if k < 4 { self.inputs[j][k] } else { 0.0 };
        (0..states.len()).map(|i| a.times(i, |j| x[j]) + b.times(i, order)).collect()
    }

    /// Value and derivatives of an output now: y⁽ᵏ⁾ = C x⁽ᵏ⁾ + D u⁽ᵏ⁾.
    fn output(&self, i: usize, derivatives: &[Vec<f64>]) -> Taylor {
        let LinearUnit { c, d, .. } = self.linear;
        Taylor(std::array::from_fn(|k| {
            if k > self.offered[i] {
                return 0.0;
            }
            c.times(i, |j| derivatives[k][j]) + d.times(i, |j| self.inputs[j][k])
        }))
    }

    /// All outputs with the derivatives that are provided.
    pub fn outputs(&self) -> Vec<Taylor> {
        let mut derivatives = vec![self.states.clone()];
        for k in 0..3 {
            derivatives.push(self.derivative(&derivatives[k], k));
        }
        (0..self.offered.len()).map(|i| self.output(i, &derivatives)).collect()
    }
}

impl Unit for SteppedUnit<'_> {
    type Error = Infallible;

    fn capabilities(&self) -> Capabilities {
        Capabilities { restore: true, variable_step: true, directional: true }
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), Infallible> {
        self.inputs.copy_from_slice(&inputs.reals);
        Ok(())
    }

    fn step(&mut self, _: f64, size: f64) -> Result<(), Infallible> {
        let parts = Self::parts(self.rate, size);
        for _ in 0..parts as usize {
            self.advance(size / parts);
        }
        Ok(())
    }

    fn receive(&mut self, _: f64, outputs: &mut UnitValues) -> Result<(), Infallible> {
        match &self.preset_outputs {
            Some(preset) => outputs.reals.copy_from_slice(preset),
            None => outputs.reals.copy_from_slice(&self.outputs()),
        }
        Ok(())
    }

    fn save(&mut self, place: usize) -> Result<(), Infallible> {
        self.saved[place] = (self.states.clone(), self.inputs.clone());
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), Infallible> {
        (self.states, self.inputs) = self.saved[place].clone();
        Ok(())
    }

    fn directional(&mut self, input: InputIndex, column: &mut [f64]) -> Result<(), Infallible> {
        for (i, value) in column.iter_mut().enumerate() {
            *value = self.linear.d.times(i, |j| f64::from(u8::from(j == input.0)));
        }
        Ok(())
    }
}
