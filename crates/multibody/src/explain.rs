//! Puts names to what the analysis of the equations found.

use crate::composite::Composite;
use crate::error::{Error, Redundancy};
use crate::joint::JointConstraint;
use crate::ordering::Unusable;
use crate::rank::Dependency;
use crate::state::Kinematics;

/// Names the body or joint whose equations cannot be factored.
pub(crate) fn unusable(
    Unusable(node): Unusable,
    composites: &[Composite],
    joints: &[JointConstraint],
) -> Error {
    let (path, name) = composites.get(node).map_or_else(
        || ("joints", &joints[node - composites.len()].name),
        |composite| ("bodies", &composite.name),
    );
    Error::Invalid {
        path: path.to_owned(),
        message: format!(
            "the equations of `{name}` cannot be solved: masses, inertias, stiffnesses and lengths \
             differ too much in magnitude, or overflow"
        ),
    }
}

/// Says in words what dependent equations constrain twice.
pub(crate) fn redundant(
    found: &[Dependency],
    joints: &[JointConstraint],
    kin: &[Kinematics],
) -> Error {
    let redundancy = |dependency: &Dependency| {
        let joint = &joints[dependency.joint];
        let own = dependency.multipliers.get(&dependency.joint);
        let direction =
            own.map_or_else(String::new, |x| describe_reaction(joint, kin, x.as_slice()));
        let others = dependency.multipliers.keys().filter(|k| **k != dependency.joint);
        let together_with = others.map(|k| format!("`{}`", joints[*k].name)).collect();
        Redundancy { joint: joint.name.clone(), direction, together_with }
    };
    Error::Redundant(found.iter().map(redundancy).collect())
}

fn describe_reaction(joint: &JointConstraint, kin: &[Kinematics], multipliers: &[f64]) -> String {
    let (force, moment) = joint.reaction(kin, multipliers);
    let mut parts = Vec::new();
    let largest = force.amax().max(moment.amax());
    for (what, v) in [("translation along", force), ("rotation about", moment)] {
        if v.amax() > 1e-6 * largest {
            let mut e = v.normalize();
            if e[e.iamax()] < 0.0 {
                e = -e;
            }
            // adding zero turns −0 into 0
            let [x, y, z] = [e.x, e.y, e.z].map(|c| (c * 1000.0).round() / 1000.0 + 0.0);
            parts.push(format!("{what} ({x}, {y}, {z})"));
        }
    }
    parts.join(" with ")
}
