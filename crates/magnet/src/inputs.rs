//! Inputs of the magnet: at an instant, and as polynomials over a step.

use serde::{Deserialize, Serialize};

use crate::{Error, conditions::Signals, lift_loss::Place, parameters::finite};

/// Value and first three time derivatives of a signal at the start of a step: the polynomial
/// u(τ) = u + u'·τ + u''·τ²/2 + u'''·τ³/6.
pub type Taylor = [f64; 4];

/// The fourth and fifth derivative of a signal at the start of a step: the polynomial has the terms
/// u⁗·τ⁴/24 + u⁗′·τ⁵/120 as well.
pub type Further = [f64; 2];

/// The fourth and fifth derivatives of the signals of an [`InputCourse`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FurtherCourse {
    /// Of the gap.
    pub gap: Further,
    /// Of the acceleration.
    pub acceleration: Further,
    /// Of the voltage command.
    pub voltage_command: Further,
    /// Of the lateral offset.
    pub lateral_offset: Further,
}

/// Signals at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct MagnetInputs {
    /// Gap c, in m.
    pub gap: f64,
    /// Rate of the gap ċ, in m/s.
    pub gap_rate: f64,
    /// Inertial acceleration q̈ of the magnet, in m/s², positive downward.
    pub acceleration: f64,
    /// Displacement y of the magnet to the left of the rail, in m.
    pub lateral_offset: f64,
    /// Static force F_s that the magnet carries at its operating point, in N.
    pub static_force: f64,
    /// Δv of eq. 3, in V, that a controller outside asks for; not used otherwise
    /// ([`MagnetParameters::external_controller`](crate::MagnetParameters::external_controller)).
    pub voltage_command: f64,
    /// The part of `voltage_command`, in V, that the gap's rate causes at the start and that does not
    /// last; [`Magnet::initialise`](crate::Magnet::initialise) subtracts it.
    pub transient_voltage: f64,
}

/// The signals that the voltage depends on directly, not through a state: the acceleration by the
/// control law, or the command of a controller outside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Direct {
    /// q̈, in m/s².
    pub acceleration: f64,
    /// Δv, in V.
    pub command: f64,
}

impl MagnetInputs {
    pub(crate) fn place(&self) -> Place {
        Place { gap: self.gap, offset: self.lateral_offset }
    }

    pub(crate) fn signals(&self) -> Signals {
        Signals {
            values: [self.gap, self.acceleration],
            command: [self.voltage_command, 0.0],
            ..Signals::default()
        }
    }

    /// Checks that all signals are finite and that the gap is open.
    pub(crate) fn check(&self) -> Result<(), Error> {
        finite("gap (m)", self.gap)?;
        finite("gap rate (m/s)", self.gap_rate)?;
        finite("acceleration (m/s²)", self.acceleration)?;
        finite("lateral offset (m)", self.lateral_offset)?;
        finite("static force (N)", self.static_force)?;
        finite("voltage command (V)", self.voltage_command)?;
        finite("transient voltage (V)", self.transient_voltage)?;
        if self.gap > 0.0 {
            return Ok(());
        }
        let must = "positive: at zero the magnet touches the rail and the force law ends";
        Err(Error::OutOfRange { name: "gap (m)", value: self.gap, must })
    }
}

/// The signals that drive the state, over a step: polynomials of up to fifth order in the time
/// since the start of the step.
///
/// The gap drives the filter and the coil. The rate used here is the derivative of the gap, not the
/// input gap rate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct InputCourse {
    /// Gap, in m, m/s, …
    pub gap: Taylor,
    /// Acceleration, in m/s², …
    pub acceleration: Taylor,
    /// Δv that a controller outside asks for, in V, …; not used otherwise.
    pub voltage_command: Taylor,
    /// Lateral offset, in m, …; used with lift loss only.
    pub lateral_offset: Taylor,
    /// What is beyond the third order.
    pub further: FurtherCourse,
}

impl InputCourse {
    /// Signals that keep their value over the step.
    pub fn constant(inputs: &MagnetInputs) -> Self {
        let hold = |value| [value, 0.0, 0.0, 0.0];
        Self {
            gap: hold(inputs.gap),
            acceleration: hold(inputs.acceleration),
            voltage_command: hold(inputs.voltage_command),
            lateral_offset: hold(inputs.lateral_offset),
            further: FurtherCourse::default(),
        }
    }

