//! The sampled controller: sampling instants and the voltage held between them.

use crate::{
    Error,
    inputs::InputCourse,
    parameters::Sampling,
    runge_kutta::{self, Excitation},
    state::State,
    system::Magnet,
};

/// Instants closer than this fraction of a sample time count as one, so that a step that is meant
/// to end at a sampling instant does so despite rounding.
const COINCIDENCE: f64 = 1e-9;

/// Integrates over `size` from `time`, in pieces that end at sampling instants. A sample that falls
/// on the end of a step is taken at the start of the next, when the inputs of that instant are
/// known.
pub(crate) fn integrate(
    magnet: &Magnet,
    sampling: Sampling,
    state: &mut State,
    course: &InputCourse,
    time: f64,
    size: f64,
) -> Result<(), Error> {
    let rounding = 4.0 * f64::EPSILON * (time.abs() + size);
    let tolerance = COINCIDENCE * sampling.period + rounding;
    let mut elapsed = 0.0;
    while elapsed < size {
        let due = state.hold.start + state.hold.next as f64 * sampling.period - time;
        if due <= elapsed + tolerance {
            let [_, acceleration] = course.at(elapsed);
            let voltage = magnet.demand(state, acceleration);
            state.hold.take(voltage, sampling.delayed);
            continue;
        }
        let end = if due < size - tolerance { due } else { size };
        let drive = Excitation { course, time, held: Some(state.hold.applied) };
        runge_kutta::integrate(magnet, state, &drive, elapsed, end)?;
        elapsed = end;
    }
    Ok(())
}
