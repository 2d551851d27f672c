//! Derivatives of inputs and outputs, by name.

use super::instance::TestInstance;
use super::log::CallFailure;
use crate::ffi;

impl TestInstance {
    /// Sets a derivative of a real input for the next step.
    ///
    /// # Errors
    /// There is no such input, or the order or value is invalid.
    pub fn set_input_derivative(
        &mut self,
        name: &str,
        order: i32,
        value: f64,
    ) -> Result<(), CallFailure> {
        let reference = self.reference(name)?;
        let (component, vr, order) = (self.component, &raw const reference, &raw const order);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_real_input_derivatives(component, vr, 1, order, &raw const value) };
        self.check("fmi2SetRealInputDerivatives", status)
    }

    /// Reads every derivative that the outputs declare, and returns how many there are.
    ///
    /// # Errors
    /// The model does not provide a derivative that it declares.
    pub fn declared_derivatives(&mut self) -> Result<usize, CallFailure> {
        let mut count = 0;
        for (name, highest) in self.offered.clone() {
            for order in (1..).take(highest as usize) {
                self.output_derivative(&name, order)?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// Time derivative of a real output, of the given order.
    ///
    /// # Errors
    /// There is no such output, or the derivative is not offered.
    pub fn output_derivative(&mut self, name: &str, order: i32) -> Result<f64, CallFailure> {
        let (reference, mut value) = (self.reference(name)?, 0.0);
        let (component, vr, order) = (self.component, &raw const reference, &raw const order);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_real_output_derivatives(component, vr, 1, order, &raw mut value) };
        self.check("fmi2GetRealOutputDerivatives", status).map(|()| value)
    }

    /// ∂unknown/∂known.
    ///
    /// # Errors
    /// A name is unknown or not allowed here.
    pub fn derivative(&mut self, unknown: &str, known: &str) -> Result<f64, CallFailure> {
        let (unknown, known) = (self.reference(unknown)?, self.reference(known)?);
        let (seed, mut value) = (1.0, 0.0);
        let component = self.component;
        let (unknown, known) = (&raw const unknown, &raw const known);
        let (seed, out) = (&raw const seed, &raw mut value);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_directional_derivative(component, unknown, 1, known, 1, seed, out) };
        self.check("fmi2GetDirectionalDerivative", status).map(|()| value)
    }
}
