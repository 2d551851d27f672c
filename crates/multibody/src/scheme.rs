//! Runge-Kutta schemes of the time integration.

/// Explicit Runge-Kutta schemes in which every stage depends only on the previous one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scheme {
    /// The midpoint rule: order 2 with two evaluations.
    Midpoint,
    /// Heun's scheme of order 3 with three evaluations.
    Heun,
    /// The classical scheme: order 4 with four evaluations.
    #[default]
    Classical,
}

impl Scheme {
    /// Node and weight of each stage; a stage's node is also its distance along the slope before.
    pub(crate) fn stages(self) -> &'static [(f64, f64)] {
        match self {
            Self::Midpoint => &[(0.0, 0.0), (0.5, 1.0)],
            Self::Heun => &[(0.0, 0.25), (1.0 / 3.0, 0.0), (2.0 / 3.0, 0.75)],
            Self::Classical => {
                &[(0.0, 1.0 / 6.0), (0.5, 1.0 / 3.0), (0.5, 1.0 / 3.0), (1.0, 1.0 / 6.0)]
            }
        }
    }
}
