//! Connections between instances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::table::Table;

/// A connection from outputs to inputs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Connection {
    /// `instance.output`, patterns allowed. A list: the inputs receive the sum.
    pub from: Sources,
    /// `instance.input`, patterns allowed, or a list of these. Each names as many inputs as `from` names outputs, or
    /// `from` is a single output that feeds all inputs.
    pub to: Targets,
    /// Degree of the extrapolation for these inputs. Default: `algorithm.extrapolation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 3))]
    pub extrapolation: Option<u8>,
    /// The slopes of these signals jump at communication points, as the acceleration does under a sampled
    /// controller: no polynomial uses data from before the beginning of its step but the value. For Reals only.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub kinks: bool,
    /// The input is factor · source + offset, in the input's unit of measurement. For Real inputs only. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<f64>,
    /// Added to the input, in its unit of measurement. For Real inputs only. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// Values that the input receives instead of others, from Boolean to Boolean or between Integers and Enumerations:
    /// `{ "off": "standby" }`, `{ "1": 3 }`, `{ "true": false, "false": true }`. Other values pass as without it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<Table>,
    /// Pass values on without converting or comparing their units of measurement.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ignore_units: bool,
    /// A comment, ignored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comment: Option<String>,
}

/// The source of a connection, or several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected \"instance.output\", or a list of these and of { \"signal\", \"factor\" }"
)]
pub enum Sources {
    /// One source.
    One(String),
    /// Several. The inputs receive their sum.
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
    /// An output with a factor.
    Weighted(WeightedTerm),
}

/// A source of a sum, with a factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WeightedTerm {
    /// `instance.output`, patterns allowed.
    pub signal: String,
    /// Multiplies the signal.
    pub factor: f64,
}

impl Sources {
    /// The terms of the sum: pattern and factor.
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

/// The target of a connection, or several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"instance.input\" or a list of these")]
pub enum Targets {
    /// One target.
    One(String),
    /// Several targets. Each receives the signals of the source.
    Many(Vec<String>),
}

impl Targets {
    /// The targets as a list, also when there is one.
    #[must_use]
    pub fn as_slice(&self) -> &[String] {
        match self {
            Self::One(target) => std::slice::from_ref(target),
            Self::Many(targets) => targets,
        }
    }
}
