//! The FMUs of a scenario: their layout files and parameters.

use fmi2_derive::UnitSource;
use fmi2_import::description::{Causality, ModelDescription, Variable};
use results::{InstanceAsRun, ScenarioAsRun};
use serde::Serialize;
use serde_json::Value;

use crate::error::ReportError;

/// An instance whose FMU contains a layout file.
#[derive(Debug)]
pub(crate) struct LayoutFmu<'a> {
    scenario: &'a ScenarioAsRun,
    instance: InstanceAsRun<'a>,
    file: &'static str,
    layout: String,
    parameters: Vec<ParameterValue>,
}

impl<'a> LayoutFmu<'a> {
    /// The first instance whose FMU contains `resources/{file}`.
    pub(crate) fn find(
        scenario: &'a ScenarioAsRun,
        file: &'static str,
    ) -> Result<Option<Self>, ReportError> {
        let mut seen = Vec::new();
        for instance in scenario.instances() {
            if seen.contains(&instance.unit().to_owned()) {
                continue;
            }
            let unit = source(&instance);
            if let Some(layout) = read(&unit, file)? {
                // without a description, the values that the scenario gives are known
                let description = fmi2_derive::describe(&unit).ok();
                let parameters = description.map(|it| parameters(&instance, &it));
                let parameters = parameters.unwrap_or_default();
                return Ok(Some(Self { scenario, instance, file, layout, parameters }));
            }
            seen.push(instance.unit().to_owned());
        }
        Ok(None)
    }

    /// Whether the scenario names a variable: as an input that is driven, or that an event changes.
    pub(crate) fn is_mentioned(&self, variable: &str) -> bool {
        self.scenario.mentions(variable)
    }

    /// The layout, parsed by `reader`.
    pub(crate) fn layout<T, E: std::fmt::Display>(
        &self,
        reader: impl Fn(&str) -> Result<T, E>,
    ) -> Result<T, ReportError> {
        reader(&self.layout)
            .map_err(|error| self.unusable(&format!("resources/{}: {error}", self.file)))
    }

    /// The text of a file in the FMU's resources.
    pub(crate) fn resource(&self, name: &str) -> Result<String, ReportError> {
        self.find_resource(name)?
            .ok_or_else(|| self.unusable(&format!("resources/{name} does not exist")))
    }

    /// The same of a file that may be missing.
    pub(crate) fn find_resource(&self, name: &str) -> Result<Option<String>, ReportError> {
        read(&source(&self.instance), name)
    }

    /// An error about this FMU.
    pub(crate) fn unusable(&self, message: &str) -> ReportError {
        ReportError::Fmu { path: self.instance.path.clone(), message: message.to_owned() }
    }

    /// The value of a numeric parameter, from the scenario or else the description; 1 for true.
    pub(crate) fn parameter(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Value::Bool(on) => Some(f64::from(u8::from(on))),
            value => value.as_f64(),
        }
    }

    /// The value of a parameter, from the scenario or else the description.
    pub(crate) fn value(&self, name: &str) -> Option<Value> {
        let known = self.parameters.iter().find(|it| it.name == name);
        known.map(|it| it.value.clone()).or_else(|| self.instance.value(name).cloned())
    }

    /// The instance, by its name in the scenario.
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
pub struct ParameterValue {
    name: String,
    /// The value from the scenario, or else the start value of the description.
    value: Value,
    unit: Option<String>,
    /// Whether the scenario gives the value.
    given: bool,
    description: Option<String>,
}

/// The parameters of one member of the scenario's `instances`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InstanceParameters {
    /// Name of the member, a pattern if it is an array of instances.
    instances: String,
    /// Its key in `units`.
    unit: String,
    values: Vec<ParameterValue>,
}

/// Parameters of all instances whose FMUs can still be read.
pub(crate) fn all_parameters(scenario: &ScenarioAsRun) -> Vec<InstanceParameters> {
    let of = |entry: InstanceAsRun<'_>| {
        let values = parameters(&entry, &fmi2_derive::describe(&source(&entry)).ok()?);
        let unit = entry.unit().to_owned();
        Some(InstanceParameters { instances: entry.name, unit, values })
    };
    scenario.entries().filter_map(of).collect()
}

/// All parameters that a description declares, with the values for an instance.
fn parameters(instance: &InstanceAsRun<'_>, description: &ModelDescription) -> Vec<ParameterValue> {
    let parameter = |it: &Variable| {
        let given = instance.value(&it.name);
        let start = serde_json::to_value(it.start.as_ref()?).ok()?;
        Some(ParameterValue {
            name: it.name.clone(),
            value: given.cloned().unwrap_or(start),
            unit: it.unit.clone(),
            given: given.is_some(),
            description: it.description.clone(),
        })
    };
    let variables = description.variables.iter();
    variables.filter(|it| it.causality == Causality::Parameter).filter_map(parameter).collect()
}

/// The unit of an instance.
fn source(instance: &InstanceAsRun<'_>) -> UnitSource {
    let changes = |value: &Value| serde_json::from_value(value.clone()).unwrap_or_default();
    let resources = &instance.resources;
    UnitSource {
        fmu: instance.path.clone(),
        resources: resources.iter().map(|(name, it)| (name.clone(), changes(it))).collect(),
    }
}

/// A text file in the resources of a unit, `None` if it has no such file.
fn read(unit: &UnitSource, name: &str) -> Result<Option<String>, ReportError> {
    let unusable = |message: String| ReportError::Fmu { path: unit.fmu.clone(), message };
    let failed = |error| unusable(results::causes(&error).join(": "));
    let bytes = fmi2_derive::read(unit, name).map_err(failed)?;
    let text = bytes.map(String::from_utf8).transpose();
    text.map_err(|_| unusable(format!("resources/{name} is not UTF-8 text")))
}
