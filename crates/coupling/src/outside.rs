//! Inputs that the program around a simulation sets.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use crate::Taylor;
use crate::taylor::COEFFICIENTS;

/// Inputs that a program sets while a simulation runs, each as a polynomial about a time.
#[derive(Debug, Default)]
pub struct Outside(Vec<Polynomial>);

/// The bits of a time (s), and of value and derivatives at it.
#[derive(Debug, Default)]
struct Polynomial([AtomicU64; 1 + COEFFICIENTS]);

impl Outside {
    /// So many inputs, all zero.
    #[must_use]
    pub fn new(inputs: usize) -> Self {
        Self((0..inputs).map(|_| Polynomial::default()).collect())
    }

    /// Sets an input from a time (s) on.
    pub fn set(&self, input: usize, time: f64, course: &Taylor) {
        let bits = self.0[input].0.iter();
        for (bits, number) in bits.zip(std::iter::once(&time).chain(&course.0)) {
            bits.store(number.to_bits(), Relaxed);
        }
    }

    /// An input from a time (s) on. Times closer than `slack` (s) are equal.
    #[must_use]
    pub fn course(&self, input: usize, time: f64, slack: f64) -> Taylor {
        let bits = self.0[input].0.each_ref();
        let [origin, p @ ..] = bits.map(|it| f64::from_bits(it.load(Relaxed)));
        let p = Taylor(p);
        if (time - origin).abs() <= slack { p } else { p.shifted(time - origin) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 1 + 2 τ + 3 τ²/2 about 5 s, half a second later; a rounded time changes no bit.
    #[test]
    fn analytic_an_input_follows_its_polynomial() {
        let outside = Outside::new(2);
        outside.set(1, 5.0, &Taylor::cubic([1.0, 2.0, 3.0, 0.0]));
        assert_eq!(outside.course(1, 5.5, 1e-9), Taylor::cubic([2.375, 3.5, 3.0, 0.0]));
        assert_eq!(outside.course(1, 5.0 + 1e-12, 1e-9), Taylor::cubic([1.0, 2.0, 3.0, 0.0]));
        assert_eq!(outside.course(0, 7.0, 1e-9), Taylor::ZERO);
    }

    /// τ⁵ about 5 s, two seconds later: (τ + 2)⁵.
    #[test]
    fn analytic_an_input_is_of_degree_five() {
        let outside = Outside::new(1);
        outside.set(0, 5.0, &Taylor([0.0, 0.0, 0.0, 0.0, 0.0, 120.0]));
        let expected = Taylor([32.0, 80.0, 160.0, 240.0, 240.0, 120.0]);
        assert_eq!(outside.course(0, 7.0, 1e-9), expected);
    }
}
