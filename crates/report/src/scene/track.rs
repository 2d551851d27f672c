//! The girders: where they are, their mode shapes, and their modal coordinates over time.

use guideway::{Guideway, State, Workspace};
use multibody::VehicleDescription as Vehicle;
use serde::Serialize;

use super::bodies::{BodyBox, DrawnBodies};
use super::motion::{RecordedMotion, SignalSource};
use super::surface::{self, DrawnIrregularity};
use crate::embed::ArrayRef;
use crate::error::ReportError;
use crate::layout_fmu::LayoutFmu;
use crate::names::{self, numbered};

/// Points of a mode shape along a span.
const POINTS: usize = 65;
/// Least value of a shape at a recorded point, as a fraction of its largest value, for it to be computed.
const VISIBLE: f64 = 0.2;
/// Ground that the page draws before and after train and spans, and a little more (m).
const BEYOND: f64 = 45.0;
/// Pole length (m) if no guideway defines one.
const POLE_LENGTH: f64 = 0.65;
/// Outputs for the deflection of a span: row, and position as a fraction of the span's length.
const MEASURED: [(&str, f64); 2] = [(names::MIDSPAN, 0.5), (names::QUARTER, 0.25)];

/// The girders and the surface on them.
#[derive(Debug, Serialize)]
pub(super) struct DrawnTrack {
    spans: Vec<DrawnSpan>,
    /// One that all rails share, or one of each rail.
    irregularity: Vec<DrawnIrregularity>,
    /// Height of the rails over the shear centre of the girders (m), about which these twist.
    rail_height: f64,
}

/// One span.
#[derive(Debug, Serialize)]
struct DrawnSpan {
    /// Start and end (m).
    start: f64,
    end: f64,
    /// Mode shapes at equal distances from end to end, of the modes whose coordinates are known.
    shapes: Vec<Vec<f64>>,
    /// Modal coordinates over time (m).
    modes: Vec<ArrayRef>,
    /// Shapes of all natural modes at equal distances from end to end, the lowest first.
    natural: Vec<ArrayRef>,
    /// Lateral deflection (m, left positive) and twist (rad, left side up), if they are recorded.
    lateral: Option<Sway>,
    twist: Option<Sway>,
}

/// A lateral deflection or a twist, known in the middle of the span.
#[derive(Debug, Serialize)]
struct Sway {
    /// The shape of the lowest mode that has this component in the middle, 1 there, at equal distances.
    shape: Vec<f64>,
    /// Values in the middle over time.
    values: ArrayRef,
}

impl DrawnTrack {
    /// Number of spans.
    pub(super) fn spans(&self) -> usize {
        self.spans.len()
    }

    /// Places (m) between which the track is drawn, at most.
    pub(super) fn stretch(&self, motion: &RecordedMotion, bodies: &DrawnBodies) -> (f64, f64) {
        let half = |it: &BodyBox| it.size[0] / 2.0;
        let rear = bodies.boxes.iter().map(|it| it.center[0] - half(it)).fold(0.0, f64::min);
        let front = bodies.boxes.iter().map(|it| it.center[0] + half(it)).fold(0.0, f64::max);
        let (from, to) = motion.travel;
        let starts = self.spans.iter().map(|it| it.start).fold(from + rear, f64::min);
        let ends = self.spans.iter().map(|it| it.end).fold(to + front, f64::max);
        (starts - BEYOND, ends + BEYOND)
    }

    /// The track, and the magnets' pole length (m).
    pub(super) fn new(
        unit: Option<&LayoutFmu<'_>>,
        vehicle: &LayoutFmu<'_>,
        layout: &Vehicle,
        source: &mut SignalSource<'_>,
    ) -> Result<(Self, f64), ReportError> {
        let Some(unit) = unit else {
            source.missing.push(
                "no unit of this run is a guideway with girders: the track is drawn rigid"
                    .to_owned(),
            );
            return Ok((
                Self { spans: Vec::new(), irregularity: Vec::new(), rail_height: 0.0 },
                POLE_LENGTH,
            ));
        };
        let mut description = unit.layout(guideway::GuidewayDescription::from_json)?;
        // only the shapes are needed; generating a profile takes time
        description.irregularity.on = false;
        if let Some(rails) = &mut description.rails {
            rails.irregularity.on = false;
        }
        for (girder, file) in description.shapes_files() {
            let text = unit.resource(&file)?;
            description
                .set_shapes(&girder, &text)
                .map_err(|error| unit.unusable(&error.to_string()))?;
        }
        let wanted = unit.parameter(names::MODES);
        for girder in description.girders.values_mut() {
            let modes = girder.mode_count();
            girder.modes = Some(wanted.map_or(modes, |it| modes.min(it as usize)).max(1));
        }
        let pole = unit.parameter(names::POLE_LENGTH).unwrap_or(description.pole.length);
        let guideway =
            Guideway::new(&description, None).map_err(|error| unit.unusable(&error.to_string()))?;
        let mut shapes = SpanShapes::new(&guideway);
        let spans = (0..guideway.spans().len()).map(|k| shapes.span(k, unit, source)).collect();
        let rails = description.rails.as_ref();
        let irregularity = surface::irregularity(unit, vehicle, layout, rails, source);
        if irregularity.is_empty() && unit.parameter(names::IRREGULARITY_ON) == Some(1.0) {
            source.missing.push(
                "the track is drawn smooth: no irregularity_NN with its position_NN is recorded"
                    .to_owned(),
            );
        }
        shapes.note_missing_modes(source.missing);
        let rail_height = rails.map_or(0.0, |it| it.height);
        Ok((Self { spans, irregularity, rail_height }, if pole > 0.0 { pole } else { POLE_LENGTH }))
    }
}

