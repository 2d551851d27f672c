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

use faer::Mat;
use faer::prelude::c64;
use indexmap::IndexMap;
use master::Setup;
use results::modes::{CoupledMode, CoupledModes, Eigenvalue};

use super::eigen::eigen;
use super::error::LinearError;
use super::matching::{Matched, matched};
use super::stepped::Stepped;
use super::structure;
use super::system::Linearised;
use super::unit::LinearUnit;

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
    let Linearised { system, stepping } = linearised;
    let units = &system.units;
    let matrix: Mat<f64> = system.matrix()?;
    let found = eigen(&matrix)?;
    let multipliers = Stepped::new(units, stepping)?.multipliers()?;
    let values: Vec<c64> = found.iter().map(|eigen| eigen.value).collect();
    let Matched { stepped, own } = matched(&values, &multipliers, stepping.step);
    let mut modes: Vec<CoupledMode> = found
        .iter()
        .zip(stepped)
        .map(|(eigen, stepped)| CoupledMode {
            continuous: eigenvalue(eigen.value),
            stepped: stepped.map(eigenvalue),
            relative_error: stepped.map(|it| (it - eigen.value).norm() / eigen.value.norm()),
            participation: participation(units, &eigen.shares),
        })
        .collect();
    modes.sort_by(|a, b| {
        let key = |mode: &CoupledMode| mode.continuous.damping_ratio;
        key(a)
            .total_cmp(&key(b))
            .then(a.continuous.frequency_hz.total_cmp(&b.continuous.frequency_hz))
    });
    Ok(CoupledModes {
        states: system.states(),
        step: stepping.step,
        coupling_multiplier: own,
        apart: structure::apart(&matrix, units),
        operating_point: system.point.clone(),
        stable: values.iter().all(|value| value.re < 0.0),
        stepped_stable: multipliers.iter().all(|z| z.norm() < 1.0),
        modes,
    })
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
