//! Directional derivatives: the model's own or central differences.

use std::mem::MaybeUninit;

use crate::Error;
use crate::instance::{ExportedInstance, unknown};
use crate::interface::VariableRole;
use crate::model::{Seed, Sensitivity};
use crate::per_type::VariableType;
use crate::scratch::DerivativeScratch;
use crate::state::InstanceMode;

impl ExportedInstance {
    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        out: &mut [MaybeUninit<f64>],
    ) -> Result<(), Error> {
        if let Some(why) = &self.table.interface.limits.directional {
            let text = format!("the unit has no directional derivatives: {why}");
            return Err(Error::invalid(text));
        }
        self.check_derivative(unknowns, knowns, direction)?;
        self.refresh()?;
        let mut scratch = self.scratch.take().unwrap_or_else(|| self.new_scratch());
        scratch.seed.0.fill(0.0);
        scratch.result.0.fill(0.0);
        for (&known, &component) in knowns.iter().zip(direction) {
            scratch.seed.0[known as usize] += component;
        }
        let done = self.derive(&mut scratch, knowns);
        let done = done.and_then(|()| self.check_result(unknowns, &scratch.result));
        for (&unknown, out) in unknowns.iter().zip(out) {
            out.write(scratch.result.0[unknown as usize]);
        }
        self.scratch = Some(scratch);
        done
    }

    fn new_scratch(&self) -> Box<DerivativeScratch> {
        let zeros = vec![0.0; self.values.arrays.reals.len()];
        let values = self.values.clone();
        Box::new(DerivativeScratch {
            seed: Seed(zeros.clone()),
            result: Sensitivity(zeros),
            values,
        })
    }

    fn derive(&mut self, scratch: &mut DerivativeScratch, knowns: &[u32]) -> Result<(), Error> {
        let DerivativeScratch { seed, result, .. } = scratch;
        let own = self.progress.mode != InstanceMode::Initialization
            && self.model.directional_derivative(&self.values, seed, result)?;
        if own {
            return Ok(());
        }
        result.0.fill(0.0);
        self.differences(scratch, knowns)
    }

    fn check_result(&self, unknowns: &[u32], result: &Sensitivity) -> Result<(), Error> {
        let value = |&unknown: &u32| result.0[unknown as usize];
        match unknowns.iter().find(|&unknown| !value(unknown).is_finite()) {
            None => Ok(()),
            Some(unknown) => Err(Error::invalid(format!(
                "the directional derivative of {} is {} at t = {} s",
                self.table.name(VariableType::Real, *unknown as usize),
                value(unknown),
                self.progress.time
            ))),
        }
    }

    /// Central differences (f(v + δd) − f(v − δd))/2δ. Their error is δ²·f⃛/6 + ε·f/δ, least near
    /// δ = ∛ε of the size of the variables; a linear model only has the second part, about 4e-11
    /// of f's size.
    fn differences(
        &mut self,
        scratch: &mut DerivativeScratch,
        knowns: &[u32],
    ) -> Result<(), Error> {
        let relative = |&known: &u32| {
            let (value, component) =
                (self.values.arrays.reals[known as usize], scratch.seed.0[known as usize]);
            component.abs() / value.abs().max(self.table.nominal(known as usize))
        };
        let largest = knowns.iter().map(relative).fold(0.0, f64::max);
        if largest == 0.0 {
            return Ok(());
        }
        let delta = f64::EPSILON.cbrt() / largest;
        scratch.values.clone_from(&self.values);
        let done = self.difference(scratch, knowns, delta);
        self.values.clone_from(&scratch.values);
        if self.progress.mode == InstanceMode::Initialization {
            // The model now holds the state of a displaced point.
            self.progress.state_stale = true;
        }
        done
    }

    fn difference(
        &mut self,
        scratch: &mut DerivativeScratch,
        knowns: &[u32],
        delta: f64,
    ) -> Result<(), Error> {
        self.displaced(scratch, knowns, delta)?;
        scratch.result.0.copy_from_slice(&self.values.arrays.reals);
        self.displaced(scratch, knowns, -delta)?;
        for (result, value) in scratch.result.0.iter_mut().zip(&self.values.arrays.reals) {
            *result = (*result - value) / (2.0 * delta);
        }
        Ok(())
    }

    /// Computes all outputs at v + δd.
    fn displaced(
        &mut self,
        scratch: &DerivativeScratch,
        knowns: &[u32],
        delta: f64,
    ) -> Result<(), Error> {
        for &known in knowns {
            let known = known as usize;
            let value = scratch.values.arrays.reals[known] + delta * scratch.seed.0[known];
            self.values.put_real(known, self.table.rules.reals[known].slot, value);
        }
        let time = self.progress.time;
        if self.progress.mode == InstanceMode::Initialization {
            self.model.initialise(&mut self.values, time)?;
        }
        self.model.outputs(&mut self.values, time)
    }

    fn check_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
    ) -> Result<(), Error> {
        let initial = self.progress.mode == InstanceMode::Initialization;
        for &reference in unknowns {
            let role = self.table.role(VariableType::Real, reference as usize);
            let role = role.ok_or_else(|| unknown(VariableType::Real, reference))?;
            if role != VariableRole::Output
                && !(initial && role == VariableRole::CalculatedParameter)
            {
                let name = self.table.name(VariableType::Real, reference as usize);
                return Err(Error::invalid(format!("{name} is not an unknown of the model")));
            }
        }
        for (&known, &component) in knowns.iter().zip(direction) {
            let role = self.table.role(VariableType::Real, known as usize);
            let role = role.ok_or_else(|| unknown(VariableType::Real, known))?;
            let name = self.table.name(VariableType::Real, known as usize);
            let fits = role == VariableRole::Input
                || (initial && matches!(role, VariableRole::Parameter | VariableRole::Tunable));
            if !fits {
                return Err(Error::invalid(format!(
                    "{name} is not an input or parameter to differentiate by"
                )));
            }
            if !component.is_finite() {
                return Err(Error::invalid(format!(
                    "the seed of {name} is {component}; it must be finite"
                )));
            }
        }
        Ok(())
    }
}
