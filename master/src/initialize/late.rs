//! Outputs that change on leaving initialization mode.
//!
//! All connected outputs are read once more after it, and handed on to all inputs, before the first
//! step. After that FMI 2.0 (4.2.4) allows no more reading until a unit has stepped. So a unit that
//! feeds such a value through cannot be asked for what becomes of it: whoever comes after it gets the
//! new value a step later, which is noted. Its output jumps with the first step, so that neither
//! interpolation nor extrapolation draws a line from the earlier value to the new one.

use std::collections::HashMap;

use crate::graph::SignalGraph;
use crate::system::{Port, System};

/// Notes that are made at most; one more counts the rest.
const MOST: usize = 10;

/// What outputs that changed on leaving initialization mode lead to.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Late {
    /// For each of them that a unit feeds through to an output that feeds others.
    pub notes: Vec<String>,
    /// Outputs that depend on those by direct feed-through: at the start they have earlier values.
    pub stale: Vec<Port>,
}

/// Finds outputs that have changed: `before` are those in initialization mode, `now` those after it.
#[must_use]
pub fn find(
    system: &System,
    before: &HashMap<Port, f64>,
    tolerance: f64,
    now: impl Fn(Port) -> Option<f64>,
) -> Late {
    let changed = |port: Port| -> Option<[f64; 2]> {
        let (old, new) = (*before.get(&port)?, now(port)?);
        let nominal = system.variable(port).nominal.unwrap_or(1.0).abs();
        let scale = f64::max(old.abs(), new.abs()).max(1e-3 * nominal);
        // a loop may be solved as exactly as that
        ((new - old).abs() > 10.0 * tolerance * scale).then_some([old, new])
    };
    let signals = SignalGraph::stepping(system);
    let found: Vec<(usize, [f64; 2])> = (0..signals.ports.len())
        .filter(|&node| !signals.is_input[node])
        .filter_map(|node| Some((node, changed(signals.ports[node])?)))
        .collect();
    let changed: Vec<usize> = found.iter().map(|(node, _)| *node).collect();
    let stale = reached(&signals, changed).into_iter().map(|node| signals.ports[node]).collect();
    let noted = found.into_iter().filter_map(|(node, by)| note(system, &signals, node, by));
    let mut notes: Vec<String> = noted.collect();
    let more = notes.len().saturating_sub(MOST);
    notes.truncate(MOST);
    notes.extend((more > 0).then(|| format!("{more} more outputs changed like that")));
    Late { notes, stale }
}

/// Outputs that depend on these by direct feed-through.
fn reached(signals: &SignalGraph, from: Vec<usize>) -> Vec<usize> {
    let mut seen = vec![false; signals.ports.len()];
    let mut left = from;
    while let Some(node) = left.pop() {
        for &next in &signals.graph.next[node] {
            if !std::mem::replace(&mut seen[next], true) {
                left.push(next);
            }
        }
    }
    (0..seen.len()).filter(|&node| seen[node] && !signals.is_input[node]).collect()
}

fn note(
    system: &System,
    signals: &SignalGraph,
    node: usize,
    [old, new]: [f64; 2],
) -> Option<String> {
    let next = |node: usize| signals.graph.next[node].iter().copied();
    let name = |node: usize| system.port_name(signals.ports[node]);
    let paths = || next(node).flat_map(|input| next(input).map(move |output| (input, output)));
    let (input, output) = paths().next()?;
    let mut targets: Vec<String> = next(output).map(name).collect();
    if targets.len() > 3 {
        let more = targets.len() - 3;
        targets.truncate(3);
        targets.push(format!("{more} more"));
    }
    let mut text = format!(
        "{} changed on leaving initialization mode ({old} → {new}); {}, which depends on it through \
         {}, still has its earlier value at the start, and {} a step later, unless it steps after {}",
        name(node),
        name(output),
        name(input),
        match &targets[..] {
            [one] => format!("{one} gets the new value"),
            many => format!("{} get the new value", many.join(", ")),
        },
        system.instances[signals.ports[output].instance].name,
    );
    let others = paths().count() - 1;
    if others > 0 {
        text += &format!(" (and so do {others} more outputs and what they feed)");
    }
    Some(text)
}
