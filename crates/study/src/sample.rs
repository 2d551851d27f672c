//! Samples of the unit cube.

use crate::content;

/// Most points of a Sobol sample: the library's sequence has so many.
pub(crate) const MOST_SOBOL: u64 = 1 << 16;
/// Most factors of a Sobol sample.
pub(crate) const MOST_DIMENSIONS: usize = 256;

/// Coordinate `dimension` of row `k` of a scrambled Sobol sequence, 0 < u < 1.
pub(crate) fn sobol(seed: u64, k: u64, dimension: usize) -> f64 {
    let scramble = (content::hash(seed, "scrambling") >> 96) as u32;
    let (k, dimension) = (k as u32, dimension as u32);
    // 24 bits, and half a step so that 0 does not occur
    f64::from(sobol_burley::sample(k, dimension, scramble)) + 0.5_f64.powi(25)
}

/// Coordinates of a Latin hypercube: of each factor, the part of each row.
#[derive(Debug, Clone)]
pub(crate) struct LatinHypercube {
    /// by factor and row
    parts: Vec<Vec<u32>>,
}

impl LatinHypercube {
    /// `factors` are names, which the draws depend on.
    pub(crate) fn new(seed: u64, rows: u32, factors: &[&str]) -> Self {
        let order = |name: &&str| {
            let mut keys: Vec<(u128, u32)> = (0..rows)
                .map(|k| (content::hash(seed, &format!("part {k} of {name} among {rows}")), k))
                .collect();
            keys.sort_unstable();
            keys.into_iter().map(|(_, k)| k).collect()
        };
        Self { parts: factors.iter().map(order).collect() }
    }

    pub(crate) fn at(&self, seed: u64, row: u64, factor: usize, name: &str) -> f64 {
        let parts = &self.parts[factor];
        let place = content::uniform(seed, &format!("place in part of {name} in row {row}"));
        (f64::from(parts[row as usize]) + place) / parts.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_a_latin_hypercube_has_one_value_in_each_part() {
        let names = ["a", "b", "c"];
        let sample = LatinHypercube::new(5, 40, &names);
        for (k, name) in names.iter().enumerate() {
            let mut found: Vec<usize> =
                (0..40).map(|row| (40.0 * sample.at(5, row, k, name)) as usize).collect();
            assert_ne!(found, (0..40).collect::<Vec<_>>());
            found.sort_unstable();
            assert_eq!(found, (0..40).collect::<Vec<_>>());
        }
    }

    /// A (0, m, s)-net in base 2 has one of 2^m points in each interval of length 2^-m, in each dimension.
    #[test]
    fn analytic_sobol_points_are_a_net() {
        for dimension in [0, 1, 7, 63] {
            let mut found: Vec<usize> =
                (0..64).map(|k| (64.0 * sobol(1, k, dimension)) as usize).collect();
            found.sort_unstable();
            assert_eq!(found, (0..64).collect::<Vec<_>>(), "dimension {dimension}");
        }
        // the mean of a product is that of independent factors much closer than that of a random sample
        let product: f64 = (0..1024).map(|k| sobol(1, k, 0) * sobol(1, k, 1)).sum::<f64>() / 1024.0;
        assert!((product - 0.25).abs() < 1e-3, "{product}");
        assert_ne!(sobol(1, 5, 0), sobol(2, 5, 0));
    }
}
