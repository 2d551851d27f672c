//! Which limits of the power electronics are at work.

use crate::{
    parameters::{Limits, Range},
    system::Magnet,
};

/// Where a limited quantity stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Free,
    Lower,
    Upper,
}

/// Which limits are at work: a pure function of state, inputs and parameters, so nothing of it
/// needs to be remembered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mode {
    pub(crate) voltage: Side,
    pub(crate) current: Side,
}

impl Side {
    /// The bound at which the quantity is held, if it is.
    pub(crate) fn bound(self) -> Option<fn(Range) -> f64> {
        match self {
            Self::Free => None,
            Self::Lower => Some(|range| range.min),
            Self::Upper => Some(|range| range.max),
        }
    }
}

impl Mode {
    pub(crate) const FREE: Self = Self { voltage: Side::Free, current: Side::Free };

    /// Whether the controller asks for more voltage than there is.
    pub fn voltage_is_limited(self) -> bool {
        self.voltage != Side::Free
    }

    /// Whether the limiter holds the current at a bound.
    pub fn current_is_limited(self) -> bool {
        self.current != Side::Free
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
    pub(crate) fn side(self, value: f64) -> Side {
        if value > self.max {
            Side::Upper
        } else if value < self.min {
            Side::Lower
        } else {
            Side::Free
        }
    }

    /// What a current at a bound may be off by: it comes back from the flux with a few roundings.
    fn slack(self) -> f64 {
        16.0 * f64::EPSILON * self.max.abs().max(self.min.abs())
    }

    pub(crate) fn clamp(self, value: f64) -> f64 {
        value.clamp(self.min, self.max)
    }
}

impl Limits {
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

impl Magnet {
    /// The mode at a point. A current at its bound is held if the voltage would drive it outwards.
    pub(crate) fn mode(&self, point: &Point) -> Mode {
        let limits = &self.parameters().limits;
        let voltage = limits.voltage.map_or(Side::Free, |range| range.side(point.command));
        let current = limits.current.map_or(Side::Free, |range| {
            let rate = self.free_rate(point);
            let slack = range.slack();
            if point.current >= range.max - slack && rate > 0.0 {
                Side::Upper
            } else if point.current <= range.min + slack && rate < 0.0 {
                Side::Lower
            } else {
                Side::Free
            }
        });
        Mode { voltage, current }
    }

    /// Whether a mode entered earlier still holds at a point.
    pub(crate) fn holds(&self, mode: Mode, point: &Point) -> bool {
        let limits = &self.parameters().limits;
        let voltage = limits.voltage.is_none_or(|range| match mode.voltage {
            Side::Free => range.side(point.command) == Side::Free,
            Side::Upper => point.command >= range.max,
            Side::Lower => point.command <= range.min,
        });
        let current = limits.current.is_none_or(|range| match mode.current {
            Side::Free => range.side(point.current) == Side::Free,
            Side::Upper => self.free_rate(point) >= 0.0,
            Side::Lower => self.free_rate(point) <= 0.0,
        });
        voltage && current
    }

    /// di/dt without the current limiter.
    fn free_rate(&self, point: &Point) -> f64 {
        let voltage = self.parameters().limits.clamp_voltage(point.command);
        self.electromagnet().current_rate(point.gap, point.gap_rate, point.current, voltage)
    }
}
