//! Checks of a line: lengths, radii, and continuity.

use crate::Error;
use crate::description::{Kind, LineDescription, Piece};
use crate::profile::end_curvature;

/// Smallest radius in m: below it a train's frames are far from each other in direction.
const SMALLEST_RADIUS: f64 = 5.0;
/// Largest slope and cant, rad.
const LARGEST_ANGLE: f64 = 0.5;
/// Longest line, m.
const LONGEST: f64 = 1e6;
/// Curvatures that differ by less, relative to the larger, are the same.
const SAME: f64 = 1e-9;

fn invalid(path: impl Into<String>, message: impl Into<String>) -> Error {
    Error::Invalid { path: path.into(), message: message.into() }
}

impl LineDescription {
    /// Checks lengths, radii and the continuity of curvature; position, direction and cant are continuous
    /// by their form.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first fault.
    pub fn check(&self) -> Result<(), Error> {
        if !self.start.is_finite() {
            return Err(invalid(
                "start",
                format!("{} is not a finite number of metres", self.start),
            ));
        }
        if self.plan.is_empty() {
            return Err(invalid(
                "plan",
                "there is no piece; give at least one, such as a straight",
            ));
        }
        check_pieces("plan", &self.plan)?;
        check_pieces("elevation", &self.elevation)?;
        let mut slope = 0.0;
        let mut curvature = 0.0;
        for (k, piece) in self.elevation.iter().enumerate() {
            let end = end_curvature(piece);
            let mean = if piece.kind == Kind::Clothoid { 0.5 * (curvature + end) } else { end };
            slope += mean * piece.length;
            curvature = end;
            if slope.abs() > LARGEST_ANGLE {
                return Err(invalid(
                    format!("elevation[{k}]"),
                    format!(
                        "the slope at its end is {slope:.3} rad; at most {LARGEST_ANGLE} rad are allowed"
                    ),
                ));
            }
        }
        for (k, piece) in self.cant.iter().enumerate() {
            check_length(&format!("cant[{k}].length"), piece.length)?;
            let Some(to) = piece.to else { continue };
            if !to.is_finite() || to.abs() > LARGEST_ANGLE {
                return Err(invalid(
                    format!("cant[{k}].to"),
                    format!(
                        "{to} rad is not a cant between −{LARGEST_ANGLE} and {LARGEST_ANGLE} rad"
                    ),
                ));
            }
        }
        Ok(())
    }
}

fn check_length(path: &str, length: f64) -> Result<(), Error> {
    if length > 0.0 && length <= LONGEST {
        return Ok(());
    }
    Err(invalid(path, format!("{length} m is not a length above 0 and up to {LONGEST} m")))
}

fn check_pieces(list: &str, pieces: &[Piece]) -> Result<(), Error> {
    let (mut at, mut curvature) = (0.0, 0.0);
    for (k, piece) in pieces.iter().enumerate() {
        let path = |key: &str| format!("{list}[{k}].{key}");
        check_length(&path("length"), piece.length)?;
        check_keys(piece, &path)?;
        let end = end_curvature(piece);
        if piece.kind != Kind::Clothoid && !same(curvature, end) {
            return Err(invalid(
                format!("{list}[{k}]"),
                format!(
                    "the curvature jumps from {} to {} at {at} m of the line; put a clothoid between",
                    shown(curvature),
                    shown(end)
                ),
            ));
        }
        curvature = end;
        at += piece.length;
    }
    if curvature != 0.0 {
        return Err(invalid(
            format!("{list}[{}]", pieces.len().saturating_sub(1)),
            format!(
                "the line ends with {}, but it continues straight; add a clothoid without to_radius",
                shown(curvature)
            ),
        ));
    }
    Ok(())
}

fn check_keys(piece: &Piece, path: &dyn Fn(&str) -> String) -> Result<(), Error> {
    for (key, radius, kind) in
        [("radius", piece.radius, Kind::Circle), ("to_radius", piece.to_radius, Kind::Clothoid)]
    {
        let Some(radius) = radius else { continue };
        if piece.kind != kind {
            let what = if kind == Kind::Circle { "circles" } else { "clothoids" };
            return Err(invalid(path(key), format!("only {what} have it")));
        }
        if !radius.is_finite() || radius.abs() < SMALLEST_RADIUS {
            return Err(invalid(
                path(key),
                format!("{radius} m is not a radius of at least {SMALLEST_RADIUS} m"),
            ));
        }
    }
    if piece.kind == Kind::Circle && piece.radius.is_none() {
        return Err(invalid(
            path("radius"),
            "a circle needs its radius (m), positive to the left or up",
        ));
    }
    Ok(())
}

fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= SAME * a.abs().max(b.abs())
}

fn shown(curvature: f64) -> String {
    if curvature == 0.0 {
        "straight".to_owned()
    } else {
        format!("a radius of {} m", 1.0 / curvature)
    }
}
