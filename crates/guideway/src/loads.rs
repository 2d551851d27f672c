//! Loads of the guideway.

use crate::Error;

/// One magnet's force and place over a step: `[u, u′, u″, u‴]` at its start, time derivatives of
/// the Taylor polynomial that the input follows, of degree 5 at most.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Levitation force (N); positive attracts the magnet up and pushes the girder down.
    pub force: [f64; 4],
    /// Centre of the magnet (m along the track).
    pub position: [f64; 4],
    /// Lateral force on the magnet (N), left positive; it pushes the rail to the right. Without rails it has no effect.
    pub lateral: [f64; 4],
    /// Fourth and fifth derivatives of `force`, `position` and `lateral`.
    pub further: [[f64; 2]; 3],
}

impl Load {
    /// Levitation force τ after the start of the step.
    pub(crate) fn force_at(&self, tau: f64) -> f64 {
        taylor(&self.force, &self.further[0], tau)
    }

    /// Place τ after the start of the step.
    pub(crate) fn position_at(&self, tau: f64) -> f64 {
        taylor(&self.position, &self.further[1], tau)
    }

    /// Lateral force τ after the start of the step.
    pub(crate) fn lateral_at(&self, tau: f64) -> f64 {
        taylor(&self.lateral, &self.further[2], tau)
    }

    /// Whether it stays in its place.
    pub fn stands(&self) -> bool {
        self.position[1..] == [0.0; 3] && self.further[1] == [0.0; 2]
    }

    /// A constant force at a fixed place.
    pub fn standing(force: f64, position: f64) -> Self {
        let held = |value| [value, 0.0, 0.0, 0.0];
        Self { force: held(force), position: held(position), ..Self::default() }
    }
}

/// A small change of a load.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LoadChange {
    /// Of the levitation force (N).
    pub force: f64,
    /// Of the place (m).
    pub place: f64,
    /// Of the lateral force (N).
    pub lateral: f64,
}

/// A force at one place of the track, beside the magnets' and the chirp's: `[u, u′, u″, u‴]` at the start of
/// a step (N), down positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointForce {
    /// Place along the track (m). Beyond the girders the force has no effect.
    pub position: f64,
    /// The force and its time derivatives.
    pub force: [f64; 4],
}

/// Value of a Taylor polynomial with these further derivatives τ after its start.
pub(crate) fn taylor(u: &[f64; 4], [fourth, fifth]: &[f64; 2], tau: f64) -> f64 {
    let third = u[3] / 6.0 + tau * (fourth / 24.0 + tau * (fifth / 120.0));
    u[0] + tau * (u[1] + tau * (u[2] / 2.0 + tau * third))
}

/// Refuses a force or place that is not finite.
pub(crate) fn check_further(further: Option<PointForce>, time: f64) -> Result<(), Error> {
    let Some(PointForce { position, force }) = further else { return Ok(()) };
    match [position].into_iter().chain(force).find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Error::PointForce { time, value }),
    }
}
