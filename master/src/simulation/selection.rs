//! The signals to record and to plot.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use crate::error::Error;
use crate::participant::{Participant, Slot};
use crate::system::{InstanceIndex, Port, System, SystemError};
use fmi2_import::description::Type;
use results::RecordedColumn;
use scenario::{MetricSignal, Recorded, Scenario, ScenarioError};

/// The signals to record and to plot.
#[derive(Debug)]
pub struct Selection {
    /// The recorded signals, those of figures included, then those that are only plotted.
    pub ports: Vec<Port>,
    /// Per recorded signal, the number of steps between two of its values.
    pub strides: Vec<u64>,
    /// Per plot and panel, positions in `ports`.
    pub plots: Vec<Vec<Vec<usize>>>,
}

impl Selection {
    pub(super) fn new(scenario: &Scenario, system: &System) -> Result<Self, Error> {
        let mut ports: Vec<Port> = Vec::new();
        let mut strides = Vec::new();
        // a map of positions, since thousands of signals are common
        let mut known: HashMap<Port, usize> = HashMap::new();
        for (k, entry) in scenario.record.signals.iter().enumerate() {
            let place = format!("record.signals[{k}]");
            let patterns = match entry {
                Recorded::Signal(pattern) => std::slice::from_ref(pattern),
                Recorded::Group(group) => group.signals.as_slice(),
            };
            for pattern in patterns {
                for port in Self::select(system, &place, pattern, Strings::Accepted)? {
                    if let Entry::Vacant(entry) = known.entry(port) {
                        entry.insert(ports.len());
                        ports.push(port);
                        strides.push(scenario.stride(k)?);
                    }
                }
            }
        }
        for MetricSignal { place, pattern, optional } in scenario.metric_signals() {
            let chosen = match Self::select(system, &place, pattern, Strings::Refused) {
                Err(_) if optional => continue,
                chosen => chosen?,
            };
            same_unit(system, place, pattern, &chosen)?;
            for port in chosen {
                if let Entry::Vacant(entry) = known.entry(port) {
                    entry.insert(ports.len());
                    ports.push(port);
                    // at the interval of the record
                    strides.push(scenario.stride(scenario.record.signals.len())?);
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
                    for port in Self::select(system, &place, pattern, Strings::Refused)? {
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

    /// The signals that a pattern matches. A star does not match Strings.
    fn select(
        system: &System,
        place: &str,
        pattern: &str,
        strings: Strings,
    ) -> Result<Vec<Port>, SystemError> {
        let mut ports = system.select(place, pattern)?;
        if pattern.contains('*') && system.exact(pattern).is_none() {
            ports.retain(|port| system.variable(*port).kind != Type::String);
        }
        if strings == Strings::Accepted {
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

    /// The places of the signals in the participants. Without participants, the list is empty.
    pub fn slots(&self, participants: &[Participant]) -> Vec<(InstanceIndex, Slot)> {
        self.ports
            .iter()
            .filter_map(|port| {
                // a run that has not started has no participants
                let participant = participants.get(port.instance.0)?;
                Some((port.instance, participant.slot(port.variable)?))
            })
            .collect()
    }
}

/// Refuses a figure of signals with different units of measurement: a star easily takes more than was meant.
fn same_unit(
    system: &System,
    place: String,
    pattern: &str,
    ports: &[Port],
) -> Result<(), ScenarioError> {
    let Some(&first) = ports.first() else { return Ok(()) };
    let measure = base_unit(system, first);
    let Some(&other) = ports.iter().find(|port| base_unit(system, **port) != measure) else {
        return Ok(());
    };
    let [first, other] = [first, other].map(|port| {
        let unit = base_unit(system, port).unwrap_or_else(|| "no unit".to_owned());
        format!("{} has {unit}", system.port_name(port))
    });
    let problem = format!(
        "\"{pattern}\" mixes units of measure: {first}, {other}; a range such as [01..64] is exact"
    );
    Err(ScenarioError::Metric { place, problem })
}

/// Treatment of Strings that are named without a star.
#[derive(Clone, Copy, PartialEq)]
enum Strings {
    /// They are selected.
    Accepted,
    /// They are errors.
    Refused,
}

/// Factor and offset from a variable's unit of measurement to SI base units.
pub fn to_base(system: &System, port: Port) -> (f64, f64) {
    let description = system.instances[port.instance].description();
    let relative = system.variable(port).relative_quantity;
    description
        .unit_of(port.variable.0)
        .and_then(|unit| unit.base.as_ref())
        .map_or((1.0, 0.0), |base| (base.factor, if relative { 0.0 } else { base.offset }))
}

/// A variable's unit of measurement in SI base units, or as declared if its base is not defined.
pub fn base_unit(system: &System, port: Port) -> Option<String> {
    let description = system.instances[port.instance].description();
    match description.unit_of(port.variable.0).and_then(|unit| Some((unit, unit.base.as_ref()?))) {
        Some((unit, base)) if base.factor == 1.0 && base.offset == 0.0 => Some(unit.name.clone()),
        Some((_, base)) => Some(base.expression()),
        None => system.variable(port).unit.clone(),
    }
}
