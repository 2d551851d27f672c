//! Loops of direct feed-through while stepping, and how the scenario's algorithm treats them.
//!
//! In such an algebraic loop, outputs depend directly on inputs that depend on them. It must be solved
//! in every step, which an algorithm does that iterates over all units of the loop. Others cut it: some
//! input takes an older value. Extrapolated by a polynomial of degree 2, a loop of gain 1/7
//! already grows, since 3y₀ − 3y₁ + y₂ can be seven times as large as the values that it is computed
//! from. With held values, a loop with a gain below 1 converges. So connections in loops that are cut
//! are held, unless the scenario sets another degree.

use std::collections::{HashMap, HashSet};

use crate::system::{InstanceIndex, Link, Port, SignalGraph, System};
use coupling::Schedule;
use scenario::{AlgorithmName, Scenario};

/// A value larger than this times its nominal value has grown without bound: no physical quantity is
/// so large in any unit of measurement.
const UNBOUNDED: f64 = 1e30;

/// A loop of direct feed-through.
#[derive(Debug, Clone)]
pub struct AlgebraicLoop {
    /// Its outputs by name.
    pub names: String,
    /// All its ports.
    ports: HashSet<Port>,
    /// Its outputs.
    outputs: Vec<Port>,
    /// The algorithm that solves it in every step, if any.
    pub solver: Option<AlgorithmName>,
    /// Whether the scenario sets how its inputs are extrapolated.
    chosen: bool,
}

impl AlgebraicLoop {
    /// The loops of a system, from its graph for stepping.
    pub(super) fn find(
        scenario: &Scenario,
        system: &System,
        signals: &SignalGraph,
        schedule: &Schedule,
    ) -> Vec<Self> {
        let found = signals.loops().into_iter().map(|nodes| {
            let ports: HashSet<Port> = nodes.iter().map(|&node| signals.ports[node]).collect();
            let outputs = nodes.iter().filter(|&&node| !signals.is_input[node]);
            Self {
                names: signals.names(system, &nodes),
                outputs: outputs.map(|&node| signals.ports[node]).collect(),
                solver: solver(system, schedule, &ports),
                chosen: scenario.algorithm.extrapolation.is_some(),
                ports,
            }
        });
        found.collect()
    }

    /// A notice for the user before the start.
    #[must_use]
    pub fn notice(&self) -> String {
        let names = &self.names;
        match (self.solver, self.chosen) {
            (Some(name), _) => {
                format!("algebraic loop, solved in every step by {}: {names}", name.as_str())
            }
            (None, true) => format!(
                "algebraic loop, cut by extrapolation as the scenario sets it: {names}; without \
                 \"extrapolation\" its inputs are held; \"newton\" or \"iterated\" solve it"
            ),
            (None, false) => format!(
                "algebraic loop, cut by holding its inputs over each step (extrapolation 0): {names}; \
                 \"newton\" or \"iterated\" solve it"
            ),
        }
    }

    /// A sentence if the loop limits the accuracy of the coupling.
    pub(super) fn limit(&self) -> Option<String> {
        let held = self.solver.is_none() && !self.chosen;
        held.then(|| {
            format!(
                "{}: in an algebraic loop that the algorithm does not solve: the inputs in it are \
                 held over each step, so the coupling is of order 1",
                self.names
            )
        })
    }

    /// Whether its values have grown without bound; `value` returns them.
    pub(super) fn has_diverged(
        &self,
        system: &System,
        value: impl Fn(Port) -> Option<f64>,
    ) -> bool {
        let unbounded = |&port: &Port| {
            let limit = UNBOUNDED * system.nominal(port);
            value(port).is_some_and(|value| value.is_nan() || value.abs() > limit)
        };
        self.solver.is_none() && self.outputs.iter().any(unbounded)
    }
}

/// The ports in loops that no algorithm solves, each with its loop.
#[derive(Debug, Default)]
pub(super) struct CutLoops(HashMap<Port, usize>);

impl CutLoops {
    pub(super) fn of(loops: &[AlgebraicLoop]) -> Self {
        let open = loops.iter().enumerate().filter(|(_, it)| it.solver.is_none());
        Self(open.flat_map(|(k, it)| it.ports.iter().map(move |&port| (port, k))).collect())
    }

    /// Whether a connection is in one of the loops.
    pub(super) fn contain(&self, link: &Link) -> bool {
        let of = |port| self.0.get(port);
        of(&link.from).is_some() && of(&link.from) == of(&link.to)
    }
}

/// The iterating algorithm that steps all units of a loop, if all of them can repeat a step.
fn solver(system: &System, schedule: &Schedule, ports: &HashSet<Port>) -> Option<AlgorithmName> {
    let instances: HashSet<InstanceIndex> = ports.iter().map(|port| port.instance).collect();
    let able = |&k: &InstanceIndex| {
        system.instances[k].description().co_simulation.can_get_and_set_fmu_state
    };
    let mut homes = instances.iter().map(|&k| schedule.group_of(k.into()));
    let home = homes.next()??;
    let group = &schedule.groups[home];
    if !group.iterates() || homes.any(|other| other != Some(home)) {
        return None;
    }
    instances.iter().all(able).then_some(group.name)
}
