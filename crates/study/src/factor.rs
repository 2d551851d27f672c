//! Factors: what varies from point to point.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{Distribution, Targets};

/// What varies from point to point, and by how much. A factor has `values`, a `range`, a `distribution` or `seeds`; in a
/// study with a table of points it has none of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// What it changes.
    pub target: Targets,
    /// Its values, one by one: numbers, true, false or texts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub values: Option<Vec<FactorValue>>,
    /// Evenly spaced values.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range: Option<Range>,
    /// A distribution that samples take values of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distribution: Option<Distribution>,
    /// Number of seeds. Every combination of the other factors is computed with so many of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1))]
    pub seeds: Option<u64>,
    /// For `seeds`: whether all combinations get the same seeds, which compares them on the same tracks. Otherwise each
    /// gets its own.
    #[serde(default, skip_serializing_if = "is_false")]
    pub common: bool,
    /// Number by which the value is multiplied for the target, such as 0.2777777777777778 for km/h. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Unit of measure of its values, for tables and pictures.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Title in tables and pictures. Default: its name.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub title: String,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_false(flag: &bool) -> bool {
    !*flag
}

/// Evenly spaced values.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// First value.
    pub from: f64,
    /// Last value.
    pub to: f64,
    /// Number of values. A sample that is not a grid takes any value between the ends.
    #[schemars(range(min = 1))]
    pub count: u64,
    /// Whether the values or their logarithms are evenly spaced.
    #[serde(default)]
    pub spacing: Spacing,
}

/// How the values of a range are spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Spacing {
    /// Equal differences.
    #[default]
    Linear,
    /// Equal ratios.
    Log,
}

/// A value of a factor: a number, true, false or a text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, true, false or a text")]
pub enum FactorValue {
    /// True or false.
    Boolean(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

impl fmt::Display for FactorValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Boolean(value) => write!(f, "{value}"),
            Self::Integer(value) => write!(f, "{value}"),
            // the shortest text that reads back to the same number
            Self::Number(value) => f.write_str(ryu::Buffer::new().format(*value)),
            Self::Text(value) => f.write_str(value),
        }
    }
}

impl FactorValue {
    /// The value of a field of a table.
    pub(crate) fn of_text(text: &str) -> Self {
        match text {
            "true" => Self::Boolean(true),
            "false" => Self::Boolean(false),
            _ => match (text.parse::<i64>(), text.parse::<f64>()) {
                (Ok(whole), _) => Self::Integer(whole),
                (_, Ok(number)) if number.is_finite() => Self::Number(number),
                _ => Self::Text(text.to_owned()),
            },
        }
    }

    /// The number, if it is one.
    #[must_use]
    pub fn number(&self) -> Option<f64> {
        match *self {
            Self::Integer(value) => Some(value as f64),
            Self::Number(value) => Some(value),
            Self::Boolean(_) | Self::Text(_) => None,
        }
    }
}

impl Factor {
    /// What is wrong with its keys: the key, and the problem. `in_table`: the study has a table of points.
    pub(crate) fn fault(&self, in_table: bool) -> Option<(&'static str, String)> {
        let given = [
            ("values", self.values.is_some()),
            ("range", self.range.is_some()),
            ("distribution", self.distribution.is_some()),
            ("seeds", self.seeds.is_some()),
        ];
        let mut given = given.into_iter().filter(|(_, given)| *given).map(|(key, _)| key);
        if self.target.all().is_empty() {
            return Some(("target", "empty; name at least one".to_owned()));
        }
        match (given.next(), given.next(), in_table) {
            (Some(first), Some(second), _) => {
                return Some((
                    second,
                    format!("given together with \"{first}\"; give one of them"),
                ));
            }
            (Some(key), None, true) if key != "seeds" => {
                return Some((key, "the table of points has the values; leave it out".to_owned()));
            }
            (None, _, false) => {
                let problem = "missing; give \"values\", \"range\", \"distribution\" or \"seeds\"";
                return Some(("values", problem.to_owned()));
            }
            _ => {}
        }
        if self.values.as_ref().is_some_and(Vec::is_empty) {
            return Some(("values", "empty; give at least one value".to_owned()));
        }
        if let Some(values) = &self.values
            && let Some(k) = (1..values.len()).find(|&k| values[..k].contains(&values[k]))
        {
            return Some(("values", format!("{} occurs twice", values[k])));
        }
        if self.seeds == Some(0) {
            return Some(("seeds", "0; give 1 or more".to_owned()));
        }
        if self.common && self.seeds.is_none() {
            return Some(("common", "only for \"seeds\"".to_owned()));
        }
        if let Some(scale) = self.scale.filter(|it| !it.is_finite() || *it == 0.0) {
            return Some(("scale", format!("{scale} is not a number other than 0")));
        }
        if let Some(fault) = self.range.and_then(Range::fault) {
            return Some(("range", fault));
        }
        self.distribution.and_then(|it| it.fault()).map(|fault| ("distribution", fault))
    }

