//! Modes of a coupled system: small motions about its start, as modelled (continuous) and as the
//! master steps them.
//!
//! Every unit reports its linearisation ẋ = A x + B u, y = C x + D u (the report `linear`, which
//! is not part of FMI 2.0; `fmi2_export::StateSpace` is one way to provide it). The scenario's
//! connections join them to the continuous system with the eigenvalues λ. The same linear units, stepped
//! by the scenario's own algorithm with its extrapolation and order, give the map from one
//! communication point to the next, with the multipliers z. A stepped mode has the eigenvalue ln z/h, of
//! the branch that is nearest to λ: above 1/(2h), z alone does not show the frequency.
//! Multipliers that belong to no λ come from the coupling alone. One outside the unit circle makes
//! the run unstable, even if the continuous system is stable.
//!
//! All this is valid at one point, the start of the scenario ([`OperatingPoint`]). States that are in no
//! loop with another unit there are listed ([`UncoupledStates`]): their stability at this point does not carry over
//! to states in which they are coupled.

mod continuous;
mod error;
mod linear_unit;
mod matching;
mod operating_point;
mod state_space;
mod stepped;
mod structure;
#[cfg(test)]
mod tests;

use faer::prelude::c64;
use indexmap::IndexMap;

use crate::participant::Participant;
use crate::simulation::Setup;
use crate::system::VariableIndex;
use coupling::{Links, Schedule};
pub use error::ModesError;
use matching::{Matched, matched};
pub use results::modes::{
    CoupledMode, CoupledModes, Eigenvalue, InputFamily, OperatingPoint, UncoupledStates,
};
use state_space::{Linear, StateSpace};
use stepped::Stepped;

/// Smaller shares are left out.
const LEAST_SHARE: f64 = 1e-3;

/// An eigenvalue as frequency and damping.
fn eigenvalue(value: c64) -> Eigenvalue {
    let size = value.norm();
    Eigenvalue {
        real: value.re,
        imaginary: value.im,
        frequency_hz: size / std::f64::consts::TAU,
        damping_ratio: if size > 0.0 { -value.re / size } else { 0.0 },
    }
}

/// Computes the modes of a scenario at its start.
///
/// # Errors
/// The scenario does not start, or a unit does not report its linearisation.
pub fn find(setup: &Setup) -> Result<CoupledModes, ModesError> {
    let mut simulation = setup.start()?;
    let (participants, exchange, schedule) = simulation.parts();
    let system = Linearised::new(participants, setup.scenario().experiment.start)?;
    let degree = setup.scenario().algorithm.degree();
    let step = setup.scenario().experiment.step;
    of(system, exchange.links(), degree, schedule, step)
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
            let variables = participant.variables();
            let real = |list: &[(VariableIndex, usize)]| -> Vec<VariableIndex> {
                list.iter().map(|(variable, _)| *variable).collect()
            };
            let (inputs, outputs) = (real(&variables.inputs.reals), real(&variables.outputs.reals));
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
    schedule: &Schedule,
    step: f64,
) -> Result<CoupledModes, ModesError> {
    let Linearised { units, names, point } = system;
    let matrix = continuous::coupled(&units, &links)?;
    let found = continuous::eigen(&matrix)?;
    let instances: Vec<&str> = names.iter().map(|(name, _)| name.as_str()).collect();
    let multipliers =
        Stepped::new(&units, links, degree, schedule, step)?.multipliers(&instances)?;
    let values: Vec<c64> = found.iter().map(|eigen| eigen.value).collect();
    let Matched { stepped, own } = matched(&values, &multipliers, step);
    let mut modes: Vec<CoupledMode> = found
        .iter()
        .zip(stepped)
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
