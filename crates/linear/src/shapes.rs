//! Mode shapes: which bodies and girders move, and how.

use faer::prelude::c64;
use fmi2_import::instance::Instance;
use results::modes::{ModeShape, ModeShapes, MovingPart};
use serde::Deserialize;

use super::error::LinearError;
use super::rows::{Entry, Rows};
use super::unit::LinearUnit;

/// Amplitudes below this share of the largest are left out.
const LEAST: f64 = 1e-2;

/// Motions of the parts of one unit by its states, from the report `motions`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Motions {
    /// What moves.
    pub parts: Vec<MovingPart>,
    /// Motion by state, one row per part.
    pub rows: Rows,
}

/// The report as written.
#[derive(Deserialize)]
struct Written {
    parts: Vec<WrittenPart>,
    rows: Vec<(usize, usize, Option<f64>)>,
}

#[derive(Deserialize)]
struct WrittenPart {
    part: String,
    direction: String,
    at: Option<f64>,
    unit: String,
}

impl Motions {
    /// Asks a unit. Most units have no such report: nothing of them moves.
    ///
    /// # Errors
    /// The report cannot be used.
    pub(crate) fn of(instance: &mut Instance, states: usize) -> Result<Self, LinearError> {
        let name = instance.name().to_owned();
        match instance.report("motions") {
            Ok(text) => Self::read(&name, states, &text),
            Err(_) => Ok(Self::default()),
        }
    }

    /// Reads a report.
    ///
    /// # Errors
    /// The text is not such a report, or an entry is outside its matrix or not finite.
    pub fn read(instance: &str, states: usize, text: &str) -> Result<Self, LinearError> {
        let wrong = |message: String| LinearError::Report {
            instance: instance.to_owned(),
            message: format!("its motions: {message}"),
        };
        let Written { parts, rows } =
            serde_json::from_str(text).map_err(|e| wrong(e.to_string()))?;
        let count = parts.len();
        let entry = |(i, j, value): (usize, usize, Option<f64>)| {
            let inside = i < count && j < states;
            match value.filter(|value| value.is_finite() && inside) {
                Some(value) => Ok((i, j, value)),
                None => Err(wrong(format!(
                    "[{i}][{j}] is not finite, or outside the matrix of {count} rows and {states} columns"
                ))),
            }
        };
        let rows = rows.into_iter().map(entry).collect::<Result<Vec<Entry>, _>>()?;
        let part = |it: WrittenPart| MovingPart {
            instance: instance.to_owned(),
            part: it.part,
            direction: it.direction,
            at: it.at,
            unit: it.unit,
        };
        Ok(Self { parts: parts.into_iter().map(part).collect(), rows: Rows::new(count, &rows) })
    }
}

/// The shapes of modes, from the right eigenvectors over all states.
pub fn shapes<'a>(
    units: &[LinearUnit],
    motions: &[Motions],
    vectors: impl Iterator<Item = &'a [c64]>,
) -> ModeShapes {
    let parts: Vec<MovingPart> = motions.iter().flat_map(|it| it.parts.iter().cloned()).collect();
    let mut modes = Vec::new();
    for (mode, vector) in vectors.enumerate() {
        let (mut amplitudes, mut rest) = (Vec::with_capacity(parts.len()), vector);
        for (unit, motions) in units.iter().zip(motions) {
            let (mine, others) = rest.split_at(unit.states.len());
            rest = others;
            amplitudes.extend((0..motions.rows.len()).map(|i| {
                let row = motions.rows.row(i).iter();
                row.fold(c64::new(0.0, 0.0), |sum, &(j, value)| sum + mine[j] * value)
            }));
        }
        let moves = scaled(&amplitudes, &parts);
        if !moves.is_empty() {
            modes.push(ModeShape { mode, moves });
        }
    }
    ModeShapes { parts, modes }
}

/// The largest displacement becomes 1, or the largest amplitude if there is none.
fn scaled(amplitudes: &[c64], parts: &[MovingPart]) -> Vec<(usize, f64, f64)> {
    let largest = |metres: bool| {
        let all = amplitudes.iter().zip(parts).filter(|(_, part)| !metres || part.unit == "m");
        let largest = all.map(|(it, _)| *it).max_by(|a, b| a.norm().total_cmp(&b.norm()));
        largest.filter(|it| it.norm() > 0.0 && it.norm().is_finite())
    };
    let Some(unit) = largest(true).or_else(|| largest(false)) else { return Vec::new() };
    let scaled = amplitudes.iter().map(|it| it / unit).enumerate();
    scaled.filter(|(_, it)| it.norm() >= LEAST).map(|(k, it)| (k, it.re, it.im)).collect()
}
