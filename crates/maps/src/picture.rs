//! A map as a picture.

use figure::{HeatMap, HeatMark, PlotError};

use crate::result::{MapAxis, ModeKind, StabilityMap};

/// Largest damping ratio that the colours tell apart.
const LARGEST: f64 = 0.2;

/// The map as SVG: colours for the least damping ratio, the stability boundary, marks at the boundary for the kind of
/// mode that grows there, and the scenario's own values.
///
/// # Errors
/// The figure cannot be drawn.
pub fn picture(map: &StabilityMap) -> Result<String, PlotError> {
    let label = |axis: &MapAxis| match &axis.unit {
        Some(unit) => format!("{} ({unit})", axis.target),
        None => axis.target.clone(),
    };
    let Some(y) = &map.y else {
        let points = |of: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> {
            map.x.values.iter().enumerate().map(|(k, x)| (*x, of(k))).collect()
        };
        let panel = |ylabel: &str, of: &dyn Fn(usize) -> f64| figure::FigurePanel {
            ylabel: ylabel.to_owned(),
            lines: vec![figure::FigureLine { label: String::new(), points: points(of) }],
        };
        let cell = |k: usize| &map.cells[0][k];
        let panels = [
            panel("least damping ratio", &|k| cell(k).damping),
            panel("its frequency (Hz)", &|k| cell(k).frequency_hz),
        ];
        return figure::draw_over(&map.title, &label(&map.x), &panels);
    };
    let marks = marks(map, y);
    let own = map.x.scenario.zip(y.scenario);
    let heat = HeatMap {
        title: map.title.clone(),
        xlabel: label(&map.x),
        ylabel: label(y),
        legend: "least damping ratio".to_owned(),
        x: map.x.values.clone(),
        y: y.values.clone(),
        values: map.cells.iter().map(|row| row.iter().map(|it| it.damping).collect()).collect(),
        largest: LARGEST,
        marks,
        own,
        crossings: map
            .boundary
            .iter()
            .map(|it| ((it.row, it.column, it.along_x), it.part))
            .collect(),
    };
    figure::draw_heat_map(&heat)
}

/// One mark every few cells along the boundary: the kind of units whose mode grows beyond it.
fn marks(map: &StabilityMap, y: &MapAxis) -> Vec<HeatMark> {
    let (rows, columns) = (map.cells.len(), map.x.values.len());
    let spacing = (rows.max(columns) / 12).max(1);
    let mut all: Vec<(usize, usize, HeatMark)> = Vec::new();
    let name = |mode: ModeKind| match mode {
        ModeKind::Plant => Some(map.kinds[0].clone()),
        ModeKind::Attached => Some(map.kinds[1].clone()),
        ModeKind::Controllers => Some(map.kinds[2].clone()),
        ModeKind::Unknown => None,
    };
    for r in 0..rows {
        for c in 0..columns {
            let cell = &map.cells[r][c];
            let beside = |dr: isize, dc: isize| {
                let (r, c) = (r.checked_add_signed(dr)?, c.checked_add_signed(dc)?);
                map.cells.get(r)?.get(c)
            };
            let at_boundary = cell.damping < 0.0
                && [(0, 1), (0, -1), (1, 0), (-1, 0)]
                    .iter()
                    .any(|(dr, dc)| beside(*dr, *dc).is_some_and(|it| it.damping > 0.0));
            let Some(label) = name(cell.mode).filter(|_| at_boundary) else { continue };
            let near = |(other_r, other_c, _): &(usize, usize, HeatMark)| {
                r.abs_diff(*other_r) < spacing && c.abs_diff(*other_c) < spacing
            };
            if !all.iter().any(near) {
                let label = format!("{label}, {:.1} Hz", cell.frequency_hz);
                all.push((
                    r,
                    c,
                    HeatMark {
                        x: map.x.values[c],
                        y: y.values[r],
                        kind: name(cell.mode).unwrap_or_default(),
                        label,
                    },
                ));
            }
        }
    }
    all.into_iter().map(|it| it.2).collect()
}
