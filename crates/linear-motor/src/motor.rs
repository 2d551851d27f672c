//! A motor by either law, and the control of its slip frequency.

use crate::Error;
use crate::description::{ForceTable, MotorDescription};
use crate::field::Field;

/// Forces on the vehicle, N.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Forces {
    /// Along the track, forward positive.
    pub thrust: f64,
    /// Between primary and reaction plate, attraction positive.
    pub normal: f64,
}

/// What a motor is fed with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Feed {
    /// Current, r.m.s. of a phase, A.
    pub current: f64,
    /// Frequency, Hz; negative with the phases reversed.
    pub frequency: f64,
}

/// A linear induction motor.
#[derive(Debug, Clone, PartialEq)]
pub struct Motor {
    law: Law,
    pole_pitch: f64,
    slip_frequency: f64,
    max_current: f64,
    nominal_gap: f64,
    phase_resistance: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Law {
    Field(Field),
    Table(ForceTable),
}

impl Motor {
    /// The motor of a description.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the description's first fault.
    pub fn new(description: &MotorDescription) -> Result<Self, Error> {
        description.check()?;
        let law = match (&description.field, &description.table) {
            (Some(field), _) => Law::Field(Field::new(field, description.pole_pitch)),
            (None, Some(table)) => Law::Table(table.clone()),
            (None, None) => return Err(crate::error::invalid("field", "the law is missing")),
        };
        Ok(Self {
            law,
            pole_pitch: description.pole_pitch,
            slip_frequency: description.slip_frequency,
            max_current: description.max_current,
            nominal_gap: description.nominal_gap,
            phase_resistance: description.phase_resistance,
        })
    }

    /// Clearance in the vehicle's nominal place, m.
    #[must_use]
    pub fn nominal_gap(&self) -> f64 {
        self.nominal_gap
    }

    /// Slip frequency of the traction control, Hz.
    #[must_use]
    pub fn control_slip(&self) -> f64 {
        self.slip_frequency
    }

    /// Largest current of the traction control, A.
    #[must_use]
    pub fn max_current(&self) -> f64 {
        self.max_current
    }

    /// f − v/2τ, Hz.
    #[must_use]
    pub fn slip_frequency(&self, feed: Feed, speed: f64) -> f64 {
        feed.frequency - speed / (2.0 * self.pole_pitch)
    }

    /// Forces at a speed (m/s, forward positive) and a gap (m). Without current there are none, at any gap.
    ///
    /// # Errors
    /// [`Error::Touches`], or [`Error::Outside`] for a motor with a table.
    pub fn forces(&self, feed: Feed, speed: f64, gap: f64) -> Result<Forces, Error> {
        if feed.current == 0.0 {
            return Ok(Forces::default());
        }
        if gap <= 0.0 {
            return Err(Error::Touches { gap });
        }
        match &self.law {
            Law::Field(field) => Ok(field.forces(feed, speed, gap)),
            Law::Table(table) => {
                table.forces(feed.current, self.slip_frequency(feed, speed), speed, gap)
            }
        }
    }

    /// Electrical power that the motor takes, W: that of its thrust, of the losses in the sheet and of those in
    /// its winding. `None` with a table, which knows no losses.
    #[must_use]
    pub fn input_power(&self, feed: Feed, speed: f64, gap: f64) -> Option<f64> {
        let Law::Field(field) = &self.law else { return None };
        let copper = 3.0 * self.phase_resistance * feed.current * feed.current;
        if feed.current == 0.0 || gap <= 0.0 {
            return Some(copper);
        }
        Some(copper + field.powers(feed, speed, gap).input)
    }

    /// The feed that gives a thrust (N) at a speed (m/s) and the nominal gap: the slip frequency is the given one
    /// (Hz) for traction and its opposite for braking, and the current follows, up to `max_current` (A). If
    /// that slip gives a thrust of the wrong sign, as the end effect can with very small slip, the current is 0.
    ///
    /// # Errors
    /// As [`Motor::forces`].
    pub fn feed_for(
        &self,
        thrust: f64,
        speed: f64,
        [slip_frequency, max_current]: [f64; 2],
    ) -> Result<Feed, Error> {
        let slip = if thrust < 0.0 { -slip_frequency } else { slip_frequency };
        let frequency = speed / (2.0 * self.pole_pitch) + slip;
        if thrust == 0.0 {
            return Ok(Feed { current: 0.0, frequency });
        }
        let one = Feed { current: 1.0, frequency };
        let square = thrust / self.forces(one, speed, self.nominal_gap)?.thrust;
        let current = if square > 0.0 { square.sqrt().min(max_current) } else { 0.0 };
        Ok(Feed { current, frequency })
    }
}
