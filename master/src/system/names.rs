//! Looks up the names in a scenario. A name that exists exactly as written is not a pattern.

use super::error::Named;
use super::{InstanceIndex, Port, Result, System, SystemError, VariableIndex};
use patterns::PatternError;

impl System {
    /// The port with exactly this name.
    pub(crate) fn exact(&self, name: &str) -> Option<Port> {
        let (instance, variable) = name.split_once('.')?;
        let instance = self.find(instance)?;
        let variable = self.instances[instance].find(variable)?;
        Some(Port { instance, variable })
    }

    /// The error for an instance name that does not exist.
    #[must_use]
    pub fn unknown_instance(&self, place: &str, name: &str) -> SystemError {
        let names = self.instance_names();
        SystemError::Unknown {
            place: place.to_owned(),
            what: Named::Instance,
            name: name.to_owned(),
            within: None,
            suggestion: patterns::suggest(name, names).map(str::to_owned),
        }
    }

    fn instance_names(&self) -> impl Iterator<Item = &str> {
        self.instances.iter().map(|plan| plan.name.as_str())
    }

    /// The pattern that was probably meant by one that matches nothing: instance and variable are corrected each on its
    /// own.
    fn similar_ports(&self, instances: &str, variable: &str) -> Option<String> {
        let matching = |pattern: &str| {
            let names = self.instance_names().enumerate();
            let found =
                names.filter(|(_, name)| *name == pattern || patterns::matches(pattern, name));
            found.map(|(index, _)| index).collect::<Vec<_>>()
        };
        let (mut instances, mut members) = (instances.to_owned(), matching(instances));
        if members.is_empty() {
            instances = patterns::suggest_pattern(&instances, self.instance_names())?;
            members = matching(&instances);
        }
        let variables = members.iter().flat_map(|&it| &self.instances[it].description().variables);
        let variable = patterns::suggest_pattern(variable, variables.map(|it| it.name.as_str()))?;
        Some(format!("{instances}.{variable}"))
    }

    /// The error for a variable that an instance does not have.
    fn unknown_variable(&self, place: &str, instance: InstanceIndex, name: &str) -> SystemError {
        let instance = &self.instances[instance];
        let description = instance.description();
        let names = description.variables.iter().map(|variable| variable.name.as_str());
        SystemError::Unknown {
            place: place.to_owned(),
            what: Named::Variable,
            name: name.to_owned(),
            within: Some(format!("{} (unit {})", instance.name, description.model_name)),
            suggestion: patterns::suggest(name, names).map(str::to_owned),
        }
    }

    /// The variables of an instance that a name with ranges matches. A star has no special meaning.
    pub(super) fn find_variables(
        &self,
        place: &str,
        instance: InstanceIndex,
        pattern: &str,
    ) -> Result<Vec<VariableIndex>> {
        let setup = &self.instances[instance];
        if let Some(variable) = setup.find(pattern) {
            return Ok(vec![variable]);
        }
        let names = patterns::expand(pattern).map_err(|source| in_pattern(place, source))?;
        let find = |name: &String| {
            let found = setup.find(name);
            found.ok_or_else(|| self.unknown_variable(place, instance, name))
        };
        names.iter().map(find).collect()
    }

    /// All ports that a name with ranges and stars matches, in order.
    ///
    /// # Errors
    /// A plain name does not exist, or a pattern matches nothing.
    pub fn select(&self, place: &str, pattern: &str) -> Result<Vec<Port>> {
        self.resolve(place, pattern, true)
    }

    /// All ports that a name with ranges and stars matches, in order. They have the same unit of measurement.
    ///
    /// # Errors
    /// As [`select`](Self::select), or units of measurement differ.
    pub(crate) fn select_alike(&self, place: &str, pattern: &str) -> Result<Vec<Port>> {
        let ports = self.select(place, pattern)?;
        let unit = |port: Port| self.variable(port).unit.as_deref().unwrap_or("1");
        let named = |port: Port| format!("{} ({})", self.port_name(port), unit(port));
        let differs = |other: &&Port| unit(**other) != unit(ports[0]);
        match ports.iter().find(differs) {
            None => Ok(ports),
            Some(&other) => Err(SystemError::MixedUnits {
                place: place.to_owned(),
                pattern: pattern.to_owned(),
                first: named(ports[0]),
                other: named(other),
            }),
        }
    }

    /// All ports that a name with ranges matches, in order. A star has no special meaning.
    pub(super) fn ports(&self, place: &str, pattern: &str) -> Result<Vec<Port>> {
        self.resolve(place, pattern, false)
    }

    /// The ports of two names with ranges, paired.
    ///
    /// # Errors
    /// A name does not exist, or the two match different numbers of ports.
    pub fn pairs(&self, place: &str, from: &str, to: &str) -> Result<Vec<(Port, Port)>> {
        let (sources, targets) = match (self.ports(place, from), self.ports(place, to)) {
            (Ok(sources), Ok(targets)) => (sources, targets),
            // different numbers are a better explanation than a missing name
            (sources, targets) => match patterns::zip(from, to) {
                Err(source @ PatternError::Lengths { .. }) => {
                    return Err(in_pattern(place, source));
                }
                _ => (sources?, targets?),
            },
        };
        patterns::pair((from, sources), (to, targets)).map_err(|source| in_pattern(place, source))
    }

