//! Reads scenario-as-run.json, also as other versions wrote it.

use std::collections::HashSet;
use std::path::PathBuf;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The scenario of a run, as far as reports need it.
///
/// Unlike the reader of scenarios to run, it accepts unknown and missing members: the run may be of an
/// older or a newer version than this program.
#[derive(Debug, Clone, PartialEq)]
pub struct ScenarioAsRun {
    text: String,
    content: ScenarioContent,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
struct ScenarioContent {
    description: String,
    units: IndexMap<String, UnitAsRun>,
    instances: IndexMap<String, InstanceEntry>,
    plots: Vec<PlotAsRun>,
}

/// A unit: the path of its .fmu file, or an object that also has changes of its resources.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum UnitAsRun {
    File(PathBuf),
    Changed {
        fmu: PathBuf,
        #[serde(default)]
        resources: IndexMap<String, Value>,
    },
}

/// One member of `instances`: an instance, or an array of equal ones.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
struct InstanceEntry {
    unit: String,
    parameters: IndexMap<String, Value>,
    start: IndexMap<String, Value>,
}

/// One of the scenario's plots.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct PlotAsRun {
    /// File name in the results folder.
    pub file: String,
    /// Heading.
    pub title: String,
    /// From top to bottom.
    pub panels: Vec<PanelAsRun>,
}

/// One panel of a plot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct PanelAsRun {
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Factor from SI units to the unit of the axis.
    pub scale: f64,
    /// Signals to draw: patterns in the file, names in what [`ScenarioAsRun::plots`] returns.
    pub signals: Vec<String>,
    /// Legend texts of the first signals. The others are called by their names.
    pub labels: Vec<String>,
}

impl Default for PanelAsRun {
    fn default() -> Self {
        Self { ylabel: String::new(), scale: 1.0, signals: Vec::new(), labels: Vec::new() }
    }
}

impl ScenarioAsRun {
    /// Reads the text of scenario-as-run.json.
    ///
    /// # Errors
    /// The text is not JSON, or not a scenario.
    pub fn parse(text: String) -> serde_json::Result<Self> {
        let content = serde_json::from_str(&text)?;
        Ok(Self { text, content })
    }

    /// Whether a name occurs anywhere in it.
    #[must_use]
    pub fn mentions(&self, name: &str) -> bool {
        self.text.contains(name)
    }

    /// The file's text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The scenario's description of itself.
    #[must_use]
    pub fn description(&self) -> &str {
        &self.content.description
    }

    /// The members of `instances`. Their names may be patterns.
    pub fn entries(&self) -> impl Iterator<Item = InstanceAsRun<'_>> {
        self.content.instances.iter().map(|(name, entry)| {
            let (path, resources) = match self.content.units.get(&entry.unit).cloned() {
                Some(UnitAsRun::File(path)) => (path, IndexMap::new()),
                Some(UnitAsRun::Changed { fmu, resources }) => (fmu, resources),
                None => Default::default(),
            };
            InstanceAsRun { name: name.clone(), path, resources, entry }
        })
    }

    /// All instances, patterns expanded.
    #[must_use]
    pub fn instances(&self) -> Vec<InstanceAsRun<'_>> {
        let expand = |it: &InstanceAsRun<'_>| patterns::expand(&it.name).unwrap_or_default();
        self.entries()
            .flat_map(|it| {
                expand(&it).into_iter().map(move |name| InstanceAsRun { name, ..it.clone() })
            })
            .collect()
    }

    /// The plots, with patterns replaced by the names of the recorded signals that match. A signal that
    /// is not recorded keeps its name.
    #[must_use]
    pub fn plots(&self, recorded: &[String]) -> Vec<PlotAsRun> {
        let mut plots = self.content.plots.clone();
        let known: HashSet<&str> = recorded.iter().map(String::as_str).collect();
        for panel in plots.iter_mut().flat_map(|plot| &mut plot.panels) {
            let names = panel.signals.iter().flat_map(|pattern| {
                // a recorded name may look like a pattern
                let exact = known.contains(pattern.as_str()).then(|| vec![pattern.clone()]);
                exact.unwrap_or_else(|| matching(pattern, recorded))
            });
            panel.signals = names.collect();
        }
        plots
    }
}

/// One instance, or one member of `instances`.
#[derive(Debug, Clone)]
pub struct InstanceAsRun<'a> {
    /// Name of the instance in the scenario.
    pub name: String,
    /// The unit's .fmu file.
    pub path: PathBuf,
    /// Changes of its resources, as the scenario writes them.
    pub resources: IndexMap<String, Value>,
    entry: &'a InstanceEntry,
}

impl InstanceAsRun<'_> {
    /// Key in `units`.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.entry.unit
    }

    /// The value that the scenario gives a parameter or start value. The last one counts.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<&Value> {
        let fits = |pattern: &str| {
            pattern == name
                || patterns::is_pattern(pattern)
                    && patterns::expand(pattern).is_ok_and(|it| it.iter().any(|one| one == name))
        };
        let mut settings = self.entry.parameters.iter().chain(&self.entry.start);
        settings.rfind(|(pattern, _)| fits(pattern)).map(|(_, value)| value)
    }
}

/// Names of the recorded signals that a pattern matches.
fn matching(pattern: &str, recorded: &[String]) -> Vec<String> {
    let mut names = Vec::new();
    for glob in patterns::expand(pattern).unwrap_or_default() {
        if glob.contains('*') {
            names.extend(recorded.iter().filter(|name| patterns::matches(&glob, name)).cloned());
        } else {
            names.push(glob);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_patterns_are_resolved() {
        let text = r#"{
            "units": {"m": "/a/m.fmu"},
            "instances": {"m_[1..2]": {"unit": "m", "parameters": {"k_[1..3]": 1, "k_2": 5}}},
            "plots": [{"title": "t", "panels": [
                {"ylabel": "y", "scale": 1e3, "signals": ["m_[1..2].x", "m_*.y"], "labels": ["one"]}
            ]}],
            "something": "new"
        }"#;
        let scenario = ScenarioAsRun::parse(text.to_owned()).unwrap();
        let instances = scenario.instances();
        assert_eq!((instances.len(), instances[1].unit()), (2, "m"));
        assert_eq!(instances[1].path, PathBuf::from("/a/m.fmu"));
        let changed = text.replace(
            r#""/a/m.fmu""#,
            r#"{"fmu": "/a/m.fmu", "resources": {"l.json": {"x": 1}}, "new": 1}"#,
        );
        let changed = ScenarioAsRun::parse(changed).unwrap();
        let instance = &changed.instances()[1];
        assert_eq!(instance.path, PathBuf::from("/a/m.fmu"));
        assert_eq!(instance.resources["l.json"]["x"], 1);
        let value = |name| instances[0].value(name).and_then(Value::as_i64);
        assert_eq!((value("k_2"), value("k_3"), value("k_4")), (Some(5), Some(1), None));
        let recorded = ["m_1.x", "m_2.y"].map(str::to_owned);
        let plots = scenario.plots(&recorded);
        assert_eq!(plots[0].panels[0].signals, ["m_1.x", "m_2.x", "m_2.y"]);
        assert_eq!(plots[0].panels[0].labels, ["one"]);
        let recorded = ["m_*.y", "m_1.y", "m_[1..2].x"].map(str::to_owned);
        let plots = scenario.plots(&recorded);
        assert_eq!(plots[0].panels[0].signals, ["m_[1..2].x", "m_*.y"]);
    }
}
