//! From the checked system to instances with their traffic laid out.

use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use super::loops::FeedLoop;
use super::needs::Needs;
use super::selection::Selection;
use super::wiring::Wiring;
use crate::coupling::{Block, Blueprint, Exchange, Size};
use crate::error::Error;
use crate::graph;
use crate::participant::Participant;
use crate::system::{Plan, Port, System, SystemError};
use fmi2_import::description::Type;
use fmi2_import::instance::{FmuError, Instance, InstanceOptions};
use fmi2_import::isolate::Isolation;
use fmi2_import::library::Functions;
use fmi2_import::trace::Trace;
use scenario::{OnDiscard, Scenario, ScenarioError};

/// Makes all instances; each library is loaded once, and again in the process of each isolated
/// instance. `again`: there have been instances of these units before in this process.
pub(super) fn instantiate(
    scenario: &Scenario,
    system: &System,
    trace: Option<&Trace>,
    again: bool,
) -> Result<Vec<Instance>, Error> {
    let settings = scenario.isolation;
    let seconds = |limit: Option<f64>| limit.and_then(|it| Duration::try_from_secs_f64(it).ok());
    let isolation = Isolation {
        step_timeout: seconds(settings.step_timeout),
        call_timeout: seconds(settings.call_timeout),
        memory: settings.memory,
        program: None,
    };
    let isolated = |plan: &Plan| plan.isolate.unwrap_or(settings.all);
    if isolation != Isolation::default() && !system.instances.iter().any(isolated) {
        return Err(ScenarioError::NothingIsolated.into());
    }
    let mut loaded: HashMap<PathBuf, (Functions, Arc<AtomicBool>)> = HashMap::new();
    let mut instances = Vec::with_capacity(system.instances.len());
    for plan in &system.instances {
        let package = &plan.package;
        let options = InstanceOptions { debug_log: plan.debug_log.clone(), trace: trace.cloned() };
        if isolated(plan) {
            let made = Instance::isolated_with_options(package, &isolation, &plan.name, &options);
            let mut instance = made.map_err(Error::Instantiate)?;
            isolation.step_timeout.into_iter().for_each(|it| instance.set_pending_limit(it));
            instances.push(instance);
            continue;
        }
        // keyed by the unpacked binary: one file under two names is unpacked, and loaded, twice
        let binary = package.binary();
        let once = package.description().co_simulation.can_be_instantiated_only_once_per_process;
        let (functions, dead) = match loaded.get(&binary) {
            Some(known) if !once => known.clone(),
            Some(_) => (Functions::load_copy(package)?, Arc::default()),
            None if once && again => (Functions::load_copy(package)?, Arc::default()),
            None => {
                let fresh: (Functions, Arc<AtomicBool>) =
                    (Functions::load(package)?, Arc::default());
                loaded.insert(binary, fresh.clone());
                fresh
            }
        };
        let made = Instance::with_options(package, functions, &dead, &plan.name, &options);
        instances.push(made.map_err(Error::Instantiate)?);
    }
    Ok(instances)
}

/// Begins the trace that the scenario asks for.
pub(super) fn trace(scenario: &Scenario) -> Result<Option<Trace>, Error> {
    let begin = |path: &PathBuf| {
        let failed = |source| Error::Trace { path: path.clone(), source };
        Trace::create(path).map_err(failed)
    };
    scenario.trace.as_ref().map(begin).transpose()
}

/// How the units are coupled, as far as names decide it.
pub struct Layout {
    /// Which algorithm steps which instances.
    pub blueprint: Blueprint,
    /// What tolerances are relative to, where the scenario says so.
    sizes: HashMap<Port, f64>,
    /// Pairs of effort and flow.
    pub power: Vec<(Port, Port)>,
    /// Loops of direct feed-through.
    pub loops: Vec<FeedLoop>,
}

impl Layout {
    /// Resolves the names in the scenario's algorithm.
    pub(super) fn new(scenario: &Scenario, system: &System) -> Result<Self, SystemError> {
        let settings = &scenario.algorithm;
        let mut first = Vec::new();
        for (k, pattern) in settings.order.iter().enumerate() {
            first.extend(system.select_instances(&format!("algorithm.order[{k}]"), pattern)?);
        }
        let order = graph::sequence(system, &first);
        let mut groups: Vec<Block> = Vec::new();
        let mut grouped = HashSet::new();
        for (k, group) in settings.groups.iter().enumerate() {
            let place = format!("algorithm.groups[{k}].instances");
            let mut members = Vec::new();
            for pattern in &group.instances {
                members.extend(system.select_instances(&place, pattern)?);
            }
            for member in &members {
                if !grouped.insert(*member) {
                    let name = system.instances[*member].name.clone();
                    let why = "occurs twice in algorithm.groups";
                    return Err(SystemError::InstanceName { name, why });
                }
            }
            groups.push(Block { name: group.name, iteration: group.iteration, members });
        }
        let general =
            Block { name: settings.name, iteration: settings.iteration, members: Vec::new() };
        let mut sizes = HashMap::new();
        for (pattern, &size) in &settings.sizes {
            let ports = system.select("algorithm.sizes", pattern)?;
            sizes.extend(ports.into_iter().map(|port| (port, size)));
        }
        let blueprint = Blueprint::grouped(&general, &groups, &order);
        let loops = FeedLoop::find(scenario, system, &blueprint);
        Ok(Self { blueprint, sizes, power: power_pairs(scenario, system)?, loops })
    }

    pub(super) fn size(&self, system: &System, port: Port) -> Size {
        let nominal = system.variable(port).nominal.map_or(1.0, f64::abs);
        Size { nominal, fixed: self.sizes.get(&port).copied() }
    }
}

/// Pairs of effort and flow: outputs that feed inputs.
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

/// Lays out what every instance exchanges and joins the instances to it.
pub(super) fn plan(
    scenario: &Scenario,
    system: &System,
    selection: &Selection,
    instances: Vec<Instance>,
    layout: &Layout,
) -> Result<(Vec<Participant>, Exchange), FmuError> {
    let experiment = scenario.experiment;
    let Wiring { mut traffic, mut links, .. } = Wiring::new(scenario, system, layout);
    for port in &selection.ports {
        traffic[port.instance].watched.push(port.variable);
    }
    let degree = scenario.algorithm.degree();
    let needs = Needs::of(scenario, &layout.blueprint);
    let mut participants = Vec::with_capacity(instances.len());
    for (k, (instance, traffic)) in instances.into_iter().zip(traffic).enumerate() {
        let mut participant = Participant::new(instance, traffic);
        let (steps, every) = (system.instances[k].steps, system.instances[k].every);
        participant.set_steps(steps);
        participant.set_every(every);
        let own = experiment.step * f64::from(every) / f64::from(steps);
        participant.keep_steps_equal(own, experiment.stop);
        if scenario.algorithm.on_discard == OnDiscard::Retry {
            participant.retry_discarded_steps()?;
        }
        links[k].offered = participant.ask_for_output_derivatives()?;
        if needs.states.contains(&k) {
            participant.ask_for_states()?;
        }
        if needs.directional.contains(&k) {
            participant.ask_for_directional_derivatives()?;
        }
        participants.push(participant);
    }
    Ok((participants, Exchange::new(links, degree)))
}
