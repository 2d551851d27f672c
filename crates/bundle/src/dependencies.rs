//! Which inputs and parameters of a bundle an output depends on, through the units inside and their connections.

use std::collections::{HashMap, HashSet};

use fmi2_import::description::{Causality, Initial, ModelDescription, Variability};
use master::system::{Port, System, VariableIndex};

/// The connections of a system and what is exposed of it.
pub(crate) struct Dependencies<'a> {
    system: &'a System,
    sources: HashMap<Port, Vec<Port>>,
    /// exposed inputs and parameters, by their places
    exposed: HashMap<Port, usize>,
}

impl<'a> Dependencies<'a> {
    pub(crate) fn new(system: &'a System, exposed: HashMap<Port, usize>) -> Self {
        let mut sources: HashMap<Port, Vec<Port>> = HashMap::new();
        for link in &system.links {
            sources.entry(link.to).or_default().push(link.from);
        }
        Self { system, sources, exposed }
    }

    /// The exposed inputs that a variable depends on directly while stepping.
    pub(crate) fn stepping(&self, of: Port) -> Vec<usize> {
        self.walk(of, ModelDescription::step_dependencies)
    }

    /// The exposed inputs and parameters that its first value depends on.
    pub(crate) fn initial(&self, of: Port) -> Vec<usize> {
        self.walk(of, initial)
    }

    fn walk(
        &self,
        of: Port,
        knowns: impl Fn(&ModelDescription, usize) -> Vec<usize>,
    ) -> Vec<usize> {
        let mut seen: HashSet<Port> = HashSet::from([of]);
        let mut left = vec![of];
        let mut found = Vec::new();
        while let Some(port) = left.pop() {
            let next: Vec<Port> = match self.system.variable(port).causality {
                Causality::Input | Causality::Parameter => {
                    found.extend(self.exposed.get(&port));
                    self.sources.get(&port).cloned().unwrap_or_default()
                }
                _ => {
                    let instance = port.instance;
                    let description = self.system.instances[instance].description();
                    let list = knowns(description, port.variable.0).into_iter();
                    list.map(|k| Port { instance, variable: VariableIndex(k) }).collect()
                }
            };
            left.extend(next.into_iter().filter(|port| seen.insert(*port)));
        }
        found.sort_unstable();
        found.dedup();
        found
    }
}

/// The inputs and parameters that the first value of an unknown depends on; all, if the description does not say.
fn initial(description: &ModelDescription, unknown: usize) -> Vec<usize> {
    let variable = &description.variables[unknown];
    if variable.variability == Variability::Constant || variable.initial == Some(Initial::Exact) {
        return Vec::new();
    }
    let is_known = |k: &usize| {
        matches!(description.variables[*k].causality, Causality::Input | Causality::Parameter)
    };
    let found = description.initial_unknowns.iter().find(|it| it.variable == unknown);
    match found.and_then(|it| it.dependencies.as_ref()) {
        Some(list) => list.iter().copied().filter(is_known).collect(),
        None => (0..description.variables.len()).filter(is_known).collect(),
    }
}
