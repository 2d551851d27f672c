//! Curves within the limits of their axes.

use std::ops::Range;

/// The parts of a line of points that lie within a rectangle, cut at its border.
pub(crate) fn clip(
    points: &[(f64, f64)],
    across: &Range<f64>,
    up: &Range<f64>,
) -> Vec<Vec<(f64, f64)>> {
    let mut parts: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in points.windows(2) {
        let Some([a, b]) = segment(pair[0], pair[1], across, up) else { continue };
        match parts.last_mut() {
            Some(part) if part.last() == Some(&a) => part.push(b),
            _ => parts.push(vec![a, b]),
        }
    }
    if let [one] = points
        && (across.start..=across.end).contains(&one.0)
        && (up.start..=up.end).contains(&one.1)
    {
        parts.push(vec![*one]);
    }
    parts
}

/// The part of a segment within the rectangle (Liang and Barsky 1984).
fn segment(
    a: (f64, f64),
    b: (f64, f64),
    across: &Range<f64>,
    up: &Range<f64>,
) -> Option<[(f64, f64); 2]> {
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    if !(dx.is_finite() && dy.is_finite()) {
        return None;
    }
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (way, room) in [
        (-dx, a.0 - across.start),
        (dx, across.end - a.0),
        (-dy, a.1 - up.start),
        (dy, up.end - a.1),
    ] {
        if way == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if way < 0.0 {
            enter = enter.max(room / way);
        } else {
            leave = leave.min(room / way);
        }
    }
    // ends that are inside keep their digits, so that parts join
    let at = |part: f64| match part {
        0.0 => a,
        1.0 => b,
        _ => (a.0 + part * dx, a.1 + part * dy),
    };
    (enter <= leave).then(|| [at(enter), at(leave)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_lines_end_at_the_border() {
        let zigzag = [(0.0, 0.0), (1.0, 2.0), (2.0, 0.0), (3.0, 0.5), (9.0, 0.5)];
        let parts = clip(&zigzag, &(0.0..4.0), &(0.0..1.0));
        assert_eq!(parts.len(), 2);
        assert_eq!(parts[0], [(0.0, 0.0), (0.5, 1.0)]);
        assert_eq!(parts[1], [(1.5, 1.0), (2.0, 0.0), (3.0, 0.5), (4.0, 0.5)]);
        assert_eq!(clip(&zigzag, &(0.0..9.0), &(0.0..2.0)), [zigzag.to_vec()]);
        assert!(clip(&zigzag, &(10.0..11.0), &(0.0..1.0)).is_empty());
        assert!(clip(&[(0.0, f64::NAN), (1.0, 0.5)], &(0.0..1.0), &(0.0..1.0)).is_empty());
        assert_eq!(clip(&[(0.5, 0.5)], &(0.0..1.0), &(0.0..1.0)), [vec![(0.5, 0.5)]]);
    }
}
