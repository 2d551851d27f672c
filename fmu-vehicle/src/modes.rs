//! The report `modes`: natural frequencies, damping ratios and participation.

use fmi2_export::Error;
use multibody::{
    AppliedForces, BodyShape, MagnetSprings, State, TrackContact, VehicleModel, damping_ratio,
    natural_frequency,
};
use serde::{Deserialize, Serialize};

/// Participation below this is omitted.
const LEAST_SHARE: f64 = 1e-3;

/// Options of the report `modes`, as JSON. Omitted values are zero: the forces on the magnets are
/// then constant.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct ModesOptions {
    /// N/m at each magnet, vertical.
    magnet_stiffness: f64,
    /// N·s/m at each magnet, vertical.
    magnet_damping: f64,
    /// N/m at each magnet, lateral.
    magnet_lateral_stiffness: f64,
    /// N·s/m at each magnet, lateral.
    magnet_lateral_damping: f64,
    /// State of the linearisation.
    pub at: At,
}

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum At {
    /// At rest under the static loads.
    #[default]
    Equilibrium,
    /// The current state, under the current forces.
    State,
}

impl ModesOptions {
    /// Parses the options of the request `modes`.
    pub fn read(text: &str) -> Result<Self, Error> {
        if text.trim().is_empty() {
            return Ok(Self::default());
        }
        let options: Self = serde_json::from_str(text)
            .map_err(|e| Error::caused(&e).context("the options of the report modes"))?;
        let numbers = [
            ("magnet_stiffness", options.magnet_stiffness),
            ("magnet_damping", options.magnet_damping),
            ("magnet_lateral_stiffness", options.magnet_lateral_stiffness),
            ("magnet_lateral_damping", options.magnet_lateral_damping),
        ];
        match numbers.into_iter().find(|(_, value)| !value.is_finite()) {
            Some((name, value)) => Err(Error::invalid(format!("{name} cannot be {value}"))),
            None => Ok(options),
        }
    }

    fn springs(&self) -> MagnetSprings {
        MagnetSprings {
            stiffness: self.magnet_stiffness,
            damping: self.magnet_damping,
            lateral_stiffness: self.magnet_lateral_stiffness,
            lateral_damping: self.magnet_lateral_damping,
        }
    }
}

#[derive(Debug, Serialize)]
struct ModesReport<'a> {
    vehicle: &'a str,
    time: f64,
    options: &'a ModesOptions,
    bodies: usize,
    constraint_rank: usize,
    degrees_of_freedom: usize,
    merged_bodies: usize,
    merged_constraint_rank: usize,
    modes: Vec<ModeEntry<'a>>,
}

#[derive(Debug, Serialize)]
struct ModeEntry<'a> {
    /// 1/s.
    real: f64,
    /// rad/s; 0 for a mode that does not oscillate, otherwise the positive one of the pair.
    imaginary: f64,
    /// |λ|/2π of a mode that oscillates.
    frequency_hz: Option<f64>,
    /// −Re λ/|λ|.
    damping_ratio: f64,
    participation: Vec<Participation<'a>>,
}

#[derive(Debug, Serialize)]
struct Participation<'a> {
    body: &'a str,
    share: f64,
}

/// Linearises and writes JSON.
pub(crate) fn report(
    model: &VehicleModel,
    state: &State,
    forces: &AppliedForces,
    track: Option<&TrackContact>,
    options: &ModesOptions,
) -> Result<String, Error> {
    let failed = |e: multibody::Error| Error::caused(&e).context("the report modes");
    let linearisation = model
        .linearise_in_contact(state, *forces, &options.springs(), track, &mut model.workspace())
        .map_err(failed)?;
    let counts = model.counts();
    let modes = linearisation
        .eigenvalues
        .iter()
        .map(|&value| {
            Ok(ModeEntry {
                real: value.re,
                imaginary: value.im,
                frequency_hz: (value.im > 0.0)
                    .then(|| natural_frequency(value) / std::f64::consts::TAU),
                damping_ratio: damping_ratio(value),
                participation: participation(model, &linearisation.shape(value).map_err(failed)?),
            })
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let report = ModesReport {
        vehicle: model.name(),
        time: state.time,
        options,
        bodies: counts.bodies,
        constraint_rank: counts.rank,
        degrees_of_freedom: linearisation.degrees_of_freedom(),
        merged_bodies: counts.composites,
        merged_constraint_rank: linearisation.rank,
        modes,
    };
    serde_json::to_string(&report).map_err(|e| Error::caused(&e).context("the report modes"))
}

/// Bodies by participation, largest first.
fn participation<'a>(model: &'a VehicleModel, shape: &[BodyShape]) -> Vec<Participation<'a>> {
    let mut all: Vec<_> = model
        .body_names()
        .zip(shape)
        .filter(|(_, moved)| moved.share >= LEAST_SHARE)
        .map(|(body, moved)| Participation { body, share: moved.share })
        .collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}