/// Why a span is drawn with only some of its modes.
#[derive(Debug, Clone, Copy)]
struct PartialModes {
    drawn: usize,
    there: usize,
    /// Whether the drawn modes are the lowest.
    lowest: bool,
    /// Number of recorded points.
    points: usize,
}

/// Evaluates mode shapes.
struct SpanShapes<'a> {
    guideway: &'a Guideway,
    work: Workspace,
    still: Vec<f64>,
    alone: State,
    /// Number of spans without any known mode.
    unknown: usize,
    /// A span with only some modes drawn.
    partly: Option<PartialModes>,
    /// Number of spans that can sway, but whose sway is not recorded.
    stiff: usize,
}

impl<'a> SpanShapes<'a> {
    fn new(guideway: &'a Guideway) -> Self {
        let still = vec![0.0; guideway.modes().len()];
        let alone = State { q: still.clone(), v: still.clone() };
        let work = Workspace::new(guideway);
        Self { guideway, work, still, alone, unknown: 0, partly: None, stiff: 0 }
    }

    /// φₙ of span `k` at a fraction of its length.
    fn shape(&mut self, k: usize, mode: usize, part: f64) -> f64 {
        let i = self.guideway.spans()[k].first_mode + mode;
        self.alone.q[i] = 1.0;
        let y = self.guideway.span_motion(&mut self.work, &self.alone, &self.still, k, part);
        self.alone.q[i] = 0.0;
        y.displacement
    }

    /// φₙ at equal distances from end to end of span `k`.
    fn table(&mut self, k: usize, mode: usize) -> Vec<f64> {
        (0..POINTS).map(|n| self.shape(k, mode, n as f64 / (POINTS - 1) as f64)).collect()
    }

    /// A span with as many modes as its recorded points determine.
    fn span(&mut self, k: usize, unit: &LayoutFmu<'_>, source: &mut SignalSource<'_>) -> DrawnSpan {
        let place = self.guideway.spans()[k];
        let count = self.guideway.girders()[place.girder].vertical_modes().len();
        let spans = self.guideway.spans().len();
        let mut known: Vec<(f64, Vec<f64>)> = Vec::new();
        for (row, part) in MEASURED {
            let name = unit.variable(&numbered(row, k + 1, spans));
            known.extend(source.signal(&name).map(|values| (part, values)));
        }
        let tables: Vec<Vec<f64>> = (0..count).map(|mode| self.table(k, mode)).collect();
        let natural = tables.iter().map(|table| source.arrays.f32(table)).collect();
        let found = coordinates(&tables, &known);
        self.unknown += usize::from(found.is_empty());
        if !found.is_empty() && found.len() < count {
            let lowest = found.iter().enumerate().all(|(n, (mode, _))| *mode == n);
            self.partly = Some(PartialModes {
                drawn: found.len(),
                there: count,
                lowest,
                points: known.len(),
            });
        }
        let modes = found.iter().map(|(_, values)| source.arrays.f32(values)).collect();
        let shapes = found.into_iter().map(|(mode, _)| tables[mode].clone()).collect();
        let lateral =
            self.sway(k, 1, unit.variable(&numbered(names::MIDSPAN_LATERAL, k + 1, spans)), source);
        let twist =
            self.sway(k, 2, unit.variable(&numbered(names::MIDSPAN_TWIST, k + 1, spans)), source);
        let spatial = self.guideway.girders()[place.girder].is_spatial();
        self.stiff += usize::from(spatial && (lateral.is_none() || twist.is_none()));
        DrawnSpan { start: place.start, end: place.end, shapes, modes, natural, lateral, twist }
    }

