//! The sampled controller: sampling instants and the voltage held between them.

use crate::{
    Error,
    inputs::InputCourse,
    parameters::Sampling,
    runge_kutta::{self, Excitation},
    state::{Hold, State},
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
    let mut elapsed = 0.0;
    while elapsed < size {
        match next(&state.hold, sampling.period, time, elapsed, size) {
            Next::Sample => {
                let voltage = magnet.demand(state, course.direct(elapsed));
                state.hold.take(voltage, sampling.delayed);
            }
            Next::Hold { until } => {
                let drive = Excitation { course, time, held: Some(state.hold.applied) };
                runge_kutta::integrate(magnet, state, &drive, elapsed, until)?;
                elapsed = until;
            }
        }
    }
    Ok(())
}

/// What a sampled controller does next within a step.
pub(crate) enum Next {
    /// It takes a sample now.
    Sample,
    /// It holds its voltage until then, in s since the start of the step.
    Hold { until: f64 },
}

/// The next piece of a step of `size` from `time`, of which `elapsed` is done.
pub(crate) fn next(hold: &Hold, period: f64, time: f64, elapsed: f64, size: f64) -> Next {
    let rounding = 4.0 * f64::EPSILON * (time.abs() + size);
    let tolerance = COINCIDENCE * period + rounding;
    let due = hold.start + hold.next as f64 * period - time;
    if due <= elapsed + tolerance {
        Next::Sample
    } else if due < size - tolerance {
        Next::Hold { until: due }
    } else {
        Next::Hold { until: size }
    }
}
