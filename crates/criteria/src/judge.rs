//! Judges a run by metrics.

use std::collections::HashSet;

use indexmap::IndexMap;

use crate::figure::first_beyond;
use crate::{Figure, Metric, Outcome, Over, OverName, Quantity, Verdict, compute};

/// What is known of a run.
pub trait Evidence {
    /// Names of the recorded signals that are numbers.
    fn signals(&self) -> &[String];

    /// Times (s) and values of a recorded signal, by its position.
    fn samples(&self, index: usize) -> (Vec<f64>, Vec<f64>);

    /// Unit of measure of a signal.
    fn unit(&self, signal: &str) -> Option<String>;

    /// The span that a signal belongs to.
    ///
    /// # Errors
    /// Why it is not known, as a sentence.
    fn span(&self, signal: &str) -> Result<Place, String>;

    /// Largest speed of the train (m/s).
    ///
    /// # Errors
    /// Why it is not known, as a sentence.
    fn speed(&self) -> Result<f64, String>;

    /// The values of a quantity of the system.
    ///
    /// # Errors
    /// Why there are none, as a sentence.
    fn quantity(&self, quantity: Quantity) -> Result<Vec<Finding>, String>;
}

/// A span.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Distance between its supports (m).
    pub length: f64,
    /// Which one, and where in it.
    pub text: String,
}

/// A value and where it occurs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Finding {
    /// The value in SI units.
    pub value: f64,
    /// The signal, mode or point.
    pub place: String,
    /// What is known of the place.
    pub detail: String,
    /// What the value does not cover, as a sentence. It is shown also if the run passes.
    pub caveat: String,
    /// Its time (s), if it is that of an instant.
    pub time: Option<f64>,
    /// First time beyond the bounds (s).
    beyond_since: Option<f64>,
}

impl Finding {
    /// A value at a place, of no instant.
    #[must_use]
    pub fn new(value: f64, place: String, detail: String) -> Self {
        Self { value, place, detail, ..Self::default() }
    }
}

/// Why a metric has no value.
enum Unknown {
    /// What it needs is missing.
    Missing(String),
    /// A signal is not what it must be: NaN, or not settled.
    Bad { place: String, reason: String },
}

/// Positions of the recorded signals that a pattern selects.
#[must_use]
pub fn selected(pattern: &str, recorded: &[String]) -> Vec<usize> {
    if let Some(exact) = recorded.iter().position(|name| name == pattern) {
        return vec![exact];
    }
    let globs = patterns::expand(pattern).unwrap_or_default();
    let (stars, plain): (Vec<String>, Vec<String>) =
        globs.into_iter().partition(|glob| glob.contains('*'));
    let plain: HashSet<String> = plain.into_iter().collect();
    let fits = |name: &String| {
        plain.contains(name) || stars.iter().any(|glob| patterns::matches(glob, name))
    };
    (0..recorded.len()).filter(|&k| fits(&recorded[k])).collect()
}

/// The pattern that was probably meant.
fn near(pattern: &str, recorded: &[String]) -> Option<String> {
    patterns::suggest_pattern(pattern, recorded.iter().map(String::as_str))
}

/// What a pattern names without a star and is not recorded.
fn missing(pattern: &str, recorded: &[String]) -> Option<String> {
    let names = patterns::expand(pattern).unwrap_or_default();
    if names.len() < 2 || recorded.iter().any(|name| name == pattern) {
        return None;
    }
    let recorded: HashSet<&str> = recorded.iter().map(String::as_str).collect();
    let lacks = |name: &&String| !name.contains('*') && !recorded.contains(name.as_str());
    let first = names.iter().find(lacks)?;
    match names.iter().filter(lacks).count() - 1 {
        0 => Some(format!("{first} is not recorded")),
        others => Some(format!("{first} and {others} more of \"{pattern}\" are not recorded")),
    }
}

/// Judges a run by metrics, in their order.
#[must_use]
pub fn judge(metrics: &IndexMap<String, Metric>, evidence: &dyn Evidence) -> Vec<Verdict> {
    metrics.iter().map(|(name, metric)| verdict(name, metric, evidence)).collect()
}

