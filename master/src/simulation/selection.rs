//! The signals that a run is about: what is recorded and what is drawn.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::error::Error;
use crate::participant::{Participant, Slot};
use crate::system::{Port, System, SystemError};
use fmi2_import::description::Type;
use results::RecordedColumn;
use scenario::{Recorded, Scenario};

/// Signals of interest: those recorded first, then those only drawn.
#[derive(Debug)]
pub struct Selection {
    /// Those recorded, then those only drawn.
    pub ports: Vec<Port>,
    /// Of each recorded signal, the number of steps between two of its values
    pub strides: Vec<u64>,
    /// Per plot, per panel: positions in `ports`
    pub plots: Vec<Vec<Vec<usize>>>,
}

impl Selection {
    pub(super) fn new(scenario: &Scenario, system: &System) -> Result<Self, Error> {
        let mut ports: Vec<Port> = Vec::new();
        let mut strides = Vec::new();
        // positions beside the list: thousands of signals are usual
        let mut known: HashMap<Port, usize> = HashMap::new();
        for (k, entry) in scenario.record.signals.iter().enumerate() {
            let place = format!("record.signals[{k}]");
            let patterns = match entry {
                Recorded::Signal(pattern) => std::slice::from_ref(pattern),
                Recorded::Group(group) => group.signals.as_slice(),
            };
            for pattern in patterns {
                for port in Self::select(system, &place, pattern, Texts::Named)? {
                    if let Entry::Vacant(entry) = known.entry(port) {
                        entry.insert(ports.len());
                        ports.push(port);
                        strides.push(scenario.stride(k)?);
                    }
                }
            }
        }
        let mut plots = Vec::new();
        for (k, plot) in scenario.plots.iter().enumerate() {
            let mut panels = Vec::new();
            for (j, panel) in plot.panels.iter().enumerate() {
                let mut curves = Vec::new();
                for pattern in &panel.signals {
                    let place = format!("plots[{k}].panels[{j}].signals");
                    for port in Self::select(system, &place, pattern, Texts::Refused)? {
                        curves.push(*known.entry(port).or_insert_with(|| {
                            ports.push(port);
                            ports.len() - 1
                        }));
                    }
                }
                panels.push(curves);
            }
            plots.push(panels);
        }
        Ok(Self { ports, strides, plots })
    }

    /// The recorded signals.
    pub fn recorded(&self) -> impl Iterator<Item = Port> {
        self.ports.iter().take(self.strides.len()).copied()
    }

    /// The columns of the results.
    pub fn columns(&self, system: &System) -> Vec<RecordedColumn> {
        self.recorded()
            .zip(&self.strides)
            .map(|(port, &stride)| RecordedColumn {
                name: system.port_name(port),
                unit: base_unit(system, port),
                stride,
                is_text: system.variable(port).kind == Type::String,
            })
            .collect()
    }

    /// Signals; a star passes over texts.
    fn select(
        system: &System,
        place: &str,
        pattern: &str,
        texts: Texts,
    ) -> Result<Vec<Port>, SystemError> {
        let mut ports = system.select(place, pattern)?;
        if pattern.contains('*') && system.exact(pattern).is_none() {
            ports.retain(|port| system.variable(*port).kind != Type::String);
        }
        if texts == Texts::Named {
            return Ok(ports);
        }
        if let Some(text) = ports.iter().find(|port| system.variable(**port).kind == Type::String) {
            return Err(SystemError::NotNumeric {
                place: place.to_owned(),
                port: system.port_name(*text),
            });
        }
        Ok(ports)
    }

    /// Where the signals are among the participants; those of participants that do not exist are left out.
    pub fn slots(&self, participants: &[Participant]) -> Vec<(usize, Slot)> {
        self.ports
            .iter()
            .filter_map(|port| {
                // a run that did not start has none
                let participant = participants.get(port.instance)?;
                Some((port.instance, participant.slot(port.variable)?))
            })
            .collect()
    }
}

/// What becomes of Strings among signals.
#[derive(Clone, Copy, PartialEq)]
enum Texts {
    /// Those that are named are taken.
    Named,
    /// One that is named is an error.
    Refused,
}

/// Factor and offset to SI base units.
pub fn to_base(system: &System, port: Port) -> (f64, f64) {
    let description = system.instances[port.instance].description();
    let relative = system.variable(port).relative_quantity;
    description
        .unit_of(port.variable)
        .and_then(|unit| unit.base.as_ref())
        .map_or((1.0, 0.0), |base| (base.factor, if relative { 0.0 } else { base.offset }))
}

/// Unit of measurement in SI base units; the variable's own unit where that is not defined.
pub fn base_unit(system: &System, port: Port) -> Option<String> {
    let description = system.instances[port.instance].description();
    match description.unit_of(port.variable).and_then(|unit| Some((unit, unit.base.as_ref()?))) {
        Some((unit, base)) if base.factor == 1.0 && base.offset == 0.0 => Some(unit.name.clone()),
        Some((_, base)) => Some(base.expression()),
        None => system.variable(port).unit.clone(),
    }
}
