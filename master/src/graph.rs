//! Directed graphs: strongly connected components and topological order.

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

    /// All nodes in topological order of their components; nodes of equal rank in their own order.
    #[must_use]
    pub fn ranked(&self) -> Vec<usize> {
        let components = self.components();
        let mut home = vec![0; self.next.len()];
        for (k, component) in components.iter().enumerate() {
            for &node in component {
                home[node] = k;
            }
        }
        let mut rank = vec![0_usize; components.len()];
        for (k, component) in components.iter().enumerate() {
            for &node in component {
                for &to in &self.next[node] {
                    if home[to] != k {
                        rank[home[to]] = rank[home[to]].max(rank[k] + 1);
                    }
                }
            }
        }
        let mut nodes: Vec<usize> = (0..self.next.len()).collect();
        nodes.sort_by_key(|&node| (rank[home[node]], node));
        nodes
    }
}
