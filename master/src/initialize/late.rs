//! Outputs that change on leaving initialization mode.
//!
//! All connected outputs are read once more after it, and handed on to all inputs, before the first
//! step. After that FMI 2.0 (4.2.4) allows no more reading until a unit has stepped. So a unit that
//! feeds such a value through cannot be asked for what becomes of it: whoever comes after it gets the
//! new value a step later, which is noted.

use std::collections::HashMap;

use crate::graph::SignalGraph;
use crate::system::{Port, System};

/// Notes that are made at most; one more counts the rest.
const MOST: usize = 10;

/// A note for each output that has changed and is fed through by a unit, whose own output feeds
/// others: `before` are the outputs in initialization mode, `now` those after it.
#[must_use]
pub fn notes(
    system: &System,
    before: &HashMap<Port, f64>,
    tolerance: f64,
    now: impl Fn(Port) -> Option<f64>,
) -> Vec<String> {
    let changed = |port: Port| -> Option<[f64; 2]> {
        let (old, new) = (*before.get(&port)?, now(port)?);
        let nominal = system.variable(port).nominal.unwrap_or(1.0).abs();
        let scale = f64::max(old.abs(), new.abs()).max(1e-3 * nominal);
        // a loop may be solved as exactly as that
        ((new - old).abs() > 10.0 * tolerance * scale).then_some([old, new])
    };
    let signals = SignalGraph::stepping(system);
    let found: Vec<String> = (0..signals.ports.len())
        .filter(|&node| !signals.is_input[node])
        .filter_map(|node| Some((node, changed(signals.ports[node])?)))
        .filter_map(|(node, change)| note(system, &signals, node, change))
        .collect();
    let more = found.len().saturating_sub(MOST);
    let rest = (more > 0).then(|| format!("{more} more outputs changed like that"));
    found.into_iter().take(MOST).chain(rest).collect()
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
         {}, still has its earlier value at the start, and {} a step later",
        name(node),
        name(output),
        name(input),
        match &targets[..] {
            [one] => format!("{one} gets the new value"),
            many => format!("{} get the new value", many.join(", ")),
        },
    );
    let others = paths().count() - 1;
    if others > 0 {
        text += &format!(" (and so do {others} more outputs and what they feed)");
    }
    Some(text)
}
