//! Parameters of one magnet and its controller; the defaults are the paper's table 2.

use serde::{Deserialize, Serialize};

use crate::{Conditions, Electromagnet, Error, state::MAX_DELAY};

/// Everything that describes a magnet. [`Default`] is the paper's magnet: table 2, the filter of
/// eq. 4, the linear law, no limits, a continuous controller.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MagnetParameters {
    /// Number of turns N of the coil.
    pub turns: f64,
    /// Area A of one pole face, in m².
    pub pole_area: f64,
    /// Resistance R of the coil, in Ω.
    pub resistance: f64,
    /// Nominal gap c₀, in m.
    pub nominal_gap: f64,
    /// Current i₀ about which the force is linearised, in A. The nonlinear law does not use it.
    pub operating_current: f64,
    /// Which force law and coil equation hold.
    pub law: Law,
    /// Gains and sampling of the controller.
    pub control: Controller,
    /// Whether the controller is left out: Δv is then the input `voltage_command`, and `control` and
    /// `filter` are not used.
    pub external_controller: bool,
    /// Design of the filter in front of the control law.
    pub filter: FilterDesign,
    /// Limits on the coil's voltage and current.
    pub limits: PowerLimits,
    /// Width w of a pole for the lateral force, in m; `None` switches the lateral force off.
    pub pole_width: Option<f64>,
    /// Whether an offset costs lift ([`LiftLoss`](crate::LiftLoss)); the nonlinear law only.
    pub lift_loss: bool,
    /// Longest Runge-Kutta step, in s, where the exact integration does not apply (nonlinear law,
    /// limits, a sampled controller, or conditions).
    pub integration_step: f64,
    /// Sensors, failures, lift-off and set-down.
    pub conditions: Conditions,
}

/// Force law and coil equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Law {
    /// Eqs 1 and 2, linear about (i₀, c₀), carrying the static force.
    Linear,
    /// F = μ₀AN²/4·(i/c)² with the gap-dependent inductance L(c) = μ₀N²A/(2c).
    Nonlinear,
}

/// The controller: gains of eq. 3, continuous or sampled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Controller {
    /// Gains of eq. 3.
    pub gains: Gains,
    /// Sampled instead of continuous, if given.
    pub sampling: Option<Sampling>,
}

/// Gains of the control law Δv = k₁·y₃ + k₂·y₄ + k₃·y₅ + k₄·y₂ + k₅·y₁ (eq. 3), in V per unit of
/// the scaled estimate y (eq. 5).
///
/// The gains follow eq. 3's order, the estimates eq. 5's. Applying the gains in eq. 5's order would
/// give a loop with almost no damping, hence the names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Gains {
    /// k₁, on the estimated acceleration y₃.
    pub acceleration: f64,
    /// k₂, on the estimated velocity y₄.
    pub velocity: f64,
    /// k₃, on the estimated position y₅.
    pub position: f64,
    /// k₄, on the estimated gap velocity y₂.
    pub gap_velocity: f64,
    /// k₅, on the estimated gap y₁.
    pub gap: f64,
}

/// A controller that acts at the instants t₀ + n·T, counted from initialisation, and holds its
/// voltage in between. The filter before it stays continuous.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Sampling {
    /// Sample time T, in s.
    pub period: f64,
    /// Number of samples, at most [`MAX_DELAY`], after which a voltage is applied that was computed
    /// at a sample.
    pub delay: usize,
}

/// Cut-off design of the dynamic filter; see [`crate::Filter`] for the equations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FilterDesign {
    /// Cut-off ω_c of the low-pass on the gap, in rad/s.
    pub gap_cutoff: f64,
    /// Damping ratio ζ_c of that low-pass.
    pub gap_damping: f64,
    /// Frequency ω_v where the velocity estimate passes from gap rate to acceleration, in rad/s.
    pub velocity_cutoff: f64,
    /// Damping ratio ζ_v of that passage.
    pub velocity_damping: f64,
    /// Frequency ω_p where the position estimate passes from gap to velocity, in rad/s.
    pub position_cutoff: f64,
}

/// Limits of the power electronics. `None` means unlimited.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct PowerLimits {
    /// Range of the coil's total voltage v, in V.
    pub voltage: Option<Range>,
    /// Range of the coil's total current i, in A, held by an ideal limiter: at a bound the current
    /// stays there as long as the voltage would drive it outwards, with any voltage that this
    /// requires.
    pub current: Option<Range>,
}

