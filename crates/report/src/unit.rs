//! The units of a scenario: their layout files and parameters.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;
use zip::ZipArchive;

use crate::error::ReportError;
use crate::scenario::{Instance, Scenario};

/// Largest file of a unit that is read (bytes): a layout of 1000 cars has 40 MB.
const LARGEST: u64 = 64 << 20;

/// An instance whose unit carries a layout file.
#[derive(Debug)]
pub(crate) struct Unit<'a> {
    instance: Instance<'a>,
    file: &'static str,
    layout: String,
    parameters: Vec<Parameter>,
}

impl<'a> Unit<'a> {
    /// The first instance whose unit has `resources/{file}`.
    pub(crate) fn find(
        scenario: &'a Scenario,
        file: &'static str,
    ) -> Result<Option<Self>, ReportError> {
        let mut seen = Vec::new();
        for instance in scenario.instances() {
            if seen.contains(&instance.path) {
                continue;
            }
            if let Some(layout) = read(&instance.path, &format!("resources/{file}"))? {
                let description = read(&instance.path, "modelDescription.xml")?.unwrap_or_default();
                let parameters = parameters(&instance, &description);
                return Ok(Some(Self { instance, file, layout, parameters }));
            }
            seen.push(instance.path);
        }
        Ok(None)
    }

    /// The layout, read by its own crate.
    pub(crate) fn layout<T, E: std::fmt::Display>(
        &self,
        reader: impl Fn(&str) -> Result<T, E>,
    ) -> Result<T, ReportError> {
        reader(&self.layout)
            .map_err(|error| self.unusable(&format!("resources/{}: {error}", self.file)))
    }

    /// An error about this unit.
    pub(crate) fn unusable(&self, message: &str) -> ReportError {
        ReportError::Unit { path: self.instance.path.clone(), message: message.to_owned() }
    }

    /// The value of a number parameter: what the scenario gives, or what the unit starts with; 1
    /// for true.
    pub(crate) fn parameter(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Value::Bool(on) => Some(f64::from(u8::from(on))),
            value => value.as_f64(),
        }
    }

    /// The value of a parameter.
    pub(crate) fn value(&self, name: &str) -> Option<Value> {
        let known = self.parameters.iter().find(|it| it.name == name);
        known.map(|it| it.value.clone()).or_else(|| self.instance.value(name).cloned())
    }

    /// The name that was passed to `fmi2Instantiate`.
    pub(crate) fn name(&self) -> &str {
        &self.instance.name
    }

    /// The full name of one of this instance's variables.
    pub(crate) fn variable(&self, name: &str) -> String {
        format!("{}.{name}", self.instance.name)
    }
}

/// A parameter of an instance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameter {
    name: String,
    /// What the scenario gives, or what the unit starts with.
    value: Value,
    unit: Option<String>,
    /// Whether the scenario gives it.
    given: bool,
    description: Option<String>,
}

/// The parameters of one entry of the scenario's instances.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameters {
    /// The entry's name, a pattern where it stands for several.
    instances: String,
    /// Its unit's name.
    unit: String,
    values: Vec<Parameter>,
}

/// Parameters of all entries whose units' files are still there.
pub(crate) fn all_parameters(scenario: &Scenario) -> Vec<Parameters> {
    let of = |entry: Instance<'_>| {
        let description = read(&entry.path, "modelDescription.xml").ok()??;
        let values = parameters(&entry, &description);
        let unit = entry.unit().to_owned();
        Some(Parameters { instances: entry.name, unit, values })
    };
    scenario.entries().filter_map(of).collect()
}

/// All parameters that a description declares, with the values that an instance has.
fn parameters(instance: &Instance<'_>, description: &str) -> Vec<Parameter> {
    let Ok(document) = roxmltree::Document::parse(description) else { return Vec::new() };
    let is_parameter = |it: &roxmltree::Node<'_, '_>| {
        it.has_tag_name("ScalarVariable") && it.attribute("causality") == Some("parameter")
    };
    let parameter = |it: roxmltree::Node<'_, '_>| {
        let name = it.attribute("name")?;
        let kind = it.children().find(|child| child.attribute("start").is_some())?;
        let given = instance.value(name);
        let text = kind.attribute("start").unwrap_or_default();
        let start = match kind.tag_name().name() {
            "String" => Value::from(text),
            "Boolean" => Value::from(text == "true" || text == "1"),
            _ => text.trim().parse().map_or(Value::from(text), |number: f64| Value::from(number)),
        };
        Some(Parameter {
            name: name.to_owned(),
            value: given.cloned().unwrap_or(start),
            unit: kind.attribute("unit").map(str::to_owned),
            given: given.is_some(),
            description: it.attribute("description").map(str::to_owned),
        })
    };
    document.descendants().filter(is_parameter).filter_map(parameter).collect()
}

/// A text file of an archive, `None` if it has no such file.
fn read(path: &Path, name: &str) -> Result<Option<String>, ReportError> {
    let unusable = |message: String| ReportError::Unit { path: path.to_owned(), message };
    let file = File::open(path).map_err(|error| unusable(error.to_string()))?;
    let mut archive = ZipArchive::new(file).map_err(|error| unusable(error.to_string()))?;
    let entry = match archive.by_name(name) {
        Ok(entry) => entry,
        Err(zip::result::ZipError::FileNotFound) => return Ok(None),
        Err(error) => return Err(unusable(format!("{name}: {error}"))),
    };
    let mut text = String::new();
    entry
        .take(LARGEST)
        .read_to_string(&mut text)
        .map_err(|error| unusable(format!("{name}: {error}")))?;
    Ok(Some(text))
}
