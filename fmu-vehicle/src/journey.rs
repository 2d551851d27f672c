//! The journey along the track: speed and place of the frame in which the vehicle's equations run.

use fmi2_export::{Interface, RealVar, Step, UnitOfMeasure, Values, VariableRow};
use serde::{Deserialize, Serialize};

use crate::table::ParameterHandles;

/// Handles of what determines the journey.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JourneyHandles {
    travel_speed: RealVar,
    initial_position: RealVar,
    speed_change: RealVar,
}

/// Where the frame is, and how fast.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct Journey {
    /// Speed at the end of the last step, m/s.
    pub speed: f64,
    /// Its rate there, m/s², and the rate of that, m/s³.
    pub acceleration: f64,
    pub jerk: f64,
    /// The rate of the jerk, m/s⁴.
    pub snap: f64,
    /// Place (m) at the time (s) since which the speed is constant.
    place: f64,
    since: f64,
}

impl JourneyHandles {
    pub fn declare(interface: &mut Interface, parameters: &ParameterHandles) -> Self {
        let speed_change = interface
            .real("speed_change")
            .input(0.0)
            .unit(UnitOfMeasure::METRE_PER_SECOND)
            .display("km/h")
            .nominal(1.0)
            .description(
                "Change of the nominal speed, which is travel_speed + speed_change: a profile over time. The \
                 linear motor applies the force that its rate needs, in equal parts at the magnets; a jump is \
                 an impulse",
            )
            .done();
        let &ParameterHandles { travel_speed, initial_position, .. } = parameters;
        Self { travel_speed, initial_position, speed_change }
    }

    /// What the speed at the start depends on.
    pub fn speed_rows(&self) -> [VariableRow; 2] {
        [self.travel_speed.row(), self.speed_change.row()]
    }

    /// The journey at its start.
    pub fn start(&self, values: &Values, time: f64) -> Journey {
        Journey {
            speed: values.real(self.travel_speed) + values.real(self.speed_change),
            acceleration: 0.0,
            jerk: 0.0,
            snap: 0.0,
            place: values.real(self.initial_position),
            since: time,
        }
    }

    /// The speed over a step: a polynomial, v + v' τ + v'' τ²/2 + v''' τ³/6.
    pub fn speed_course(&self, values: &Values) -> [f64; 4] {
        let [change, rest @ ..] = *values.taylor(self.speed_change);
        let [a, j, s] = rest;
        [values.real(self.travel_speed) + change, a, j, s]
    }
}

impl Journey {
    /// Place of the frame along the track (m) at a time of the last step's end or later.
    pub fn place_at(&self, time: f64) -> f64 {
        self.place + self.speed * (time - self.since)
    }

    /// Whether forces are the same for both.
    pub fn alike(&self, other: &Self) -> bool {
        let forces = |it: &Self| (it.speed, it.acceleration, it.jerk, it.snap);
        forces(self) == forces(other)
    }

    /// The journey after a step. The place is the integral of the polynomial.
    pub fn after(&self, speed: [f64; 4], step: Step) -> Self {
        let [v, a, j, s] = speed;
        if v.to_bits() == self.speed.to_bits() && [a, j, s] == [0.0; 3] {
            // counted from where the speed became constant, not summed
            return Self { acceleration: 0.0, jerk: 0.0, snap: 0.0, ..*self };
        }
        let h = step.size;
        Self {
            speed: v + h * (a + h / 2.0 * (j + h / 3.0 * s)),
            acceleration: a + h * (j + h / 2.0 * s),
            jerk: j + h * s,
            snap: s,
            place: self.place_at(step.time) + h * (v + h / 2.0 * (a + h / 3.0 * (j + h / 4.0 * s))),
            since: step.end(),
        }
    }
}
