//! Units that make several steps of their own per communication step.
//!
//! A communication step of size h is made in n steps of h/n. The inputs are the same functions of time
//! as for one step: at each step's beginning τ its polynomial goes on from p(τ), p'(τ), p''(τ), p'''(τ).
//! So a unit that takes all derivatives feels no difference but that its own step is smaller. For one
//! that takes derivatives up to L < 3 only, the polynomial over each of its steps, of size δ, is replaced
//! by one of degree L:
//!
//! | L | polynomial | error of the input's integral over a step |
//! |---|---|---|
//! | 0 | the value in the middle, held | p'' δ³/24 |
//! | 1 | the line through both ends | −p'' δ³/12 |
//! | 2 | through both ends, with the slope at the first | O(p''' δ⁴) |
//!
//! What happens between communication points is not seen by others. With n > 1 a unit in a process of
//! its own steps when it is waited for, not beside the others.

use super::Participant;
use crate::coupling::signal::Taylor;
use fmi2_import::instance::FmuError;
use fmi2_import::span::parts;

/// What steps of one's own need.
#[derive(Debug)]
pub(super) struct Rate {
    /// per communication step
    steps: u32,
    /// over the communication step
    inputs: Vec<Taylor>,
}

impl Rate {
    #[inline]
    pub(super) fn take(&mut self, inputs: &[Taylor]) {
        self.inputs.copy_from_slice(inputs);
    }
}

/// Value and derivatives after τ.
pub(super) fn shifted(p: &Taylor, tau: f64) -> Taylor {
    [
        p[0] + tau * (p[1] + tau / 2.0 * (p[2] + tau / 3.0 * p[3])),
        p[1] + tau * (p[2] + tau / 2.0 * p[3]),
        p[2] + tau * p[3],
        p[3],
    ]
}

/// The polynomial of a degree that stands for p over a step of that size.
fn reduced(p: &Taylor, degree: usize, size: f64) -> Taylor {
    let change = || shifted(p, size)[0] - p[0];
    match degree {
        0 => [shifted(p, size / 2.0)[0], 0.0, 0.0, 0.0],
        1 => [p[0], change() / size, 0.0, 0.0],
        2 => [p[0], p[1], 2.0 * (change() - size * p[1]) / (size * size), 0.0],
        _ => *p,
    }
}

impl Participant {
    /// Lets the unit make so many steps per communication step.
    pub fn set_steps(&mut self, steps: u32) {
        let inputs = vec![[0.0; 4]; self.traffic.real_inputs.len()];
        self.rate = (steps > 1).then_some(Rate { steps, inputs });
    }

    /// Whether the unit's steps are not the communication steps; then it is given all derivatives of
    /// its inputs, whatever it takes itself.
    #[must_use]
    pub fn has_own_steps(&self) -> bool {
        self.rate.is_some() || self.slow.is_some()
    }

    /// Makes the unit's own steps over a communication step.
    pub(super) fn own_steps(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let Some(rate) = self.rate.take() else { return Ok(()) };
        let result = self.all_steps(&rate, time, size);
        self.rate = Some(rate);
        result
    }

    fn all_steps(&mut self, rate: &Rate, time: f64, size: f64) -> Result<(), FmuError> {
        for (begin, part) in parts(time, size, rate.steps) {
            let tau = begin - time;
            self.fill(|k, degree| reduced(&shifted(&rate.inputs[k], tau), degree, part));
            if let Some(retry) = &mut self.retry {
                for (kept, p) in retry.inputs.iter_mut().zip(&rate.inputs) {
                    *kept = shifted(p, tau);
                }
            }
            self.send_values()?;
            self.one_step(begin, part)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shifted polynomial takes the same values: all terms are exact in these numbers.
    #[test]
    fn analytic_a_shifted_polynomial_is_the_same_function() {
        let p = [1.0, -2.0, 3.0, 6.0];
        let at = |p: &Taylor, t: f64| p[0] + p[1] * t + p[2] * t * t / 2.0 + p[3] * t * t * t / 6.0;
        let q = shifted(&p, 0.5);
        for t in [0.0, 0.25, 0.5, 1.0, 2.0] {
            assert!((at(&q, t) - at(&p, t + 0.5)).abs() < 1e-14, "{t}");
        }
    }

    /// The table of errors, by integrals of cubics: 0.5 and the coefficients are exact, sums of four
    /// terms below 2 round by less than 1e-15.
    #[test]
    fn analytic_reduced_polynomials_err_as_told() {
        let integral =
            |p: &Taylor, h: f64| h * (p[0] + h / 2.0 * (p[1] + h / 3.0 * (p[2] + h / 4.0 * p[3])));
        let (parabola, h) = ([1.0, -2.0, 3.0, 0.0], 0.5);
        for (degree, error) in [(0, 3.0 / 24.0), (1, -3.0 / 12.0), (2, 0.0), (3, 0.0)] {
            let found = integral(&parabola, h) - integral(&reduced(&parabola, degree, h), h);
            assert!((found - error * h * h * h).abs() < 1e-15, "{degree}: {found}");
        }
        let cubic = [1.0, -2.0, 3.0, 6.0];
        for degree in [1, 2, 3] {
            let p = reduced(&cubic, degree, h);
            assert!((shifted(&p, h)[0] - shifted(&cubic, h)[0]).abs() < 1e-15);
        }
    }
}