    fn resolve(&self, place: &str, pattern: &str, stars: bool) -> Result<Vec<Port>> {
        if let Some(port) = self.exact(pattern) {
            return Ok(vec![port]);
        }
        let Some((instances, variables)) = patterns::split_port(pattern) else {
            return Err(SystemError::Form { place: place.to_owned(), name: pattern.to_owned() });
        };
        let names = patterns::expand(instances).map_err(|source| in_pattern(place, source))?;
        let members = names
            .into_iter()
            .map(|name| Ok((self.members(place, &name, stars)?, name)))
            .collect::<Result<Vec<_>>>()?;
        let mut choice = Choice { system: self, place, stars, ports: Vec::new() };
        for (members, name) in members {
            choice.add(&name, members, variables)?;
        }
        if choice.ports.len() > patterns::MAX_NAMES {
            let source = PatternError::TooMany { pattern: pattern.to_owned() };
            return Err(in_pattern(place, source));
        }
        Ok(choice.ports)
    }

    /// The instances that a name without ranges matches.
    fn members(&self, place: &str, name: &str, stars: bool) -> Result<Vec<InstanceIndex>> {
        if let Some(index) = self.find(name) {
            return Ok(vec![index]);
        }
        if !stars || !name.contains('*') {
            return Err(self.unknown_instance(place, name));
        }
        let all = self.indexed().filter(|(_, it)| patterns::matches(name, &it.name));
        Ok(all.map(|(k, _)| k).collect())
    }

    /// All instances that a name with ranges and stars matches, in order.
    ///
    /// # Errors
    /// A name does not exist, or a pattern matches nothing.
    pub fn select_instances(&self, place: &str, pattern: &str) -> Result<Vec<InstanceIndex>> {
        let names = patterns::expand(pattern).map_err(|source| in_pattern(place, source))?;
        let mut found = Vec::new();
        for name in names {
            let members = self.members(place, &name, true)?;
            if members.is_empty() {
                let suggestion = patterns::suggest_pattern(&name, self.instance_names());
                return Err(SystemError::NoMatch {
                    place: place.to_owned(),
                    pattern: name,
                    suggestion,
                });
            }
            found.extend(members);
        }
        Ok(found)
    }
}

fn in_pattern(place: &str, source: PatternError) -> SystemError {
    SystemError::Pattern { place: place.to_owned(), source }
}

/// The ports that a pattern matches, as they are found.
struct Choice<'a> {
    system: &'a System,
    place: &'a str,
    stars: bool,
    ports: Vec<Port>,
}

impl Choice<'_> {
    /// Adds variables of the instances that one name matches.
    fn add(&mut self, name: &str, members: Vec<InstanceIndex>, variables: &str) -> Result<()> {
        let (exact, others): (Vec<InstanceIndex>, Vec<InstanceIndex>) =
            members.into_iter().partition(|&it| self.variable(it, variables).is_some());
        for instance in &exact {
            self.ports.extend(self.variable(*instance, variables));
        }
        if others.is_empty() && !exact.is_empty() {
            return Ok(());
        }
        let expanded =
            patterns::expand(variables).map_err(|source| in_pattern(self.place, source))?;
        for variable in expanded {
            let before = self.ports.len();
            for &instance in &others {
                self.add_matches(instance, &variable);
            }
            if self.ports.len() == before && exact.is_empty() {
                return Err(self.nothing(name, &others, &variable));
            }
        }
        Ok(())
    }

    fn variable(&self, instance: InstanceIndex, name: &str) -> Option<Port> {
        let variable = self.system.instances[instance].find(name)?;
        Some(Port { instance, variable })
    }

    /// Adds the variables of an instance that a name without ranges matches, if any.
    fn add_matches(&mut self, instance: InstanceIndex, name: &str) {
        if let Some(port) = self.variable(instance, name) {
            self.ports.push(port);
        } else if self.stars && name.contains('*') {
            let variables = &self.system.instances[instance].description().variables;
            let all = variables.iter().enumerate();
            let matching = all.filter(|(_, it)| patterns::matches(name, &it.name));
            self.ports.extend(matching.map(|(k, _)| Port { instance, variable: VariableIndex(k) }));
        }
    }

    /// The error for names of an instance and a variable that match nothing.
    fn nothing(&self, name: &str, members: &[InstanceIndex], variable: &str) -> SystemError {
        match *members {
            [only] if !(name.contains('*') || self.stars && variable.contains('*')) => {
                self.system.unknown_variable(self.place, only, variable)
            }
            _ => SystemError::NoMatch {
                place: self.place.to_owned(),
                pattern: format!("{name}.{variable}"),
                suggestion: self.system.similar_ports(name, variable),
            },
        }
    }
}
