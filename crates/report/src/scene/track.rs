//! The girders: where they are, their mode shapes, and their modal coordinates over time.

use std::collections::BTreeMap;

use guideway::{Guideway, State, Workspace};
use multibody::Description as Vehicle;
use serde::Serialize;

use super::motion::{Source, numbered};
use crate::embed::ArrayRef;
use crate::error::ReportError;
use crate::unit::Unit;

/// Points of a mode shape along a span.
const POINTS: usize = 65;
/// Distance of the points of the drawn irregularity (m): a fifth of the shortest wave.
const GRID: f64 = 0.1;
/// Pole length (m) where no guideway tells one.
const POLE_LENGTH: f64 = 0.65;
/// Where a span's deflection is an output: row of the output, and part of the span's length.
const MEASURED: [(&str, f64); 2] = [("midspan_displacement", 0.5), ("quarter_displacement", 0.25)];

/// The girders and the surface on them.
#[derive(Debug, Serialize)]
pub(super) struct Track {
    spans: Vec<Span>,
    irregularity: Option<Irregularity>,
}

/// One span.
#[derive(Debug, Serialize)]
struct Span {
    /// Where it begins and ends (m).
    start: f64,
    end: f64,
    /// Mode shapes at even distances from end to end, of those modes whose coordinates are known.
    shapes: Vec<Vec<f64>>,
    /// Modal coordinates over time (m).
    modes: Vec<ArrayRef>,
}

/// Height of the rails' surface (m) as the magnets met it, at even distances from `start`.
#[derive(Debug, Serialize)]
struct Irregularity {
    start: f64,
    step: f64,
    values: ArrayRef,
}

impl Track {
    /// The track, and the magnets' pole length (m).
    pub(super) fn new(
        unit: Option<&Unit<'_>>,
        vehicle: &Unit<'_>,
        layout: &Vehicle,
        source: &mut Source<'_>,
    ) -> Result<(Self, f64), ReportError> {
        let Some(unit) = unit else {
            source.missing.push(
                "no unit of this run is a guideway of girders: the track is rigid".to_owned(),
            );
            return Ok((Self { spans: Vec::new(), irregularity: None }, POLE_LENGTH));
        };
        let mut description = unit.layout(guideway::Description::from_json)?;
        // only shapes are wanted; making a profile takes time
        description.irregularity.on = false;
        let modes = unit.parameter("modes");
        for girder in description.girders.values_mut() {
            let wanted = modes.map_or(girder.modes, |it| it as usize);
            girder.modes = girder.modes.min(wanted).max(1);
        }
        let pole = unit.parameter("pole_length").unwrap_or(description.pole.length);
        let guideway =
            Guideway::new(&description, None).map_err(|error| unit.unusable(&error.to_string()))?;
        let mut shapes = Shapes::new(&guideway);
        let spans = (0..guideway.spans().len()).map(|k| shapes.span(k, unit, source)).collect();
        let irregularity = irregularity(unit, vehicle, layout, source);
        if irregularity.is_none() && unit.parameter("irregularity_on") == Some(1.0) {
            source.missing.push(
                "the track is drawn smooth: no irregularity_NN with its position_NN is recorded"
                    .to_owned(),
            );
        }
        shapes.say_what_is_left_out(source.missing);
        Ok((Self { spans, irregularity }, if pole > 0.0 { pole } else { POLE_LENGTH }))
    }
}

/// Evaluates mode shapes.
struct Shapes<'a> {
    guideway: &'a Guideway,
    work: Workspace,
    still: Vec<f64>,
    alone: State,
    /// Spans of which nothing is known, and those of which only some modes are.
    unknown: usize,
    /// Modes drawn and modes there, of a span with fewer drawn than there.
    partly: Option<(usize, usize)>,
}

impl<'a> Shapes<'a> {
    fn new(guideway: &'a Guideway) -> Self {
        let still = vec![0.0; guideway.modes().len()];
        let alone = State { q: still.clone(), v: still.clone() };
        let work = Workspace::new(guideway);
        Self { guideway, work, still, alone, unknown: 0, partly: None }
    }

