//! Steps between communication points, in floating point.
//!
//! An FMU computes the end of a step as `t + h` in doubles. With a constant h this sum differs from the
//! next communication point by rounding, and the last one may lie beyond the stop time: 3 · 0.1 > 0.3. A
//! step past the stop time is an error (FMI 2.0.5, 2.1.6). So the size is the difference of the points. By
//! Sterbenz's lemma it is exact if the end is at most twice the begin; then t + h is the next point to the
//! last bit.

/// The largest step size for which `begin + size`, as an FMU computes it, is not beyond `end`.
#[inline]
#[must_use]
pub fn between(begin: f64, end: f64) -> f64 {
    let mut size = end - begin;
    while begin + size > end {
        size = size.next_down();
    }
    size
}

/// A step size for messages, without rounding errors in its last digits.
#[must_use]
pub fn plain(size: f64) -> f64 {
    // a printed number can always be parsed
    format!("{size:.9e}").parse().unwrap_or(size)
}

/// Time and size of the steps that divide a step into equal parts. Each begins at the end of the previous
/// one, and the last ends at the end of the whole step.
pub fn parts(begin: f64, size: f64, count: u32) -> impl Iterator<Item = (f64, f64)> {
    let part = size / f64::from(count);
    let end = begin + size;
    let mut time = begin;
    (1..=count).map(move |k| {
        let next = if k == count { end } else { end.min(begin + f64::from(k) * part) };
        let step = (time, between(time, next));
        time += step.1;
        step
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The sum of begin and size is the end where that is exact, and else at most its rounding below.
    #[test]
    fn analytic_a_step_ends_at_its_end() {
        assert_eq!(0.2 + between(0.2, 0.3), 0.3);
        for (begin, end) in
            [(0.0, 1e-3), (-1.0, 1e-20), (-0.3, 0.1), (1e-20, 1.0), (1e6, 1e6 + 0.7e-3)]
        {
            let size = between(begin, end);
            assert!(size > 0.0 && begin + size <= end, "{begin} {end} {size}");
            // the difference is rounded once, lowered once at most, and so is the sum
            assert!(end - (begin + size) <= 2.0 * f64::EPSILON * size, "{begin} {end} {size}");
        }
    }

    #[test]
    fn analytic_plain_sizes_have_no_rounding() {
        assert_eq!(plain(0.4 - 0.3), 0.1);
        assert_eq!(plain(1.001 - 1.0), 0.001);
        assert_eq!(plain(1.0 / 3.0), 0.333_333_333_3);
    }

    #[test]
    fn analytic_parts_follow_each_other_up_to_the_end() {
        for count in [1, 2, 3, 7, 1024] {
            let (begin, size) = (0.3, 0.1);
            let mut time = begin;
            for (t, h) in parts(begin, size, count) {
                assert_eq!(t, time, "{count}");
                assert!((h - size / f64::from(count)).abs() < 1e-15);
                time = t + h;
            }
            assert_eq!(time, begin + size);
        }
    }

    proptest! {
        #[test]
        fn invariant_no_step_ends_beyond_its_end(begin in -1e3..1e3_f64, length in 1e-6..1e3_f64) {
            let end = begin + length;
            let size = between(begin, end);
            prop_assert!(size > 0.0 && begin + size <= end);
            prop_assert!(end - (begin + size) <= 2.0 * f64::EPSILON * (size + end.abs()));
            if begin > 0.0 && end <= 2.0 * begin {
                prop_assert_eq!(begin + size, end);
            }
        }
    }
}
