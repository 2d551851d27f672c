//! Modes of a coupled system: small motions about its start, as the equations have them and as the
//! master steps them.
//!
//! Every unit is asked for its linearisation ẋ = A x + B u, y = C x + D u (the report `linear`, which
//! is no part of FMI 2.0; `fmi2_export::StateSpace` is one way to answer it). Joined by the scenario's
//! connections they give the continuous system and its eigenvalues λ. The same linear units, stepped
//! by the scenario's own algorithm with its extrapolation and sequence, give the map from one
//! communication point to the next and its multipliers z; ln z/h is what a mode has become by the
//! coupling. Multipliers that belong to no λ are the coupling's own; one beyond the unit circle makes
//! the run unstable whatever the equations say.
//!
//! All this holds at one point, the start of the scenario ([`OperatingPoint`]). What is in no loop with
//! another unit there is named ([`UncoupledStates`]): that it is stable says nothing of what it does once coupled.

mod continuous;
mod linear_unit;
mod operating_point;
mod state_space;
mod stepped;
mod structure;

use faer::prelude::c64;
use indexmap::IndexMap;
use thiserror::Error;

use crate::coupling::{Blueprint, Links};
use crate::error::Error;
use crate::participant::Participant;
use crate::simulation::Setup;
use continuous::upper;
use fmi2_import::instance::FmuError;
pub use results::modes::{
    CoupledMode, CoupledModes, Eigenvalue, InputFamily, OperatingPoint, UncoupledStates,
};
use state_space::{Linear, StateSpace};
use stepped::Stepped;

/// Shares below this are left out.
const LEAST_SHARE: f64 = 1e-3;
/// Multipliers below this size are gone after a step and belong to no mode.
const GONE: f64 = 1e-8;

/// Why a system's modes cannot be found.
#[derive(Debug, Error)]
pub enum ModesError {
    /// A unit does not report its linearisation.
    #[error("{instance} does not tell its linearisation, which the modes are made of")]
    Silent {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// A unit steps in some communication steps only.
    #[error(
        "{instance} does not step in every communication step (\"every\"): modes are of equal steps"
    )]
    Slow {
        /// The instance, by its name in the scenario.
        instance: String,
    },
    /// A report cannot be used.
    #[error("the linearisation that {instance} reports cannot be used: {message}")]
    Report {
        /// The instance, by its name in the scenario.
        instance: String,
        /// What is wrong with the linearisation, in words.
        message: String,
    },
    /// A connected output is not in the report.
    #[error("the linearisation that {instance} reports leaves out its connected output {output}")]
    Missing {
        /// The instance, by its name in the scenario.
        instance: String,
        /// Connected output that the report lacks.
        output: String,
    },
    /// A unit does not return its inputs.
    #[error("cannot read the inputs of {instance} at the point of linearisation")]
    Inputs {
        /// The instance, by its name in the scenario.
        instance: String,
        /// The call that failed, and its status.
        #[source]
        source: FmuError,
    },
    /// An algebraic loop without a solution.
    #[error("the linearised system has an algebraic loop that cannot be solved")]
    Loop,
    /// The iteration for eigenvalues failed.
    #[error("the eigenvalues of the linearised system were not found")]
    Eigenvalues,
}

impl ModesError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::Silent { .. } | Self::Missing { .. } => Some(
                "modes need units that answer the report \"linear\" (docs/coupled-modes.md); \
                 `maglev run` does not need it",
            ),
            _ => None,
        }
    }
}

/// One connection between Real variables.
#[derive(Debug, Clone, Copy)]
struct LinearLink {
    unit: usize,
    input: usize,
    source: usize,
    output: usize,
    factor: f64,
}

fn eigenvalue(value: c64) -> Eigenvalue {
    let size = value.norm();
    Eigenvalue {
        real: value.re,
        imaginary: value.im,
        frequency_hz: size / std::f64::consts::TAU,
        damping_ratio: if size > 0.0 { -value.re / size } else { 0.0 },
    }
}

/// Finds the modes of a scenario at its start.
///
/// # Errors
/// The scenario does not start, or a unit does not report its linearisation.
pub fn find(setup: &Setup) -> Result<CoupledModes, Error> {
    let mut simulation = setup.start()?;
    let (participants, exchange, blueprint) = simulation.parts();
    let system = Linearised::new(participants, setup.scenario().experiment.start)?;
    let degree = setup.scenario().algorithm.degree();
    let step = setup.scenario().experiment.step;
    Ok(of(system, exchange.links(), degree, blueprint, step)?)
}

/// All units about one point.
struct Linearised {
    units: Vec<Linear>,
    /// Instance and states of each unit.
    names: Vec<(String, Vec<String>)>,
    point: OperatingPoint,
}

