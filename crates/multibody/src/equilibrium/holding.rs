//! What the search for an equilibrium is given, and what it finds.

use crate::state::State;

/// Law of the lateral guidance: from the load (N), the gap (m) and the offset to the left (m) of a magnet
/// its lateral force to the left (N) and how fast that falls with the offset (N/m).
pub type Guidance<'a> = &'a dyn Fn(f64, f64, f64) -> [f64; 2];

/// How the magnets are held while the equilibrium is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holding {
    /// K: stiffness at each magnet, N/m. Speeds the search, does not change the result.
    pub stiffness: f64,
    /// σ: inertial regularisation, 1/s².
    pub inertia: f64,
    /// Iterations before giving up.
    pub iterations: usize,
}

impl Default for Holding {
    fn default() -> Self {
        Self { stiffness: 1e7, inertia: 1.0, iterations: 300 }
    }
}

/// A vehicle at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Equilibrium {
    /// Pose, with zero velocities, at time zero.
    pub state: State,
    /// Upward force of each magnet, N.
    pub loads: Vec<f64>,
    /// Guidance force of each magnet to the left, N; zeros where no law is given.
    pub lateral: Vec<f64>,
    /// Iterations done.
    pub iterations: usize,
    /// Largest acceleration component left, m/s² or rad/s².
    pub acceleration: f64,
}