/// A closed range.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Range {
    /// Lower bound.
    pub min: f64,
    /// Upper bound.
    pub max: f64,
}

impl Default for MagnetParameters {
    fn default() -> Self {
        Self {
            turns: 400.0,
            pole_area: 0.036,
            resistance: 0.6,
            nominal_gap: 0.008,
            operating_current: 24.0,
            law: Law::Linear,
            control: Controller { gains: Gains::default(), sampling: None },
            external_controller: false,
            filter: filter_design_of_eq_4(),
            limits: PowerLimits::default(),
            pole_width: Some(0.028),
            lift_loss: false,
            integration_step: 5e-5,
            conditions: Conditions::default(),
        }
    }
}

impl Default for Gains {
    fn default() -> Self {
        Self { acceleration: 7.0, velocity: 40.0, position: 4.0, gap_velocity: 40.0, gap: 7.0 }
    }
}

/// The design that gives eq. 4's matrices, entry by entry: 1000 rad/s and 10 rad/s, both with a
/// damping ratio of one half, and 10 rad/s for the position.
pub const fn filter_design_of_eq_4() -> FilterDesign {
    FilterDesign {
        gap_cutoff: 1000.0,
        gap_damping: 0.5,
        velocity_cutoff: 10.0,
        velocity_damping: 0.5,
        position_cutoff: 10.0,
    }
}

/// The longest Runge-Kutta step times the fastest rate; see [`MagnetParameters::check`].
const MAX_STEP_ANGLE: f64 = 0.5;

/// The shortest sample time, in s. A million samples take about a second.
const SHORTEST_PERIOD: f64 = 1e-6;

impl MagnetParameters {
    /// Checks that the model is defined for these values.
    ///
    /// Where it is used, the integration step is held below half a radian of the fastest rate: a fourth-order
    /// Runge-Kutta step then errs by less than 0.5⁵/5! ≈ 3e-4 of the fastest mode's amplitude, far
    /// from its limit of stability at 2.6-2.8. Noise of a sensor that is read continuously has at most a
    /// tenth of a cycle of its bandwidth per step.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] or another one for the first value that is not acceptable.
    pub fn check(&self) -> Result<(), Error> {
        positive("turns", self.turns)?;
        positive("pole area (m²)", self.pole_area)?;
        positive("resistance (Ω)", self.resistance)?;
        positive("nominal gap (m)", self.nominal_gap)?;
        positive("operating current (A)", self.operating_current)?;
        long_enough("integration step (s)", self.integration_step)?;
        if let Some(width) = self.pole_width {
            positive("pole width (m)", width)?;
        }
        self.check_lift_loss()?;
        self.control.gains.check()?;
        if let Some(sampling) = self.control.sampling {
            self.check_sampling(&sampling)?;
        }
        self.filter.check()?;
        if let Some(range) = self.limits.voltage {
            range.check("lower voltage limit (V)", "upper voltage limit (V)")?;
        }
        if let Some(range) = self.limits.current {
            range.check("lower current limit (A)", "upper current limit (A)")?;
        }
        self.conditions.check(self)?;
        if self.is_exact() { Ok(()) } else { self.check_integration_step() }
    }

    /// Whether the closed form applies: linear law, no limits, continuous controller, no conditions.
    pub(crate) fn is_exact(&self) -> bool {
        let continuous = self.control.sampling.is_none();
        self.law == Law::Linear && self.limits.none() && continuous && self.conditions.none()
    }

    fn check_lift_loss(&self) -> Result<(), Error> {
        if !self.lift_loss {
            return Ok(());
        }
        if self.law == Law::Linear {
            return Err(Error::Unsupported {
                what: "lift loss with the linear law: the loss 2y²/(πwc) is of second order in the \
                       offset y, so a linear law has none; set nonlinear to true",
            });
        }
        if self.pole_width.is_none() {
            return Err(Error::Unsupported {
                what: "lift loss without lateral force: both follow from one co-energy; set \
                       lateral_guidance to true",
            });
        }
        Ok(())
    }

    fn check_sampling(&self, sampling: &Sampling) -> Result<(), Error> {
        if self.external_controller {
            return Err(Error::OutOfRange {
                name: "sample time (s)",
                value: sampling.period,
                must: "zero with an external controller, which has its own: set it there",
            });
        }
        sampling.check()
    }