fn verdict(name: &str, metric: &Metric, evidence: &dyn Evidence) -> Verdict {
    let title = if metric.title.is_empty() { name } else { &metric.title };
    let mut verdict = Verdict {
        name: name.to_owned(),
        title: title.to_owned(),
        fraction: metric.over == Some(Over::Named(OverName::SpanLength)),
        max: metric.max.map(|it| it.value),
        min: metric.min.map(|it| it.value),
        source: metric.source.clone(),
        note: metric.note.clone(),
        optional: metric.optional,
        ..Verdict::default()
    };
    match findings(metric, evidence) {
        Ok((found, left_out)) => {
            verdict.unit = unit(metric, &found, evidence);
            verdict.fraction &= verdict.unit.as_deref() == Some("1");
            verdict.reason = left_out;
            conclude(&mut verdict, metric, found);
        }
        Err(Unknown::Missing(reason)) => verdict.reason = reason,
        Err(Unknown::Bad { place, reason }) => {
            // a limit that a signal cannot be shown to keep is not kept
            verdict.outcome =
                if metric.is_bounded() { Outcome::Failed } else { Outcome::NotJudged };
            (verdict.place, verdict.reason, verdict.judged) = (place, reason, 1);
        }
    }
    verdict
}

/// The values of a metric, divided, and a sentence on what is left out.
fn findings(metric: &Metric, evidence: &dyn Evidence) -> Result<(Vec<Finding>, String), Unknown> {
    let divisor = match metric.over {
        Some(Over::Number(number)) => number,
        Some(Over::Named(OverName::Speed)) => {
            let speed = evidence.speed().map_err(Unknown::Missing)?;
            if speed == 0.0 {
                return Err(Unknown::Missing("the train stands, its speed is 0".to_owned()));
            }
            speed
        }
        Some(Over::Named(OverName::SpanLength)) | None => 1.0,
    };
    if let Some(quantity) = metric.quantity {
        let mut found = evidence.quantity(quantity).map_err(Unknown::Missing)?;
        if let Some(odd) = found.iter().find(|it| !it.value.is_finite()) {
            let reason = format!("it is {}", odd.value);
            return Err(Unknown::Bad { place: odd.place.clone(), reason });
        }
        found.iter_mut().for_each(|it| it.value /= divisor);
        return Ok((found, String::new()));
    }
    let pattern = metric.signal.as_deref().unwrap_or_default();
    let recorded = evidence.signals();
    let chosen = selected(pattern, recorded);
    if let Some(reason) = missing(pattern, recorded) {
        return Err(Unknown::Missing(reason));
    }
    if chosen.is_empty() {
        // one that may be missing is no misspelling
        let near = if metric.optional { None } else { near(pattern, recorded) };
        let near = near.map(|near| format!("; did you mean \"{near}\"?")).unwrap_or_default();
        return Err(Unknown::Missing(format!("\"{pattern}\" is not recorded{near}")));
    }
    // a star easily takes more than was meant: gap_* also takes gap_rate_01
    let first = &recorded[chosen[0]];
    let measure = evidence.unit(first);
    if let Some(&other) = chosen.iter().find(|&&k| evidence.unit(&recorded[k]) != measure) {
        let word = |unit: Option<String>| unit.unwrap_or_else(|| "no unit".to_owned());
        let other = &recorded[other];
        let reason = format!(
            "\"{pattern}\" mixes units of measure: {first} has {}, {other} has {}; a range such as [01..64] is exact",
            word(measure),
            word(evidence.unit(other))
        );
        return Err(Unknown::Bad { place: pattern.to_owned(), reason });
    }
    let (mut found, mut left_out) = (Vec::new(), Vec::new());
    for index in chosen {
        let name = &recorded[index];
        let (length, detail) = match metric.over {
            Some(Over::Named(OverName::SpanLength)) => match evidence.span(name) {
                Ok(Place { length, text }) => (length, text),
                Err(reason) => {
                    left_out.push(reason);
                    continue;
                }
            },
            _ => (divisor, String::new()),
        };
        let (times, values) = evidence.samples(index);
        let figure = compute(metric, &times, &values).map_err(|error| match error {
            crate::FigureError::Empty { .. } => Unknown::Missing(format!("{name}: {error}")),
            _ => Unknown::Bad { place: name.clone(), reason: error.to_string() },
        })?;
        let beyond = |x: f64| is_beyond(metric, x / length);
        found.push(Finding {
            value: figure.value / length,
            place: name.clone(),
            detail,
            caveat: String::new(),
            time: figure.time,
            beyond_since: first_beyond(metric, &times, &values, beyond),
        });
    }
    match (found.is_empty(), left_out.len()) {
        (true, _) => Err(Unknown::Missing(left_out.swap_remove(0))),
        (false, 0) => Ok((found, String::new())),
        (false, n) => {
            let all = n + found.len();
            Ok((found, format!("{n} of {all} signals are left out: {}", left_out[0])))
        }
    }
}

