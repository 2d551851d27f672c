//! Checks of the equilibrium in which a vehicle starts, and the internal step that it allows.

use fmi2_export::Error;
use multibody::{Equilibrium, Loads, ObservedIndex, State, VehicleModel, Workspace};

/// Largest roll, pitch or yaw (rad) of an observed body at the start, against its place in the file.
const MOST_TURN: f64 = 0.1;
/// Its largest displacement up, down or sideways, m.
const MOST_SHIFT: f64 = 0.2;
/// The classical Runge-Kutta scheme is stable up to |λ| h = 2.78 for decay and 2.83 for vibration.
const STABLE: f64 = 2.78;
/// Fraction of the longest stable step that a vehicle takes.
const MARGIN: f64 = 0.7;

/// Refuses an equilibrium in which a car body lies far from its place: it satisfies the equations, but is
/// not one that the vehicle is built for.
pub(crate) fn check_place(model: &VehicleModel, state: &State) -> Result<(), Error> {
    let start = model.initial_state();
    for (k, (name, _)) in model.observed().enumerate() {
        let k = ObservedIndex(k);
        let now = model.observed_attitude(state, k);
        let turns =
            model.observed_attitude(&start, k).into_iter().zip(now).zip(["roll", "pitch", "yaw"]);
        for ((placed, angle), what) in turns {
            let turn = angle - placed;
            if turn.abs() > MOST_TURN {
                return Err(refused(name, what, &format!("{turn:.3} rad")));
            }
        }
        let shift = model.observed_motion(state, k).displacement;
        for (shift, what) in [(shift.y, "lateral displacement"), (shift.z, "vertical displacement")]
        {
            if shift.abs() > MOST_SHIFT {
                return Err(refused(name, what, &format!("{shift:.3} m")));
            }
        }
    }
    Ok(())
}

fn refused(body: &str, what: &str, amount: &str) -> Error {
    Error::invalid(format!(
        "{body} is not held in its place: in the static equilibrium its {what} would be {amount} (at most \
         {MOST_TURN} rad or {MOST_SHIFT} m); give its supports more stiffness or a wider base (air springs, \
         anti-roll ends, more magnets or bogies), or reduce its load or move it to the middle"
    ))
}

/// |λ| of the fastest motion about an equilibrium, 1/s.
pub(crate) fn fastest(
    model: &VehicleModel,
    found: &Equilibrium,
    work: &mut Workspace,
) -> Result<f64, Error> {
    let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
    let forces = multibody::AppliedForces { magnets, external: &found.external, acceleration: 0.0 };
    model
        .fastest_rate(&found.state, forces, work)
        .map_err(|e| Error::caused(&e).context("the fastest motion of the vehicle"))
}

/// The longest internal step (s) that a vehicle with this fastest motion (1/s) takes.
pub(crate) fn longest_step(fastest: f64) -> f64 {
    MARGIN * STABLE / fastest
}
