//! The definition of a figure with its bounds.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Bound;

/// A figure of recorded signals, or a quantity of the system, with optional bounds. It is computed from the recorded
/// values after the run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Metric {
    /// Title in tables. Default: the name.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub title: String,
    /// Signal `instance.variable`; ranges and `*` allowed. Of several signals the worst one counts: the one closest to a
    /// bound, or without bounds the largest value, with `min` the smallest. Give either this or `quantity`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<String>,
    /// What is computed of each signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub figure: Option<Figure>,
    /// A quantity of the system instead of a signal.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quantity: Option<Quantity>,
    /// Start of the time that counts (s). Default: the start of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub from: Option<f64>,
    /// End of the time that counts (s). Default: the end of the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub to: Option<f64>,
    /// Value that is subtracted from the signal first, in the signal's SI unit. Default 0; of `settling_time` the last
    /// value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<f64>,
    /// For `percentile`: the percentage of the time, 0 to 100.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub percentile: Option<f64>,
    /// For `settling_time`: the largest deviation from `reference` that counts as settled, in the signal's SI unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub band: Option<f64>,
    /// What the figure is divided by: a number, `"span_length"` (of the span that the signal belongs to) or `"speed"` (of
    /// the train). Default: 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<Over>,
    /// Largest allowed value. Default: no upper bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<Bound>,
    /// Smallest allowed value. Default: no lower bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<Bound>,
    /// Where the bound comes from: standard and clause, paper, or whose choice it is.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// How the figure relates to the source, where they differ.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// Whether a run that cannot be judged by it passes nevertheless, for example because it recorded no such signal.
    #[serde(skip_serializing_if = "is_false")]
    pub optional: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
pub(crate) fn is_false(flag: &bool) -> bool {
    !*flag
}

/// A figure of one signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Figure {
    /// Largest value.
    Max,
    /// Smallest value.
    Min,
    /// Largest magnitude.
    MaxAbs,
    /// Largest minus smallest value.
    PeakToPeak,
    /// Mean over time.
    Mean,
    /// Root mean square over time.
    Rms,
    /// Standard deviation over time.
    StandardDeviation,
    /// Value that the signal does not exceed for `percentile` per cent of the time.
    Percentile,
    /// Time from `from` until the signal stays within `band` of `reference` (s).
    SettlingTime,
    /// Last value.
    Final,
}

/// A quantity of the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// First natural frequency of the empty girder times the length of its span, f₁·L (m/s), of each span.
    FrequencyTimesSpan,
    /// Smallest damping ratio of the coupled modes at the start of the run, without those in which only a girder moves.
    /// It needs modes.json: `maglev check --modes`.
    LeastDampingRatio,
    /// The same of the system as it is stepped.
    LeastDampingRatioAsStepped,
    /// Vibration total value of ISO 2631-1 (m/s²), of each point of `ride_quality`.
    VibrationTotal,
    /// Sperling's index, of each point and direction of `ride_quality`.
    SperlingIndex,
}

/// A divisor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, \"span_length\" or \"speed\"")]
pub enum Over {
    /// A number in SI units.
    Number(f64),
    /// A property of the run.
    Named(OverName),
}

/// A divisor that the run has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OverName {
    /// Distance between the supports (m) on both sides of the point that the signal belongs to.
    SpanLength,
    /// Largest speed of the train in the run (m/s).
    Speed,
}

/// Why a definition is invalid.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{key}: {problem}")]
pub struct MetricError {
    /// The key within the definition.
    pub key: &'static str,
    /// What is wrong and what is allowed.
    pub problem: String,
}

