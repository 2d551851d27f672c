//! Entries of the summary for instances, units and algorithm.

use std::collections::HashMap;
use std::time::{Duration, Instant};

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

use super::journal::JournalSummary;
use master::Setup;
use master::participant::Participant;
use master::simulation::CouplingSetup;
use master::system::{InstanceIndex, InstanceSetup, System};
use results::summary::{
    AccuracyReport, AlgorithmSummary, CouplingSummary, FmuSummary, InstanceSummary, WallTime,
};
use scenario::{AlgorithmName, Scenario};

/// Totals of a run before it was resumed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Earlier {
    /// Wall time of stepping (s).
    pub(super) run_seconds: f64,
    /// How often the run was resumed.
    pub(super) resumed: u64,
    /// totals per instance
    instances: Vec<Work>,
}

/// Totals of one instance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
struct Work {
    steps: u64,
    warned_steps: u64,
    stalled_since: Option<f64>,
    step_seconds: f64,
    exchange_seconds: f64,
}

impl Earlier {
    /// These totals plus those since the run was resumed.
    pub(super) fn and(&self, run_seconds: f64, participants: &[Participant]) -> Self {
        let instances = (0..participants.len()).map(|k| self.work(k, participants)).collect();
        Self { run_seconds: self.run_seconds + run_seconds, resumed: self.resumed, instances }
    }

    fn work(&self, k: usize, participants: &[Participant]) -> Work {
        let mut work = self.instances.get(k).copied().unwrap_or_default();
        if let Some(participant) = participants.get(k) {
            work.steps += participant.instance().steps();
            work.warned_steps += participant.instance().warnings().steps();
            let stall = participant.stall().map(|stall| stall.since);
            work.stalled_since = work.stalled_since.or(stall);
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
    journal: &JournalSummary,
) -> IndexMap<String, InstanceSummary> {
    (0..)
        .zip(&setup.system().instances)
        .map(|(k, plan): (usize, _)| {
            let work = earlier.work(k, participants);
            let summary = InstanceSummary {
                unit: plan.unit.clone(),
                tolerance: plan.tolerance,
                steps: work.steps,
                warned_steps: work.warned_steps,
                stalled_since: work.stalled_since,
                discarded_steps: journal.discarded.get(k).copied().unwrap_or(0),
                messages: journal.sent.get(k).copied().unwrap_or(0),
                step_seconds: work.step_seconds,
                exchange_seconds: work.exchange_seconds,
            };
            (plan.name.clone(), summary)
        })
        .collect()
}

/// A sentence for each instance with steps that returned `fmi2Warning`.
pub(super) fn warned_steps(participants: &[Participant]) -> Vec<String> {
    let sentence = |participant: &Participant| {
        let instance = participant.instance();
        let (name, warned, all) = (instance.name(), instance.warnings().steps(), instance.steps());
        (warned > 0).then(|| format!("unit {name}: {warned} of {all} steps returned fmi2Warning"))
    };
    participants.iter().filter_map(sentence).collect()
}

pub(super) fn units(
    scenario: &Scenario,
    system: &System,
    instances: &IndexMap<String, InstanceSummary>,
) -> IndexMap<String, FmuSummary> {
    let mut first: HashMap<&str, &InstanceSetup> = HashMap::new();
    for plan in &system.instances {
        first.entry(&plan.unit).or_insert(plan);
    }
    let mut units = IndexMap::new();
    for (name, unit) in &scenario.units {
        // skips units without instances
        let Some(plan) = first.get(name.as_str()) else { continue };
        let description = plan.description();
        let unit = FmuSummary {
            path: unit.fmu.display().to_string(),
            resources: unit.resources.keys().cloned().collect(),
            model: description.model_name.clone(),
            version: description.version.clone(),
            guid: description.guid.clone(),
            generation_tool: description.generation_tool.clone(),
            instances: 0,
            steps: 0,
            step_seconds: 0.0,
            exchange_seconds: 0.0,
        };
        units.insert(name.clone(), unit);
    }
    for instance in instances.values() {
        let Some(unit) = units.get_mut(&instance.unit) else { continue };
        unit.instances += 1;
        unit.steps += instance.steps;
        unit.step_seconds += instance.step_seconds;
        unit.exchange_seconds += instance.exchange_seconds;
    }
    units
}

pub(super) fn wall_time(
    begin: Instant,
    start: Duration,
    run_seconds: f64,
    threads: usize,
    instances: &IndexMap<String, InstanceSummary>,
) -> WallTime {
    let units_seconds: f64 =
        instances.values().map(|it| it.step_seconds + it.exchange_seconds).sum();
    WallTime {
        total_seconds: begin.elapsed().as_secs_f64(),
        start_seconds: start.as_secs_f64(),
        run_seconds,
        units_seconds,
        master_seconds: Some(run_seconds - units_seconds).filter(|it| threads <= 1 && *it >= 0.0),
    }
}

pub(super) fn algorithm_summary(
    scenario: &Scenario,
    system: &System,
    setup: &CouplingSetup,
    (coupling, accuracy): (CouplingSummary, Option<AccuracyReport>),
) -> AlgorithmSummary {
    let schedule = &setup.schedule;
    let jacobi = schedule.groups.iter().all(|group| group.name == AlgorithmName::Jacobi);
    AlgorithmSummary {
        name: scenario.algorithm.name.as_str().to_owned(),
        extrapolation: scenario.algorithm.degree(),
        derivatives: scenario.algorithm.derivatives,
        order: schedule
            .order()
            .filter(|_| !jacobi)
            .map(|unit| system.instances[InstanceIndex::from(unit)].name.clone())
            .collect(),
        accuracy,
        algebraic_loops: setup.loops.iter().map(|it| it.names.clone()).collect(),
        coupling,
    }
}
