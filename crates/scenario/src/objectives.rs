//! Named figures of signals, and their limits.

use indexmap::IndexMap;

use criteria::Metric;

use crate::{Scenario, ScenarioError};

/// The signals that a figure needs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MetricSignal<'a> {
    /// JSON path.
    pub place: String,
    /// `instance.variable`, patterns allowed.
    pub pattern: &'a str,
    /// Whether it is no error if there is no such signal.
    pub optional: bool,
}

impl Scenario {
    /// Adds criteria to the limits. A limit of the scenario with the same name remains.
    pub fn add_limits(&mut self, criteria: IndexMap<String, Metric>) {
        for (name, metric) in criteria {
            self.limits.entry(name).or_insert(metric);
        }
    }

    /// All figures: `objectives`, then `limits`.
    #[must_use]
    pub fn metrics(&self) -> IndexMap<String, Metric> {
        self.objectives.iter().chain(&self.limits).map(|(k, it)| (k.clone(), it.clone())).collect()
    }

    /// The signals that figures need, with the place of each in the scenario. They are recorded also if `record` does not
    /// name them.
    pub fn metric_signals(&self) -> impl Iterator<Item = MetricSignal<'_>> {
        let lists = [("objectives", &self.objectives), ("limits", &self.limits)];
        lists.into_iter().flat_map(|(key, list)| {
            list.iter().filter_map(move |(name, metric)| {
                Some(MetricSignal {
                    place: format!("{key}.{name}.signal"),
                    pattern: metric.signal.as_deref()?,
                    optional: metric.optional,
                })
            })
        })
    }

    /// Checks that figures are complete, that `limits` have bounds, and that each name occurs once.
    pub(crate) fn check_metrics(&self) -> Result<(), ScenarioError> {
        for (list, metrics) in [("objectives", &self.objectives), ("limits", &self.limits)] {
            for (name, metric) in metrics {
                let wrong = |key: &str, problem: String| ScenarioError::Metric {
                    place: format!("{list}.{name}.{key}"),
                    problem,
                };
                metric.check(name).map_err(|error| wrong(error.key, error.problem))?;
                match (list, metric.is_bounded()) {
                    ("objectives", true) => {
                        let key = if metric.max.is_some() { "max" } else { "min" };
                        let problem = "an objective has no bound; move it to \"limits\"";
                        return Err(wrong(key, problem.to_owned()));
                    }
                    ("limits", false) => {
                        let problem = "missing; a limit needs \"max\" or \"min\", a figure without \
                                       a bound belongs to \"objectives\"";
                        return Err(wrong("max", problem.to_owned()));
                    }
                    ("limits", _) if self.objectives.contains_key(name) => {
                        let problem = "the same name is in \"objectives\"; choose another one";
                        return Err(wrong("name", problem.to_owned()));
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn parse(keys: &str) -> Scenario {
        let text = format!(
            r#"{{"units": {{"a": "a.fmu"}}, "instances": {{"a": {{"unit": "a"}}}}, {keys},
            "experiment": {{"stop": 1.0, "step": 0.1}}}}"#
        );
        Scenario::parse(&text, Path::new("s.json")).unwrap()
    }

    #[test]
    fn refusal_figures_that_do_not_fit_name_their_place() {
        for (keys, place, part) in [
            (
                r#""objectives": {"top": {"signal": "a.y", "figure": "max", "max": 1}}"#,
                "objectives.top.max",
                "move it to \"limits\"",
            ),
            (r#""limits": {"top": {"signal": "a.y", "figure": "max"}}"#, "limits.top.max", "needs"),
            (r#""limits": {"top": {"signal": "a.y", "max": 1}}"#, "limits.top.figure", "missing"),
            (
                r#""objectives": {"x": {"signal": "a.y", "figure": "max"}},
                   "limits": {"x": {"signal": "a.y", "figure": "max", "max": 1}}"#,
                "limits.x.name",
                "choose another one",
            ),
        ] {
            let error = parse(keys).check().unwrap_err().to_string();
            assert!(error.contains(place) && error.contains(part), "{error}");
        }
    }

    #[test]
    fn invariant_metrics_keep_their_order_and_survive_a_round_trip() {
        let scenario = parse(
            r#""objectives": {"b": {"signal": "a.y", "figure": "rms"}},
               "limits": {"a": {"signal": "a.z", "figure": "max", "max": "1/3", "source": "x"}}"#,
        );
        scenario.check().unwrap();
        let names: Vec<String> = scenario.metrics().into_keys().collect();
        assert_eq!(names, ["b", "a"]);
        let signals: Vec<_> = scenario.metric_signals().collect();
        let second =
            MetricSignal { place: "limits.a.signal".to_owned(), pattern: "a.z", optional: false };
        assert_eq!(signals[1], second);
        let text = serde_json::to_string(&scenario).unwrap();
        assert_eq!(Scenario::parse(&text, Path::new("s.json")).unwrap(), scenario);
    }
}
