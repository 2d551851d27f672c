//! The stability boundary between the points of a grid: the parameter and the frequency at which a mode neither grows
//! nor decays.

use stability_map::{Branch, Point};

use crate::result::{BoundaryPoint, MapCell};
use crate::scene::Reduced;

/// |Re λ| / |λ| at a point of the boundary.
const ON_IT: f64 = 1e-11;
/// Iterations.
const MOST: usize = 30;

/// Every edge between neighbouring points of which one grows and one decays, as far as the growing mode can be followed
/// between them.
pub(crate) fn boundary(reduced: &Reduced<'_>, cells: &[Vec<MapCell>]) -> Vec<BoundaryPoint> {
    let mut found = Vec::new();
    let grows = |row: usize, column: usize| cells[row][column].damping < 0.0;
    for row in 0..cells.len() {
        for column in 0..cells[row].len() {
            for along_x in [true, false] {
                let other = if along_x { (row, column + 1) } else { (row + 1, column) };
                if cells.get(other.0).is_none_or(|it| other.1 >= it.len())
                    || grows(row, column) == grows(other.0, other.1)
                {
                    continue;
                }
                let here = grows(row, column);
                let cell = if here { &cells[row][column] } else { &cells[other.0][other.1] };
                let Some((part, omega)) = crossing(reduced, (column, row), along_x, here, cell)
                else {
                    continue;
                };
                found.push(BoundaryPoint {
                    row,
                    column,
                    along_x,
                    part,
                    x: 0.0,
                    y: None,
                    frequency_hz: omega / std::f64::consts::TAU,
                    distance: None,
                });
            }
        }
    }
    found
}

/// Where the mode of a growing cell crosses the imaginary axis, as a part of the way to the next point, and its |Im λ|;
/// by the method of false position (Illinois), with the mode refined by Newton's method at each place.
fn crossing(
    reduced: &Reduced<'_>,
    place: (usize, usize),
    along_x: bool,
    grows_first: bool,
    cell: &MapCell,
) -> Option<(f64, f64)> {
    let at = |part: f64, near: &dyn Fn(Point<'_>) -> Option<Branch>| {
        let (level, controllers) = reduced.between(place, along_x, part);
        near(Point { space: &reduced.space, level: &level, controllers: &controllers })
    };
    let s = faer::prelude::c64::new(cell.real, cell.imaginary);
    let (from, to) = if grows_first { (0.0, 1.0) } else { (1.0, 0.0) };
    let first = at(from, &|point| Branch::near(0, s, point))?;
    let last = at(to, &|point| first.at(point))?;
    let mut ends = [(from, first.s.re), (to, last.s.re)];
    if ends[0].1 <= 0.0 || ends[1].1 >= 0.0 {
        return None;
    }
    let mut branch = first;
    let mut before = 0;
    for _ in 0..MOST {
        let [(a, fa), (b, fb)] = ends;
        let part = (a * fb - b * fa) / (fb - fa);
        branch = at(part, &|point| branch.at(point))?;
        let value = branch.s.re;
        if value.abs() <= ON_IT * branch.s.norm() {
            return Some((part, branch.s.im.abs()));
        }
        let side = usize::from(value < 0.0);
        ends[side] = (part, value);
        // an end that stays twice counts half
        if before == side + 1 {
            ends[1 - side].1 *= 0.5;
        }
        before = side + 1;
    }
    None
}