    fn check_integration_step(&self) -> Result<(), Error> {
        if self.external_controller {
            return self.check_coil_step();
        }
        let rate = self.filter.fastest_rate();
        let longest = MAX_STEP_ANGLE / rate;
        if self.integration_step > longest {
            let step = self.integration_step;
            return Err(Error::CoarseIntegration { step, rate, longest });
        }
        let sensors = &self.conditions.sensors;
        sensors.map_or(Ok(()), |sensors| sensors.check_step(self.integration_step))
    }
}

impl MagnetParameters {
    /// Without the filter, the coil's R/L₀ is the fastest rate.
    fn check_coil_step(&self) -> Result<(), Error> {
        let rate = self.resistance / Electromagnet::new(self).inductance;
        if self.integration_step * rate <= MAX_STEP_ANGLE {
            return Ok(());
        }
        Err(Error::OutOfRange {
            name: "integration step (s)",
            value: self.integration_step,
            must: "at most half of the coil's time constant L/R with an external controller",
        })
    }
}

impl Sampling {
    /// Sampling with a period (s), or none if it is 0.
    ///
    /// # Errors
    /// [`Error::Needs`] for a delay without samples that it could count.
    pub fn if_any(period: f64, delay: usize) -> Result<Option<Self>, Error> {
        if period != 0.0 {
            return Ok(Some(Self { period, delay }));
        }
        if delay == 0 {
            return Ok(None);
        }
        Err(Error::Needs {
            name: "delay (samples)",
            value: delay as f64,
            needs: "a sampled controller, whose samples it counts: set sample_time, or set \
                    delay_samples to 0 and sample_delay to false; with an external controller, \
                    set both there",
        })
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        if self.period > 0.0 && self.period < SHORTEST_PERIOD {
            return Err(Error::OutOfRange {
                name: "sample time (s)",
                value: self.period,
                must: "at least 1e-6: each sample is computed (0 is a continuous controller)",
            });
        }
        positive("sample time (s)", self.period)?;
        if self.delay <= MAX_DELAY {
            return Ok(());
        }
        let value = self.delay as f64;
        Err(Error::OutOfRange { name: "delay (samples)", value, must: "at most 15" })
    }
}

impl Gains {
    pub(crate) fn check(&self) -> Result<(), Error> {
        finite("gain on the acceleration (V)", self.acceleration)?;
        finite("gain on the velocity (V)", self.velocity)?;
        finite("gain on the position (V)", self.position)?;
        finite("gain on the gap velocity (V)", self.gap_velocity)?;
        finite("gain on the gap (V)", self.gap)
    }
}

impl FilterDesign {
    pub(crate) fn check(&self) -> Result<(), Error> {
        positive("cut-off of the gap filter (rad/s)", self.gap_cutoff)?;
        positive("damping ratio of the gap filter", self.gap_damping)?;
        positive("cut-off of the velocity filter (rad/s)", self.velocity_cutoff)?;
        positive("damping ratio of the velocity filter", self.velocity_damping)?;
        positive("cut-off of the position filter (rad/s)", self.position_cutoff)
    }

    /// Largest modulus of the filter's poles, in 1/s: ω of a pair, or the faster of two real poles
    /// where a damping ratio exceeds one.
    pub fn fastest_rate(&self) -> f64 {
        let pair = |omega: f64, zeta: f64| omega * (zeta + (zeta * zeta - 1.0).max(0.0).sqrt());
        pair(self.gap_cutoff, self.gap_damping)
            .max(self.gap_cutoff)
            .max(pair(self.velocity_cutoff, self.velocity_damping))
            .max(self.velocity_cutoff)
            .max(self.position_cutoff)
    }
}

impl Range {
    fn check(&self, lower: &'static str, upper: &'static str) -> Result<(), Error> {
        finite(lower, self.min)?;
        finite(upper, self.max)?;
        if self.min < self.max {
            return Ok(());
        }
        Err(Error::OutOfRange { name: upper, value: self.max, must: "above the lower limit" })
    }
}

pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Error::OutOfRange { name, value, must: "positive and finite" })
}

/// Steps below a nanosecond would only take for ever.
fn long_enough(name: &'static str, value: f64) -> Result<(), Error> {
    positive(name, value)?;
    if value >= 1e-9 {
        return Ok(());
    }
    Err(Error::OutOfRange { name, value, must: "at least 1e-9" })
}

pub(crate) fn finite(name: &'static str, value: f64) -> Result<(), Error> {
    if value.is_finite() {
        return Ok(());
    }
    Err(Error::OutOfRange { name, value, must: "finite" })
}