impl Metric {
    /// Whether it has a bound.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.max.is_some() || self.min.is_some()
    }

    /// Checks what the types cannot express.
    ///
    /// # Errors
    /// The first key that does not fit.
    pub fn check(&self, name: &str) -> Result<(), MetricError> {
        let wrong = |key, problem: String| Err(MetricError { key, problem });
        let plain = |c: char| c.is_alphanumeric() || "_-. ".contains(c);
        if name.is_empty() || !name.chars().all(plain) {
            return wrong("name", format!("\"{name}\" must be letters, digits, _ - . and blanks"));
        }
        match (&self.signal, self.figure, self.quantity) {
            (None, _, None) => {
                return wrong("signal", "missing; give \"signal\" or \"quantity\"".to_owned());
            }
            (Some(_), _, Some(_)) => {
                return wrong("quantity", "give either \"signal\" or \"quantity\"".to_owned());
            }
            (Some(_), None, None) => {
                return wrong("figure", "missing; a signal needs one, such as \"max\"".to_owned());
            }
            _ => {}
        }
        for (key, given) in [
            ("figure", self.figure.is_some()),
            ("from", self.from.is_some()),
            ("to", self.to.is_some()),
            ("reference", self.reference.is_some()),
        ] {
            if given && self.quantity.is_some() {
                return wrong(key, "a quantity has none; it is for signals".to_owned());
            }
        }
        self.check_numbers().map_or(Ok(()), |(key, problem)| wrong(key, problem))
    }

    /// The first number that does not fit, with the reason.
    fn check_numbers(&self) -> Option<(&'static str, String)> {
        let of = |figure| self.figure == Some(figure);
        match (self.percentile, of(Figure::Percentile)) {
            (None, true) => return Some(("percentile", "missing; 0 to 100".to_owned())),
            (Some(_), false) => {
                return Some(("percentile", "only for \"figure\": \"percentile\"".to_owned()));
            }
            (Some(it), true) if !(0.0..=100.0).contains(&it) => {
                return Some(("percentile", format!("{it} is not between 0 and 100")));
            }
            _ => {}
        }
        match (self.band, of(Figure::SettlingTime)) {
            (None, true) => return Some(("band", "missing; a positive number".to_owned())),
            (Some(_), false) => {
                return Some(("band", "only for \"figure\": \"settling_time\"".to_owned()));
            }
            (Some(it), true) if !(it > 0.0 && it.is_finite()) => {
                return Some(("band", format!("{it} is not a positive number")));
            }
            _ => {}
        }
        for (key, value) in [
            ("from", self.from),
            ("to", self.to),
            ("reference", self.reference),
            ("max", self.max.map(|it| it.value)),
            ("min", self.min.map(|it| it.value)),
        ] {
            if let Some(value) = value.filter(|it| !it.is_finite()) {
                return Some((key, format!("{value} is not a finite number")));
            }
        }
        if let (Some(from), Some(to)) = (self.from, self.to)
            && from > to
        {
            return Some(("from", format!("{from} is after \"to\", {to}")));
        }
        if let (Some(max), Some(min)) = (self.max, self.min)
            && min.value > max.value
        {
            return Some(("min", format!("{} is above \"max\", {}", min.value, max.value)));
        }
        match self.over {
            Some(Over::Number(it)) if !(it > 0.0 && it.is_finite()) => {
                Some(("over", format!("{it} is not a positive number")))
            }
            Some(Over::Named(OverName::SpanLength)) if self.signal.is_none() => {
                Some(("over", "\"span_length\" is for signals".to_owned()))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refusal_keys_that_do_not_fit_are_named() {
        for (text, key, part) in [
            (r#"{}"#, "signal", "or \"quantity\""),
            (r#"{"signal": "a.x"}"#, "figure", "needs one"),
            (r#"{"signal": "a.x", "quantity": "sperling_index"}"#, "quantity", "either"),
            (r#"{"quantity": "sperling_index", "from": 1}"#, "from", "for signals"),
            (r#"{"quantity": "sperling_index", "over": "span_length"}"#, "over", "for signals"),
            (r#"{"signal": "a.x", "figure": "percentile"}"#, "percentile", "missing"),
            (
                r#"{"signal": "a.x", "figure": "percentile", "percentile": 101}"#,
                "percentile",
                "101 is not between 0 and 100",
            ),
            (r#"{"signal": "a.x", "figure": "max", "percentile": 1}"#, "percentile", "only for"),
            (r#"{"signal": "a.x", "figure": "settling_time"}"#, "band", "missing"),
            (r#"{"signal": "a.x", "figure": "settling_time", "band": 0}"#, "band", "0 is not"),
            (r#"{"signal": "a.x", "figure": "max", "band": 1}"#, "band", "only for"),
            (r#"{"signal": "a.x", "figure": "max", "from": 2, "to": 1}"#, "from", "2 is after"),
            (r#"{"signal": "a.x", "figure": "max", "over": -1}"#, "over", "-1 is not"),
            (r#"{"signal": "a.x", "figure": "max", "max": 1, "min": 2}"#, "min", "2 is above"),
        ] {
            let error = serde_json::from_str::<Metric>(text).unwrap().check("m").unwrap_err();
            assert_eq!(error.key, key, "{text}");
            assert!(error.problem.contains(part), "{text}: {error}");
        }
        let plain: Metric = serde_json::from_str(r#"{"signal": "a.x", "figure": "max"}"#).unwrap();
        assert!(plain.check("a.b-c d_1").is_ok());
        assert_eq!(plain.check("a/b").unwrap_err().key, "name");
        assert_eq!(plain.check("").unwrap_err().key, "name");
    }
}
