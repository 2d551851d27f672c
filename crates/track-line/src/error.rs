//! Errors of a line's description and of places on it.

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The description is not JSON, or has a missing, unknown or ill-typed entry.
    #[error("line, at `{path}`: {message}")]
    Json {
        /// Path of the entry within the document.
        path: String,
        /// Message of the JSON reader, with line and column.
        message: String,
    },
    /// An entry can be read, but its value is invalid.
    #[error("line, `{path}`: {message}")]
    Invalid {
        /// Path of the entry.
        path: String,
        /// What is wrong, and what is needed.
        message: String,
    },
    /// A point has no place on the line: it lies beyond the centre of the curvature.
    #[error(
        "the point ({x:.3}, {y:.3}, {z:.3}) m has no place on the line near s = {near:.3} m: it is too far \
         from the line for the line's curvature"
    )]
    NoPlace {
        /// Coordinates of the point, m.
        x: f64,
        /// Left.
        y: f64,
        /// Up.
        z: f64,
        /// Where the search ended, m.
        near: f64,
    },
}