    /// The same polynomials, starting `time` (s) later: the rest of a step.
    pub fn after(&self, time: f64) -> Self {
        let it = &self.further;
        let later = |[fourth, fifth]: Further| [fourth + time * fifth, fifth];
        Self {
            gap: shift(&self.gap, &it.gap, time),
            acceleration: shift(&self.acceleration, &it.acceleration, time),
            voltage_command: shift(&self.voltage_command, &it.voltage_command, time),
            lateral_offset: shift(&self.lateral_offset, &it.lateral_offset, time),
            further: FurtherCourse {
                gap: later(it.gap),
                acceleration: later(it.acceleration),
                voltage_command: later(it.voltage_command),
                lateral_offset: later(it.lateral_offset),
            },
        }
    }

    /// Gap and acceleration `time` (s) after the step's start.
    pub(crate) fn at(&self, time: f64) -> [f64; 2] {
        let it = &self.further;
        [value(&self.gap, &it.gap, time), value(&self.acceleration, &it.acceleration, time)]
    }

    /// What the voltage depends on directly, `time` (s) after the step's start.
    pub(crate) fn direct(&self, time: f64) -> Direct {
        Direct {
            acceleration: value(&self.acceleration, &self.further.acceleration, time),
            command: self.command(time),
        }
    }

    /// Values of the signals that the controller sees, `time` (s) after the step's start.
    pub(crate) fn signals(&self, time: f64) -> Signals {
        Signals { values: self.at(time), command: [self.command(time), 0.0], ..Signals::default() }
    }

    fn command(&self, time: f64) -> f64 {
        value(&self.voltage_command, &self.further.voltage_command, time)
    }

    /// The gap's derivative `time` (s) after the step's start, in m/s.
    pub(crate) fn gap_slope(&self, time: f64) -> f64 {
        let [_, slope, ..] = shift(&self.gap, &self.further.gap, time);
        slope
    }

    /// The lateral offset and its rate `time` (s) after the step's start, in m and m/s.
    pub(crate) fn aside(&self, time: f64) -> [f64; 2] {
        let further = &self.further.lateral_offset;
        let [offset, rate, ..] = shift(&self.lateral_offset, further, time);
        [offset, rate]
    }

    pub(crate) fn check(&self, time: f64) -> Result<(), Error> {
        self.check_finite()?;
        if self.gap[0] > 0.0 {
            return Ok(());
        }
        Err(Error::GapClosed { time, gap: self.gap[0] })
    }

    pub(crate) fn check_finite(&self) -> Result<(), Error> {
        let all_finite = |t: &[f64]| t.iter().all(|v| v.is_finite());
        let it = &self.further;
        for (name, course) in [
            ("gap or one of its derivatives", [&self.gap[..], &it.gap]),
            ("acceleration or one of its derivatives", [&self.acceleration, &it.acceleration]),
            (
                "voltage command or one of its derivatives",
                [&self.voltage_command, &it.voltage_command],
            ),
            (
                "lateral offset or one of its derivatives",
                [&self.lateral_offset, &it.lateral_offset],
            ),
        ] {
            if !course.iter().all(|part| all_finite(part)) {
                let values = course.concat();
                let value = values.into_iter().find(|v| !v.is_finite()).unwrap_or(f64::NAN);
                return Err(Error::OutOfRange { name, value, must: "finite" });
            }
        }
        Ok(())
    }
}

/// Value of the polynomial after `t`.
#[inline]
fn value(u: &Taylor, w: &Further, t: f64) -> f64 {
    let third = u[3] / 6.0 + t * (w[0] / 24.0 + t * (w[1] / 120.0));
    u[0] + t * (u[1] + t * (0.5 * u[2] + t * third))
}

/// The polynomial's first four derivatives after `t`.
fn shift(u: &Taylor, w: &Further, t: f64) -> Taylor {
    [
        value(u, w, t),
        u[1] + t * (u[2] + t * (0.5 * u[3] + t * (w[0] / 6.0 + t * (w[1] / 24.0)))),
        u[2] + t * (u[3] + t * (0.5 * w[0] + t * (w[1] / 6.0))),
        u[3] + t * (w[0] + t * (0.5 * w[1])),
    ]
}
