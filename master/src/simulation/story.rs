//! What a scenario lets happen during a run: inputs over time, events, and conditions that end the run. All names and
//! values are checked before a unit runs.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::error::Error;
use crate::system::{Port, System, SystemError};
use coupling::{Outside, Taylor};
use fmi2_import::description::{Causality, Type, Value, Variability};
use scenario::{Comparison, Condition, Scenario};
use sources::Source;

/// Most values that a sentence about an event lists.
const MOST: usize = 3;

/// Everything that happens during a run by the scenario's order.
#[derive(Debug)]
pub(super) struct Story {
    /// what is due at a time, in the order of time
    pub(super) agenda: Vec<Due>,
    pub(super) events: Vec<PlannedEvent>,
    /// watches of the events, then of the stop conditions
    pub(super) watches: Vec<Watch>,
    pub(super) inputs: Vec<DrivenInput>,
}

/// Something that is due at a time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Due {
    pub(super) time: f64,
    pub(super) what: Happening,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Happening {
    /// an event, by its position
    Event(usize),
    /// an input jumps
    Jump,
    /// a derivative of an input jumps
    Kink,
}

/// New values for variables.
#[derive(Debug)]
pub(super) struct PlannedEvent {
    pub(super) name: String,
    pub(super) changes: Vec<(Port, Value)>,
    /// the changes in words
    pub(super) text: String,
}

/// A condition on signals.
#[derive(Debug)]
pub(super) struct Watch {
    pub(super) outcome: Outcome,
    pub(super) ports: Vec<Port>,
    pub(super) comparison: Comparison,
    pub(super) limit: f64,
    /// not checked before this time (s)
    pub(super) after: f64,
}

/// What follows when a condition becomes true.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Outcome {
    /// an event, by its position
    Event(usize),
    /// the end of the run; the name of the condition
    Stop(String),
}

/// An input that follows a signal over time.
#[derive(Debug)]
pub(super) struct DrivenInput {
    pub(super) port: Port,
    pub(super) driver: Driver,
}

/// Where the values of a driven input come from.
#[derive(Debug, Clone)]
pub(super) enum Driver {
    /// a signal of the scenario
    Signal(Arc<Source>),
    /// the program, by the input's place in its list
    Outside(Arc<Outside>, usize),
}

impl Story {
    /// Checks everything, and gives driven inputs their values at the start.
    pub(super) fn new(scenario: &Scenario, system: &mut System) -> Result<Self, Error> {
        let mut story = Self {
            agenda: Vec::new(),
            events: Vec::new(),
            watches: Vec::new(),
            inputs: Vec::new(),
        };
        story.add_inputs(scenario, system)?;
        story.add_events(scenario, system)?;
        for (k, stop) in scenario.stop_when.iter().enumerate() {
            let place = format!("stop_when[{k}]");
            let name = if stop.name.is_empty() { place.clone() } else { stop.name.clone() };
            story.add_watch(system, &place, &stop.when, Outcome::Stop(name))?;
        }
        // a stable sort: what is due at one time keeps the order of the scenario
        story.agenda.sort_by(|a, b| a.time.total_cmp(&b.time));
        Ok(story)
    }

    /// A checksum of the files that determine the story.
    pub(super) fn checksum(&self) -> u32 {
        self.inputs.iter().fold(0, |sum, it| sum.rotate_left(1) ^ it.driver.checksum())
    }

    fn add_inputs(&mut self, scenario: &Scenario, system: &mut System) -> Result<(), Error> {
        let experiment = scenario.experiment;
        let sources: HashMap<Port, Port> =
            system.links.iter().map(|link| (link.to, link.from)).collect();
        let mut driven: HashSet<Port> = HashSet::new();
        for (k, input) in scenario.inputs.iter().enumerate() {
            let place = format!("inputs[{k}]");
            let failed = |source| SystemError::Source { place: format!("{place}.signal"), source };
            let source = Arc::new(Source::new(&input.signal).map_err(failed)?);
            let to = format!("{place}.to");
            for pattern in input.to.as_slice() {
                for port in system.select_alike(&to, pattern)? {
                    drivable(system, &to, port, sources.get(&port))?;
                    if !driven.insert(port) {
                        return Err(refused(system, &to, port, "it has a signal already").into());
                    }
                    let start = Value::Real(source.at(experiment.start)[0]);
                    system.instances[port.instance].inputs.insert(port.variable, start);
                    let driver = Driver::Signal(Arc::clone(&source));
                    self.inputs.push(DrivenInput { port, driver });
                }
            }
            let breaks = source.breaks(experiment.start, experiment.stop).map_err(failed)?;
            let later = breaks.into_iter().filter(|it| it.time > experiment.start);
            self.agenda.extend(later.map(|it| Due {
                time: it.time,
                what: if it.jump { Happening::Jump } else { Happening::Kink },
            }));
        }
        system.driven = driven;
        Ok(())
    }

