//! Who depends on whom: order of evaluation, loops, a good Gauss-Seidel sequence.

use std::collections::{HashMap, HashSet};

use crate::system::{Port, System};

/// A directed graph over `0..n`.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    /// Successors of each node.
    pub next: Vec<Vec<usize>>,
}

impl Graph {
    /// A graph of `n` nodes without edges.
    #[must_use]
    pub fn new(n: usize) -> Self {
        Self { next: vec![Vec::new(); n] }
    }

    /// Adds an edge: `to` depends on `from`.
    pub fn edge(&mut self, from: usize, to: usize) {
        self.next[from].push(to);
    }

    /// Strongly connected components in topological order (Tarjan 1972, without recursion).
    #[must_use]
    pub fn components(&self) -> Vec<Vec<usize>> {
        const NEW: usize = usize::MAX;
        let n = self.next.len();
        let (mut index, mut low) = (vec![NEW; n], vec![NEW; n]);
        let (mut on_stack, mut stack) = (vec![false; n], Vec::new());
        let mut components = Vec::new();
        let mut counter = 0;
        for root in 0..n {
            if index[root] != NEW {
                continue;
            }
            let mut calls = vec![(root, 0)];
            while let Some((node, edge)) = calls.pop() {
                if edge == 0 {
                    index[node] = counter;
                    low[node] = counter;
                    counter += 1;
                    stack.push(node);
                    on_stack[node] = true;
                }
                if let Some(&to) = self.next[node].get(edge) {
                    calls.push((node, edge + 1));
                    if index[to] == NEW {
                        calls.push((to, 0));
                    } else if on_stack[to] {
                        low[node] = low[node].min(index[to]);
                    }
                    continue;
                }
                if let Some(&(parent, _)) = calls.last() {
                    low[parent] = low[parent].min(low[node]);
                }
                if low[node] == index[node] {
                    let mut component = Vec::new();
                    while let Some(member) = stack.pop() {
                        on_stack[member] = false;
                        component.push(member);
                        if member == node {
                            break;
                        }
                    }
                    component.sort_unstable();
                    components.push(component);
                }
            }
        }
        components.reverse();
        components
    }

    /// Whether a component is a loop: several nodes, or one that depends on itself.
    #[must_use]
    pub fn is_loop(&self, component: &[usize]) -> bool {
        component.len() > 1 || component.iter().any(|&node| self.next[node].contains(&node))
    }
}

/// The graph of all connected signals, for initialization or for steps.
#[derive(Debug)]
pub struct SignalGraph {
    /// Node k is this port: connected outputs and inputs.
    pub ports: Vec<Port>,
    /// Whether node k is an input.
    pub is_input: Vec<bool>,
    /// Edges along connections and through units.
    pub graph: Graph,
}

impl SignalGraph {
    /// Dependencies while initializing.
    #[must_use]
    pub fn initial(system: &System) -> Self {
        Self::build(system, |instance, output| {
            system.instances[instance].description().initial_dependencies(output)
        })
    }

    /// Direct feed-through while stepping.
    #[must_use]
    pub fn stepping(system: &System) -> Self {
        Self::build(system, |instance, output| {
            system.instances[instance].description().step_dependencies(output)
        })
    }

    fn build(system: &System, dependencies: impl Fn(usize, usize) -> Vec<usize>) -> Self {
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
        for (output, &port) in ports.iter().enumerate() {
            if is_input[output] {
                continue;
            }
            for variable in dependencies(port.instance, port.variable) {
                if let Some(&input) = nodes.get(&Port { instance: port.instance, variable }) {
                    graph.edge(input, output);
                }
            }
        }
        Self { ports, is_input, graph }
    }

    /// Loops: nodes that depend on each other.
    #[must_use]
    pub fn loops(&self) -> Vec<Vec<usize>> {
        self.graph
            .components()
            .into_iter()
            .filter(|component| self.graph.is_loop(component))
            .collect()
    }