    /// A component of span `k`, 1 lateral or 2 twist, from its signal in the middle.
    fn sway(
        &mut self,
        k: usize,
        component: usize,
        signal: String,
        source: &mut SignalSource<'_>,
    ) -> Option<Sway> {
        let values = source.signal(&signal)?;
        let span = self.guideway.spans()[k];
        let girder = &self.guideway.girders()[span.girder];
        let (modes, length) = (girder.modes().len(), girder.length());
        let shape = (0..modes).find_map(|mode| {
            self.alone.q[span.first_mode + mode] = 1.0;
            let mut at = |n: usize| {
                let x = length * n as f64 / (POINTS - 1) as f64;
                let (work, still) = (&mut self.work, &self.still);
                let motion = self.guideway.section_motion(work, &self.alone, still, k, x);
                motion[component].displacement
            };
            let table: Vec<f64> = (0..POINTS).map(&mut at).collect();
            self.alone.q[span.first_mode + mode] = 0.0;
            let peak = table.iter().fold(0.0_f64, |most, it| most.max(it.abs()));
            let middle = table[POINTS / 2];
            let seen = peak > 0.0 && middle.abs() > VISIBLE * peak;
            seen.then(|| table.iter().map(|it| it / middle).collect())
        })?;
        Some(Sway { shape, values: source.arrays.f32(&values) })
    }

    fn note_missing_modes(&self, missing: &mut Vec<String>) {
        if self.stiff > 0 {
            missing.push(format!(
                "{} of {} spans are drawn without lateral deflection or twist: their {} or {} is not \
                 recorded",
                self.stiff,
                self.guideway.spans().len(),
                names::MIDSPAN_LATERAL,
                names::MIDSPAN_TWIST
            ));
        } else if self.guideway.girders().iter().any(guideway::Girder::is_spatial) {
            missing.push(
                "lateral deflection and twist of the girders are drawn by their values in the middle \
                 of the spans, with the shape of one mode"
                    .to_owned(),
            );
        }
        if self.unknown > 0 {
            missing.push(format!(
                "{} of {} spans are drawn straight: their {} is not recorded, or it is a node of all \
                 modes",
                self.unknown,
                self.guideway.spans().len(),
                names::MIDSPAN
            ));
        }
        if let Some(PartialModes { drawn, there, lowest, points }) = self.partly {
            let why = if !lowest {
                ", because the others have nodes at the recorded points".to_owned()
            } else if points < MEASURED.len() {
                format!("; record {} and {} for two", names::MIDSPAN, names::QUARTER)
            } else {
                ", as many as mid-span and quarter point determine".to_owned()
            };
            missing.push(format!("girders are drawn with {drawn} of {there} modes{why}"));
        }
    }
}

/// Value of a table at a fraction of its length, which is a multiple of a quarter.
fn at(table: &[f64], part: f64) -> f64 {
    table[(part * (POINTS - 1) as f64).round() as usize]
}

/// The lowest modes that the recorded points determine, with their coordinates over time from
/// Σ φₙ(xᵢ)·qₙ = uᵢ.
///
/// A tabulated shape may have a node at a recorded point, which then does not determine its coordinate.
fn coordinates(tables: &[Vec<f64>], known: &[(f64, Vec<f64>)]) -> Vec<(usize, Vec<f64>)> {
    let peaks: Vec<f64> =
        tables.iter().map(|table| table.iter().fold(0.0_f64, |m, x| m.max(x.abs()))).collect();
    if let [(x, u), (y, w)] = known {
        for (j, second) in tables.iter().enumerate() {
            for (i, first) in tables.iter().enumerate().take(j) {
                let [a, b, c, d] = [at(first, *x), at(second, *x), at(first, *y), at(second, *y)];
                let det = a * d - b * c;
                if det.abs() > VISIBLE * peaks[i] * peaks[j] {
                    let pairs = || u.iter().zip(w);
                    let p = pairs().map(|(u, w)| (d * u - b * w) / det).collect();
                    let q = pairs().map(|(u, w)| (a * w - c * u) / det).collect();
                    return vec![(i, p), (j, q)];
                }
            }
        }
    }
    for (mode, table) in tables.iter().enumerate() {
        let seen = |part: f64| at(table, part).abs() > VISIBLE * peaks[mode];
        if let Some((part, u)) = known.iter().find(|(part, _)| seen(*part)) {
            return vec![(mode, u.iter().map(|u| u / at(table, *part)).collect())];
        }
    }
    Vec::new()
}
