//! Judging a run of two spans and two gaps.

use super::*;

/// Signals by name, at 0, 1 and 2 s.
struct Run {
    names: Vec<String>,
    values: Vec<[f64; 3]>,
    speed: f64,
}

impl Run {
    fn new(signals: &[(&str, [f64; 3])]) -> Self {
        let names = signals.iter().map(|it| it.0.to_owned()).collect();
        Self { names, values: signals.iter().map(|it| it.1).collect(), speed: 2.0 }
    }
}

impl Evidence for Run {
    fn signals(&self) -> &[String] {
        &self.names
    }

    fn samples(&self, index: usize) -> (Vec<f64>, Vec<f64>) {
        (vec![0.0, 1.0, 2.0], self.values[index].to_vec())
    }

    fn unit(&self, signal: &str) -> Option<String> {
        Some(if signal.contains("rate") { "m/s" } else { "m" }.to_owned())
    }

    fn span(&self, signal: &str) -> Result<Place, String> {
        match signal {
            "g.y_1" => Ok(Place { length: 10.0, text: "span 1".to_owned() }),
            "g.y_2" => Ok(Place { length: 30.0, text: "span 2".to_owned() }),
            _ => Err(format!("{signal} belongs to no span")),
        }
    }

    fn speed(&self) -> Result<f64, String> {
        Ok(self.speed)
    }

    fn quantity(&self, quantity: Quantity) -> Result<Vec<Finding>, String> {
        match quantity {
            Quantity::FrequencyTimesSpan => Ok([8.0, 4.0]
                .iter()
                .map(|it| Finding::new(*it, format!("girder {it}"), String::new()))
                .collect()),
            _ => Err("no modes".to_owned()),
        }
    }
}

fn one(run: &Run, metric: &str) -> Verdict {
    let metric: Metric = serde_json::from_str(metric).unwrap();
    metric.check("m").unwrap();
    judge(&IndexMap::from([("m".to_owned(), metric)]), run).remove(0)
}

/// 4 mm of 30 m is more than 1 mm of 10 m, but 2 mm of 10 m is more than both.
#[test]
fn analytic_the_worst_span_is_the_one_with_the_largest_ratio() {
    let run = Run::new(&[("g.y_1", [0.0, -0.002, -0.001]), ("g.y_2", [0.0, -0.001, -0.004])]);
    let metric =
        r#"{"signal": "g.y_*", "figure": "max_abs", "over": "span_length", "max": "1/8000"}"#;
    let verdict = one(&run, metric);
    assert_eq!((verdict.value, verdict.place.as_str()), (Some(0.002 / 10.0), "g.y_1"));
    assert_eq!((verdict.time, verdict.beyond_since), (Some(1.0), Some(1.0)));
    assert_eq!((verdict.judged, verdict.failing, verdict.outcome), (2, 2, Outcome::Failed));
    assert_eq!(verdict.unit.as_deref(), Some("1"));
    let margin = verdict.relative_margin.unwrap();
    assert!((margin - (1.0 - 8000.0 / 5000.0)).abs() < 1e-12, "{margin}");
    assert!(verdict.sentence().unwrap().contains("1/5000 at g.y_1 (span 1), at 1 s"));
    let verdict = one(&run, &metric.replace("8000", "5000"));
    assert_eq!(
        (verdict.outcome, verdict.margin),
        (Outcome::Passed, Some(0.0)),
        "a bound is allowed"
    );
}

