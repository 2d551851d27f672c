//! Units whose communication step may not vary (`canHandleVariableCommunicationStepSize` is false).
//!
//! Sizes that are differences of communication points vary in their last bits. A unit that cannot
//! vary its step may compare sizes bit by bit, so it gets the scenario's step itself, unless the end
//! of that step, as the unit computes it, would be after the stop time.

use super::Participant;
use fmi2_import::span::between;

/// The size of equal steps, and where they end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Equal {
    size: f64,
    stop: f64,
}

impl Equal {
    /// The size to use for a step of about that size.
    #[inline]
    pub(super) fn size(self, time: f64, size: f64) -> f64 {
        if (size - self.size).abs() > 1e-9 * size {
            size
        } else if time + self.size <= self.stop {
            self.size
        } else {
            between(time, self.stop)
        }
    }
}

impl Participant {
    /// Makes the unit's own steps equal, if it cannot vary them: all have this size (s), except for one
    /// that would end after the stop time (s).
    pub fn keep_steps_equal(&mut self, size: f64, stop: f64) {
        self.equal = (!self.capabilities.variable_step).then_some(Equal { size, stop });
    }

    /// The size of the unit's step from `time` where the coupling's is `size`.
    #[inline]
    pub(super) fn own_size(&self, time: f64, size: f64) -> f64 {
        match self.equal {
            Some(equal) => equal.size(time, size),
            None => size,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten steps of 0.1 from 0 to 1 and three to 0.3: the last of the three would end at
    /// 0.30000000000000004.
    #[test]
    fn analytic_steps_are_equal_until_the_stop_time() {
        let last = |stop: f64, steps: u32| {
            let equal = Equal { size: 0.1, stop };
            let point = |k: u32| f64::from(k) * 0.1;
            for k in 0..steps - 1 {
                assert_eq!(equal.size(point(k), between(point(k), point(k + 1))), 0.1);
            }
            let time = point(steps - 1);
            (time, equal.size(time, between(time, stop)))
        };
        assert_eq!(last(1.0, 10).1, 0.1);
        let (time, size) = last(0.3, 3);
        assert!(size < 0.1 && time + size == 0.3, "{size}");
        // steps of another size are not changed
        assert_eq!(Equal { size: 0.1, stop: 1.0 }.size(0.0, 0.05), 0.05);
    }
}
