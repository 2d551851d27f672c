//! Whether the supports hold a girder, as statics has it.

use nalgebra::DMatrix;

use crate::Error;
use crate::description::{GirderDescription, SupportDescription};

/// Least eigenvalue that counts as positive. Two supports a thousandth of the length apart, the
/// closest that are allowed, give some 5e-7.
const LEAST: f64 = 1e-9;

/// Refuses a girder that can move without strain: too few supports, or too many hinges.
///
/// Its rigid motions are straight lines between start, hinges and end, given by the deflections
/// there. Each support measures the deflection at its place, and the rotation if it holds that. The
/// girder is held if the measurements determine the motion, whatever the stiffnesses are.
pub(super) fn check(
    given: &GirderDescription,
    supports: &[SupportDescription],
    path: &str,
) -> Result<(), Error> {
    let mut corners = vec![0.0];
    corners.extend(&given.hinges);
    corners.push(given.length);
    let mut gram = DMatrix::<f64>::zeros(corners.len(), corners.len());
    for support in supports {
        let right = corners.partition_point(|&c| c <= support.x).clamp(1, corners.len() - 1);
        let part = corners[right] - corners[right - 1];
        let s = (support.x - corners[right - 1]) / part;
        let mut measure = |left: f64, right_share: f64| {
            for (i, a) in [(right - 1, left), (right, right_share)] {
                for (j, b) in [(right - 1, left), (right, right_share)] {
                    gram[(i, j)] += a * b;
                }
            }
        };
        measure(1.0 - s, s);
        if support.clamped || support.rotational_stiffness > 0.0 {
            measure(-1.0, 1.0);
        }
    }
    if gram.symmetric_eigenvalues().min() > LEAST {
        return Ok(());
    }
    let hinges = match given.hinges.len() {
        0 => String::new(),
        1 => " and 1 hinge".to_owned(),
        n => format!(" and {n} hinges"),
    };
    Err(Error::invalid(
        format!("{path}.supports"),
        format!("with {} of them{hinges} the girder can move as a mechanism", supports.len()),
        "add supports, hold the rotation at one (`clamped`), or remove hinges",
    ))
}