    /// Number of values in a grid. `None` of a distribution.
    pub(crate) fn levels(&self) -> Option<u64> {
        match (&self.values, self.range, self.seeds) {
            (Some(values), ..) => Some(values.len() as u64),
            (_, Some(range), _) => Some(range.count),
            (.., seeds) => seeds,
        }
    }

    /// The value of a level of a grid.
    pub(crate) fn level(&self, k: u64) -> Option<FactorValue> {
        match (&self.values, self.range) {
            (Some(values), _) => usize::try_from(k).ok().and_then(|k| values.get(k).cloned()),
            (_, Some(range)) => Some(FactorValue::Number(range.level(k))),
            _ => None,
        }
    }

    /// The value at a probability, 0 < u < 1.
    pub(crate) fn quantile(&self, u: f64) -> Option<FactorValue> {
        match (&self.values, self.range, self.distribution) {
            (Some(values), ..) => {
                let k = ((u * values.len() as f64) as usize).min(values.len().saturating_sub(1));
                values.get(k).cloned()
            }
            (_, Some(range), _) => Some(FactorValue::Number(range.between(u))),
            (.., Some(law)) => Some(FactorValue::Number(law.quantile(u))),
            _ => None,
        }
    }
}

impl Range {
    fn fault(self) -> Option<String> {
        let Self { from, to, count, spacing } = self;
        if !(from.is_finite() && to.is_finite()) {
            return Some(format!("from {from} to {to} is not finite"));
        }
        if count == 0 || (count > 1 && from == to) {
            return Some(format!("{count} values from {from} to {to} do not differ"));
        }
        (spacing == Spacing::Log && !(from > 0.0 && to > 0.0))
            .then(|| format!("a log range needs positive ends, not {from} and {to}"))
    }

    fn level(self, k: u64) -> f64 {
        let last = self.count.saturating_sub(1);
        // the ends are exact
        match k {
            0 => self.from,
            k if k == last => self.to,
            k => self.between(k as f64 / last as f64),
        }
    }

    fn between(self, u: f64) -> f64 {
        let Self { from, to, .. } = self;
        match self.spacing {
            Spacing::Linear => from + u * (to - from),
            Spacing::Log => from * (u * (to / from).ln()).exp(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Factor {
        serde_json::from_str(&format!(r#"{{"target": "a.x", {text}}}"#)).unwrap()
    }

    #[test]
    fn analytic_ranges_are_even_and_their_ends_exact() {
        let factor = read(r#""range": {"from": 0.1, "to": 0.7, "count": 4}"#);
        let values: Vec<f64> = (0..4).map(|k| factor.level(k).unwrap().number().unwrap()).collect();
        assert_eq!((values[0], values[3]), (0.1, 0.7));
        assert!((values[1] - 0.3).abs() < 1e-15 && (values[2] - 0.5).abs() < 1e-15);
        let factor = read(r#""range": {"from": 1, "to": 1000, "count": 4, "spacing": "log"}"#);
        let value = factor.level(2).unwrap().number().unwrap();
        assert!((value - 100.0).abs() < 1e-10 && factor.levels() == Some(4));
        let factor = read(r#""values": [1, 2.5, "jacobi", true]"#);
        let at = |u: f64| factor.quantile(u).unwrap().to_string();
        assert_eq!([at(0.1), at(0.3), at(0.6), at(0.99)], ["1", "2.5", "jacobi", "true"]);
    }

    #[test]
    fn refusal_keys_that_do_not_fit_are_named() {
        for (text, table, key, part) in [
            (r#""unit": "m""#, false, "values", "missing"),
            (r#""values": []"#, false, "values", "empty"),
            (r#""values": [1, 2, 1]"#, false, "values", "1 occurs twice"),
            (r#""values": [1], "seeds": 2"#, false, "seeds", "together with \"values\""),
            (r#""values": [1]"#, true, "values", "leave it out"),
            (r#""seeds": 0"#, false, "seeds", "1 or more"),
            (r#""values": [1], "common": true"#, false, "common", "only for"),
            (r#""values": [1], "scale": 0"#, false, "scale", "0 is not"),
            (r#""range": {"from": 1, "to": 1, "count": 2}"#, false, "range", "do not differ"),
            (
                r#""range": {"from": 0, "to": 1, "count": 2, "spacing": "log"}"#,
                false,
                "range",
                "positive ends",
            ),
        ] {
            let (found, problem) = read(text).fault(table).unwrap();
            assert!(found == key && problem.contains(part), "{text}: {found}: {problem}");
        }
        assert_eq!(read(r#""unit": "m""#).fault(true), None);
    }
}
