//! Forces from outside: at an instant, and over a step.

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

/// Fourth and fifth derivatives of the forces of a [`LoadCourse`], one entry per magnet, or none at all.
#[derive(Debug, Clone, Copy, Default)]
pub struct FurtherCourse<'a> {
    /// Of the upward force.
    pub vertical: &'a [[f64; 2]],
    /// Of the force to the left.
    pub lateral: &'a [[f64; 2]],
}

impl FurtherCourse<'_> {
    /// Adds what they contribute after the time t.
    pub(crate) fn add(&self, vertical: &mut [f64], lateral: &mut [f64], t: f64) {
        let scale = t * t * t * t / 24.0;
        for (values, further) in [(vertical, self.vertical), (lateral, self.lateral)] {
            for (value, [fourth, fifth]) in values.iter_mut().zip(further) {
                *value += scale * (fourth + 0.2 * t * fifth);
            }
        }
    }
}

/// External force (N) and moment (N·m) on an observed body: x, y and z of the force at the body's
/// centre of mass, then x, y and z of the moment, all in world axes.
pub type ExternalLoad = [f64; 6];

/// All forces from outside. [`Loads`] alone convert into this.
#[derive(Debug, Clone, Copy)]
pub struct AppliedForces<'a> {
    /// Forces on the magnets.
    pub magnets: Loads<'a>,
    /// One entry per observed body, or none at all.
    pub external: &'a [ExternalLoad],
    /// Acceleration of the travelling frame along the track, m/s². Each body then feels minus its mass times this, and
    /// the motor applies the mass of the vehicle times this, in equal parts at the magnets.
    pub acceleration: f64,
}

/// All forces from outside over a step. A [`LoadCourse`] alone converts into this.
#[derive(Debug, Clone, Copy)]
pub struct AppliedCourse<'a> {
    /// Forces on the magnets.
    pub magnets: LoadCourse<'a>,
    /// What these have beyond the third order.
    pub further: FurtherCourse<'a>,
    /// One entry per observed body, or none at all; polynomials as in [`LoadCourse`].
    pub external: &'a [[[f64; 4]; 6]],
    /// Acceleration of the travelling frame along the track, m/s²; a polynomial as in [`LoadCourse`].
    pub acceleration: [f64; 4],
}

impl<'a> From<&Loads<'a>> for AppliedForces<'a> {
    fn from(magnets: &Loads<'a>) -> Self {
        Self { magnets: *magnets, external: &[], acceleration: 0.0 }
    }
}

impl<'a> From<&LoadCourse<'a>> for AppliedCourse<'a> {
    fn from(magnets: &LoadCourse<'a>) -> Self {
        let further = FurtherCourse::default();
        Self { magnets: *magnets, further, external: &[], acceleration: [0.0; 4] }
    }
}

/// Value of such a polynomial after the time t.
pub(crate) fn polynomial(u: &[f64; 4], t: f64) -> f64 {
    u[0] + t * (u[1] + t * (0.5 * u[2] + t * (u[3] / 6.0)))
}

/// Copies external loads; none at all are zeros.
pub(crate) fn copy_external(target: &mut [ExternalLoad], source: &[ExternalLoad]) {
    if source.is_empty() {
        target.fill([0.0; 6]);
    } else {
        target.copy_from_slice(source);
    }
}
