//! Errors in what a scenario describes.

use std::io::ErrorKind;
use std::path::PathBuf;

use thiserror::Error;

use fmi2_conformance::Defects;
use fmi2_derive::DeriveError;
use fmi2_import::archive::ArchiveError;
use fmi2_import::description::{Causality, Type, UnitMismatch};
use fmi2_import::package::PackageError;
use patterns::PatternError;
use scenario::table::TableError;
use sources::SourceError;

/// A kind of thing that a scenario names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Named {
    /// An FMU, under `units`.
    Fmu,
    /// An instance of an FMU.
    Instance,
    /// A variable of an instance.
    Variable,
    /// A category of debug messages.
    LogCategory,
}

impl std::fmt::Display for Named {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Fmu => "unit",
            Self::Instance => "instance",
            Self::Variable => "variable",
            Self::LogCategory => "log category",
        })
    }
}

/// An error in what a scenario describes.
#[derive(Debug, Error)]
pub enum SystemError {
    /// A unit cannot be opened, or cannot get other resources.
    #[error("units.{name}: cannot use this unit")]
    Package {
        /// Key in `units`.
        name: String,
        /// What is wrong with the .fmu file or the resources.
        #[source]
        source: DeriveError,
    },
    /// Defects of a unit in a strict run.
    #[error("units.{name}: cannot use this unit")]
    Defects {
        /// Key in `units`.
        name: String,
        /// All of them.
        #[source]
        source: Defects,
    },
    /// A pattern cannot be expanded.
    #[error("{place}")]
    Pattern {
        /// JSON path.
        place: String,
        /// What is wrong with the pattern.
        #[source]
        source: PatternError,
    },
    /// A name that does not exist.
    #[error("{place}: there is no {what} \"{name}\"{}{}",
        within.as_ref().map(|w| format!(" in {w}")).unwrap_or_default(),
        did_you_mean(suggestion.as_ref()))]
    Unknown {
        /// JSON path.
        place: String,
        /// Kind of thing.
        what: Named,
        /// The name as the scenario writes it.
        name: String,
        /// Where it was looked for.
        within: Option<String>,
        /// A similar name.
        suggestion: Option<String>,
    },
    /// A signal that is not written as `instance.variable`.
    #[error("{place}: \"{name}\" is not of the form instance.variable")]
    Form {
        /// JSON path.
        place: String,
        /// As written.
        name: String,
    },
    /// The file that a String names cannot be used.
    #[error("{place}: cannot use the file {path} for {port}")]
    File {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// Path of the file, as it was given.
        path: PathBuf,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// An invalid or duplicate instance name.
    #[error("instances: the name \"{name}\" {why}")]
    InstanceName {
        /// The name as the scenario writes it.
        name: String,
        /// What is wrong with the name, in words.
        why: &'static str,
    },
    /// A connection that does not start at an output, or does not end at an input.
    #[error("{place}: {port} is {}, not {wanted}", causality_name(*causality))]
    Causality {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The variable's causality.
        causality: Causality,
        /// What the place requires, with its article, such as `an input`.
        wanted: &'static str,
    },
    /// The types of a connection's ends do not fit.
    #[error("{place}: {from} is of type {from_type}, {to} of type {to_type}")]
    Type {
        /// JSON path.
        place: String,
        /// Source.
        from: String,
        /// Data type of the source.
        from_type: Type,
        /// Target.
        to: String,
        /// Data type of the target.
        to_type: Type,
    },
    /// The units of measurement of a connection's ends do not fit.
    #[error("{place}: the units of measurement of {from} and {to} are incompatible")]
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
    #[error("{place}: {to} is already connected to {first}")]
    DrivenTwice {
        /// JSON path of the second connection.
        place: String,
        /// The input, `instance.variable`.
        to: String,
        /// The source of the first connection.
        first: String,
    },
    /// A factor, an offset or a sum at an input that is not Real.
    #[error("{place}: factor, offset and sums need a Real input, but {to} is of type {kind}")]
    NotLinear {
        /// JSON path.
        place: String,
        /// `instance.variable`
        to: String,
        /// Data type of the variable.
        kind: Type,
    },
    /// `kinks` between variables that have no slope.
    #[error("{place}: kinks is for connections of a Real to a Real, not for {from} to {to}")]
    NoKinks {
        /// JSON path.
        place: String,
        /// `instance.variable`
        from: String,
        /// `instance.variable`
        to: String,
    },
    /// Enumerations or a table that do not fit.
    #[error("{place}: from {from} to {to}: {source}")]
    Map {
        /// JSON path of the connection.
        place: String,
        /// `instance.variable`
        from: String,
        /// `instance.variable`
        to: String,
        /// What does not fit.
        source: TableError,
    },
    /// An input without a source and without a start value.
    #[error("{input} is not connected and has no start value")]
    Unconnected {
        /// `instance.variable`
        input: String,
    },
    /// A value that does not fit its variable's type.
    #[error("{place}: {value} is not a valid {kind} for {port}")]
    Value {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value as the scenario or the command line gives it.
        value: String,
        /// The variable's type.
        kind: Type,
    },
    /// An item that an Enumeration does not have.
    #[error("{place}: {value} is not an item of {port}, which has {}", items.join(", "))]
    NoItem {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
        /// The value as the scenario or the command line gives it.
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
        /// The value as the scenario or the command line gives it.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// A pattern for one number that stands for quantities of several kinds.
    #[error(
        "{place}: \"{pattern}\" matches signals of different units of measurement: {first} and {other}"
    )]
    MixedUnits {
        /// JSON path.
        place: String,
        /// The pattern.
        pattern: String,
        /// `instance.variable (unit)`
        first: String,
        /// The first one with another unit of measurement.
        other: String,
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
    /// A signal over time that cannot be used.
    #[error("{place}")]
    Source {
        /// JSON path.
        place: String,
        /// What is wrong with it.
        #[source]
        source: SourceError,
    },
    /// A value for a connected input.
    #[error("{place}: the value has no effect, because {port} is connected to {from}")]
    Unused {
        /// JSON path, or the option of the command line.
        place: String,
        /// The input, `instance.variable`.
        port: String,
        /// The output that feeds it.
        from: String,
    },
    /// A String in a plot.
    #[error("{place}: {port} is a String, which cannot be plotted")]
    NotNumeric {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
    },
    /// A signal that is not exchanged between units, but should be.
    #[error("{place}: {port} is not a connected Real output")]
    NotExchanged {
        /// JSON path.
        place: String,
        /// `instance.variable`
        port: String,
    },
    /// A pattern without a match.
    #[error("{place}: \"{pattern}\" matches nothing{}", did_you_mean(suggestion.as_ref()))]
    NoMatch {
        /// JSON path.
        place: String,
        /// The pattern, with its ranges expanded.
        pattern: String,
        /// A similar pattern that matches something.
        suggestion: Option<String>,
    },
}

