//! Instants of a sampled controller, which holds its voltage between them.

use crate::state::Hold;

/// Instants closer than this fraction of a sample time count as one, so that a step that is meant
/// to end at a sampling instant does so despite rounding.
const COINCIDENCE: f64 = 1e-9;

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