    /// φₙ of span `k` at a part of its length.
    fn shape(&mut self, k: usize, mode: usize, part: f64) -> f64 {
        let i = self.guideway.spans()[k].first_mode + mode;
        self.alone.q[i] = 1.0;
        let y = self.guideway.span_motion(&mut self.work, &self.alone, &self.still, k, part);
        self.alone.q[i] = 0.0;
        y.displacement
    }

    /// A span with as many modes, the lowest ones, as points of it are recorded.
    fn span(&mut self, k: usize, unit: &Unit<'_>, source: &mut Source<'_>) -> Span {
        let place = self.guideway.spans()[k];
        let count = self.guideway.girders()[place.girder].modes().len();
        let digits = self.guideway.spans().len().to_string().len().max(2);
        let mut known: Vec<(f64, Vec<f64>)> = MEASURED
            .iter()
            .filter_map(|(row, part)| {
                let name = unit.variable(&format!("{row}_{:0digits$}", k + 1));
                Some((*part, source.signal(&name)?))
            })
            .collect();
        known.truncate(count);
        let coordinates = self.coordinates(k, &known);
        self.unknown += usize::from(coordinates.is_empty());
        if !coordinates.is_empty() && coordinates.len() < count {
            self.partly = Some((coordinates.len(), count));
        }
        let along = |n: usize| n as f64 / (POINTS - 1) as f64;
        let shapes = (0..coordinates.len())
            .map(|mode| (0..POINTS).map(|n| self.shape(k, mode, along(n))).collect())
            .collect();
        let modes = coordinates.iter().map(|values| source.arrays.f32(values)).collect();
        Span { start: place.start, end: place.end, shapes, modes }
    }

    /// Solves Σ φₙ(xᵢ)·qₙ = uᵢ for one or two points.
    fn coordinates(&mut self, k: usize, known: &[(f64, Vec<f64>)]) -> Vec<Vec<f64>> {
        match known {
            [] => Vec::new(),
            [(part, u)] => {
                let phi = self.shape(k, 0, *part);
                vec![u.iter().map(|u| u / phi).collect()]
            }
            [(x, u), (y, w), ..] => {
                let [a, b] = [self.shape(k, 0, *x), self.shape(k, 1, *x)];
                let [c, d] = [self.shape(k, 0, *y), self.shape(k, 1, *y)];
                let det = a * d - b * c;
                let pairs = || u.iter().zip(w);
                vec![
                    pairs().map(|(u, w)| (d * u - b * w) / det).collect(),
                    pairs().map(|(u, w)| (a * w - c * u) / det).collect(),
                ]
            }
        }
    }

    fn say_what_is_left_out(&self, missing: &mut Vec<String>) {
        if self.unknown > 0 {
            missing.push(format!(
                "{} of {} spans are drawn straight: their midspan_displacement is not recorded",
                self.unknown,
                self.guideway.spans().len()
            ));
        }
        if let Some((drawn, there)) = self.partly {
            let why = if drawn == 1 {
                "; record quarter_displacement for the second"
            } else {
                ", as far as mid-span and quarter tell them"
            };
            missing.push(format!("girders are drawn with {drawn} of {there} modes{why}"));
        }
    }
}

/// The surface as the magnets with a recorded irregularity met it, at the places where they were.
fn irregularity(
    unit: &Unit<'_>,
    vehicle: &Unit<'_>,
    layout: &Vehicle,
    source: &mut Source<'_>,
) -> Option<Irregularity> {
    let mut cells: BTreeMap<i64, (f64, f64)> = BTreeMap::new();
    for k in 1..=layout.magnets.len() {
        let height = unit.variable(&numbered("irregularity", k, layout));
        let place = vehicle.variable(&numbered("position", k, layout));
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
    // between cells that no magnet met, straight
    let mut values = Vec::new();
    for pair in mean.windows(2) {
        let [(k, a), (l, b)] = [pair[0], pair[1]];
        values.extend((k..l).map(|i| a + (b - a) * (i - k) as f64 / (l - k) as f64));
    }
    values.push(mean[mean.len() - 1].1);
    let values = source.arrays.f32(&values);
    Some(Irregularity { start: first as f64 * GRID, step: GRID, values })
}
