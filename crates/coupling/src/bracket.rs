//! The place within a step at which a condition becomes true, by steps of other sizes from its beginning.
//!
//! The method is ITP (Oliveira & Takahashi 2020, "An Enhancement of the Bisection Method Average Performance Preserving
//! Minmax Optimality", ACM TOMS 47): it proposes a point near that of the secant, and needs at most one evaluation more
//! than bisection. Without useful values it bisects, so that conditions on integers, and several at once, are located
//! too.

/// Sizes between which a condition becomes true: not yet after the smaller one, already after the larger one.
#[derive(Debug, Clone, Copy)]
pub struct Bracket {
    lower: f64,
    upper: f64,
    /// what the signal exceeds its limit by, NaN if not known
    excess: [f64; 2],
    whole: f64,
    width: f64,
    /// evaluations that are left
    left: i32,
}

impl Bracket {
    /// A condition that is true after a step of the size and not at its beginning, with what the signal exceeds its
    /// limit by at both ends, NaN if not known. The bracket is closed as soon as it is not wider than `width`.
    #[must_use]
    pub fn new(size: f64, width: f64, excess: [f64; 2]) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "at most 2100")]
        let left = (size / width).log2().ceil().max(0.0) as i32 + 1;
        Self { lower: 0.0, upper: size, excess, whole: size, width, left }
    }

    /// The smallest known size after which the condition is true.
    #[must_use]
    pub fn upper(&self) -> f64 {
        self.upper
    }

    /// The size to try next; `None` if the bracket is closed.
    #[must_use]
    pub fn next(&self) -> Option<f64> {
        let (a, b) = (self.lower, self.upper);
        let middle = f64::midpoint(a, b);
        if b - a <= self.width || middle <= a || middle >= b {
            return None;
        }
        let [ya, yb] = self.excess;
        let is_bracket = ya * yb < 0.0; // also false for NaN
        if !is_bracket {
            return Some(middle);
        }
        let secant = (yb * a - ya * b) / (yb - ya);
        let way = (middle - secant).signum();
        let truncation = 0.2 / self.whole * (b - a) * (b - a);
        let truncated =
            if truncation <= (middle - secant).abs() { secant + way * truncation } else { middle };
        let radius = 0.5 * (self.width * f64::from(self.left).exp2() - (b - a)).max(0.0);
        let near = (truncated - middle).abs() <= radius;
        let size = if near { truncated } else { middle - way * radius };
        Some(if size > a && size < b { size } else { middle })
    }

    /// Takes the outcome of a step of that size: whether the condition is true, and what the signal exceeds its limit
    /// by. `same`: whether it is the signal of the evaluations before.
    pub fn take(&mut self, size: f64, met: bool, excess: f64, same: bool) {
        let (end, other) = if met { (1, 0) } else { (0, 1) };
        *(if met { &mut self.upper } else { &mut self.lower }) = size;
        self.excess[end] = excess;
        if !same {
            self.excess[other] = f64::NAN;
        }
        self.left -= 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn located(root: f64, value: impl Fn(f64) -> f64, known: bool) -> (f64, u32) {
        let excess = |x: f64| if known { value(x) } else { f64::NAN };
        let mut bracket = Bracket::new(0.01, 1e-8, [excess(0.0), excess(0.01)]);
        let mut count = 0;
        while let Some(size) = bracket.next() {
            count += 1;
            bracket.take(size, value(size) > 0.0, excess(size), true);
            assert!(count < 100);
        }
        assert!(bracket.upper() >= root && bracket.upper() - root <= 1e-8, "{root}: {bracket:?}");
        (bracket.upper(), count)
    }

    /// At most one evaluation more than bisection, which needs 20; fewer for smooth signals.
    #[test]
    fn analytic_roots_are_within_the_width() {
        for root in [1e-9, 3e-7, 0.0021, 0.00501, 0.009_999] {
            let (_, count) = located(root, |x| x - root, false);
            assert!(count <= 20, "bisection: {count}");
            let (_, count) = located(root, |x| x - root, true);
            assert!(count <= 9, "line: {count}");
            let (_, count) =
                located(root, |x| (40.0 * (x - root)).tanh() + (x - root).powi(2), true);
            assert!(count <= 12, "curve: {count}");
            // as flat as a root can be: no worse than promised
            let (_, count) = located(root, |x| (x - root).powi(9), true);
            assert!(count <= 21, "flat: {count}");
        }
    }
}
