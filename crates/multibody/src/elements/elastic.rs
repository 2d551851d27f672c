//! Elastic coordinates of the elements, for the static problem.

use crate::index::BodyIndex;
use crate::joint::JacobianRow;
use crate::math::Vec3;
use crate::state::Kinematics;

/// One elastic coordinate of an element: its gradient for either body and its stiffness.
pub(crate) struct ElasticRow {
    pub a: BodyIndex,
    pub b: BodyIndex,
    pub row_a: JacobianRow,
    pub row_b: JacobianRow,
    pub stiffness: f64,
}

/// Gradient of e·(p_b − p_a) for e fixed to a: the arm on a ends at b's point.
pub(super) fn translation_row(
    kin: &[Kinematics],
    a: BodyIndex,
    b: BodyIndex,
    e: &Vec3,
    arms: [&Vec3; 2],
) -> [JacobianRow; 2] {
    [gradient(&kin[a], &-e, &-arms[0].cross(e)), gradient(&kin[b], e, &arms[1].cross(e))]
}

/// Gradient of a rotation about e.
pub(super) fn rotation_row(
    kin: &[Kinematics],
    a: BodyIndex,
    b: BodyIndex,
    e: &Vec3,
) -> [JacobianRow; 2] {
    [gradient(&kin[a], &Vec3::zeros(), &-e), gradient(&kin[b], &Vec3::zeros(), e)]
}

fn gradient(body: &Kinematics, linear: &Vec3, angular_world: &Vec3) -> JacobianRow {
    let angular = body.a.tr_mul(angular_world);
    [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]
}
