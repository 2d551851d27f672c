//! Numbers over a grid from few points: exact where each depends on one axis only, or is a sum or a product of such.

use crate::error::Error;

/// Relative error up to which a sum or a product counts as proven.
const PROVEN: f64 = 1e-11;
/// Points of the grid at which it is checked, besides those that it is made of.
const CHECKS: usize = 8;

/// How a number depends on two axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    Sum,
    Product,
}

/// Vectors of numbers over columns and rows.
#[derive(Debug, Clone)]
pub(crate) enum Model {
    /// Along both axes through a corner, and the kind of each number.
    Separate { by_column: Vec<Vec<f64>>, by_row: Vec<Vec<f64>>, kinds: Vec<Kind> },
    /// Row by row.
    Whole(Vec<Vec<Vec<f64>>>),
}

impl Model {
    /// `at` computes the numbers at a column and row. `varies`: along which axes they may vary.
    pub fn new(
        (columns, rows): (usize, usize),
        varies: (bool, bool),
        mut at: impl FnMut(usize, usize) -> Result<Vec<f64>, Error>,
    ) -> Result<Self, Error> {
        let width = if varies.0 { columns } else { 1 };
        let height = if varies.1 { rows } else { 1 };
        let by_column = (0..width).map(|c| at(c, 0)).collect::<Result<Vec<_>, _>>()?;
        let mut by_row = vec![by_column[0].clone()];
        for r in 1..height {
            by_row.push(at(0, r)?);
        }
        let mut model =
            Self::Separate { kinds: vec![Kind::Sum; by_column[0].len()], by_column, by_row };
        if width == 1 || height == 1 {
            return Ok(model);
        }
        // the far corner decides between sum and product, points all over the grid check it
        let mut points = vec![(width - 1, height - 1)];
        points.extend((0..CHECKS).map(|k| {
            let spread = |n: usize, step: usize| 1 + (k * step + 3) * 7919 % (n - 1).max(1);
            (spread(width, 3).min(width - 1), spread(height, 5).min(height - 1))
        }));
        for (k, (c, r)) in points.into_iter().enumerate() {
            let exact = at(c, r)?;
            if !model.settle((c, r), &exact, k == 0) {
                let mut all = Vec::new();
                for r in 0..rows {
                    all.push((0..columns).map(|c| at(c, r)).collect::<Result<Vec<_>, _>>()?);
                }
                return Ok(Self::Whole(all));
            }
        }
        Ok(model)
    }

    /// Whether the numbers are these at a point; at the first one, their kinds are chosen so.
    fn settle(&mut self, (column, row): (usize, usize), exact: &[f64], first: bool) -> bool {
        let Self::Separate { by_column, by_row, kinds } = self else { return true };
        (0..exact.len()).all(|k| {
            let (x, y, corner) = (by_column[column][k], by_row[row][k], by_row[0][k]);
            let size = exact[k].abs().max(x.abs()).max(y.abs());
            let fits = |kind: Kind| (value(kind, x, y, corner) - exact[k]).abs() <= PROVEN * size;
            if fits(kinds[k]) {
                return true;
            }
            kinds[k] = Kind::Product;
            first && fits(Kind::Product)
        })
    }

    /// The numbers at a column and row.
    pub fn at(&self, column: usize, row: usize) -> Vec<f64> {
        match self {
            Self::Whole(all) => all[row][column].clone(),
            Self::Separate { by_column, by_row, kinds } => {
                let x = &by_column[if by_column.len() == 1 { 0 } else { column }];
                let y = &by_row[if by_row.len() == 1 { 0 } else { row }];
                let corner = &by_row[0];
                (0..x.len()).map(|k| value(kinds[k], x[k], y[k], corner[k])).collect()
            }
        }
    }

    /// Whether every point of the grid was computed by the unit.
    pub fn is_whole(&self) -> bool {
        matches!(self, Self::Whole(_))
    }
}

fn value(kind: Kind, x: f64, y: f64, corner: f64) -> f64 {
    match kind {
        Kind::Sum => x + (y - corner),
        Kind::Product if corner == 0.0 => 0.0,
        Kind::Product => x * (y / corner),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_sums_and_products_are_found_and_others_computed_point_by_point() {
        let mut calls = 0;
        let of = |c: usize, r: usize| {
            let (x, y) = (2.0 + c as f64, 0.5 + 0.1 * r as f64);
            vec![x, y * y, 3.0 * x + y, -x.sqrt() * y, 7.0]
        };
        let model = Model::new((30, 20), (true, true), |c, r| {
            calls += 1;
            Ok(of(c, r))
        });
        let model = model.unwrap();
        assert!(!model.is_whole() && calls < 70);
        for (c, r) in [(0, 0), (29, 19), (13, 7)] {
            for (a, b) in model.at(c, r).iter().zip(of(c, r)) {
                assert!((a - b).abs() < 1e-12 * b.abs().max(1.0));
            }
        }
        let mixed = |c: usize, r: usize| vec![(1.0 + c as f64 * r as f64).sqrt()];
        let model = Model::new((6, 5), (true, true), |c, r| Ok(mixed(c, r))).unwrap();
        assert!(model.is_whole());
        assert_eq!(model.at(3, 4), mixed(3, 4));
    }
}