#[test]
fn analytic_the_worst_of_several_is_the_one_closest_to_its_bound() {
    let run = Run::new(&[("v.gap_1", [8.0, 7.0, 8.5]), ("v.gap_2", [8.0, 9.5, 7.5])]);
    let of = |metric: &str| {
        let it = one(&run, &metric.replace('S', r#""signal": "v.gap_[1..2]", "figure""#));
        (it.value.unwrap(), it.place, it.time, it.outcome)
    };
    let (passed, failed) = (Outcome::Passed, Outcome::Failed);
    assert_eq!(of(r#"{S: "min", "min": 6}"#), (7.0, "v.gap_1".into(), Some(1.0), passed));
    assert_eq!(of(r#"{S: "max", "max": 9}"#), (9.5, "v.gap_2".into(), Some(1.0), failed));
    let around = r#"{S: "max_abs", "reference": 8, "max": 2}"#;
    assert_eq!(of(around), (1.5, "v.gap_2".into(), Some(1.0), passed));
    // both bounds: 7.5 is closer to 7 than 8.5 to 10
    let last = r#"{S: "final", "min": 7, "max": 10}"#;
    assert_eq!(of(last), (7.5, "v.gap_2".into(), Some(2.0), passed));
    assert_eq!(of(r#"{S: "min"}"#), (7.0, "v.gap_1".into(), Some(1.0), Outcome::NoLimit));
    assert_eq!(of(r#"{S: "max"}"#), (9.5, "v.gap_2".into(), Some(1.0), Outcome::NoLimit));
}

#[test]
fn analytic_a_quantity_over_the_speed() {
    let mut run = Run::new(&[]);
    let metric = r#"{"quantity": "frequency_times_span", "over": "speed", "min": 1.1}"#;
    let verdict = one(&run, metric);
    assert_eq!((verdict.value, verdict.place.as_str()), (Some(2.0), "girder 4"));
    assert_eq!((verdict.outcome, verdict.unit.as_deref()), (Outcome::Passed, Some("1")));
    run.speed = 0.0;
    let verdict = one(&run, metric);
    assert_eq!(verdict.outcome, Outcome::NotJudged);
    assert!(verdict.reason.contains("stands") && !verdict.passes());
    assert!(one(&run, &metric.replace("}", r#", "optional": true}"#)).passes());
}

#[test]
fn refusal_what_cannot_be_judged_does_not_pass() {
    let run = Run::new(&[
        ("v.gap_1", [8.0, f64::NAN, 8.5]),
        ("v.gap_rate_1", [0.0; 3]),
        ("g.y_1", [0.0; 3]),
        ("g.x", [0.0; 3]),
    ]);
    for (metric, outcome, part) in [
        (r#"{"signal": "v.gpa_1", "figure": "max", "max": 9}"#, Outcome::NotJudged, "\"v.gap_1\"?"),
        (
            r#"{"signal": "v.gap_[1..3]", "figure": "max", "max": 9}"#,
            Outcome::NotJudged,
            "v.gap_2 and 1 more of \"v.gap_[1..3]\" are not recorded",
        ),
        (
            r#"{"signal": "v.gap_*", "figure": "min", "min": -1, "optional": true}"#,
            Outcome::Failed,
            "v.gap_1 has m, v.gap_rate_1 has m/s",
        ),
        // optional means that it may be missing, not that it may be NaN
        (
            r#"{"signal": "v.gap_1", "figure": "max", "max": 9, "optional": true}"#,
            Outcome::Failed,
            "v.gap_1; it is NaN at 1 s",
        ),
        (
            r#"{"signal": "g.y_1", "figure": "max", "max": 9, "from": 3}"#,
            Outcome::NotJudged,
            "no value is recorded from 3 s to 2 s",
        ),
        (
            r#"{"signal": "g.x", "figure": "max", "over": "span_length", "max": 9}"#,
            Outcome::NotJudged,
            "g.x belongs to no span",
        ),
        (r#"{"quantity": "least_damping_ratio", "min": 0}"#, Outcome::NotJudged, "no modes"),
    ] {
        let verdict = one(&run, metric);
        let sentence = verdict.sentence().unwrap();
        assert_eq!((verdict.outcome, verdict.passes()), (outcome, false), "{metric}");
        assert!(sentence.contains(part), "{sentence}");
    }
    let some = one(&run, r#"{"signal": "g.*", "figure": "max", "over": "span_length", "max": 9}"#);
    assert!(
        some.passes() && some.reason.contains("1 of 2 signals are left out"),
        "{}",
        some.reason
    );
    // without a limit nothing fails
    assert!(one(&run, r#"{"signal": "v.gap_1", "figure": "max"}"#).passes());
}