    fn add_events(&mut self, scenario: &Scenario, system: &System) -> Result<(), Error> {
        for (k, event) in scenario.events.iter().enumerate() {
            let place = format!("events[{k}]");
            let mut changes = Vec::new();
            for (pattern, setting) in &event.set {
                changes.extend(system.changes(&format!("{place}.set"), pattern, setting)?);
            }
            let shown = event.set.iter().take(MOST).map(|(to, value)| format!("{to} = {value}"));
            let mut text = shown.collect::<Vec<_>>().join(", ");
            if event.set.len() > MOST {
                text += &format!(" and {} more", event.set.len() - MOST);
            }
            let name = if event.name.is_empty() { place.clone() } else { event.name.clone() };
            self.events.push(PlannedEvent { name, changes, text });
            if let Some(time) = event.at {
                self.agenda.push(Due { time, what: Happening::Event(k) });
            }
            if let Some(when) = &event.when {
                self.add_watch(system, &place, when, Outcome::Event(k))?;
            }
        }
        Ok(())
    }

    fn add_watch(
        &mut self,
        system: &System,
        place: &str,
        when: &Condition,
        outcome: Outcome,
    ) -> Result<(), Error> {
        // the scenario is checked: there is one
        let Some((comparison, limit)) = when.comparison() else { return Ok(()) };
        let place = format!("{place}.when.signal");
        let ports = system.select_alike(&place, &when.signal)?;
        if let Some(text) = ports.iter().find(|port| system.variable(**port).kind == Type::String) {
            let port = system.port_name(*text);
            return Err(SystemError::NotNumeric { place, port }.into());
        }
        let after = when.after.unwrap_or(f64::NEG_INFINITY);
        self.watches.push(Watch { outcome, ports, comparison, limit, after });
        Ok(())
    }
}

/// Checks that a signal over time may drive an input.
fn drivable(
    system: &System,
    place: &str,
    port: Port,
    source: Option<&Port>,
) -> Result<(), SystemError> {
    let variable = system.variable(port);
    if variable.causality != Causality::Input {
        return Err(SystemError::Causality {
            place: place.to_owned(),
            port: system.port_name(port),
            causality: variable.causality,
            wanted: "an input",
        });
    }
    if let Some(&from) = source {
        let (place, to) = (place.to_owned(), system.port_name(port));
        return Err(SystemError::DrivenTwice { place, to, first: system.port_name(from) });
    }
    if variable.kind != Type::Real {
        let why = format!("signals are for Real inputs, and it is of type {}", variable.kind);
        return Err(refused(system, place, port, &why));
    }
    if system.overridden.iter().any(|it| it.port == port) {
        return Err(refused(system, place, port, "--set gives it a constant value"));
    }
    Ok(())
}

fn refused(system: &System, place: &str, port: Port, why: &str) -> SystemError {
    let (place, port) = (place.to_owned(), system.port_name(port));
    SystemError::NotSettable { place, port, why: why.to_owned() }
}

impl Driver {
    /// Value and derivatives at the begin of a step (s).
    pub(super) fn course(&self, time: f64, size: f64, slack: f64) -> Taylor {
        match self {
            Self::Signal(source) => Taylor::cubic(source.course(time, size, slack)),
            Self::Outside(outside, input) => outside.course(*input, time, slack),
        }
    }

    fn checksum(&self) -> u32 {
        match self {
            Self::Signal(source) => source.checksum(),
            Self::Outside(..) => 0,
        }
    }
}

impl DrivenInput {
    /// Whether it changes at communication points only.
    pub(super) fn is_held(&self, system: &System) -> bool {
        system.variable(self.port).variability != Variability::Continuous
    }
}
