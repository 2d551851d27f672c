//! Errors of a guideway's description, files and steps. Every message says what failed, where, and
//! how to fix it.

use std::path::PathBuf;

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The description is not JSON, or has a missing, unknown or ill-typed entry.
    #[error("guideway description, at `{path}`: {message}")]
    Json {
        /// Path of the entry within the document, e.g. `girders.standard.length`.
        path: String,
        /// Message of the JSON reader, with line and column.
        message: String,
    },
    /// An entry can be read, but its value is invalid.
    #[error("guideway, `{path}`: {found}; {remedy}")]
    Invalid {
        /// Path of the entry within the description.
        path: String,
        /// What is wrong.
        found: String,
        /// What is needed.
        remedy: String,
    },
    /// A profile file cannot be opened or read.
    #[error("irregularity file {}: {source}; give a readable CSV file with two columns x, z in metres", path.display())]
    ProfileFile {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A line of a profile file cannot be used.
    #[error(
        "irregularity profile, line {line}: {found}; need two finite numbers x, z (m), with x increasing from line to line"
    )]
    ProfileLine {
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it.
        found: String,
    },
    /// A line of a file with mode shapes cannot be used.
    #[error(
        "shapes file {file}, line {line}: {found}; need columns x (m), phi_1, phi_2 ... of finite numbers with decimal points, with x increasing from line to line"
    )]
    ShapesLine {
        /// Name of the file.
        file: String,
        /// Line number, from 1.
        line: usize,
        /// What is wrong with it.
        found: String,
    },
    /// A step of no, negative or non-finite size.
    #[error("at t = {time} s: step size {step} s; the step must be positive and finite")]
    StepSize {
        /// Start of the step (s).
        time: f64,
        /// Requested size (s).
        step: f64,
    },
    /// The loads move so far, or the chirp oscillates so fast, that the step cannot be resolved.
    #[error(
        "at t = {time} s: a step of {step} s would need {needed:.3e} internal sub-steps (limit {limit}); make the step smaller, or check speed and positions"
    )]
    TooManySubsteps {
        /// Start of the step (s).
        time: f64,
        /// Requested size (s).
        step: f64,
        /// Sub-steps that resolve the motion.
        needed: f64,
        /// Largest number of sub-steps.
        limit: u32,
    },
    /// A further force, or its position, is not a number.
    #[error("at t = {time} s: the external force or its position is {value}; it must be finite")]
    PointForce {
        /// Start of the step (s).
        time: f64,
        /// The value that is not finite.
        value: f64,
    },
    /// A force or position of a load is not a number.
    #[error("at t = {time} s: {quantity} of magnet {magnet} is {value}; it must be finite")]
    Load {
        /// Start of the step (s).
        time: f64,
        /// "force", "position" or "lateral force".
        quantity: &'static str,
        /// Number of the magnet, from 1.
        magnet: usize,
        /// The value that is not finite.
        value: f64,
    },
}

impl Error {
    /// An [`Error::Invalid`].
    pub(crate) fn invalid(
        path: impl Into<String>,
        found: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Invalid { path: path.into(), found: found.into(), remedy: remedy.into() }
    }
}
