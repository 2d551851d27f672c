//! The irregularity of the track, laid out along it.

use std::collections::BTreeMap;

use guideway::description::{RailsDescription, WhichRail};
use multibody::VehicleDescription as Vehicle;
use serde::Serialize;

use super::motion::SignalSource;
use crate::embed::ArrayRef;
use crate::layout_fmu::LayoutFmu;
use crate::names::{self, numbered};

/// Distance between points of the drawn irregularity (m): a fifth of the shortest wave.
const GRID: f64 = 0.1;

/// Recorded height of a rail's surface (m) at equal distances from `start`.
#[derive(Debug, Serialize)]
pub(super) struct DrawnIrregularity {
    /// 1 for the left rail, -1 for the right, 0 for all.
    side: i8,
    start: f64,
    step: f64,
    values: ArrayRef,
}

/// The surface from recorded irregularities and positions of magnets: of each rail, if a guideway has two.
pub(super) fn irregularity(
    unit: &LayoutFmu<'_>,
    vehicle: &LayoutFmu<'_>,
    layout: &Vehicle,
    rails: Option<&RailsDescription>,
    source: &mut SignalSource<'_>,
) -> Vec<DrawnIrregularity> {
    let count = layout.magnets.len();
    let Some(rails) = rails.filter(|it| !it.sides.is_empty()) else {
        return of_magnets(unit, vehicle, 0, (1..=count).collect(), count, source)
            .into_iter()
            .collect();
    };
    let of = |which| (1..=count).filter(move |k| rails.sides[(k - 1) % rails.sides.len()] == which);
    let both = [(1, of(WhichRail::Left).collect()), (-1, of(WhichRail::Right).collect())];
    let drawn = both.map(|(side, magnets)| of_magnets(unit, vehicle, side, magnets, count, source));
    drawn.into_iter().flatten().collect()
}

/// The surface that some of the magnets met.
fn of_magnets(
    unit: &LayoutFmu<'_>,
    vehicle: &LayoutFmu<'_>,
    side: i8,
    magnets: Vec<usize>,
    count: usize,
    source: &mut SignalSource<'_>,
) -> Option<DrawnIrregularity> {
    let mut cells: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for k in magnets {
        let height = unit.variable(&numbered(names::IRREGULARITY, k, count));
        let place = vehicle.variable(&numbered(names::POSITION, k, count));
        let columns = (source.table.column(&height), source.table.column(&place));
        let (Some(heights), Some(places)) = columns else { continue };
        for (z, x) in heights.iter().zip(places).filter(|(z, x)| z.is_finite() && x.is_finite()) {
            let cell = cells.entry((x / GRID).round() as i64).or_default();
            *cell = (cell.0 + z, cell.1 + 1.0);
        }
    }
    let (first, last) = (*cells.keys().next()?, *cells.keys().next_back()?);
    let mean: Vec<(i64, f64)> = cells.iter().map(|(k, (sum, n))| (*k, sum / n)).collect();
    if mean.iter().all(|(_, z)| *z == 0.0) || last - first > 1_000_000 {
        return None;
    }
    // interpolates over cells without a magnet
    let mut values = Vec::new();
    for pair in mean.windows(2) {
        let [(k, a), (l, b)] = [pair[0], pair[1]];
        values.extend((k..l).map(|i| a + (b - a) * (i - k) as f64 / (l - k) as f64));
    }
    values.push(mean[mean.len() - 1].1);
    let values = source.arrays.f32(&values);
    Some(DrawnIrregularity { side, start: first as f64 * GRID, step: GRID, values })
}
