//! Levelling valves: the preload of air springs follows the weight that they carry.
//!
//! The added forces of the springs balance the added weights in force and in moment about both horizontal
//! axes. Of all that do, they are the least in the sum of squares: a + b ξ + c η with the springs' places
//! (ξ, η) across gravity. So the body stays where it is in the vehicle file.

use nalgebra::{Matrix3, Vector3};

use crate::description::VehicleDescription;
use crate::error::Error;
use crate::math::{Mat3, Vec3, complement, normalised, rotation_matrix};

/// Singular values below this fraction of the largest are none: springs in one line carry no moment
/// about it.
const RANK_THRESHOLD: f64 = 1e-9;

/// Adds the weights (masses and their places) of observed body k to the preload of its springs.
pub(super) fn level(
    description: &mut VehicleDescription,
    k: usize,
    weights: &[(f64, Vec3)],
) -> Result<(), Error> {
    let gravity = Vec3::from(description.gravity);
    let springs = description.levelling_bushings(k)?;
    if weights.is_empty() || springs.is_empty() || gravity.norm() == 0.0 {
        return Ok(());
    }
    let up = -gravity.normalize();
    let (first, second) = complement(&up);
    let observed = &description.observed[k];
    let own = |name: &String| *name == observed.body || observed.parts.contains(name);
    let centre = description.bodies.iter().find(|b| b.name == observed.body);
    let origin = centre.map_or_else(Vec3::zeros, |b| b.position.into());
    let arm = |place: &Vec3| {
        let way = place - origin;
        Vector3::new(1.0, way.dot(&first), way.dot(&second))
    };
    let added = weights.iter().map(|(mass, place)| arm(place) * *mass).sum::<Vector3<f64>>();
    let arms: Vec<Vector3<f64>> =
        springs.iter().map(|&i| arm(&description.bushings[i].position.into())).collect();
    let gram = arms.iter().map(|c| c * c.transpose()).sum::<Matrix3<f64>>();
    let svd = gram.svd(true, true);
    let threshold = RANK_THRESHOLD * svd.singular_values.max();
    // both factors were asked for
    let Ok(law) = svd.solve(&(added * gravity.norm()), threshold) else { return Ok(()) };
    let from_a: Vec<bool> = springs.iter().map(|&i| own(&description.bushings[i].body_a)).collect();
    for ((&i, arm), from_a) in springs.iter().zip(&arms).zip(from_a) {
        let bushing = &mut description.bushings[i];
        let axes = bushing.orientation.map_or(Mat3::identity(), |q| rotation_matrix(normalised(q)));
        // the preload is the force on a; the body is on the side of b unless a is the body
        let on_a = if from_a { law.dot(arm) } else { -law.dot(arm) };
        let preload = Vec3::from(bushing.preload) + axes.tr_mul(&(up * on_a));
        bushing.preload = preload.into();
    }
    Ok(())
}
