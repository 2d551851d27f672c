//! Counts of a vehicle's parts.

use std::collections::BTreeMap;

use crate::composite::Merged;
use crate::description::{JointKind, VehicleDescription};

/// What the vehicle consists of, before fixed joints are merged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VehicleCounts {
    /// Bodies of the description.
    pub bodies: usize,
    /// Joints by kind.
    pub joints: BTreeMap<JointKind, usize>,
    /// Constraint equations of all joints, brackets included.
    pub equations: usize,
    /// Rank of their Jacobian; equal to `equations`, since redundant joints are an error.
    pub rank: usize,
    /// Degrees of freedom, 6·bodies − rank.
    pub degrees_of_freedom: usize,
    /// Magnets: points of levitation and guidance forces.
    pub magnets: usize,
    /// Bodies after merging.
    pub composites: usize,
    /// Constraint equations after merging.
    pub reduced_equations: usize,
    /// Groups of composites that share no joint.
    pub components: usize,
    /// Bushings, springs and joint springs.
    pub force_elements: usize,
}

/// Counts bodies, joints and equations before and after merging.
pub(crate) fn counts(
    description: &VehicleDescription,
    merged: &Merged,
    reduced_equations: usize,
    components: usize,
) -> VehicleCounts {
    let mut joints = BTreeMap::new();
    for kind in
        [JointKind::Bracket, JointKind::Translational, JointKind::Spherical, JointKind::Revolute]
    {
        joints.insert(kind, description.joints.iter().filter(|j| j.kind == kind).count());
    }
    let equations = description.joints.iter().map(|j| j.kind.equations()).sum();
    VehicleCounts {
        bodies: description.bodies.len(),
        joints,
        equations,
        rank: equations,
        degrees_of_freedom: 6 * description.bodies.len() - equations,
        magnets: description.magnets.len(),
        composites: merged.composites.len(),
        reduced_equations,
        components,
        force_elements: description.bushings.len()
            + description.springs.len()
            + description.joint_forces.len(),
    }
}