impl Linearised {
    fn new(participants: &mut [Participant], time: f64) -> Result<Self, ModesError> {
        let point = OperatingPoint { time, inputs: IndexMap::new() };
        let mut system = Self { units: Vec::new(), names: Vec::new(), point };
        for participant in participants {
            let received = operating_point::inputs(participant)?;
            let (inputs, outputs) = participant.exchanged_reals();
            let instance = participant.instance_mut();
            let name = instance.name().to_owned();
            let text = instance
                .report("linear")
                .map_err(|source| ModesError::Silent { instance: name.clone(), source })?;
            let report = StateSpace::read(&name, &text)?;
            let description = instance.package().description();
            system.units.push(report.between(&name, description, &inputs, &outputs)?);
            system.point.inputs.insert(name.clone(), received);
            system.names.push((name, report.states));
        }
        Ok(system)
    }
}

/// The modes of linear units.
fn of(
    system: Linearised,
    links: Vec<Links>,
    degree: usize,
    blueprint: &Blueprint,
    step: f64,
) -> Result<CoupledModes, ModesError> {
    let Linearised { units, names, point } = system;
    let connections: Vec<LinearLink> = links
        .iter()
        .enumerate()
        .flat_map(|(unit, links)| {
            links.reals.iter().map(move |link| LinearLink {
                unit,
                input: link.input,
                source: link.unit,
                output: link.output,
                factor: link.factor,
            })
        })
        .collect();
    let matrix = continuous::coupled(&units, &connections)?;
    let found = continuous::eigen(&matrix)?;
    let multipliers = Stepped::new(&units, links, degree, blueprint, step).multipliers()?;
    let values: Vec<c64> = found.iter().map(|eigen| eigen.value).collect();
    let (belonging, own) = assign(&values, &multipliers, step);
    let mut modes: Vec<CoupledMode> = found
        .iter()
        .zip(belonging)
        .map(|(eigen, stepped)| CoupledMode {
            continuous: eigenvalue(eigen.value),
            stepped: stepped.map(eigenvalue),
            relative_error: stepped.map(|it| (it - eigen.value).norm() / eigen.value.norm()),
            participation: participation(&units, &names, &eigen.shares),
        })
        .collect();
    modes.sort_by(|a, b| {
        let key = |mode: &CoupledMode| mode.continuous.damping_ratio;
        key(a)
            .total_cmp(&key(b))
            .then(a.continuous.frequency_hz.total_cmp(&b.continuous.frequency_hz))
    });
    Ok(CoupledModes {
        states: units.iter().map(|unit| unit.states).sum(),
        step,
        coupling_multiplier: own,
        apart: structure::apart(&matrix, &units, &names),
        operating_point: point,
        stable: values.iter().all(|value| value.re < 0.0),
        stepped_stable: multipliers.iter().all(|z| z.norm() < 1.0),
        modes,
    })
}

/// The multiplier that belongs to each eigenvalue, as ln z/h: nearest pairs first. Also the size of
/// the largest multiplier that belongs to none.
fn assign(values: &[c64], multipliers: &[c64], step: f64) -> (Vec<Option<c64>>, f64) {
    let candidates: Vec<c64> = multipliers
        .iter()
        .copied()
        .filter(|z| z.norm() > GONE)
        .filter_map(|z| upper(z.ln() / step))
        .collect();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for (i, value) in values.iter().enumerate() {
        for (j, candidate) in candidates.iter().enumerate() {
            let distance = (candidate - value).norm();
            // beyond its own size a multiplier has nothing of the mode left
            if distance < value.norm() {
                pairs.push((distance, i, j));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut belonging = vec![None; values.len()];
    let mut free = vec![true; candidates.len()];
    for (_, i, j) in pairs {
        if belonging[i].is_none() && free[j] {
            belonging[i] = Some(candidates[j]);
            free[j] = false;
        }
    }
    let own = candidates
        .iter()
        .zip(free)
        .filter(|(_, free)| *free)
        .map(|(candidate, _)| (candidate.re * step).exp())
        .fold(0.0, f64::max);
    (belonging, own)
}

/// Shares by instance, the largest first.
fn participation(
    units: &[Linear],
    names: &[(String, Vec<String>)],
    shares: &[f64],
) -> IndexMap<String, f64> {
    let mut rest = shares;
    let mut all: Vec<(String, f64)> = Vec::new();
    for (unit, (name, _)) in units.iter().zip(names) {
        let (mine, others) = rest.split_at(unit.states);
        rest = others;
        let share: f64 = mine.iter().sum();
        if share >= LEAST_SHARE {
            all.push((name.clone(), share));
        }
    }
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.into_iter().collect()
}
