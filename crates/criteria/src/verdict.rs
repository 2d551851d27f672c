//! The verdict on a run by one criterion, and its words.

use serde::{Deserialize, Serialize};

use crate::metric::is_false;

/// A figure of a run, and whether it is within its bounds.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Verdict {
    /// Name of the metric.
    pub name: String,
    /// Title of the metric, or its name.
    pub title: String,
    /// The figure, in SI units; none if it is not judged.
    pub value: Option<f64>,
    /// Unit of measure, if it is known.
    pub unit: Option<String>,
    /// Whether it is a deflection over a span, which is written as 1/N.
    #[serde(skip_serializing_if = "is_false")]
    pub fraction: bool,
    /// Upper bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Lower bound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Distance to the nearer bound in the unit of the figure; negative beyond it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub margin: Option<f64>,
    /// The margin as a fraction of that bound's magnitude; none of a bound of 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative_margin: Option<f64>,
    /// How it ends.
    pub outcome: Outcome,
    /// The signal, mode or point with the figure.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub place: String,
    /// What is known of the place, such as the span.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub detail: String,
    /// Time of the figure (s), if it is that of an instant.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<f64>,
    /// First time beyond the bound (s), of an extreme.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beyond_since: Option<f64>,
    /// Number of signals, modes or points that were judged.
    pub judged: usize,
    /// Number of them that fail.
    #[serde(skip_serializing_if = "is_zero")]
    pub failing: usize,
    /// Why it is not judged, or what is left out.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// Source of the bound.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub source: String,
    /// How figure and source differ.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub note: String,
    /// Whether a run that cannot be judged passes.
    #[serde(skip_serializing_if = "is_false")]
    pub optional: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(count: &usize) -> bool {
    *count == 0
}

/// How a verdict ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Within the bounds.
    Passed,
    /// Beyond a bound.
    Failed,
    /// The figure is not known.
    #[default]
    NotJudged,
    /// The figure has no bounds.
    NoLimit,
}

impl Outcome {
    /// The word for a table.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::NotJudged => "not judged",
            Self::NoLimit => "",
        }
    }
}

impl Verdict {
    /// Whether the run passes: within the bounds, without bounds, or not judged by an optional criterion.
    #[must_use]
    pub fn passes(&self) -> bool {
        let bounded = self.max.is_some() || self.min.is_some();
        match self.outcome {
            Outcome::Passed | Outcome::NoLimit => true,
            Outcome::Failed => false,
            Outcome::NotJudged => self.optional || !bounded,
        }
    }

    /// The figure as text; a dash if it is not known.
    #[must_use]
    pub fn figure(&self) -> String {
        self.value.map_or_else(|| "-".to_owned(), |value| self.number(value))
    }

    /// The bounds as text, such as "max 1/3800".
    #[must_use]
    pub fn limit(&self) -> String {
        let of = |word: &str, bound: Option<f64>| {
            bound.map(|bound| format!("{word} {}", self.number(bound)))
        };
        let bounds = [of("min", self.min), of("max", self.max)];
        bounds.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// The margin as text: in per cent of the bound, or absolute for a bound of 0.
    #[must_use]
    pub fn margin_text(&self) -> String {
        match (self.relative_margin, self.margin) {
            (Some(relative), _) if relative.abs() >= 10.0 => format!("{:.0} %", 100.0 * relative),
            (Some(relative), _) => format!("{:.1} %", 100.0 * relative),
            (None, Some(margin)) => shown(margin, self.unit.as_deref()),
            (None, None) => "-".to_owned(),
        }
    }

    /// A sentence for what fails, is not judged, or is left out: which, where, when and why. None if all is said by the
    /// numbers.
    #[must_use]
    pub fn sentence(&self) -> Option<String> {
        let Self { title, place, detail, reason, .. } = self;
        match self.outcome {
            Outcome::NotJudged => return Some(format!("{title} is not judged: {reason}")),
            Outcome::Passed | Outcome::NoLimit => {
                return (!reason.is_empty()).then(|| format!("{title}: {reason}"));
            }
            Outcome::Failed => {}
        }
        let mut text = title.clone();
        match self.value {
            Some(value) => text += &format!(": {} at {place}", self.number(value)),
            None => text += &format!(": {place}"),
        }
        if !detail.is_empty() {
            text += &format!(" ({detail})");
        }
        if let Some(time) = self.time {
            text += &format!(", at {} s", digits(time, 7));
        }
        match (self.value, self.max, self.min) {
            (Some(value), Some(max), _) if value > max => {
                text += &format!(", is above the limit of {}", self.number(max));
            }
            (Some(_), _, Some(min)) => {
                text += &format!(", is below the limit of {}", self.number(min));
            }
            _ => {}
        }
        if let Some(since) = self.beyond_since {
            text += &format!(", for the first time at {} s", digits(since, 7));
        }
        if self.judged > 1 {
            text += &format!("; {} of {} fail", self.failing, self.judged);
        }
        if !reason.is_empty() {
            text += &format!("; {reason}");
        }
        Some(text)
    }

    fn number(&self, value: f64) -> String {
        // beyond 1/5 a fraction says less than the number
        if self.fraction && value > 0.0 && value < 0.2 {
            return format!("1/{:.0}", 1.0 / value);
        }
        shown(value, self.unit.as_deref())
    }
}

/// A number with four digits and its unit; lengths below a metre in mm.
#[must_use]
pub fn shown(value: f64, unit: Option<&str>) -> String {
    match unit {
        Some("m") if value.abs() < 1.0 && value != 0.0 => format!("{} mm", digits(1e3 * value, 4)),
        Some("1") | None => digits(value, 4),
        Some(unit) => format!("{} {unit}", digits(value, 4)),
    }
}

/// A number with so many significant digits, without zeros at its end.
fn digits(value: f64, count: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let scale = value.abs().log10().floor();
    if !(-5.0..9.0).contains(&scale) {
        return format!("{value:.*e}", usize::try_from(count - 1).unwrap_or(0));
    }
    #[expect(clippy::cast_possible_truncation, reason = "-5 to 8")]
    let places = usize::try_from(count - 1 - scale as i32).unwrap_or(0);
    let text = format!("{value:.places$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_numbers_are_short_and_have_units() {
        for (value, unit, text) in [
            (0.003_541_2, Some("m"), "3.541 mm"),
            (25.0, Some("m"), "25 m"),
            (0.0, Some("m"), "0 m"),
            (-0.6, Some("m/s2"), "-0.6 m/s2"),
            (127.81, Some("1"), "127.8"),
            (1_234_567.0, None, "1234567"),
            (1e-9, None, "1.000e-9"),
            (f64::INFINITY, None, "inf"),
        ] {
            assert_eq!(shown(value, unit), text);
        }
    }

    #[test]
    fn issue_the_sentence_says_which_where_and_when() {
        let verdict = Verdict {
            title: "deflection".to_owned(),
            value: Some(1.0 / 2629.0),
            fraction: true,
            max: Some(1.0 / 3800.0),
            outcome: Outcome::Failed,
            place: "g.midspan_displacement_2".to_owned(),
            detail: "middle of span 2".to_owned(),
            time: Some(31.2),
            beyond_since: Some(0.1 + 0.2),
            judged: 3,
            failing: 2,
            ..Verdict::default()
        };
        let expected = "deflection: 1/2629 at g.midspan_displacement_2 (middle of span 2), at 31.2 s, is above the \
                        limit of 1/3800, for the first time at 0.3 s; 2 of 3 fail";
        assert_eq!(verdict.sentence().unwrap(), expected);
        assert!(!verdict.passes());
    }
}
