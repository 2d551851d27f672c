//! The settings of a study: points that differ in their seeds only are repetitions of one setting.

use indexmap::IndexMap;

use crate::columns::ColumnKind;
use crate::study_results::StudyResults;

/// The values of all factors but seeds, once each, in the order of the first points that have them.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Columns of the factors.
    pub factors: Vec<usize>,
    /// Values of the factors, one row per setting.
    pub values: Vec<Vec<f64>>,
    /// Points of each setting.
    pub points: Vec<Vec<usize>>,
}

impl Settings {
    /// Groups the points of a study. In a design of Saltelli, in which equal rows may have different places, each
    /// run of consecutive equal rows is a setting.
    #[must_use]
    pub fn of(study: &StudyResults) -> Self {
        let columns = study.columns.iter().enumerate();
        let factors: Vec<usize> =
            columns.filter(|(_, it)| it.kind == ColumnKind::Factor).map(|(k, _)| k).collect();
        let row = |point: usize| -> Vec<f64> {
            factors.iter().map(|&k| study.columns[k].values.number(point)).collect()
        };
        let in_order = study.design() == "saltelli";
        let mut known: IndexMap<Vec<u64>, usize> = IndexMap::new();
        let (mut values, mut points): (Vec<Vec<f64>>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
        for point in 0..study.points.len() {
            let row = row(point);
            let key = row.iter().map(|it| it.to_bits()).collect();
            let last = values.len().wrapping_sub(1);
            let place = match known.get(&key) {
                Some(&place) if !in_order || place == last => place,
                _ => {
                    values.push(row);
                    points.push(Vec::new());
                    known.insert(key, values.len() - 1);
                    values.len() - 1
                }
            };
            points[place].push(point);
        }
        Self { factors, values, points }
    }

    /// The mean of a figure over the points of each setting, NaN if one of them lacks it.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
    pub fn means(&self, figure: &[f64]) -> Vec<f64> {
        let mean = |points: &Vec<usize>| {
            points.iter().map(|&it| figure[it]).sum::<f64>() / points.len() as f64
        };
        self.points.iter().map(mean).collect()
    }

    /// Mean over the settings of the variance within a setting; none without repetitions.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53 points")]
    pub fn variance_within(&self, figure: &[f64]) -> Option<f64> {
        let of = |points: &Vec<usize>| {
            let values: Vec<f64> =
                points.iter().map(|&it| figure[it]).filter(|it| it.is_finite()).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let sum = values.iter().map(|it| (it - mean).powi(2)).sum::<f64>();
            (values.len() > 1).then(|| sum / (values.len() - 1) as f64)
        };
        let all: Vec<f64> = self.points.iter().filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }
}
