//! The analysis of variance of a complete grid.

use super::Index;

/// The indices of a figure on a grid of all combinations of the factors' values, each equally likely:
/// S = Var(mean over the other factors) / Var, T = mean(variance over the factor itself) / Var.
///
/// `None` if the settings are no complete grid, or if the figure is missing somewhere.
#[must_use]
#[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
pub fn decompose(settings: &[Vec<f64>], figure: &[f64]) -> Option<Vec<Index>> {
    let dimensions = settings.first()?.len();
    let levels: Vec<Vec<f64>> = (0..dimensions)
        .map(|d| {
            let mut all: Vec<f64> = settings.iter().map(|row| row[d]).collect();
            all.sort_by(f64::total_cmp);
            all.dedup();
            all
        })
        .collect();
    let size = levels.iter().try_fold(1_usize, |size, it| size.checked_mul(it.len()))?;
    if size != settings.len() || figure.iter().any(|it| !it.is_finite()) {
        return None;
    }
    // place of each setting in the grid, the last factor fastest
    let mut table = vec![f64::NAN; size];
    for (row, value) in settings.iter().zip(figure) {
        let mut place = 0;
        for (it, levels) in row.iter().zip(&levels) {
            let level = levels.binary_search_by(|other| other.total_cmp(it)).ok()?;
            place = place * levels.len() + level;
        }
        table[place] = *value;
    }
    // as many settings as places: one is missing if another is twice
    if table.iter().any(|it| it.is_nan()) {
        return None;
    }
    let mean = table.iter().sum::<f64>() / size as f64;
    let variance = table.iter().map(|it| (it - mean).powi(2)).sum::<f64>() / size as f64;
    let index = |d: usize| {
        let count = levels[d].len();
        let stride: usize = levels[d + 1..].iter().map(Vec::len).product();
        let at = |place: usize| place / stride % count;
        let mut sums = vec![0.0; count];
        table.iter().enumerate().for_each(|(place, value)| sums[at(place)] += value);
        let each = (size / count) as f64;
        let main = sums.iter().map(|sum| (sum / each - mean).powi(2)).sum::<f64>() / count as f64;
        let mut own = 0.0;
        for start in (0..size).filter(|place| at(*place) == 0) {
            let line = || (0..count).map(|k| table[start + k * stride]);
            let middle = line().sum::<f64>() / count as f64;
            own += line().map(|it| (it - middle).powi(2)).sum::<f64>() / count as f64;
        }
        Index { first: main / variance, total: own / each / variance, ..Index::default() }
    };
    (variance > 0.0).then(|| (0..dimensions).map(index).collect())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{closed_form, ishigami};
    use super::*;

    fn cube(count: usize) -> Vec<Vec<f64>> {
        let at = |k: usize| (k as f64 + 0.5) / count as f64;
        let all = (0..count.pow(3))
            .map(|k| vec![at(k / count / count), at(k / count % count), at(k % count)]);
        all.collect()
    }

    /// The midpoint rule with 40 values per factor.
    #[test]
    fn analytic_the_indices_of_ishigami_are_those_of_a_fine_grid() {
        let settings = cube(40);
        let figure: Vec<f64> = settings.iter().map(|it| ishigami(it)).collect();
        for (found, [first, total]) in
            decompose(&settings, &figure).unwrap().iter().zip(closed_form())
        {
            // (π/40)²·4²/24: the error of the midpoint rule for x⁴
            assert!(
                (found.first - first).abs() < 5e-3 && (found.total - total).abs() < 5e-3,
                "{found:?}"
            );
        }
    }

    #[test]
    fn issue_incomplete_grids_are_not_decomposed() {
        let settings = cube(3);
        let mut figure: Vec<f64> = settings.iter().map(|it| ishigami(it)).collect();
        assert!(decompose(&settings, &figure).is_some());
        assert!(decompose(&settings[1..], &figure[1..]).is_none());
        let mut twice = settings.clone();
        twice[1] = twice[0].clone();
        assert!(decompose(&twice, &figure).is_none());
        figure[4] = f64::NAN;
        assert!(decompose(&settings, &figure).is_none());
    }
}
