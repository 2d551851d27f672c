//! Puts names to what the analysis of the equations found.

use crate::composite::Composite;
use crate::elimination::Dependency;
use crate::error::{Error, Redundancy};
use crate::joint::JointConstraint;
use crate::ordering::AnalysisFailure;
use crate::state::Kinematics;

/// Puts names to what the analysis found.
pub(crate) fn explain(
    failure: &AnalysisFailure,
    composites: &[Composite],
    joints: &[JointConstraint],
    kin: &[Kinematics],
) -> Error {
    match failure {
        AnalysisFailure::Dependent(found) => {
            Error::Redundant(name_dependencies(found, joints, kin))
        }
        AnalysisFailure::Unusable(node) => {
            let (path, name) = composites.get(*node).map_or_else(
                || ("joints", &joints[node - composites.len()].name),
                |composite| ("bodies", &composite.name),
            );
            Error::Invalid {
                path: path.to_owned(),
                message: format!(
                    "the equations of `{name}` cannot be solved: masses, inertias, stiffnesses \
                     and lengths differ too much in magnitude, or overflow"
                ),
            }
        }
    }
}

/// Says in words what dependent equations constrain twice.
fn name_dependencies(
    found: &[Dependency],
    joints: &[JointConstraint],
    kin: &[Kinematics],
) -> Vec<Redundancy> {
    let bodies = kin.len() - 1;
    found
        .iter()
        .map(|dependency| {
            let joint = &joints[dependency.node - bodies];
            let direction = dependency
                .forces
                .get(&dependency.node)
                .map_or_else(String::new, |x| describe_reaction(joint, kin, x.as_slice()));
            let together_with = dependency
                .forces
                .keys()
                .filter(|n| **n != dependency.node)
                .map(|n| format!("`{}`", joints[n - bodies].name))
                .collect();
            Redundancy { joint: joint.name.clone(), direction, together_with }
        })
        .collect()
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
