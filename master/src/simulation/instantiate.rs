//! Creates the instances of a run and connects them.

use std::path::PathBuf;
use std::time::Duration;

use super::happenings::SNAP;
use super::pool::Pool;
use super::setup::Setup;
use super::wiring::Wiring;
use crate::error::Error;
use crate::participant::Participant;
use crate::system::{InstanceSetup, System};
use coupling::{Course, Exchange, Taylor};
use fmi2_import::instance::{FmuError, Instance, InstanceOptions};
use fmi2_import::isolate::Isolation;
use fmi2_import::trace::Trace;
use scenario::{OnDiscard, Scenario, ScenarioError};

/// Creates all instances. Each library is loaded once, and again in the process of each isolated
/// instance. `again`: this process has had instances of these units before.
pub(super) fn instantiate(
    scenario: &Scenario,
    system: &System,
    trace: Option<&Trace>,
    again: bool,
    pool: &mut Pool,
) -> Result<Vec<Instance>, Error> {
    let settings = scenario.isolation;
    let seconds = |limit: Option<f64>| limit.and_then(|it| Duration::try_from_secs_f64(it).ok());
    let isolation = Isolation {
        step_timeout: seconds(settings.step_timeout),
        call_timeout: seconds(settings.call_timeout),
        memory: settings.memory,
        program: None,
    };
    let isolated = |setup: &InstanceSetup| setup.isolate.unwrap_or(settings.all);
    if isolation != Isolation::default() && !system.instances.iter().any(isolated) {
        return Err(ScenarioError::NothingIsolated.into());
    }
    let mut instances = Vec::with_capacity(system.instances.len());
    for setup in &system.instances {
        let (package, name) = (&setup.package, &setup.name);
        let options = InstanceOptions { debug_log: setup.debug_log.clone(), trace: trace.cloned() };
        if isolated(setup) {
            let made = Instance::isolated_with_options(package, &isolation, name, &options);
            let mut instance = made.map_err(Error::Instantiate)?;
            isolation.step_timeout.into_iter().for_each(|it| instance.set_pending_limit(it));
            instances.push(instance);
            continue;
        }
        let used = trace.is_none().then(|| pool.take(setup)).flatten();
        if let Some(instance) = used {
            instances.push(instance);
            continue;
        }
        let (functions, dead) = pool.library(package, again)?;
        let made = Instance::with_options(package, functions, &dead, name, &options);
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

/// Connects initialized instances: finds out what the units can do beyond plain steps, and lays out the
/// signals between them.
pub(super) fn connect(
    setup: &Setup,
    instances: Vec<Instance>,
) -> Result<(Vec<Participant>, Exchange), FmuError> {
    let Setup { scenario, system, selection, coupling, story, .. } = setup;
    let experiment = scenario.experiment;
    let wiring = Wiring::new(scenario, system, coupling, &story.inputs);
    let Wiring { mut variables, mut links, given, .. } = wiring;
    let watched = story.watches.iter().flat_map(|watch| &watch.ports);
    for port in selection.ports.iter().chain(watched) {
        variables[port.instance].watched.push(port.variable);
    }
    let (saved, differentiated) = (coupling.saved(scenario), coupling.differentiated());
    let mut participants = Vec::with_capacity(instances.len());
    let all = instances.into_iter().zip(variables).zip(system.indexed());
    for ((instance, variables), (k, setup)) in all {
        let mut participant = Participant::new(instance, variables);
        participant.set_steps(setup.steps);
        participant.set_every(setup.every);
        let own = experiment.step * f64::from(setup.every) / f64::from(setup.steps);
        participant.keep_steps_equal(own, experiment.stop);
        if scenario.algorithm.on_discard == OnDiscard::Retry {
            participant.retry_discarded_steps()?;
        }
        links[k].offered = participant.probe_output_derivatives()?;
        if saved.contains(&k) || !story.watches.is_empty() {
            participant.probe_states()?;
        }
        if differentiated.contains(&k) {
            participant.probe_directional_derivatives()?;
        }
        participants.push(participant);
    }
    let mut exchange = Exchange::new(links, scenario.algorithm.degree());
    for (driven, (input, limit)) in story.inputs.iter().zip(given) {
        let slack = SNAP * experiment.step;
        let (driver, held) = (driven.driver.clone(), driven.is_held(system));
        let course: Course = Box::new(move |time, size| {
            let p = driver.course(time, size, slack);
            if held { Taylor::constant(p[0]) } else { p }
        });
        exchange.give(driven.port.instance.into(), input, limit, course);
    }
    Ok((participants, exchange))
}
