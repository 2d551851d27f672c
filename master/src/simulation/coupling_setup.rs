//! How the units of a scenario are coupled.

use std::collections::{HashMap, HashSet};

use super::loops::AlgebraicLoop;
use crate::system::{InstanceIndex, Port, SignalGraph, System, SystemError};
use coupling::{Schedule, Size, StepGroup, UnitIndex};
use fmi2_import::description::Type;
use scenario::{AlgorithmName, JacobianSource, Scenario};

/// Instances are the units of the coupling, in the same order.
impl From<InstanceIndex> for UnitIndex {
    fn from(instance: InstanceIndex) -> Self {
        Self(instance.0)
    }
}

impl From<UnitIndex> for InstanceIndex {
    fn from(unit: UnitIndex) -> Self {
        Self(unit.0)
    }
}

/// How the units are coupled: everything in the scenario's algorithm that names instances or signals.
pub struct CouplingSetup {
    /// Which algorithm steps which instances.
    pub schedule: Schedule,
    /// Pairs of effort and flow.
    pub power: Vec<(Port, Port)>,
    /// Loops of direct feed-through.
    pub loops: Vec<AlgebraicLoop>,
    /// Direct feed-through while stepping.
    pub signals: SignalGraph,
    /// What tolerances are relative to, where the scenario sets it.
    sizes: HashMap<Port, f64>,
}

impl CouplingSetup {
    /// Looks up the names in the scenario's algorithm.
    pub(super) fn new(scenario: &Scenario, system: &System) -> Result<Self, SystemError> {
        let settings = &scenario.algorithm;
        let signals = SignalGraph::stepping(system);
        let mut first = Vec::new();
        for (k, pattern) in settings.order.iter().enumerate() {
            first.extend(system.select_instances(&format!("algorithm.order[{k}]"), pattern)?);
        }
        let order: Vec<UnitIndex> =
            signals.sequence(system, &first).into_iter().map(UnitIndex::from).collect();
        let general =
            StepGroup { name: settings.name, iteration: settings.iteration, members: Vec::new() };
        let mut sizes = HashMap::new();
        for (pattern, &size) in &settings.sizes {
            let ports = system.select("algorithm.sizes", pattern)?;
            sizes.extend(ports.into_iter().map(|port| (port, size)));
        }
        let schedule = Schedule::grouped(&general, &groups(scenario, system)?, &order);
        let loops = AlgebraicLoop::find(scenario, system, &signals, &schedule);
        Ok(Self { schedule, sizes, power: power_pairs(scenario, system)?, loops, signals })
    }

    /// What a tolerance for a Real output is relative to.
    pub(super) fn size(&self, system: &System, port: Port) -> Size {
        Size { nominal: system.nominal(port), fixed: self.sizes.get(&port).copied() }
    }

    /// Whether the outputs of an instance are interpolated with second derivatives.
    pub(super) fn is_of_order_six(&self, instance: InstanceIndex) -> bool {
        let group = self.schedule.group_of(instance.into()).map(|k| &self.schedule.groups[k]);
        group.is_some_and(|group| group.iterates() && group.iteration.order == 6)
    }

    /// The instances whose states are saved.
    pub(super) fn saved(&self, scenario: &Scenario) -> HashSet<InstanceIndex> {
        self.members(|group| scenario.algorithm.variable.is_some() || group.iterates())
    }

    /// The instances whose directional derivatives Newton's method uses.
    pub(super) fn differentiated(&self) -> HashSet<InstanceIndex> {
        self.members(|group| {
            group.name == AlgorithmName::Newton
                && group.iteration.jacobian == JacobianSource::Directional
        })
    }

    fn members(&self, chosen: impl Fn(&StepGroup) -> bool) -> HashSet<InstanceIndex> {
        let groups = self.schedule.groups.iter().filter(|group| chosen(group));
        groups.flat_map(|group| group.members.iter().map(|&unit| unit.into())).collect()
    }
}

/// The groups of instances that have an algorithm of their own.
fn groups(scenario: &Scenario, system: &System) -> Result<Vec<StepGroup>, SystemError> {
    let mut groups = Vec::new();
    let mut grouped = HashSet::new();
    for (k, group) in scenario.algorithm.groups.iter().enumerate() {
        let place = format!("algorithm.groups[{k}].instances");
        let mut members: Vec<UnitIndex> = Vec::new();
        for pattern in &group.instances {
            for member in system.select_instances(&place, pattern)? {
                if !grouped.insert(member) {
                    let name = system.instances[member].name.clone();
                    let why = "occurs twice in algorithm.groups";
                    return Err(SystemError::InstanceName { name, why });
                }
                members.push(member.into());
            }
        }
        groups.push(StepGroup { name: group.name, iteration: group.iteration, members });
    }
    Ok(groups)
}

/// Pairs of effort and flow, which must be outputs that feed inputs.
fn power_pairs(scenario: &Scenario, system: &System) -> Result<Vec<(Port, Port)>, SystemError> {
    let feeding: HashSet<Port> = system.links.iter().map(|link| link.from).collect();
    let mut pairs = Vec::new();
    for (k, pair) in scenario.algorithm.power.iter().enumerate() {
        let place = format!("algorithm.power[{k}]");
        for (effort, flow) in system.pairs(&place, &pair.effort, &pair.flow)? {
            for port in [effort, flow] {
                if !feeding.contains(&port) || system.variable(port).kind != Type::Real {
                    let port = system.port_name(port);
                    return Err(SystemError::NotExchanged { place, port });
                }
            }
            pairs.push((effort, flow));
        }
    }
    Ok(pairs)
}
