//! Settings and result of the search for an equilibrium.

use crate::loads::ExternalLoad;
use crate::state::State;

/// Law of the lateral guidance. Arguments: load (N), gap (m) and offset to the left (m) of a
/// magnet. Result: its lateral force to the left (N) and the restoring stiffness (N/m).
pub type Guidance<'a> = &'a dyn Fn(f64, f64, f64) -> [f64; 2];

/// Settings of the search for an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holding {
    /// K: stiffness at each magnet, N/m. Speeds up the search and does not change the result.
    pub stiffness: f64,
    /// σ: inertial regularisation, 1/s².
    pub inertia: f64,
    /// Largest number of iterations.
    pub iterations: usize,
}

impl Default for Holding {
    fn default() -> Self {
        Self { stiffness: 1e7, inertia: 1.0, iterations: 300 }
    }
}

/// The rails at rest, one entry per magnet.
#[derive(Debug, Clone, Copy)]
pub struct Rails<'a> {
    /// Heights of the surface, m, up positive.
    pub height: &'a [f64],
    /// Lateral displacements, m, left positive; an empty list means zeros.
    pub side: &'a [f64],
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
    /// External loads under which it rests; empty if there are none.
    pub external: Vec<ExternalLoad>,
    /// Iterations done.
    pub iterations: usize,
    /// Largest acceleration component left, m/s² or rad/s².
    pub acceleration: f64,
}
