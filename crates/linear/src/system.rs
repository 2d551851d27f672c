//! A system of linear units and the connections between them.

use std::collections::HashMap;

use coupling::{Links, Schedule};
use fmi2_import::instance::Instance;
use indexmap::IndexMap;
use master::system::VariableIndex;
use master::{Setup, Simulation};
use results::modes::OperatingPoint;

use super::derivatives;
use super::error::LinearError;
use super::model::Source;
use super::operating_point;
use super::report::Report;
use super::shapes::Motions;
use super::steps::UnitSteps;
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

    /// Checks that a pattern names an input or output.
    ///
    /// # Errors
    /// It names none.
    pub fn check_pattern(&self, pattern: &str) -> Result<(), LinearError> {
        let named = |unit: &LinearUnit| {
            let mut all = unit.inputs.iter().chain(&unit.outputs);
            all.any(|it| patterns::matches(pattern, &format!("{}.{}", unit.name, it.name)))
        };
        if self.units.iter().any(named) {
            return Ok(());
        }
        Err(LinearError::NoPort { name: pattern.to_owned(), kind: "input or output" })
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
    /// What moves in each unit, if it was asked for.
    pub motions: Vec<Motions>,
    /// Where the linearisation of each unit comes from.
    pub sources: Vec<Source>,
    /// Units without one, with models identified from their steps. Their linear units are empty.
    pub unreported: Vec<(String, UnitSteps)>,
}

/// What to ask units for, in addition to their linearisation.
#[derive(Clone, Copy, Default)]
struct Wanted<'a> {
    motions: bool,
    /// Identifies units without a linearisation, and those of which this is true in any case.
    identify: Option<&'a dyn Fn(&str) -> bool>,
}

impl Linearised {
    /// Starts the scenario, and asks every unit for its linearisation.
    ///
    /// # Errors
    /// The scenario does not start, or a unit does not report its linearisation.
    pub fn at_start(setup: &Setup) -> Result<Self, LinearError> {
        Self::started(setup, Wanted::default())
    }

    /// As [`Linearised::at_start`], and asks every unit what moves, for mode shapes.
    ///
    /// # Errors
    /// As [`Linearised::at_start`], or a unit describes its motions in a way that cannot be used.
    pub fn with_motions(setup: &Setup) -> Result<Self, LinearError> {
        Self::started(setup, Wanted { motions: true, ..Wanted::default() })
    }

    /// As [`Linearised::at_start`]; units that report no linearisation are identified from steps instead, and
    /// so are those of which `forced` is true.
    ///
    /// # Errors
    /// As [`Linearised::at_start`], or a unit cannot be identified either.
    pub fn with_identified(
        setup: &Setup,
        forced: &dyn Fn(&str) -> bool,
    ) -> Result<Self, LinearError> {
        Self::started(setup, Wanted { identify: Some(forced), ..Wanted::default() })
    }

    fn started(setup: &Setup, wanted: Wanted<'_>) -> Result<Self, LinearError> {
        Self::here(setup, &mut setup.start()?, wanted)
    }

    /// Asks every unit of a simulation for its linearisation where it is now.
    ///
    /// # Errors
    /// A unit does not report its linearisation.
    pub fn of(setup: &Setup, simulation: &mut Simulation<'_>) -> Result<Self, LinearError> {
        Self::here(setup, simulation, Wanted::default())
    }

    /// As [`Linearised::of`], and asks every unit what moves.
    ///
    /// # Errors
    /// As [`Linearised::of`], or a unit describes its motions in a way that cannot be used.
    pub fn of_with_motions(
        setup: &Setup,
        simulation: &mut Simulation<'_>,
    ) -> Result<Self, LinearError> {
        Self::here(setup, simulation, Wanted { motions: true, ..Wanted::default() })
    }

    fn here(
        setup: &Setup,
        simulation: &mut Simulation<'_>,
        wanted: Wanted<'_>,
    ) -> Result<Self, LinearError> {
        let scenario = setup.scenario();
        let stepping = Stepping {
            links: simulation.exchange().links(),
            degree: scenario.algorithm.degree(),
            schedule: setup.coupling().schedule.clone(),
            step: scenario.experiment.step,
        };
        let time = simulation.time();
        let mut system = LinearSystem {
            units: Vec::new(),
            connections: stepping.connections(),
            point: OperatingPoint { time, inputs: IndexMap::new() },
        };
        // equal units at the same point give the same text: it is read once
        let (mut motions, mut sources, mut unreported) = (Vec::new(), Vec::new(), Vec::new());
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
            let (report, source) = match asked(instance, wanted, &mut read, time, stepping.step)? {
                Answer::Report(report, source) => (report, source),
                Answer::Steps(steps) => {
                    sources.push(Source::Identified);
                    motions.push(Motions::default());
                    system.units.push(LinearUnit { name: name.clone(), ..Default::default() });
                    system.point.inputs.insert(name.clone(), received);
                    unreported.push((name, *steps));
                    continue;
                }
            };
            sources.push(source);
            let unit = {
                let description = instance.package().description();
                report.into_unit(&name, description, &inputs, &outputs)?
            };
            if wanted.motions {
                motions.push(Motions::of(instance, unit.states.len())?);
            }
            system.units.push(unit);
            system.point.inputs.insert(name, received);
        }
        Ok(Self { system, stepping, motions, sources, unreported })
    }
}

/// What a unit says of itself, or what its steps say.
enum Answer {
    Report(Report, Source),
    Steps(Box<UnitSteps>),
}

/// Asks a unit for its linearisation. `read` has the reports that were read before.
fn asked(
    instance: &mut Instance,
    wanted: Wanted<'_>,
    read: &mut HashMap<String, Report>,
    time: f64,
    step: f64,
) -> Result<Answer, LinearError> {
    let name = instance.name().to_owned();
    let identified = |instance: &mut Instance| {
        UnitSteps::of(instance, time, step).map(|it| Answer::Steps(Box::new(it)))
    };
    if wanted.identify.is_some_and(|forced| forced(&name)) {
        return identified(instance);
    }
    let silent = match instance.report("linear") {
        Ok(text) => {
            if let Some(report) = read.get(&text) {
                return Ok(Answer::Report(report.clone(), Source::Reported));
            }
            let report = Report::read(&name, &text)?;
            read.insert(text, report.clone());
            return Ok(Answer::Report(report, Source::Reported));
        }
        Err(silent) => silent,
    };
    match derivatives::of(instance) {
        Ok(Some(report)) => Ok(Answer::Report(report, Source::Derivatives)),
        _ if wanted.identify.is_some() => identified(instance),
        Ok(None) => Err(LinearError::Silent { instance: name, source: silent }),
        Err(source) => Err(LinearError::Derivatives { instance: name, source }),
    }
}