    /// A loop's signals by name, shortened when there are many.
    #[must_use]
    pub fn names(&self, system: &System, component: &[usize]) -> String {
        const SHOWN: usize = 6;
        let mut names: Vec<String> = component
            .iter()
            .filter(|&&node| !self.is_input[node])
            .take(SHOWN)
            .map(|&node| system.port_name(self.ports[node]))
            .collect();
        let outputs = component.iter().filter(|&&node| !self.is_input[node]).count();
        if outputs > SHOWN {
            names.push(format!("and {} more", outputs - SHOWN));
        }
        names.join(", ")
    }
}

/// A sequence for Gauss-Seidel: units step after those whose outputs reach their own outputs by
/// direct feed-through; ties and loops keep the scenario's order. `first` steps before all others.
#[must_use]
pub fn sequence(system: &System, first: &[usize]) -> Vec<usize> {
    let n = system.instances.len();
    let stepping = SignalGraph::stepping(system);
    let mut graph = Graph::new(n);
    let nodes: HashMap<Port, usize> =
        stepping.ports.iter().enumerate().map(|(node, port)| (*port, node)).collect();
    let mut known = HashSet::new();
    for link in &system.links {
        let (from, to) = (link.from.instance, link.to.instance);
        let feeds = nodes.get(&link.to).is_some_and(|&node| !stepping.graph.next[node].is_empty());
        if from != to && feeds && known.insert((from, to)) {
            graph.edge(from, to);
        }
    }
    let mut order: Vec<usize> = Vec::with_capacity(n);
    let mut placed = vec![false; n];
    let ready = ranked(&graph);
    for unit in first.iter().copied().chain(ready) {
        if !std::mem::replace(&mut placed[unit], true) {
            order.push(unit);
        }
    }
    order
}

/// Nodes in topological order of their components, within a rank in their own order.
fn ranked(graph: &Graph) -> Vec<usize> {
    let components = graph.components();
    let mut home = vec![0; graph.next.len()];
    for (k, component) in components.iter().enumerate() {
        for &node in component {
            home[node] = k;
        }
    }
    let mut rank = vec![0_usize; components.len()];
    for (k, component) in components.iter().enumerate() {
        for &node in component {
            for &to in &graph.next[node] {
                if home[to] != k {
                    rank[home[to]] = rank[home[to]].max(rank[k] + 1);
                }
            }
        }
    }
    let mut nodes: Vec<usize> = (0..graph.next.len()).collect();
    nodes.sort_by_key(|&node| (rank[home[node]], node));
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn analytic_components_of_a_small_graph() {
        let mut graph = Graph::new(5);
        for (from, to) in [(0, 1), (1, 2), (2, 1), (2, 3), (4, 4)] {
            graph.edge(from, to);
        }
        let components = graph.components();
        assert_eq!(components.len(), 4);
        let place = |node| components.iter().position(|c| c.contains(&node)).unwrap();
        assert!(place(0) < place(1) && place(1) == place(2) && place(2) < place(3));
        assert!(graph.is_loop(&[1, 2]) && graph.is_loop(&[4]) && !graph.is_loop(&[0]));
    }

    proptest! {
        #[test]
        fn invariant_components_are_in_topological_order(
            edges in proptest::collection::vec((0_usize..12, 0_usize..12), 0..40)
        ) {
            let mut graph = Graph::new(12);
            for &(from, to) in &edges {
                graph.edge(from, to);
            }
            let components = graph.components();
            let mut place = [usize::MAX; 12];
            for (k, component) in components.iter().enumerate() {
                for &node in component {
                    place[node] = k;
                }
            }
            prop_assert!(place.iter().all(|&k| k != usize::MAX));
            for (from, to) in edges {
                prop_assert!(place[from] <= place[to]);
            }
            let ranks = ranked(&graph);
            prop_assert_eq!(ranks.len(), 12);
        }
    }
}
