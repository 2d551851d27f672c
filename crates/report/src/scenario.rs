//! scenario-as-run.json: what ran, with its patterns resolved.

use std::collections::HashSet;
use std::path::PathBuf;

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// The scenario of a run, as far as the report needs it; it may be of a newer or older version than
/// this program.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    text: String,
    content: Content,
}

#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
struct Content {
    description: String,
    units: IndexMap<String, PathBuf>,
    instances: IndexMap<String, Entry>,
    plots: Vec<Plot>,
}

/// One entry of the instances, which may stand for several.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
struct Entry {
    unit: String,
    parameters: IndexMap<String, Value>,
    start: IndexMap<String, Value>,
}

/// One of the scenario's pictures.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Plot {
    /// Its file's name in the folder of results.
    pub file: String,
    /// Heading.
    pub title: String,
    /// From top to bottom.
    pub panels: Vec<Panel>,
}

/// One panel of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Panel {
    /// Label of the vertical axis.
    pub ylabel: String,
    /// Factor from SI units to what is drawn.
    pub scale: f64,
    /// Its signals: patterns in the file, names once resolved.
    pub signals: Vec<String>,
    /// What to call them, as far as given.
    pub labels: Vec<String>,
}

impl Default for Panel {
    fn default() -> Self {
        Self { ylabel: String::new(), scale: 1.0, signals: Vec::new(), labels: Vec::new() }
    }
}

impl Scenario {
    /// Reads the text of scenario-as-run.json.
    ///
    /// # Errors
    /// It is no JSON, or not of the form of a scenario.
    pub fn parse(text: String) -> serde_json::Result<Self> {
        let content = serde_json::from_str(&text)?;
        Ok(Self { text, content })
    }

    /// The file's text.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What it shows.
    #[must_use]
    pub fn description(&self) -> &str {
        &self.content.description
    }

    /// The entries of the instances, by their names in the file, which may be patterns.
    pub fn entries(&self) -> impl Iterator<Item = Instance<'_>> {
        self.content.instances.iter().map(|(name, entry)| {
            let path = self.content.units.get(&entry.unit).cloned().unwrap_or_default();
            Instance { name: name.clone(), path, entry }
        })
    }

    /// All instances with their units' names and .fmu files.
    #[must_use]
    pub fn instances(&self) -> Vec<Instance<'_>> {
        let expand = |it: &Instance<'_>| patterns::expand(&it.name).unwrap_or_default();
        self.entries()
            .flat_map(|it| expand(&it).into_iter().map(move |name| Instance { name, ..it.clone() }))
            .collect()
    }

    /// The pictures, with the names that their panels' patterns mean among the recorded signals; a
    /// signal that is drawn without being recorded keeps its name.
    #[must_use]
    pub fn plots(&self, recorded: &[String]) -> Vec<Plot> {
        let mut plots = self.content.plots.clone();
        let known: HashSet<&str> = recorded.iter().map(String::as_str).collect();
        for panel in plots.iter_mut().flat_map(|plot| &mut plot.panels) {
            let names = panel.signals.iter().flat_map(|pattern| {
                // a name that is recorded is itself, whatever is in it
                let exact = known.contains(pattern.as_str()).then(|| vec![pattern.clone()]);
                exact.unwrap_or_else(|| chosen(pattern, recorded))
            });
            panel.signals = names.collect();
        }
        plots
    }
}

/// One instance of a unit.
#[derive(Debug, Clone)]
pub struct Instance<'a> {
    /// Name of the instance in the scenario.
    pub name: String,
    /// The unit's .fmu file.
    pub path: PathBuf,
    entry: &'a Entry,
}

impl Instance<'_> {
    /// Its unit's name in the scenario.
    #[must_use]
    pub fn unit(&self) -> &str {
        &self.entry.unit
    }

    /// The value that the scenario gives a parameter or start value, the last one if several do.
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

/// Names that a pattern means.
fn chosen(pattern: &str, recorded: &[String]) -> Vec<String> {
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
        let scenario = Scenario::parse(text.to_owned()).unwrap();
        let instances = scenario.instances();
        assert_eq!((instances.len(), instances[1].unit()), (2, "m"));
        assert_eq!(instances[1].path, PathBuf::from("/a/m.fmu"));
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
