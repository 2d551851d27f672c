//! A system of linear units and the connections between them.

use std::collections::HashMap;

use coupling::{Links, Schedule};
use indexmap::IndexMap;
use master::Setup;
use master::system::VariableIndex;
use results::modes::OperatingPoint;

use super::error::LinearError;
use super::operating_point;
use super::report::Report;
use super::unit::{LinearUnit, Quantity};

/// An input or output of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Port {
    /// Position of the unit in [`LinearSystem::units`].
    pub unit: usize,
    /// Position among the inputs, or among the outputs, of that unit.
    pub index: usize,
}

/// A connection: input = factor · output. An input with several takes their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Connection {
    /// The output.
    pub from: Port,
    /// The input.
    pub to: Port,
    /// Input over output, from their units of measure.
    pub factor: f64,
}

/// Linear units with the connections between them, about one point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinearSystem {
    /// The units, in the order of the scenario.
    pub units: Vec<LinearUnit>,
    /// The connections of Real variables.
    pub connections: Vec<Connection>,
    /// The point of linearisation.
    pub point: OperatingPoint,
}

impl LinearSystem {
    /// Number of states of all units.
    #[must_use]
    pub fn states(&self) -> usize {
        self.units.iter().map(|unit| unit.states.len()).sum()
    }

    /// The input of this name, `instance.variable`.
    ///
    /// # Errors
    /// There is none.
    pub fn input(&self, name: &str) -> Result<Port, LinearError> {
        self.port(name, "input", |unit| &unit.inputs)
    }

    /// The output of this name, `instance.variable`.
    ///
    /// # Errors
    /// There is none.
    pub fn output(&self, name: &str) -> Result<Port, LinearError> {
        self.port(name, "output", |unit| &unit.outputs)
    }

    fn port(
        &self,
        name: &str,
        kind: &'static str,
        list: impl Fn(&LinearUnit) -> &[Quantity],
    ) -> Result<Port, LinearError> {
        // names of instances and variables may have points
        let find = |(k, unit): (usize, &LinearUnit)| {
            let variable = name.strip_prefix(unit.name.as_str())?.strip_prefix('.')?;
            let index = list(unit).iter().position(|it| it.name == variable)?;
            Some(Port { unit: k, index })
        };
        self.units
            .iter()
            .enumerate()
            .find_map(find)
            .ok_or_else(|| LinearError::NoPort { name: name.to_owned(), kind })
    }

    /// Name of a port of [`Self::units`] and what it is measured in: `instance.variable`.
    fn named(&self, port: Port, list: impl Fn(&LinearUnit) -> &[Quantity]) -> Quantity {
        let unit = &self.units[port.unit];
        let Quantity { name, unit: measure } = &list(unit)[port.index];
        Quantity { name: format!("{}.{name}", unit.name), unit: measure.clone() }
    }

    /// An input by its full name, `instance.variable`.
    #[must_use]
    pub fn input_name(&self, port: Port) -> Quantity {
        self.named(port, |unit| &unit.inputs)
    }

    /// An output by its full name, `instance.variable`.
    #[must_use]
    pub fn output_name(&self, port: Port) -> Quantity {
        self.named(port, |unit| &unit.outputs)
    }

    /// Names of all states, `instance.state`, unit by unit.
    #[must_use]
    pub fn state_names(&self) -> Vec<String> {
        let of = |unit: &LinearUnit| -> Vec<String> {
            unit.states.iter().map(|state| format!("{}.{state}", unit.name)).collect()
        };
        self.units.iter().flat_map(of).collect()
    }
}

/// How the master steps a system.
#[derive(Debug, Clone)]
pub struct Stepping {
    /// Where the inputs of each unit come from, in the order of the units.
    pub links: Vec<Links>,
    /// Degree of the extrapolation of inputs.
    pub degree: usize,
    /// Which algorithm steps which units.
    pub schedule: Schedule,
    /// Communication step (s).
    pub step: f64,
}

impl Stepping {
    /// The connections of Real variables.
    #[must_use]
    pub fn connections(&self) -> Vec<Connection> {
        let mut all = Vec::new();
        for (unit, links) in self.links.iter().enumerate() {
            all.extend(links.reals.iter().map(|link| Connection {
                from: Port { unit: link.unit.0, index: link.output.0 },
                to: Port { unit, index: link.input.0 },
                factor: link.factor,
            }));
        }
        all
    }
}

/// A scenario linearised at its start.
#[derive(Debug, Clone)]
pub struct Linearised {
    /// The units and their connections.
    pub system: LinearSystem,
    /// How they are stepped.
    pub stepping: Stepping,
}

impl Linearised {
    /// Starts the scenario, and asks every unit for its linearisation.
    ///
    /// # Errors
    /// The scenario does not start, or a unit does not report its linearisation.
    pub fn at_start(setup: &Setup) -> Result<Self, LinearError> {
        let mut simulation = setup.start()?;
        let scenario = setup.scenario();
        let stepping = Stepping {
            links: simulation.exchange().links(),
            degree: scenario.algorithm.degree(),
            schedule: setup.coupling().schedule.clone(),
            step: scenario.experiment.step,
        };
        let time = scenario.experiment.start;
        let mut system = LinearSystem {
            units: Vec::new(),
            connections: stepping.connections(),
            point: OperatingPoint { time, inputs: IndexMap::new() },
        };
        // equal units at the same point give the same text: it is read once
        let mut read: HashMap<String, Report> = HashMap::new();
        for participant in simulation.participants_mut() {
            let received = operating_point::inputs(participant)?;
            let variables = participant.variables();
            let real = |list: &[(VariableIndex, usize)]| -> Vec<VariableIndex> {
                list.iter().map(|(variable, _)| *variable).collect()
            };
            let (inputs, outputs) = (real(&variables.inputs.reals), real(&variables.outputs.reals));
            let instance = participant.instance_mut();
            let name = instance.name().to_owned();
            let text = instance
                .report("linear")
                .map_err(|source| LinearError::Silent { instance: name.clone(), source })?;
            let report = match read.get(&text) {
                Some(report) => report.clone(),
                None => {
                    let report = Report::read(&name, &text)?;
                    read.insert(text, report.clone());
                    report
                }
            };
            let description = instance.package().description();
            system.units.push(report.into_unit(&name, description, &inputs, &outputs)?);
            system.point.inputs.insert(name, received);
        }
        Ok(Self { system, stepping })
    }
}
