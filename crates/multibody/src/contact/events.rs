//! When a magnet touches or leaves the rail within an internal step.

use super::law::{Clearance, Contact, Touch};

/// Depth within which a magnet counts as at the rail, m: ten thousand times the rounding of a gap, and
/// too little for a force to matter (1e8 N/m: 1 mN).
const AT_THE_RAIL: f64 = 1e-11;
/// Bisections of a cubic in the unit interval, to rounding.
const HALVINGS: usize = 60;

/// Whether a contact counts as closed from this instant on.
fn closes(touch: &Touch) -> bool {
    touch.depth > AT_THE_RAIL || (touch.depth > -AT_THE_RAIL && touch.rate > 0.0)
}

/// Whether a contact that was closed or open at first is beyond doubt on the other side now.
fn has_changed(closed: bool, now: &Touch) -> bool {
    if closed { now.depth < -AT_THE_RAIL } else { now.depth > AT_THE_RAIL }
}

impl Contact {
    /// Contacts of a magnet that count as closed from this instant on.
    pub(crate) fn closed(&self, clearance: Clearance) -> impl Iterator<Item = Touch> + use<> {
        self.at(clearance).filter(closes)
    }

    /// Fraction of an internal step of the size `h` at which a contact of the magnet first closes or
    /// opens, by the cubic through depths and rates at both ends.
    pub(crate) fn change(&self, before: Clearance, after: Clearance, h: f64) -> Option<f64> {
        self.at(before)
            .zip(self.at(after))
            .filter(|(first, last)| has_changed(closes(first), last))
            .map(|(first, last)| crossing(&first, &last, h))
            .min_by(f64::total_cmp)
    }
}

/// Where the cubic Hermite interpolant of the depth passes zero.
fn crossing(first: &Touch, last: &Touch, h: f64) -> f64 {
    let (slope_0, slope_1) = (first.rate * h, last.rate * h);
    let at = |x: f64| {
        let y = 1.0 - x;
        y * y * ((1.0 + 2.0 * x) * first.depth + x * slope_0)
            + x * x * ((1.0 + 2.0 * y) * last.depth - y * slope_1)
    };
    let beyond = last.depth > 0.0;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if (at(middle) > 0.0) == beyond { high = middle } else { low = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::ContactLaw;

    const LAW: ContactLaw = ContactLaw { gap: 0.016, stiffness: 1e7, damping: 0.0, friction: 0.0 };
    const SKID: Contact = Contact { stop: None, skid: Some(LAW), slip_speed: 0.01 };

    fn at(depth: f64, rate: f64) -> Clearance {
        Clearance { gap: LAW.gap + depth, rate }
    }

    /// A free fall is a parabola, which the cubic meets exactly: ½ g t² = d.
    #[test]
    fn analytic_time_of_touch_of_a_falling_mass() {
        let (h, d) = (0.01, 2e-4);
        let found = SKID.change(at(-d, 0.0), at(0.5 * 9.81 * h * h - d, 9.81 * h), h).unwrap();
        assert!((found * h - (2.0 * d / 9.81).sqrt()).abs() < 1e-14, "{found}");
    }

    /// A magnet at the rail is on the side to which it moves: it neither touches nor leaves again.
    #[test]
    fn invariant_a_magnet_at_the_rail_changes_once() {
        let touching = at(2e-12, 0.1);
        assert_eq!(SKID.closed(touching).count(), 1);
        assert_eq!(SKID.change(touching, at(1e-4, 0.1), 1e-3), None);
        let leaving = at(-2e-12, -0.1);
        assert_eq!(SKID.closed(leaving).count(), 0);
        assert_eq!(SKID.change(leaving, at(-1e-4, -0.1), 1e-3), None);
        assert!(SKID.change(at(1e-4, -0.2), at(-1e-4, -0.2), 1e-3).is_some());
    }
}
