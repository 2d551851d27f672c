//! Signals that flow between instances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Signals that flow from one unit to others.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// `instance.output`, patterns allowed; or a list of these, whose sum the inputs take.
    pub from: Sources,
    /// `instance.input`, or several; each stands for as many signals as `from`, or `from` is one
    /// signal that feeds all.
    pub to: Targets,
    /// Degree of the extrapolation for these targets instead of `algorithm.extrapolation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 3))]
    pub extrapolation: Option<u8>,
    /// The input is factor · source + offset, in the input's unit of measurement. For Real inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Added to the input, in its unit of measurement. For Real inputs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// Connect values as they are, whatever their units of measurement.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ignore_units: bool,
    /// A remark, not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// One or several sources of a connection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.output\", or a list of these and of { \"signal\", \"factor\" }"
)]
pub enum Sources {
    /// One source.
    One(String),
    /// Several: inputs take their sum.
    Sum(Vec<Term>),
}

/// One source of a sum.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.output\", or { \"signal\": \"instance.output\", \"factor\": 2 }"
)]
pub enum Term {
    /// `instance.output`, patterns allowed.
    Plain(String),
    /// The same with a factor of its own.
    Weighted(WeightedTerm),
}

/// A source of a sum with a factor of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeightedTerm {
    /// `instance.output`, patterns allowed.
    pub signal: String,
    /// Multiplies it.
    pub factor: f64,
}

impl Sources {
    /// The terms of the sum: names and factors.
    pub fn terms(&self) -> impl Iterator<Item = (&str, f64)> {
        let (one, several) = match self {
            Self::One(name) => (Some((name.as_str(), 1.0)), &[][..]),
            Self::Sum(terms) => (None, terms.as_slice()),
        };
        one.into_iter().chain(several.iter().map(|term| match term {
            Term::Plain(name) => (name.as_str(), 1.0),
            Term::Weighted(term) => (term.signal.as_str(), term.factor),
        }))
    }
}

/// One or several targets of a connection.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"instance.input\" or a list of these")]
pub enum Targets {
    /// One target.
    One(String),
    /// Several.
    Many(Vec<String>),
}

impl Targets {
    /// All targets.
    #[must_use]
    pub fn as_slice(&self) -> &[String] {
        match self {
            Self::One(target) => std::slice::from_ref(target),
            Self::Many(targets) => targets,
        }
    }
}
