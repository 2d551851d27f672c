//! Sobol indices from the design of Saltelli.
//!
//! Row i of the design has the points A, B, and A with factor j of B for each j. With y centred about the mean of A
//! and B, and V the variance over A and B:
//!
//! Sⱼ = mean(y_B (y_ABj − y_A)) / V (Saltelli et al. 2010, Comput. Phys. Commun. 181, table 2 (b)),
//! Tⱼ = mean((y_A − y_ABj)²) / 2V (Jansen 1999; the same table (f)).

use super::Index;

/// Bootstrap samples of the intervals.
pub const SAMPLES: usize = 400;
/// Fewest complete rows.
const FEWEST: usize = 8;

/// Indices of a design.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// One for each factor.
    pub factors: Vec<Index>,
    /// Rows of the design.
    pub rows: usize,
    /// Rows of which all points have the figure. The others are left out.
    pub used: usize,
}

/// Estimates the indices of a figure that is given in the order of the design, NaN where it is not known.
///
/// # Errors
/// Too few rows are complete, or the figure does not vary.
pub fn estimate(figure: &[f64], factors: usize) -> Result<Estimate, String> {
    let rows: Vec<&[f64]> = figure.chunks_exact(factors + 2).collect();
    let complete: Vec<&[f64]> =
        rows.iter().copied().filter(|row| row.iter().all(|it| it.is_finite())).collect();
    if complete.len() < FEWEST {
        return Err(format!(
            "{} of {} rows of the design are complete; {FEWEST} are needed",
            complete.len(),
            rows.len()
        ));
    }
    let all = of_rows(&complete, factors).ok_or("this figure is the same at all settings")?;
    let mut state = 1_u64;
    let mut samples: Vec<Vec<[f64; 2]>> = vec![Vec::new(); factors];
    for _ in 0..SAMPLES {
        let pick = |_| complete[next(&mut state, complete.len())];
        let drawn: Vec<&[f64]> = (0..complete.len()).map(pick).collect();
        if let Some(found) = of_rows(&drawn, factors) {
            samples.iter_mut().zip(found).for_each(|(list, it)| list.push(it));
        }
    }
    let index = |([first, total], samples): ([f64; 2], Vec<[f64; 2]>)| {
        let interval = |which: usize| {
            let mut list: Vec<f64> = samples.iter().map(|it| it[which]).collect();
            list.sort_by(f64::total_cmp);
            let at = |per_mille: usize| list.get(per_mille * list.len() / 1000).copied();
            Some([at(25)?, at(975)?])
        };
        Index { first, total, first_interval: interval(0), total_interval: interval(1) }
    };
    let factors = all.into_iter().zip(samples).map(index).collect();
    Ok(Estimate { factors, rows: rows.len(), used: complete.len() })
}

/// First-order and total index of each factor; `None` if nothing varies.
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 rows")]
fn of_rows(rows: &[&[f64]], factors: usize) -> Option<Vec<[f64; 2]>> {
    let count = rows.len() as f64;
    let mean = rows.iter().map(|row| row[0] + row[1]).sum::<f64>() / (2.0 * count);
    let square = |it: f64| (it - mean) * (it - mean);
    let variance =
        rows.iter().map(|row| square(row[0]) + square(row[1])).sum::<f64>() / (2.0 * count);
    let of = |j: usize| {
        let first = rows.iter().map(|row| (row[1] - mean) * (row[2 + j] - row[0])).sum::<f64>();
        let total = rows.iter().map(|row| (row[0] - row[2 + j]).powi(2)).sum::<f64>();
        [first / count / variance, total / (2.0 * count) / variance]
    };
    (variance > 0.0).then(|| (0..factors).map(of).collect())
}

/// A number below `below` from SplitMix64 (Steele, Lea and Flood 2014): the same intervals in every report.
fn next(state: &mut u64, below: usize) -> usize {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^= z >> 31;
    // the high half times the range: even to 2⁻³² of it
    let wide = u128::from(z) * below as u128;
    usize::try_from(wide >> 64).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{closed_form, even, ishigami};
    use super::*;

    fn design(rows: usize) -> Vec<f64> {
        let mut figure = Vec::new();
        for i in 0..rows {
            let six = even(i, 6);
            let (a, b) = six.split_at(3);
            figure.push(ishigami(a));
            figure.push(ishigami(b));
            for j in 0..3 {
                let mut mixed = a.to_vec();
                mixed[j] = b[j];
                figure.push(ishigami(&mixed));
            }
        }
        figure
    }

    #[test]
    fn analytic_the_indices_of_ishigami_are_found() {
        let it = estimate(&design(8192), 3).unwrap();
        for (found, [first, total]) in it.factors.iter().zip(closed_form()) {
            // quasi-random points: far below 1/√8192 = 0.011 of independent ones
            assert!((found.first - first).abs() < 0.01, "{found:?} {first}");
            assert!((found.total - total).abs() < 0.01, "{found:?} {total}");
            let [low, high] = found.total_interval.unwrap();
            assert!(low <= found.total && found.total <= high && high - low < 0.1);
        }
    }

    #[test]
    fn issue_rows_with_a_failed_point_are_left_out() {
        let mut figure = design(4096);
        for row in 0..200 {
            figure[row * 20 * 5 % 20_000] = f64::NAN;
        }
        let it = estimate(&figure, 3).unwrap();
        assert!(it.rows == 4096 && it.used < 4096, "{}", it.used);
        assert!((it.factors[1].first - closed_form()[1][0]).abs() < 0.03);
        assert!(estimate(&[f64::NAN; 50], 3).unwrap_err().contains("complete"));
        assert!(estimate(&[1.0; 50], 3).unwrap_err().contains("the same"));
    }
}
