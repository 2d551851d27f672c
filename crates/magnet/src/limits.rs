//! Which limits of the power electronics are at work.

use crate::parameters::{PowerLimits, Range};

/// Where a limited quantity stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LimitSide {
    Free,
    Lower,
    Upper,
}

/// Which limits are at work: a pure function of state, inputs and parameters, so nothing of it
/// needs to be remembered.
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

    /// Whether the controller asks for more voltage than there is.
    pub fn voltage_is_limited(self) -> bool {
        self.voltage != LimitSide::Free
    }

    /// Whether the limiter holds the current at a bound.
    pub fn current_is_limited(self) -> bool {
        self.current != LimitSide::Free
    }
}

/// The part of the state and of the inputs that decides on the mode.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point {
    pub gap: f64,
    pub gap_rate: f64,
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

    /// What a current at a bound may be off by: it comes back from the flux with a few roundings.
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

    pub(crate) fn none(&self) -> bool {
        self.voltage.is_none() && self.current.is_none()
    }
}
