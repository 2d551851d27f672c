//! Outputs that change on leaving initialization mode.
//!
//! All connected outputs are read once more after it, and passed to all inputs, before the first
//! step. After that FMI 2.0 (4.2.4) allows no more reading until a unit has stepped. If a unit feeds
//! such a value through, its own new output is therefore not known yet: its targets get it one step
//! later, which is noted. That output is marked to jump with the first step, so that neither
//! interpolation nor extrapolation combines the earlier value with the new one.

use std::collections::HashMap;

use crate::system::{Port, SignalGraph, System};

/// Largest number of notes; one more counts the others.
const MOST: usize = 10;

/// Consequences of outputs that changed on leaving initialization mode.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Late {
    /// One for each of them that a unit feeds through to a connected output.
    pub notes: Vec<String>,
    /// Outputs that depend on those by direct feed-through and have earlier values at the start.
    pub stale: Vec<Port>,
}

/// Finds outputs that have changed: `before` has the values in initialization mode, `now` those after
/// it, and `signals` is the graph for stepping.
#[must_use]
pub fn find(
    system: &System,
    signals: &SignalGraph,
    before: &HashMap<Port, f64>,
    tolerance: f64,
    now: impl Fn(Port) -> Option<f64>,
) -> Late {
    let changed = |port: Port| -> Option<[f64; 2]> {
        let (old, new) = (*before.get(&port)?, now(port)?);
        let scale = f64::max(old.abs(), new.abs()).max(1e-3 * system.nominal(port));
        // solved loops have errors of this size
        ((new - old).abs() > 10.0 * tolerance * scale).then_some([old, new])
    };
    let found: Vec<(usize, [f64; 2])> = (0..signals.ports.len())
        .filter(|&node| !signals.is_input[node])
        .filter_map(|node| Some((node, changed(signals.ports[node])?)))
        .collect();
    let changed: Vec<usize> = found.iter().map(|(node, _)| *node).collect();
    let stale = reached(signals, changed).into_iter().map(|node| signals.ports[node]).collect();
    let noted = found.into_iter().filter_map(|(node, by)| note(system, signals, node, by));
    let mut notes: Vec<String> = noted.collect();
    let more = notes.len().saturating_sub(MOST);
    notes.truncate(MOST);
    notes.extend((more > 0).then(|| format!("{more} more outputs changed in the same way")));
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
         {}, still has its earlier value at the start, and {} one step later, unless it steps after {}",
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
        text += &format!(" (the same is true of {others} more outputs and their targets)");
    }
    Some(text)
}
