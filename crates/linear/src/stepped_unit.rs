//! A linear unit that the real coupling algorithms can step.

use std::convert::Infallible;

use super::unit_map::UnitMap;
use coupling::{Capabilities, InputIndex, PLACES, Taylor, Unit, UnitValues};

/// A linear unit. It is exact for inputs that are polynomials over a step, and provides the same derivatives of
/// outputs as the real unit. All its steps have the size of its map.
#[derive(Debug, Clone)]
pub struct SteppedUnit<'a> {
    map: &'a UnitMap,
    /// Highest derivative that is provided, per output.
    offered: &'a [usize],
    /// x.
    pub states: Vec<f64>,
    /// Inputs over the step; afterwards, from its end on.
    inputs: Vec<Taylor>,
    /// An input to which a constant is added, and that constant.
    pub held: Option<(usize, f64)>,
    /// What [`Unit::receive`] returns instead of the outputs while [`Self::is_preset`].
    pub preset: Vec<Taylor>,
    pub is_preset: bool,
    /// Scratch memory.
    next: Vec<f64>,
    saved: [(Vec<f64>, Vec<Taylor>); PLACES],
}

impl<'a> SteppedUnit<'a> {
    /// At rest.
    pub fn new(map: &'a UnitMap, offered: &'a [usize]) -> Self {
        let (states, inputs) = (map.by_state.matrix.nrows(), map.by_input[1].matrix.ncols());
        let nothing = || (vec![0.0; states], vec![Taylor::ZERO; inputs]);
        let (states, inputs) = nothing();
        Self {
            map,
            offered,
            states,
            inputs,
            held: None,
            preset: vec![Taylor::ZERO; offered.len()],
            is_preset: false,
            next: Vec::new(),
            saved: std::array::from_fn(|_| nothing()),
        }
    }

    /// At rest again.
    pub fn clear(&mut self) {
        self.states.fill(0.0);
        self.inputs.fill(Taylor::ZERO);
        self.held = None;
        self.is_preset = false;
    }

    /// Derivative `order` of an input now.
    pub fn input(&self, input: usize, order: usize) -> f64 {
        let held = self.held.filter(|&(held, _)| order == 0 && held == input);
        self.inputs.get(input).map_or(0.0, |it| it[order]) + held.map_or(0.0, |(_, value)| value)
    }

    /// Sets one input from now on.
    pub fn force(&mut self, input: usize, course: Taylor) {
        self.inputs[input] = course;
    }

    fn advance(&mut self, size: f64) {
        let mut next = std::mem::take(&mut self.next);
        next.clear();
        next.resize(self.states.len(), 0.0);
        self.map.by_state.add(|j| self.states[j], &mut next);
        for (k, by_input) in self.map.by_input.iter().enumerate() {
            by_input.add(|j| self.input(j, k), &mut next);
        }
        self.next = std::mem::replace(&mut self.states, next);
        self.inputs.iter_mut().for_each(|u| *u = u.shifted(size));
    }

    /// All outputs with the derivatives that are provided: y⁽ᵏ⁾ = C Aᵏ x + D u⁽ᵏ⁾ + C B u⁽ᵏ⁻¹⁾ + …
    pub fn outputs(&self) -> Vec<Taylor> {
        let mut outputs = vec![Taylor::ZERO; self.offered.len()];
        self.write_outputs(&mut outputs);
        outputs
    }

    fn write_outputs(&self, outputs: &mut [Taylor]) {
        outputs.fill(Taylor::ZERO);
        let UnitMap { providing, outputs_by_state, outputs_by_input, .. } = self.map;
        let mut values = vec![0.0; outputs.len()];
        for (k, rows) in providing.iter().enumerate() {
            let values = &mut values[..rows.len()];
            values.fill(0.0);
            outputs_by_state[k].add(|j| self.states[j], values);
            for (d, by_input) in outputs_by_input[k].iter().enumerate() {
                by_input.add(|j| self.input(j, k - d), values);
            }
            rows.iter().zip(values).for_each(|(&row, value)| outputs[row][k] = *value);
        }
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
        self.advance(size);
        Ok(())
    }

    fn receive(&mut self, _: f64, outputs: &mut UnitValues) -> Result<(), Infallible> {
        if self.is_preset {
            outputs.reals.copy_from_slice(&self.preset);
        } else {
            self.write_outputs(&mut outputs.reals);
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
        let by_input = &self.map.outputs_by_input[0][0].matrix;
        for (i, value) in column.iter_mut().enumerate() {
            *value = by_input[(i, input.0)];
        }
        Ok(())
    }
}
