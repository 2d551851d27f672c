//! Loops of direct feed-through while stepping, and what the scenario's algorithm does with them.
//!
//! An output that depends on an input without delay, connected in a circle. Over a step such a loop
//! has to be solved; an algorithm that iterates over all units of a loop does. Others cut it: some
//! input takes what was known before. Extrapolated by a polynomial of degree 2 a loop of gain 1/7
//! already grows, as 3y₀ − 3y₁ + y₂ has up to seven times the size of what it is made of; held, a loop
//! below 1 settles. So links in loops that are cut are held, unless the scenario says another degree.

use std::collections::{HashMap, HashSet};

use crate::coupling::Blueprint;
use crate::graph::SignalGraph;
use crate::system::{Link, Port, System};
use scenario::{AlgorithmName, Scenario};

/// A value this many times its nominal value has grown without bound: no quantity in any unit of
/// measurement is so large.
const BLOWN_UP: f64 = 1e30;

/// A loop of direct feed-through.
#[derive(Debug, Clone)]
pub struct FeedLoop {
    /// Its outputs by name.
    pub names: String,
    /// All its ports.
    ports: HashSet<Port>,
    /// Its Real and other outputs.
    outputs: Vec<Port>,
    /// The algorithm that solves it in every step, if one does.
    pub solver: Option<AlgorithmName>,
    /// Whether the scenario itself says how its inputs are extrapolated.
    chosen: bool,
}

impl FeedLoop {
    /// The loops of a system.
    pub(super) fn find(scenario: &Scenario, system: &System, blueprint: &Blueprint) -> Vec<Self> {
        let graph = SignalGraph::stepping(system);
        let found = graph.loops().into_iter().map(|nodes| {
            let ports: HashSet<Port> = nodes.iter().map(|&node| graph.ports[node]).collect();
            let outputs = nodes.iter().filter(|&&node| !graph.is_input[node]);
            Self {
                names: graph.names(system, &nodes),
                outputs: outputs.map(|&node| graph.ports[node]).collect(),
                solver: solver(system, blueprint, &ports),
                chosen: scenario.algorithm.extrapolation.is_some(),
                ports,
            }
        });
        found.collect()
    }

    /// What a user should know about it before the start.
    #[must_use]
    pub fn notice(&self) -> String {
        let names = &self.names;
        match (self.solver, self.chosen) {
            (Some(name), _) => {
                format!("algebraic loop, solved in every step by {}: {names}", name.as_str())
            }
            (None, true) => format!(
                "algebraic loop, cut by extrapolation as the scenario says: {names}; without \
                 \"extrapolation\" its inputs are held, \"newton\" or \"iterated\" solve it"
            ),
            (None, false) => format!(
                "algebraic loop, cut by holding its inputs over each step (extrapolation 0): {names}; \
                 \"newton\" or \"iterated\" solve it"
            ),
        }
    }

    /// Why the coupling is less exact than it could be, if it is.
    pub(super) fn limit(&self) -> Option<String> {
        let held = self.solver.is_none() && !self.chosen;
        held.then(|| {
            format!(
                "{}: in a loop of direct feed-through, which the algorithm does not solve: the inputs \
                 in it are held over each step, so the coupling is of order 1",
                self.names
            )
        })
    }

    /// Whether its values have grown without bound; `value` gives them.
    pub(super) fn has_blown_up(
        &self,
        system: &System,
        value: impl Fn(Port) -> Option<f64>,
    ) -> bool {
        let blown = |port: &Port| {
            let nominal = system.variable(*port).nominal.map_or(1.0, f64::abs);
            value(*port).is_some_and(|value| value.is_nan() || value.abs() > BLOWN_UP * nominal)
        };
        self.solver.is_none() && self.outputs.iter().any(blown)
    }
}

/// The connections in loops that no algorithm solves.
#[derive(Debug, Default)]
pub(super) struct Cuts(HashMap<Port, usize>);

impl Cuts {
    pub(super) fn of(loops: &[FeedLoop]) -> Self {
        let open = loops.iter().enumerate().filter(|(_, it)| it.solver.is_none());
        Self(open.flat_map(|(k, it)| it.ports.iter().map(move |&port| (port, k))).collect())
    }

    /// Whether a connection is in one of the loops.
    pub(super) fn contain(&self, link: &Link) -> bool {
        let of = |port| self.0.get(port);
        of(&link.from).is_some() && of(&link.from) == of(&link.to)
    }
}

/// The iterating algorithm that all units of a loop belong to, if all of them can step again.
fn solver(system: &System, blueprint: &Blueprint, ports: &HashSet<Port>) -> Option<AlgorithmName> {
    let units: HashSet<usize> = ports.iter().map(|port| port.instance).collect();
    let able =
        |&k: &usize| system.instances[k].description().co_simulation.can_get_and_set_fmu_state;
    let mut homes = units.iter().map(|&unit| blueprint.home(unit));
    let home = homes.next()??;
    let block = &blueprint.blocks[home];
    let iterates = matches!(block.name, AlgorithmName::Iterated | AlgorithmName::Newton);
    if !iterates || homes.any(|other| other != Some(home)) {
        return None;
    }
    units.iter().all(able).then_some(block.name)
}
