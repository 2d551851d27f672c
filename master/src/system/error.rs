//! Why the parts of a scenario do not make a system.

use std::path::PathBuf;

use thiserror::Error;

use crate::description::{Causality, Type, UnitMismatch};
use crate::package::PackageError;
use crate::pattern::PatternError;

/// Why the parts of a scenario do not make a system.
#[derive(Debug, Error)]
pub enum SystemError {
    /// A unit cannot be opened.
    #[error("units.{name}: the unit cannot be used")]
    Package {
        /// Key in `units`.
        name: String,
        /// Why.
        #[source]
        source: PackageError,
    },
    /// A pattern cannot be expanded.
    #[error("{place}")]
    Pattern {
        /// JSON path.
        place: String,
        /// Why.
        #[source]
        source: PatternError,
    },
    /// A name that does not exist.
    #[error("{place}: there is no {what} \"{name}\"{}{}",
        within.as_ref().map(|w| format!(" in {w}")).unwrap_or_default(),
        suggestion.as_ref().map(|s| format!("; did you mean \"{s}\"?")).unwrap_or_default())]
    Unknown {
        /// JSON path.
        place: String,
        /// Kind of thing.
        what: &'static str,
        /// The name.
        name: String,
        /// Where it was looked for.
        within: Option<String>,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// A signal not written as `instance.variable`.
    #[error("{place}: \"{name}\" is not of the form instance.variable")]
    Form {
        /// JSON path.
        place: String,
        /// As written.
        name: String,
    },
    /// A file that a String names cannot be used.
    #[error("{place}: the file {path} for {port} cannot be used")]
    File {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// An instance name that cannot be addressed, or occurs twice.
    #[error("instances: the name \"{name}\" {why}")]
    InstanceName {
        /// The name.
        name: String,
        /// What is wrong with it.
        why: &'static str,
    },
    /// A connection from something that is no output, or to something that is no input.
    #[error("{place}: {port} is {}, not {wanted}", causality_name(*causality))]
    Causality {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// What it is.
        causality: Causality,
        /// What it should be.
        wanted: &'static str,
    },
    /// Types of a connection differ.
    #[error("{place}: {from} is of type {from_type}, {to} of type {to_type}")]
    Type {
        /// JSON path.
        place: String,
        /// Source.
        from: String,
        /// Its type.
        from_type: Type,
        /// Target.
        to: String,
        /// Its type.
        to_type: Type,
    },
    /// Units of measurement of a connection do not fit.
    #[error("{place}: the units of measurement of {from} and {to} do not fit")]
    Unit {
        /// JSON path.
        place: String,
        /// Source.
        from: String,
        /// Target.
        to: String,
        /// How they differ.
        #[source]
        source: UnitMismatch,
    },
    /// Two sources for one input.
    #[error("{place}: {to} is already fed by {first}")]
    DrivenTwice {
        /// JSON path of the second connection.
        place: String,
        /// The input.
        to: String,
        /// The source of the first connection.
        first: String,
    },
    /// A factor, an offset or a sum of what is no Real.
    #[error("{place}: factor, offset and sums need a Real input; {to} is of type {kind}")]
    NotLinear {
        /// JSON path.
        place: String,
        /// `instance.variable`
        to: String,
        /// Its type.
        kind: Type,
    },
    /// Two Enumerations that have nothing in common.
    #[error(
        "{place}: {from} and {to} have no item in common: {} and {}",
        from_items.join(", "), to_items.join(", ")
    )]
    NoCommonItem {
        /// JSON path.
        place: String,
        /// `instance.variable`
        from: String,
        /// Its items.
        from_items: Vec<String>,
        /// `instance.variable`
        to: String,
        /// Its items.
        to_items: Vec<String>,
    },
    /// An input with no source and no start value.
    #[error("{input} is not connected and has no start value")]
    Unconnected {
        /// `instance.variable`
        input: String,
    },
    /// A value that does not fit its variable's type.
    #[error("{place}: {value} is no value for {port}, which is of type {kind}")]
    Value {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value.
        value: String,
        /// The variable's type.
        kind: Type,
    },
    /// A value that an Enumeration does not have.
    #[error("{place}: {value} is no item of {port}, which has {}", items.join(", "))]
    NoItem {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value.
        value: String,
        /// Names and values of the items.
        items: Vec<String>,
    },
    /// A value outside of the range that the unit declares.
    #[error("{place}: {value} is outside of the range of {port}: {min} to {max}")]
    OutOfRange {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A variable that cannot be set.
    #[error("{place}: {port} cannot be set: {why}")]
    NotSettable {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// Why not.
        why: String,
    },
    /// A value for an input that a connection feeds.
    #[error("{place}: the value has no effect, because {port} is connected to {from}")]
    Idle {
        /// JSON path, or the option of the command line.
        place: String,
        /// The input.
        port: String,
        /// The output that feeds it.
        from: String,
    },
    /// A text where only numbers can be drawn.
    #[error("{place}: {port} is a String, which cannot be drawn")]
    NotNumeric {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
    },
    /// Something that should be exchanged between units and is not.
    #[error("{place}: {port} is no Real output that feeds an input")]
    NotExchanged {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
    },
    /// A setting that concerns nothing.
    #[error("{place}: \"{pattern}\" matches nothing")]
    NoMatch {
        /// JSON path.
        place: String,
        /// As written.
        pattern: String,
    },
}

pub(super) fn causality_name(causality: Causality) -> &'static str {
    match causality {
        Causality::Parameter => "a parameter",
        Causality::CalculatedParameter => "a calculated parameter",
        Causality::Input => "an input",
        Causality::Output => "an output",
        Causality::Local => "a local variable",
        Causality::Independent => "the time",
    }
}
