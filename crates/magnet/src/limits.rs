//! Active limits of the power electronics.

use crate::parameters::{PowerLimits, Range};

/// Position of a limited quantity relative to its range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LimitSide {
    Free,
    Lower,
    Upper,
}

/// The active limits: a pure function of state, inputs and parameters, so they are not part of the
/// state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LimitsAtWork {
    pub(crate) voltage: LimitSide,
    pub(crate) current: LimitSide,
}

impl LimitSide {
    /// The bound at which the quantity is held, if it is.
    pub(crate) fn bound(self) -> Option<fn(Range) -> f64> {
        match self {
            Self::Free => None,
            Self::Lower => Some(|range| range.min),
            Self::Upper => Some(|range| range.max),
        }
    }
}

impl LimitsAtWork {
    pub(crate) const FREE: Self = Self { voltage: LimitSide::Free, current: LimitSide::Free };

    /// Whether the controller demands more voltage than is available.
    pub fn voltage_is_limited(self) -> bool {
        self.voltage != LimitSide::Free
    }

    /// Whether the limiter holds the current at a bound.
    pub fn current_is_limited(self) -> bool {
        self.current != LimitSide::Free
    }
}

/// The part of the state and of the inputs that determines the active limits.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub gap: f64,
    pub gap_rate: f64,
    /// Lateral offset (m) and its rate (m/s); 0 without lift loss.
    pub aside: [f64; 2],
    /// Total current, in A.
    pub current: f64,
    /// Total voltage that the controller asks for, in V.
    pub command: f64,
}

impl Range {
    pub(crate) fn side(self, value: f64) -> LimitSide {
        if value > self.max {
            LimitSide::Upper
        } else if value < self.min {
            LimitSide::Lower
        } else {
            LimitSide::Free
        }
    }

    /// Tolerance for a current at a bound: it is computed from the flux with a few roundings.
    pub(crate) fn slack(self) -> f64 {
        16.0 * f64::EPSILON * self.max.abs().max(self.min.abs())
    }

    pub(crate) fn clamp(self, value: f64) -> f64 {
        value.clamp(self.min, self.max)
    }
}

impl PowerLimits {
    pub(crate) fn clamp_voltage(&self, voltage: f64) -> f64 {
        self.voltage.map_or(voltage, |range| range.clamp(voltage))
    }

    pub(crate) fn clamp_current(&self, current: f64) -> f64 {
        self.current.map_or(current, |range| range.clamp(current))
    }

    /// The current without supply, in A: the limiter does not act, but a current that cannot become
    /// negative does not do so by rounding either.
    pub(crate) fn freewheeling(&self, current: f64) -> f64 {
        let positive = self.current.is_some_and(|range| range.min >= 0.0);
        if positive { current.max(0.0) } else { current }
    }

    pub(crate) fn none(&self) -> bool {
        self.voltage.is_none() && self.current.is_none()
    }
}
