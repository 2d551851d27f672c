//! Units that have stopped computing but still accept steps.
//!
//! A unit that has failed inside may answer every further step with `fmi2Warning` and not change its
//! outputs. By the standard `fmi2Warning` means that the run can continue, and `fmi2GetRealStatus` and
//! `fmi2GetBooleanStatus` may be called only after `fmi2Discard`. So a stall is recognised by this: each
//! of [`STALLED`] steps in a row returned `fmi2Warning`, and no bit of any Real output or local variable
//! that is exchanged or recorded changed. That gives a warning. A unit at rest that warns about something
//! else looks the same, so the run fails only if the unit has also reported that it has terminated.

use super::Participant;
use fmi2_import::logger;

/// Number of steps in a row with warnings and without a change after which a unit counts as stalled.
pub const STALLED: u64 = 5;

/// A unit whose steps return `fmi2Warning` and change nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stall {
    /// Time since which nothing has changed (s).
    pub since: f64,
    /// Time at which the stall was noticed (s).
    pub noticed: f64,
}

impl std::fmt::Display for Stall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "each of the last {STALLED} steps returned fmi2Warning, and no Real output has changed \
             since {} s: it may have stopped computing; do not trust its results",
            self.since
        )
    }
}

/// Compares the outputs after steps that returned `fmi2Warning`.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// steps with a warning until the last check
    warned: u64,
    /// all steps until the last check
    steps: u64,
    /// steps in a row without a change
    idle: u64,
    time: f64,
    since: f64,
    /// places of outputs and local variables among the Reals that are read
    places: Vec<usize>,
    last: Vec<u64>,
    stall: Option<Stall>,
    reported: bool,
}

impl Watch {
    /// Watches the Reals at these places.
    pub(super) fn new(places: Vec<usize>) -> Self {
        Self { places, ..Self::default() }
    }

    /// Number of steps with a warning until the last check.
    #[inline]
    pub(super) fn seen(&self) -> u64 {
        self.warned
    }

    fn check(&mut self, time: f64, steps: u64, warned: u64, reals: &[f64]) {
        let all_warned = steps - self.steps == warned - self.warned;
        let bits = || self.places.iter().map(|&place| reals[place].to_bits());
        let same = all_warned && bits().eq(self.last.iter().copied());
        (self.steps, self.warned) = (steps, warned);
        if !same {
            self.last = bits().collect();
            (self.idle, self.since) = (0, time);
        } else if time > self.time {
            // iterations repeat a step: only later times count
            self.idle += 1;
        }
        self.time = time;
        if self.idle == STALLED && self.stall.is_none() && !self.places.is_empty() {
            self.stall = Some(Stall { since: self.since, noticed: time });
            logger::note_arrival();
        }
    }
}

impl Participant {
    /// Checks the outputs after a step that returned `fmi2Warning`.
    #[cold]
    pub(super) fn look_for_stall(&mut self, time: f64) {
        let (steps, warned) = (self.instance.steps(), self.instance.warnings().steps());
        self.watch.check(time, steps, warned, &self.received.values.reals);
    }

    /// Whether the unit has stalled.
    #[must_use]
    pub fn stall(&self) -> Option<Stall> {
        self.watch.stall
    }

    /// The stall, when first called after it.
    pub fn take_stall(&mut self) -> Option<Stall> {
        if std::mem::replace(&mut self.watch.reported, self.watch.stall.is_some()) {
            return None;
        }
        self.watch.stall
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks after steps of 1 s: warned or not, with an output.
    fn watched(steps: &[(bool, f64)]) -> Watch {
        let mut watch = Watch::new(vec![0]);
        let mut warned = 0;
        for (n, &(warns, y)) in (1..).zip(steps) {
            warned += u64::from(warns);
            if warned != watch.seen() {
                #[expect(clippy::cast_precision_loss, reason = "small")]
                watch.check(n as f64, n, warned, &[y]);
            }
        }
        watch
    }

    /// The first warned step is what the others are compared with.
    #[test]
    fn analytic_a_stall_is_five_warned_steps_without_a_change() {
        let frozen = [(true, 1.0); 6];
        let stall = watched(&frozen).stall.unwrap();
        assert_eq!((stall.since, stall.noticed), (1.0, 6.0));
        assert!(watched(&frozen[..5]).stall.is_none());
        let mut moving = frozen;
        moving[3].1 = 1.0 + f64::EPSILON;
        assert!(watched(&moving).stall.is_none());
        let mut once_well = frozen;
        once_well[3].0 = false;
        assert!(watched(&once_well).stall.is_none());
        assert!(watched(&[(false, 1.0); 9]).stall.is_none());
        // it began to move and froze: steps 4 to 9
        let mut later = vec![(true, 1.0), (true, 2.0), (true, 3.0)];
        later.extend([(true, 4.0); 6]);
        assert_eq!(watched(&later).stall.unwrap().since, 4.0);
    }

    /// Iterations repeat a step: the same time counts once.
    #[test]
    fn invariant_the_same_step_made_again_does_not_count() {
        let mut watch = Watch::new(vec![0]);
        for n in 1..20 {
            watch.check(1.0, n, n, &[1.0]);
        }
        assert!(watch.stall.is_none());
    }
}
