//! Time derivatives: of inputs, as the importer sets them, and of outputs, as the model gives them.

use crate::Error;
use crate::instance::{ExportedInstance, unknown};
use crate::per_type::VariableType;
use crate::values::{NO_SLOT, Real, Var};

impl ExportedInstance {
    pub(crate) fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        new: &[f64],
    ) -> Result<(), Error> {
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(new) {
            let rule = self.table.rules.reals.get(reference as usize);
            let rule = rule.ok_or_else(|| unknown(VariableType::Real, reference))?;
            let name = self.table.name(VariableType::Real, reference as usize);
            if rule.highest == 0 {
                let text = format!("{name} is not a continuous input and has no derivatives");
                return Err(Error::invalid(text));
            }
            if !(1..=i32::from(rule.highest)).contains(&order) {
                let text = format!(
                    "{name}: only derivatives of order 1 to {} are supported, not {order}",
                    rule.highest
                );
                return Err(Error::invalid(text));
            }
            if !value.is_finite() {
                let text = format!("derivative {order} of {name} cannot be {value}");
                return Err(Error::invalid(text));
            }
        }
        for ((&reference, &order), &value) in references.iter().zip(orders).zip(new) {
            let slot = self.table.rules.reals[reference as usize].slot;
            match self.values.taylor[slot as usize].get_mut(order as usize) {
                Some(place) => *place = value,
                None => {
                    self.values.further[slot as usize][order as usize - 4] = value;
                    self.values.has_further |= value != 0.0;
                }
            }
            self.progress.derivatives_set = true;
        }
        Ok(())
    }

    pub(crate) fn output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        out: &mut [std::mem::MaybeUninit<f64>],
    ) -> Result<(), Error> {
        self.refresh()?;
        for (&reference, &order) in references.iter().zip(orders) {
            let rule = self.table.rules.reals.get(reference as usize);
            let rule = rule.ok_or_else(|| unknown(VariableType::Real, reference))?;
            if !rule.output {
                let name = self.table.name(VariableType::Real, reference as usize);
                return Err(Error::invalid(format!("{name} is not an output")));
            }
            let highest = self.table.derivatives[reference as usize];
            if !u32::try_from(order).is_ok_and(|order| (1..=highest).contains(&order)) {
                return Err(self.refuse_derivative(reference, order, highest));
            }
        }
        if references.is_empty() {
            return Ok(());
        }
        self.model.prepare_derivatives(&self.values)?;
        for ((&reference, &order), out) in references.iter().zip(orders).zip(out) {
            let output = Var { index: reference, slot: NO_SLOT, of: Real };
            let value = self.model.output_derivative(&self.values, output, order.unsigned_abs())?;
            out.write(self.check_derivative_value(reference, order, value)?);
        }
        Ok(())
    }

    /// Discard for an order that other outputs offer, error for an order that no output offers.
    #[cold]
    fn refuse_derivative(&self, reference: u32, order: i32, highest: u32) -> Error {
        let name = self.table.name(VariableType::Real, reference as usize);
        let most = self.table.interface.max_output_derivative_order();
        if u32::try_from(order).is_ok_and(|order| (1..=most).contains(&order)) {
            return Error::discard(format!(
                "derivative {order} of {name} is not offered, only up to order {highest}"
            ));
        }
        Error::invalid(format!("{name}: derivatives of order 1 to {most} are offered"))
    }

    #[inline]
    fn check_derivative_value(
        &self,
        reference: u32,
        order: i32,
        value: Option<f64>,
    ) -> Result<f64, Error> {
        if let Some(value) = value.filter(|value| value.is_finite()) {
            return Ok(value);
        }
        let name = self.table.name(VariableType::Real, reference as usize);
        Err(match value {
            None => Error::discard(format!("derivative {order} of {name} is not offered")),
            Some(value) => {
                let time = self.progress.time;
                Error::invalid(format!("derivative {order} of {name} is {value} at t = {time} s"))
            }
        })
    }
}
