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
//! All this is valid at one point, the start of the scenario ([`results::modes::OperatingPoint`]). States that are in no
//! loop with another unit there are listed ([`results::modes::UncoupledStates`]): their stability at this point does not carry over
//! to states in which they are coupled.

use faer::Mat;
use faer::prelude::c64;
use indexmap::IndexMap;
use master::Setup;
use results::modes::{CoupledMode, CoupledModes, CoupledParts, Eigenvalue, ModeShapes};

use super::error::LinearError;
use super::lanes::{Lanes, Motion};
use super::matching::{Matched, matched};
use super::stepped::Stepped;
use super::system::Linearised;
use super::unit::LinearUnit;
use super::{shapes, structure};

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
pub fn find(setup: &Setup) -> Result<CoupledModes, LinearError> {
    of(&Linearised::at_start(setup)?)
}

/// The modes of linear units.
///
/// # Errors
/// The units cannot be coupled, or their eigenvalues cannot be found.
pub fn of(linearised: &Linearised) -> Result<CoupledModes, LinearError> {
    Ok(with_shapes(linearised)?.0)
}

/// The modes of linear units, and what moves in them. Only units that were asked move
/// ([`Linearised::with_motions`]).
///
/// # Errors
/// As for [`of`].
pub fn with_shapes(linearised: &Linearised) -> Result<(CoupledModes, ModeShapes), LinearError> {
    let Linearised { system, stepping, motions, .. } = linearised;
    let units = &system.units;
    let matrix: Mat<f64> = system.matrix()?;
    let lanes = Lanes::of(system);
    // the two are independent
    let (found, multipliers) = std::thread::scope(|scope| {
        let found = scope.spawn(|| lanes.eigen(&matrix));
        let multipliers = Stepped::new(units, stepping).and_then(|it| it.multipliers());
        (found.join().unwrap_or(Err(LinearError::Eigenvalues)), multipliers)
    });
    let (found, multipliers) = (found?, multipliers?);
    let values: Vec<c64> = found.iter().map(|eigen| eigen.value).collect();
    let Matched { stepped, own } = matched(&values, &multipliers, stepping.step);
    let mut modes: Vec<(CoupledMode, &[c64])> = found
        .iter()
        .zip(stepped)
        .map(|(eigen, stepped)| {
            let mode = CoupledMode {
                continuous: eigenvalue(eigen.value),
                stepped: stepped.map(eigenvalue),
                relative_error: stepped.map(|it| (it - eigen.value).norm() / eigen.value.norm()),
                participation: participation(units, &eigen.shares),
            };
            (mode, eigen.shape.as_slice())
        })
        .collect();
    modes.sort_by(|a, b| {
        let (a, b) = (a.0.continuous, b.0.continuous);
        let by_damping = a.damping_ratio.total_cmp(&b.damping_ratio);
        by_damping.then(a.frequency_hz.total_cmp(&b.frequency_hz))
    });
    let shapes = shapes::shapes(units, motions, modes.iter().map(|(_, shape)| *shape));
    let apart = structure::apart(&matrix, units);
    let modes = CoupledModes {
        states: system.states(),
        step: stepping.step,
        coupling_multiplier: own,
        parts: structure::parts(units, &apart),
        apart,
        operating_point: system.point.clone(),
        stable: values.iter().all(|value| value.re < 0.0),
        stepped_stable: multipliers.iter().all(|z| z.norm() < 1.0),
        modes: modes.into_iter().map(|(mode, _)| mode).collect(),
    };
    Ok((modes, shapes))
}

/// The modes of the continuous system alone, least damped first, for many points: without those as stepped,
/// which take most of the time.
///
/// # Errors
/// The units cannot be coupled, or their eigenvalues cannot be found.
pub fn continuous(linearised: &Linearised) -> Result<Continuous, LinearError> {
    let units = &linearised.system.units;
    let matrix = linearised.system.matrix()?;
    let mode = |eigen: Motion| CoupledMode {
        continuous: eigenvalue(eigen.value),
        participation: participation(units, &eigen.shares),
        ..CoupledMode::default()
    };
    let mut modes: Vec<CoupledMode> =
        Lanes::of(&linearised.system).eigen(&matrix)?.into_iter().map(mode).collect();
    let damping = |mode: &CoupledMode| mode.continuous.damping_ratio;
    modes.sort_by(|a, b| damping(a).total_cmp(&damping(b)));
    let parts = structure::parts(units, &structure::apart(&matrix, units));
    Ok(Continuous { modes, parts })
}

/// Modes of the continuous system.
#[derive(Debug, Clone, PartialEq)]
pub struct Continuous {
    /// Least damped first; nothing is known of them as stepped.
    pub modes: Vec<CoupledMode>,
    /// Units with named parts, and which of these are coupled.
    pub parts: Vec<CoupledParts>,
}

/// Shares by instance, the largest first.
fn participation(units: &[LinearUnit], shares: &[f64]) -> IndexMap<String, f64> {
    let mut rest = shares;
    let mut all: Vec<(String, f64)> = Vec::new();
    for unit in units {
        let (mine, others) = rest.split_at(unit.states.len());
        rest = others;
        let share: f64 = mine.iter().sum();
        if share >= LEAST_SHARE {
            all.push((unit.name.clone(), share));
        }
    }
    all.sort_by(|a, b| b.1.total_cmp(&a.1));
    all.into_iter().collect()
}
