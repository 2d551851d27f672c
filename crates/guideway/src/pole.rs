//! How one magnet's force is spread over its pole: the inner sum of eq. 7.

use crate::Error;

/// Most discrete forces per magnet.
pub const MAX_FORCES: usize = 64;

/// Discrete forces of one magnet: offsets from its centre (m) and shares of its force (sum 1).
///
/// The points are those of Gauss-Legendre quadrature over the pole length. With n points a mode of
/// wavenumber k feels the evenly spread force with an error of order (kℓ/2)²ⁿ/(2n)!, so that a few
/// forces approximate it well. The same points and shares average the girder's displacement under
/// the magnet, so the work exchanged by the coupled units is consistent: force times the rate of
/// the mean displacement is the power of the discrete forces.
#[derive(Debug, Clone, PartialEq)]
pub struct Pole {
    length: f64,
    points: Vec<(f64, f64)>,
}

impl Pole {
    /// `forces` discrete forces over a pole of `length` (m).
    ///
    /// # Errors
    /// A negative or non-finite length, or a count outside 1 … [`MAX_FORCES`].
    pub fn new(length: f64, forces: usize) -> Result<Self, Error> {
        if !(length >= 0.0 && length.is_finite()) {
            return Err(Error::invalid(
                "pole.length",
                format!("{length} m"),
                "give a finite length of at least 0",
            ));
        }
        if !(1..=MAX_FORCES).contains(&forces) {
            return Err(Error::invalid(
                "pole.forces",
                format!("{forces} discrete forces per magnet"),
                format!("give a count from 1 to {MAX_FORCES}"),
            ));
        }
        let points =
            gauss_legendre(forces).into_iter().map(|(x, w)| (0.5 * length * x, 0.5 * w)).collect();
        Ok(Self { length, points })
    }

    /// (offset along the track in m, share of the force), front ones last.
    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// Pole length (m).
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Largest offset from the centre (m).
    pub fn reach(&self) -> f64 {
        self.points[self.points.len() - 1].0
    }

    /// Factor Σ wₗ cos(k sₗ) by which averaging over the pole scales a wave of wavenumber k (rad/m).
    pub fn filter(&self, wavenumber: f64) -> f64 {
        self.points.iter().map(|&(s, w)| w * libm::cos(wavenumber * s)).sum()
    }
}

/// Points and weights of Gauss-Legendre quadrature on [−1, 1], by Newton's method on the
/// three-term recurrence. Source: Davis & Rabinowitz, *Methods of Numerical Integration*, 2.7.
pub(crate) fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let mut points = vec![(0.0, 0.0); n];
    for i in 0..n.div_ceil(2) {
        let mut x = libm::cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5));
        let mut slope = 0.0;
        // Newton converges quadratically from this start; six rounds reach rounding for n ≤ 64.
        for _ in 0..6 {
            let (value, derivative) = legendre(n, x);
            slope = derivative;
            x -= value / derivative;
        }
        if 2 * i + 1 == n {
            x = 0.0;
            slope = legendre(n, 0.0).1;
        }
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        points[i] = (-x, weight);
        points[n - 1 - i] = (x, weight);
    }
    points
}

/// Legendre polynomial Pₙ(x) and its derivative, |x| < 1.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut p) = (0.0, 1.0);
    for k in 0..n {
        let k = k as f64;
        (before, p) = (p, ((2.0 * k + 1.0) * x * p - k * before) / (k + 1.0));
    }
    (p, n as f64 * (before - x * p) / (1.0 - x * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_shares_sum_to_one_and_points_are_symmetric() {
        for n in 1..=MAX_FORCES {
            let pole = Pole::new(0.65, n).unwrap();
            let sum: f64 = pole.points().iter().map(|p| p.1).sum();
            // n weights, each good to a few rounding errors amplified by the recurrence (≲ n).
            assert!((sum - 1.0).abs() < 1e-14 * n as f64, "{n}: {sum}");
            for (a, b) in pole.points().iter().zip(pole.points().iter().rev()) {
                assert_eq!((a.0, a.1), (-b.0, b.1));
            }
        }
    }

    #[test]
    fn order_discrete_forces_converge_to_the_evenly_spread_force() {
        // Evenly spread: sin(kℓ/2)/(kℓ/2). Shortest irregularity wave of 0.5 m under 0.65 m.
        let half = std::f64::consts::TAU / 0.5 * 0.325;
        let exact = half.sin() / half;
        let error = |n| (Pole::new(0.65, n).unwrap().filter(half / 0.325) - exact).abs();
        // Error bound of the rule on cos(half·s): half²ⁿ 2²ⁿ(n!)⁴/((2n+1)((2n)!)³).
        for n in [4usize, 6, 8, 10] {
            let f = |m: usize| (1..=m).map(|i| i as f64).product::<f64>();
            let bound = half.powi(2 * n as i32) * 2f64.powi(2 * n as i32) * f(n).powi(4)
                / ((2 * n + 1) as f64 * f(2 * n).powi(3));
            assert!(error(n) <= bound + 1e-14, "{n}: {} > {bound}", error(n));
        }
        assert!(error(8) < 1e-6 && error(1) > 0.1);
    }
}
