//! Levels: outputs that can be read together, because none depends on another one of them.

use std::collections::{BTreeMap, HashMap, HashSet};

use crate::system::{InstanceIndex, SignalGraph, VariableIndex};

/// Outputs that are read together.
#[derive(Default)]
pub(super) struct Level {
    /// per instance, the outputs to read
    pub(super) reads: BTreeMap<InstanceIndex, Vec<VariableIndex>>,
}

/// A part of the initialization.
pub(super) enum Stage {
    Once(Level),
    Loop { nodes: Vec<usize>, levels: Vec<Level> },
}

/// Groups the signals: outputs of equal depth together, each loop separately.
pub(super) fn stages(signals: &SignalGraph) -> Vec<Stage> {
    let components = signals.graph.components();
    let mut home = vec![0; signals.ports.len()];
    for (k, component) in components.iter().enumerate() {
        for &node in component {
            home[node] = k;
        }
    }
    // the number of outputs on the longest path to a component
    let mut depth = vec![0_usize; components.len()];
    for (k, component) in components.iter().enumerate() {
        let passed = component.iter().any(|&node| !signals.is_input[node]);
        for &node in component {
            for &to in &signals.graph.next[node] {
                if home[to] != k {
                    depth[home[to]] = depth[home[to]].max(depth[k] + usize::from(passed));
                }
            }
        }
    }
    let mut once: BTreeMap<usize, Level> = BTreeMap::new();
    let mut loops: BTreeMap<usize, Vec<Stage>> = BTreeMap::new();
    for (k, component) in components.iter().enumerate() {
        if signals.graph.is_loop(component) {
            let levels = loop_levels(signals, component);
            let stage = Stage::Loop { nodes: component.clone(), levels };
            loops.entry(depth[k]).or_default().push(stage);
        } else if let [node] = component[..]
            && !signals.is_input[node]
        {
            let port = signals.ports[node];
            let level = once.entry(depth[k]).or_default();
            level.reads.entry(port.instance).or_default().push(port.variable);
        }
    }
    let deepest = depth.iter().copied().max().unwrap_or(0);
    let mut stages = Vec::new();
    for d in 0..=deepest {
        stages.extend(once.remove(&d).map(Stage::Once));
        stages.extend(loops.remove(&d).into_iter().flatten());
    }
    stages
}

/// Levels of a sweep over a loop: breadth first, from the outputs of its first instance.
fn loop_levels(signals: &SignalGraph, component: &[usize]) -> Vec<Level> {
    let inside: HashSet<usize> = component.iter().copied().collect();
    let outputs: Vec<usize> =
        component.iter().copied().filter(|&node| !signals.is_input[node]).collect();
    let mut level: HashMap<usize, usize> = HashMap::new();
    let first = outputs.iter().map(|&node| signals.ports[node].instance).min();
    let mut wave: Vec<usize> = outputs
        .iter()
        .copied()
        .filter(|&node| Some(signals.ports[node].instance) == first)
        .collect();
    let mut depth = 0;
    while !wave.is_empty() {
        for &node in &wave {
            level.insert(node, depth);
        }
        let mut next: Vec<usize> = wave
            .iter()
            .flat_map(|&node| &signals.graph.next[node])
            .filter(|input| inside.contains(input))
            .flat_map(|&input| &signals.graph.next[input])
            .copied()
            .filter(|output| inside.contains(output) && !level.contains_key(output))
            .collect();
        next.sort_unstable();
        next.dedup();
        wave = next;
        depth += 1;
    }
    let mut levels: Vec<Level> = Vec::new();
    levels.resize_with(depth, Level::default);
    for node in outputs {
        let port = signals.ports[node];
        // the waves reach every output, since a component is strongly connected
        let at = level.get(&node).copied().unwrap_or(0);
        levels[at].reads.entry(port.instance).or_default().push(port.variable);
    }
    levels
}