impl SystemError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        Some(match self {
            Self::Package { source, .. } => match source {
                DeriveError::Package(PackageError::Archive {
                    source: ArchiveError::Open(error),
                    ..
                }) if error.kind() != ErrorKind::IsADirectory => {
                    "check the path, which is relative to the scenario, and that the unit has been built"
                }
                _ => return source.help(),
            },
            Self::Defects { source, .. } => source.help(),
            Self::Unknown { what: Named::Variable, .. } => {
                "`maglev inspect UNIT.fmu` lists the variables of a unit"
            }
            Self::Unknown { what: Named::Instance, .. } => {
                "instances are named under \"instances\" in the scenario"
            }
            Self::Unit { source, .. } => match source {
                UnitMismatch::Dimension { .. } => "connect quantities of the same kind",
                UnitMismatch::Undefined { .. } => {
                    "the unit's description should define its units of measurement; \
                     \"ignore_units\": true in the connection passes values without conversion"
                }
            },
            Self::Unconnected { .. } => {
                "connect it, or give it a value under \"start\" of its instance"
            }
            Self::Unused { .. } => {
                "set the variables that the output is computed from, or remove the connection or \
                 the value"
            }
            Self::Source { source, .. } => return source.help(),
            Self::DrivenTwice { .. } => {
                "remove one of the connections, or use one connection whose \"from\" is a list, \
                 which is a sum"
            }
            Self::Type { .. } => {
                "connections convert numbers and Booleans to Reals, Integers, Enumerations and Booleans to \
                 Integers, and Integers to Enumerations; other conversions need a unit in between"
            }
            Self::NoKinks { .. } => "leave it out: other values jump, and are held over each step",
            Self::NotLinear { .. } => "leave them out, or compute the value in a unit in between",
            Self::Map { source, .. } => return source.help(),
            Self::Causality { .. } => "connections go from an output to an input",
            Self::Pattern { .. } => {
                "both sides of a connection must match the same number of signals, or the source one"
            }
            Self::File { .. } => {
                "paths of the form {\"path\": \"...\"} are relative to the scenario file that they are in"
            }
            Self::MixedUnits { .. } => {
                "`*` takes any text: use a range such as gap_[01..08], or an entry for each kind of signal"
            }
            Self::Form { .. } => "write instance.variable, such as motor.speed",
            _ => return None,
        })
    }
}

fn did_you_mean(suggestion: Option<&String>) -> String {
    suggestion.map(|name| format!("; did you mean \"{name}\"?")).unwrap_or_default()
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