fn is_beyond(metric: &Metric, value: f64) -> bool {
    metric.max.is_some_and(|max| value > max.value)
        || metric.min.is_some_and(|min| value < min.value)
}

/// Signed distance to the nearer bound, and that bound.
fn margin(metric: &Metric, value: f64) -> Option<(f64, f64)> {
    let above = metric.max.map(|max| (max.value - value, max.value));
    let below = metric.min.map(|min| (value - min.value, min.value));
    above.into_iter().chain(below).min_by(|a, b| a.0.total_cmp(&b.0))
}

/// Takes the worst value into the verdict.
fn conclude(verdict: &mut Verdict, metric: &Metric, found: Vec<Finding>) {
    verdict.judged = found.len();
    verdict.failing = found.iter().filter(|it| is_beyond(metric, it.value)).count();
    let smallest = metric.figure == Some(Figure::Min)
        || matches!(
            metric.quantity,
            Some(
                Quantity::FrequencyTimesSpan
                    | Quantity::LeastDampingRatio
                    | Quantity::LeastDampingRatioAsStepped
            )
        );
    let badness = |it: &Finding| match margin(metric, it.value) {
        Some((margin, _)) => -margin,
        None if smallest => -it.value,
        None => it.value,
    };
    // the first one of equal values
    let worst = found.into_iter().reduce(|a, b| if badness(&b) > badness(&a) { b } else { a });
    let Some(worst) = worst else { return };
    verdict.value = Some(worst.value);
    if let Some((margin, bound)) = margin(metric, worst.value) {
        verdict.margin = Some(margin);
        verdict.relative_margin = (bound != 0.0).then(|| margin / bound.abs());
    }
    verdict.outcome = match (metric.is_bounded(), verdict.failing) {
        (false, _) => Outcome::NoLimit,
        (true, 0) => Outcome::Passed,
        (true, _) => Outcome::Failed,
    };
    (verdict.place, verdict.detail, verdict.time) = (worst.place, worst.detail, worst.time);
    verdict.beyond_since = worst.beyond_since;
    if !worst.caveat.is_empty() {
        verdict.reason = worst.caveat;
    }
}

/// The unit of a metric's value, if it is known.
fn unit(metric: &Metric, found: &[Finding], evidence: &dyn Evidence) -> Option<String> {
    unit_of(metric, found.first().and_then(|it| evidence.unit(&it.place)))
}

/// The unit of a metric's value, if it is known, by that of its signal.
#[must_use]
pub fn unit_of(metric: &Metric, signal: Option<String>) -> Option<String> {
    let own = match (metric.quantity, metric.figure) {
        (Some(Quantity::FrequencyTimesSpan), _) => Some("m/s".to_owned()),
        (Some(Quantity::VibrationTotal), _) => Some("m/s2".to_owned()),
        (Some(_), _) => Some("1".to_owned()),
        (None, Some(Figure::SettlingTime)) => Some("s".to_owned()),
        (None, _) => signal,
    };
    let divisor = match metric.over {
        None => return own,
        Some(Over::Named(OverName::SpanLength)) => "m",
        Some(Over::Named(OverName::Speed)) => "m/s",
        Some(Over::Number(_)) => return None,
    };
    (own.as_deref() == Some(divisor)).then(|| "1".to_owned())
}

#[cfg(test)]
#[path = "judge_tests.rs"]
mod tests;
