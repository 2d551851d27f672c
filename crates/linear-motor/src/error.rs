//! Errors of a motor's description and of its operation.

/// Errors of this crate.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The description is not JSON, or has a missing, unknown or ill-typed entry.
    #[error("motor, at `{path}`: {message}")]
    Json {
        /// Path of the entry within the document.
        path: String,
        /// Message of the JSON reader, with line and column.
        message: String,
    },
    /// An entry can be read, but its value is invalid.
    #[error("motor, `{path}`: {message}")]
    Invalid {
        /// Path of the entry.
        path: String,
        /// What is wrong, and what is needed.
        message: String,
    },
    /// The clearance has closed.
    #[error("the motor touches the reaction plate: its gap is {gap:.6} m")]
    Touches {
        /// Clearance, m.
        gap: f64,
    },
    /// The table of forces has no value there.
    #[error(
        "the {quantity} of {value} {unit} is outside the motor's table of forces, from {from} to {to} {unit}"
    )]
    Outside {
        /// The axis of the table.
        quantity: &'static str,
        /// Its unit of measure.
        unit: &'static str,
        /// The value.
        value: f64,
        /// First point of the axis.
        from: f64,
        /// Last point of the axis.
        to: f64,
    },
}

pub(crate) fn invalid(path: impl Into<String>, message: impl Into<String>) -> Error {
    Error::Invalid { path: path.into(), message: message.into() }
}
