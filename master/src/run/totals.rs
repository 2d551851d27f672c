//! What the summary says of units and algorithm.

use indexmap::IndexMap;

use crate::graph::SignalGraph;
use crate::participant::Participant;
use crate::scenario::{AlgorithmName, Scenario};
use crate::summary::{AlgorithmSummary, UnitSummary};
use crate::system::System;

pub(super) fn units(
    scenario: &Scenario,
    system: &System,
    participants: &[Participant],
) -> IndexMap<String, UnitSummary> {
    let mut units = IndexMap::new();
    for (name, path) in &scenario.units {
        // without an instance there is nothing to tell
        let Some(first) = system.instances.iter().find(|plan| plan.package.path() == path) else {
            continue;
        };
        let description = first.description();
        let mine = || participants.iter().filter(|it| it.instance().package().path() == path);
        units.insert(
            name.clone(),
            UnitSummary {
                path: path.display().to_string(),
                model: description.model_name.clone(),
                version: description.version.clone(),
                guid: description.guid.clone(),
                generation_tool: description.generation_tool.clone(),
                instances: system
                    .instances
                    .iter()
                    .filter(|plan| plan.package.path() == path)
                    .count(),
                steps: mine().map(|it| it.instance().steps()).sum(),
                step_seconds: mine().map(|it| it.timing().step_seconds()).sum(),
                exchange_seconds: mine().map(|it| it.timing().exchange_seconds()).sum(),
            },
        );
    }
    units
}

pub(super) fn algorithm_summary(
    scenario: &Scenario,
    system: &System,
    order: &[usize],
) -> AlgorithmSummary {
    let stepping = SignalGraph::stepping(system);
    let sequential = scenario.algorithm.name == AlgorithmName::GaussSeidel;
    AlgorithmSummary {
        name: scenario.algorithm.name.as_str().to_owned(),
        extrapolation: scenario.algorithm.extrapolation,
        derivatives: scenario.algorithm.derivatives,
        order: order
            .iter()
            .filter(|_| sequential)
            .map(|&k| system.instances[k].name.clone())
            .collect(),
        algebraic_loops: stepping
            .loops()
            .iter()
            .map(|component| stepping.names(system, component))
            .collect(),
    }
}
