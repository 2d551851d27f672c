//! Inputs that follow given functions of time instead of outputs, and the new start after a jump.

use super::Exchange;
use crate::index::{InputIndex, UnitIndex};
use crate::taylor::Taylor;

/// Polynomial of an input over a step, from the step's begin and size (s). The size is 0 before the first step.
pub type Course = Box<dyn Fn(f64, f64) -> Taylor + Send + Sync>;

/// An input and its function of time.
pub(super) struct Given {
    unit: UnitIndex,
    input: InputIndex,
    /// highest derivative that the unit takes
    limit: usize,
    course: Course,
}

impl Exchange {
    /// Lets a Real input that [`Links::given`](crate::Links::given) lists follow a function of time.
    pub fn give(&mut self, unit: UnitIndex, input: InputIndex, limit: usize, course: Course) {
        self.given.push(Given { unit, input, limit, course });
    }

    /// Computes the given inputs over a step.
    #[inline]
    pub fn fill_given(&mut self, time: f64, size: f64) {
        for Given { unit, input, limit, course } in &self.given {
            let p = course(time, size);
            let reduced = if size > 0.0 { p.reduced(*limit, size) } else { p };
            self.inputs[*unit].reals[*input] = reduced;
        }
    }

    /// Sends values only to a unit.
    pub(super) fn hold_given(&mut self, k: UnitIndex) {
        self.given.iter_mut().filter(|it| it.unit == k).for_each(|it| it.limit = 0);
    }

    /// Discards the history of all signals but their latest points: something has jumped there, and no polynomial may
    /// combine data from both sides.
    pub fn begin_anew(&mut self) {
        for signal in self.now.signals.iter_mut().filter(|signal| !signal.is_held()) {
            let now = *signal.now();
            signal.restart(now);
        }
    }
}
