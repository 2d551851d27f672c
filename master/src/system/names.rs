//! From the names in a scenario to instances and variables.

use super::{Port, Result, System, SystemError};
use crate::pattern;

impl System {
    pub(super) fn port(&self, place: &str, name: &str) -> Result<Port> {
        let Some((instance, variable)) = name.split_once('.') else {
            return Err(SystemError::Form { place: place.to_owned(), name: name.to_owned() });
        };
        let Some(index) = self.find(instance) else {
            return Err(self.unknown_instance(place, instance));
        };
        let variable = self.find_variable(place, index, variable)?;
        Ok(Port { instance: index, variable })
    }

    /// The error for an instance name that does not exist.
    #[must_use]
    pub fn unknown_instance(&self, place: &str, name: &str) -> SystemError {
        let names = self.instances.iter().map(|plan| plan.name.as_str());
        SystemError::Unknown {
            place: place.to_owned(),
            what: "instance",
            name: name.to_owned(),
            within: None,
            suggestion: pattern::suggest(name, names).map(str::to_owned),
        }
    }

    pub(super) fn find_variable(&self, place: &str, instance: usize, name: &str) -> Result<usize> {
        let plan = &self.instances[instance];
        let description = plan.description();
        description.find(name).ok_or_else(|| SystemError::Unknown {
            place: place.to_owned(),
            what: "variable",
            name: name.to_owned(),
            within: Some(format!("{} (unit {})", plan.name, description.model_name)),
            suggestion: pattern::suggest(
                name,
                description.variables.iter().map(|variable| variable.name.as_str()),
            )
            .map(str::to_owned),
        })
    }

    /// All ports that a name with ranges and stars stands for, in order.
    ///
    /// # Errors
    /// A plain name does not exist, or a pattern matches nothing.
    pub fn select(&self, place: &str, pattern: &str) -> Result<Vec<Port>> {
        let names = pattern::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: place.to_owned(), source })?;
        let mut ports = Vec::new();
        for name in names {
            if !name.contains('*') {
                ports.push(self.port(place, &name)?);
                continue;
            }
            let before = ports.len();
            let Some((instance_glob, variable_glob)) = name.split_once('.') else {
                return Err(SystemError::Form { place: place.to_owned(), name });
            };
            for (instance, plan) in self.instances.iter().enumerate() {
                if !pattern::matches(instance_glob, &plan.name) {
                    continue;
                }
                for (variable, it) in plan.description().variables.iter().enumerate() {
                    if pattern::matches(variable_glob, &it.name) {
                        ports.push(Port { instance, variable });
                    }
                }
            }
            if ports.len() == before {
                return Err(SystemError::NoMatch { place: place.to_owned(), pattern: name });
            }
        }
        Ok(ports)
    }

    /// All instances that a name with ranges and stars stands for, in order.
    ///
    /// # Errors
    /// A name does not exist, or a pattern matches nothing.
    pub fn select_instances(&self, place: &str, pattern: &str) -> Result<Vec<usize>> {
        let names = pattern::expand(pattern)
            .map_err(|source| SystemError::Pattern { place: place.to_owned(), source })?;
        let mut found = Vec::new();
        for name in names {
            if name.contains('*') {
                let before = found.len();
                let all = self.instances.iter().enumerate();
                found.extend(
                    all.filter(|(_, plan)| pattern::matches(&name, &plan.name)).map(|(k, _)| k),
                );
                if found.len() == before {
                    return Err(SystemError::NoMatch { place: place.to_owned(), pattern: name });
                }
            } else {
                let index = self.find(&name);
                found.push(index.ok_or_else(|| self.unknown_instance(place, &name))?);
            }
        }
        Ok(found)
    }
}
