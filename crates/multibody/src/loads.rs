//! Forces on the magnets: at an instant, and over a step.

/// Forces on the magnets, one entry per magnet, N.
#[derive(Debug, Clone, Copy)]
pub struct Loads<'a> {
    /// Upward.
    pub vertical: &'a [f64],
    /// To the left.
    pub lateral: &'a [f64],
}

/// Forces on the magnets as polynomials in the time τ since the start of the step:
/// u + u' τ + u'' τ²/2 + u''' τ³/6.
#[derive(Debug, Clone, Copy)]
pub struct LoadCourse<'a> {
    /// Upward, N.
    pub vertical: &'a [[f64; 4]],
    /// To the left, N.
    pub lateral: &'a [[f64; 4]],
}

/// Value of such a polynomial after the time t.
pub(crate) fn polynomial(u: &[f64; 4], t: f64) -> f64 {
    u[0] + t * (u[1] + t * (0.5 * u[2] + t * (u[3] / 6.0)))
}
