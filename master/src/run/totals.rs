//! What the summary says of instances, units and algorithm.

use std::time::{Duration, Instant};

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::Setup;
use crate::coupling::Blueprint;
use crate::graph::SignalGraph;
use crate::participant::Participant;
use crate::scenario::{AlgorithmName, Scenario};
use crate::summary::{AlgorithmSummary, CouplingSummary, InstanceSummary, UnitSummary, WallTime};
use crate::system::System;

/// What a run had done before it went on from a checkpoint.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Earlier {
    /// Wall time of stepping (s).
    pub(super) run_seconds: f64,
    /// How often it went on.
    pub(super) resumed: u64,
    /// per instance
    instances: Vec<Work>,
}

/// What one instance has done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Work {
    steps: u64,
    step_seconds: f64,
    exchange_seconds: f64,
}

impl Earlier {
    /// This, and what has been done since.
    pub(super) fn and(&self, run_seconds: f64, participants: &[Participant]) -> Self {
        let instances = (0..participants.len()).map(|k| self.work(k, participants)).collect();
        Self { run_seconds: self.run_seconds + run_seconds, resumed: self.resumed, instances }
    }

    fn work(&self, k: usize, participants: &[Participant]) -> Work {
        let mut work = self.instances.get(k).copied().unwrap_or_default();
        if let Some(participant) = participants.get(k) {
            work.steps += participant.instance().steps();
            work.step_seconds += participant.timing().step_seconds();
            work.exchange_seconds += participant.timing().exchange_seconds();
        }
        work
    }
}

pub(super) fn instances(
    setup: &Setup,
    participants: &[Participant],
    earlier: &Earlier,
    discarded: &[u64],
) -> IndexMap<String, InstanceSummary> {
    let units = &setup.scenario.units;
    let unit_of = |path| units.iter().find(|(_, it)| *it == path).map(|(name, _)| name);
    (0..)
        .zip(&setup.system.instances)
        .map(|(k, plan): (usize, _)| {
            let work = earlier.work(k, participants);
            let summary = InstanceSummary {
                unit: unit_of(plan.package.path()).cloned().unwrap_or_default(),
                tolerance: plan.tolerance,
                steps: work.steps,
                discarded_steps: discarded.get(k).copied().unwrap_or(0),
                step_seconds: work.step_seconds,
                exchange_seconds: work.exchange_seconds,
            };
            (plan.name.clone(), summary)
        })
        .collect()
}

pub(super) fn units(
    scenario: &Scenario,
    system: &System,
    instances: &IndexMap<String, InstanceSummary>,
) -> IndexMap<String, UnitSummary> {
    let mut units = IndexMap::new();
    for (name, path) in &scenario.units {
        // without an instance there is nothing to tell
        let Some(first) = system.instances.iter().find(|plan| plan.package.path() == path) else {
            continue;
        };
        let description = first.description();
        let mine = || instances.values().filter(|it| it.unit == *name);
        units.insert(
            name.clone(),
            UnitSummary {
                path: path.display().to_string(),
                model: description.model_name.clone(),
                version: description.version.clone(),
                guid: description.guid.clone(),
                generation_tool: description.generation_tool.clone(),
                instances: mine().count(),
                steps: mine().map(|it| it.steps).sum(),
                step_seconds: mine().map(|it| it.step_seconds).sum(),
                exchange_seconds: mine().map(|it| it.exchange_seconds).sum(),
            },
        );
    }
    units
}

pub(super) fn wall_time(
    begin: Instant,
    start: Duration,
    run_seconds: f64,
    instances: &IndexMap<String, InstanceSummary>,
) -> WallTime {
    let units_seconds: f64 =
        instances.values().map(|it| it.step_seconds + it.exchange_seconds).sum();
    WallTime {
        total_seconds: begin.elapsed().as_secs_f64(),
        start_seconds: start.as_secs_f64(),
        run_seconds,
        units_seconds,
        master_seconds: (run_seconds - units_seconds).max(0.0),
    }
}

pub(super) fn algorithm_summary(
    scenario: &Scenario,
    system: &System,
    blueprint: &Blueprint,
    coupling: CouplingSummary,
) -> AlgorithmSummary {
    let stepping = SignalGraph::stepping(system);
    let jacobi = blueprint.blocks.iter().all(|block| block.name == AlgorithmName::Jacobi);
    AlgorithmSummary {
        name: scenario.algorithm.name.as_str().to_owned(),
        extrapolation: scenario.algorithm.degree(),
        derivatives: scenario.algorithm.derivatives,
        order: blueprint
            .order()
            .filter(|_| !jacobi)
            .map(|k| system.instances[k].name.clone())
            .collect(),
        algebraic_loops: stepping
            .loops()
            .iter()
            .map(|component| stepping.names(system, component))
            .collect(),
        coupling,
    }
}
