//! One bending mode: modal mass, frequency and damping.

use std::f64::consts::PI;

/// One mode of eq. 7: M·q̈ + C·q̇ + K·q = φᵀP, with C = 2ζωM and K = ω²M.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GirderMode {
    /// Modal mass M (kg).
    pub mass: f64,
    /// Undamped natural circular frequency ω (rad/s).
    pub omega: f64,
    /// Damping ratio ζ (1).
    pub zeta: f64,
}

impl GirderMode {
    /// Modal stiffness K = ω²M (N/m).
    pub fn stiffness(&self) -> f64 {
        self.omega * self.omega * self.mass
    }

    /// Modal damping C = 2ζωM (N·s/m).
    pub fn damping(&self) -> f64 {
        2.0 * self.zeta * self.omega * self.mass
    }

    /// Undamped natural frequency (Hz).
    pub fn frequency(&self) -> f64 {
        self.omega / (2.0 * PI)
    }
}
