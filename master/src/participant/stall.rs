//! Units that go on in name only.
//!
//! A unit that has broken inside may answer every further step with `fmi2Warning` and leave its outputs
//! as they are. By the standard `fmi2Warning` means that all is well enough to go on, and
//! `fmi2GetRealStatus` and `fmi2GetBooleanStatus` may be asked only after `fmi2Discard`, so what can be
//! seen is this: each of [`STALLED`] steps in a row returned `fmi2Warning`, and not one bit of any Real
//! output or local that is exchanged or recorded changed. That is told as a warning. A unit at rest that complains
//! of something else looks the same, so the run fails only if the unit has also said in a message that it
//! has terminated.

use super::Participant;
use fmi2_import::logger;

/// Steps in a row after which a unit that warns and does not move counts as stalled.
pub const STALLED: u64 = 5;

/// A unit whose steps return `fmi2Warning` and change nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stall {
    /// Time since which nothing has changed (s).
    pub since: f64,
    /// Time at which that was noticed (s).
    pub noticed: f64,
}

impl std::fmt::Display for Stall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "each of the last {STALLED} steps returned fmi2Warning, and no Real output has changed \
             since {} s: it may have stopped computing, do not trust its results",
            self.since
        )
    }
}

/// Compares the outputs after steps that returned `fmi2Warning`.
#[derive(Debug, Default)]
pub(super) struct Watch {
    /// steps that returned a warning, of those looked at
    warned: u64,
    /// all steps until then
    steps: u64,
    /// steps in a row without a change
    idle: u64,
    time: f64,
    since: f64,
    /// what is computed by the unit, among the Reals that are read
    places: Vec<usize>,
    last: Vec<u64>,
    stall: Option<Stall>,
    told: bool,
}

impl Watch {
    /// Watches these places among the Reals that are read.
    pub(super) fn new(places: Vec<usize>) -> Self {
        Self { places, ..Self::default() }
    }

    /// Steps that returned a warning until the last look.
    #[inline]
    pub(super) fn seen(&self) -> u64 {
        self.warned
    }

    fn look(&mut self, time: f64, steps: u64, warned: u64, reals: &[f64]) {
        let all_warned = steps - self.steps == warned - self.warned;
        let bits = || self.places.iter().map(|&place| reals[place].to_bits());
        let same = all_warned && bits().eq(self.last.iter().copied());
        (self.steps, self.warned) = (steps, warned);
        if !same {
            self.last = bits().collect();
            (self.idle, self.since) = (0, time);
        } else if time > self.time {
            // iterations make the same step again: time has to pass
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
    /// Looks at the outputs after a step that returned `fmi2Warning`.
    #[cold]
    pub(super) fn watch_out(&mut self, time: f64) {
        let (steps, warned) = (self.instance.steps(), self.instance.warnings().steps());
        self.watch.look(time, steps, warned, &self.received.reals);
    }

    /// Whether the unit has stalled.
    #[must_use]
    pub fn stall(&self) -> Option<Stall> {
        self.watch.stall
    }

    /// The same, once.
    pub fn take_stall(&mut self) -> Option<Stall> {
        if std::mem::replace(&mut self.watch.told, self.watch.stall.is_some()) {
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
                watch.look(n as f64, n, warned, &[y]);
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
            watch.look(1.0, n, n, &[1.0]);
        }
        assert!(watch.stall.is_none());
    }
}
