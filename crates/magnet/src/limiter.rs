//! Determines which limits of a magnet are active.

use crate::{
    limits::{LimitSide, LimitsAtWork, Point},
    system::Magnet,
};

impl Magnet {
    /// The active limits at a point. A current at its bound is held if the voltage would drive it
    /// outwards.
    pub(crate) fn mode(&self, point: &Point) -> LimitsAtWork {
        let limits = &self.parameters().limits;
        let voltage = limits.voltage.map_or(LimitSide::Free, |range| range.side(point.command));
        let current = limits.current.map_or(LimitSide::Free, |range| {
            let rate = self.free_rate(point);
            let slack = range.slack();
            if point.current >= range.max - slack && rate > 0.0 {
                LimitSide::Upper
            } else if point.current <= range.min + slack && rate < 0.0 {
                LimitSide::Lower
            } else {
                LimitSide::Free
            }
        });
        LimitsAtWork { voltage, current }
    }

    /// Whether the limits that were active earlier are still active at a point.
    pub(crate) fn holds(&self, mode: LimitsAtWork, point: &Point) -> bool {
        let limits = &self.parameters().limits;
        let voltage = limits.voltage.is_none_or(|range| match mode.voltage {
            LimitSide::Free => range.side(point.command) == LimitSide::Free,
            LimitSide::Upper => point.command >= range.max,
            LimitSide::Lower => point.command <= range.min,
        });
        let current = limits.current.is_none_or(|range| match mode.current {
            LimitSide::Free => range.side(point.current) == LimitSide::Free,
            LimitSide::Upper => self.free_rate(point) >= 0.0,
            LimitSide::Lower => self.free_rate(point) <= 0.0,
        });
        voltage && current
    }

    /// di/dt without the current limiter.
    fn free_rate(&self, point: &Point) -> f64 {
        let voltage = self.parameters().limits.clamp_voltage(point.command);
        self.current_rate([point.gap, point.gap_rate], point.aside, point.current, voltage)
    }
}
