//! Dependencies between the connected outputs and inputs of a system.

use std::collections::{HashMap, HashSet};

use super::{InstanceIndex, Port, System, VariableIndex};
use crate::graph::Graph;
use fmi2_import::description::ModelDescription;

/// The graph of all connected outputs and inputs: an edge leads from a signal to one that depends on it.
#[derive(Debug)]
pub struct SignalGraph {
    /// The output or input of each node.
    pub ports: Vec<Port>,
    /// Whether each node is an input.
    pub is_input: Vec<bool>,
    /// Edges along connections and through instances.
    pub graph: Graph,
}

impl SignalGraph {
    /// Dependencies while initializing.
    #[must_use]
    pub fn initial(system: &System) -> Self {
        Self::build(system, ModelDescription::initial_dependencies)
    }

    /// Direct feed-through while stepping.
    #[must_use]
    pub fn stepping(system: &System) -> Self {
        Self::build(system, ModelDescription::step_dependencies)
    }

    fn build(
        system: &System,
        dependencies: impl Fn(&ModelDescription, usize) -> Vec<usize>,
    ) -> Self {
        let mut nodes: HashMap<Port, usize> = HashMap::new();
        let (mut ports, mut is_input) = (Vec::new(), Vec::new());
        let mut node = |port, input| {
            *nodes.entry(port).or_insert_with(|| {
                ports.push(port);
                is_input.push(input);
                ports.len() - 1
            })
        };
        let edges: Vec<(usize, usize)> =
            system.links.iter().map(|link| (node(link.from, false), node(link.to, true))).collect();
        let mut graph = Graph::new(ports.len());
        for (from, to) in edges {
            graph.edge(from, to);
        }
        for (output, &Port { instance, variable }) in ports.iter().enumerate() {
            if is_input[output] {
                continue;
            }
            let description = system.instances[instance].description();
            for variable in dependencies(description, variable.0).into_iter().map(VariableIndex) {
                if let Some(&input) = nodes.get(&Port { instance, variable }) {
                    graph.edge(input, output);
                }
            }
        }
        Self { ports, is_input, graph }
    }

    /// Loops: signals that depend on each other, by their nodes.
    #[must_use]
    pub fn loops(&self) -> Vec<Vec<usize>> {
        let components = self.graph.components();
        components.into_iter().filter(|component| self.graph.is_loop(component)).collect()
    }

    /// Names of a loop's outputs, shortened when there are many.
    #[must_use]
    pub fn names(&self, system: &System, component: &[usize]) -> String {
        const SHOWN: usize = 6;
        let outputs = || component.iter().filter(|&&node| !self.is_input[node]);
        let mut names: Vec<String> =
            outputs().take(SHOWN).map(|&node| system.port_name(self.ports[node])).collect();
        let count = outputs().count();
        if count > SHOWN {
            names.push(format!("and {} more", count - SHOWN));
        }
        names.join(", ")
    }

    /// An order for Gauss-Seidel, from the graph for stepping: instances step after those whose outputs
    /// reach their own outputs by direct feed-through. Ties and loops keep the order of the scenario.
    /// The instances in `first` step before all others.
    #[must_use]
    pub fn sequence(&self, system: &System, first: &[InstanceIndex]) -> Vec<InstanceIndex> {
        let count = system.instances.len();
        let mut graph = Graph::new(count);
        let mut known = HashSet::new();
        for (node, &from) in self.ports.iter().enumerate().filter(|(node, _)| !self.is_input[*node])
        {
            for &input in &self.graph.next[node] {
                let edge = (from.instance.0, self.ports[input].instance.0);
                let feeds_through = !self.graph.next[input].is_empty();
                if edge.0 != edge.1 && feeds_through && known.insert(edge) {
                    graph.edge(edge.0, edge.1);
                }
            }
        }
        let ready = graph.ranked().into_iter().map(InstanceIndex);
        let mut placed = vec![false; count];
        let all = first.iter().copied().chain(ready);
        all.filter(|&unit| !std::mem::replace(&mut placed[unit], true)).collect()
    }
}
