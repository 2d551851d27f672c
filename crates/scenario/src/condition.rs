//! Conditions on signals, for events and for the end of a run.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A condition on a signal: exactly one of `above`, `below`, `rising` and `falling`. The time at which it becomes true
/// is located within a step, if the units can save their states and vary their steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// `instance.variable`, patterns allowed that match signals of one unit of measurement. Of several signals, the first
    /// one that meets the condition counts. Values are in the variable's own unit of measurement; true is 1.
    pub signal: String,
    /// True while the signal is greater than this value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<f64>,
    /// True while the signal is less than this value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
    /// True when the signal passes this value upwards: it was at most as large before, and is greater now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rising: Option<f64>,
    /// True when the signal passes this value downwards: it was at least as large before, and is less now.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub falling: Option<f64>,
    /// Time from which on the condition is checked (s). Default: from the start of the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub after: Option<f64>,
}

/// How a signal is compared with a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Comparison {
    /// Greater than the limit.
    Above,
    /// Less than the limit.
    Below,
    /// Greater now, and not greater before.
    Rising,
    /// Less now, and not less before.
    Falling,
}

impl Comparison {
    /// Whether it holds for a value and the one before. Always false with NaN.
    #[must_use]
    pub fn holds(self, limit: f64, before: f64, now: f64) -> bool {
        match self {
            Self::Above => now > limit,
            Self::Below => now < limit,
            Self::Rising => before <= limit && now > limit,
            Self::Falling => before >= limit && now < limit,
        }
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Above => "is above",
            Self::Below => "is below",
            Self::Rising => "has risen above",
            Self::Falling => "has fallen below",
        })
    }
}

impl Condition {
    /// The comparison and its limit. `None` if not exactly one is given.
    #[must_use]
    pub fn comparison(&self) -> Option<(Comparison, f64)> {
        let all = [
            (Comparison::Above, self.above),
            (Comparison::Below, self.below),
            (Comparison::Rising, self.rising),
            (Comparison::Falling, self.falling),
        ];
        let mut given = all.into_iter().filter_map(|(kind, limit)| Some((kind, limit?)));
        given.next().filter(|_| given.next().is_none())
    }

    /// The first setting that is not allowed: its key, its value and what is allowed.
    pub(crate) fn out_of_range(&self, within: super::events::Span) -> Option<super::events::Fault> {
        match self.comparison() {
            None => {
                let given = [self.above, self.below, self.rising, self.falling];
                let count = given.iter().flatten().count();
                let value = format!("given with {count} comparisons");
                Some(("when", value, "one of above, below, rising, falling"))
            }
            Some((_, limit)) if !limit.is_finite() => {
                Some(("when", limit.to_string(), "compared with a finite number"))
            }
            Some(_) => {
                let after = self.after?;
                (!within.allows(after)).then(|| ("when.after", after.to_string(), WITHIN))
            }
        }
    }
}

/// What is allowed for a time.
pub(crate) const WITHIN: &str = "a time (s), not before the start of the run";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_comparisons_hold_as_documented() {
        use Comparison::{Above, Below, Falling, Rising};
        for (kind, before, now, expected) in [
            (Above, 9.0, 2.0, true),
            (Above, 9.0, 1.0, false),
            (Below, 9.0, 0.5, true),
            (Below, 9.0, 1.0, false),
            (Rising, 1.0, 1.5, true),
            (Rising, 1.2, 1.5, false),
            (Falling, 1.0, 0.5, true),
            (Falling, 0.9, 0.5, false),
            (Rising, f64::NAN, 1.5, false),
            (Above, 0.0, f64::NAN, false),
        ] {
            assert_eq!(kind.holds(1.0, before, now), expected, "{kind:?} {before} {now}");
        }
    }
}
