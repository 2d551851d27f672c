//! Spring-damper and constant force in the free coordinate of a translational or revolute joint.

use super::elastic::{ElasticRow, rotation_row, translation_row};
use crate::description::JointKind;
use crate::index::JointIndex;
use crate::joint::JointConstraint;
use crate::state::{Kinematics, Wrench};

/// f = f0 − (k s + c ṡ) on b along the joint's axis, or the moment f0 − (k φ + c φ̇) about it.
#[derive(Debug, Clone)]
pub(crate) struct JointForceElement {
    pub joint: JointIndex,
    /// N/m or N·m/rad.
    pub stiffness: f64,
    /// N·s/m or N·m·s/rad.
    pub damping: f64,
    /// N or N·m.
    pub preload: f64,
}

impl JointForceElement {
    /// Adds the pair of forces (or moments).
    pub fn apply(&self, joints: &[JointConstraint], kin: &[Kinematics], wrenches: &mut [Wrench]) {
        let joint = &joints[self.joint];
        let (way, rate) = joint.coordinate(kin);
        let axis = kin[joint.a].turn(&joint.frame_a[2]);
        let pull = axis * (self.stiffness * way + self.damping * rate - self.preload);
        if joint.kind == JointKind::Translational {
            let arm_b = kin[joint.b].turn(&joint.point_b);
            let arm_a = kin[joint.b].r + arm_b - kin[joint.a].r;
            wrenches[joint.a].add(&pull, &arm_a);
            wrenches[joint.b].add(&-pull, &arm_b);
        } else {
            wrenches[joint.a].moment += pull;
            wrenches[joint.b].moment -= pull;
        }
    }

    /// Stored energy, ½ k s² − f0 s, J. A constant moment has one only within half a turn.
    pub fn energy(&self, joints: &[JointConstraint], kin: &[Kinematics]) -> f64 {
        let (way, _) = joints[self.joint].coordinate(kin);
        0.5 * self.stiffness * way * way - self.preload * way
    }

    /// The elastic coordinate: the joint's.
    pub fn elastic_rows(
        &self,
        joints: &[JointConstraint],
        kin: &[Kinematics],
        sink: &mut impl FnMut(ElasticRow),
    ) {
        let joint = &joints[self.joint];
        let (a, b) = (joint.a, joint.b);
        let axis = kin[a].turn(&joint.frame_a[2]);
        let [row_a, row_b] = if joint.kind == JointKind::Translational {
            let arm_b = kin[b].turn(&joint.point_b);
            let arm_a = kin[b].r + arm_b - kin[a].r;
            translation_row(kin, a, b, &axis, [&arm_a, &arm_b])
        } else {
            rotation_row(kin, a, b, &axis)
        };
        sink(ElasticRow { a, b, row_a, row_b, stiffness: self.stiffness });
    }
}
