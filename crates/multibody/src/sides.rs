//! The two sides of a joint in the initial pose, checked to meet.

use std::fmt::Display;

use crate::description::{Body, Joint, JointKind};
use crate::error::{Error, invalid};
use crate::index::MemberIndex;
use crate::math::{Vec3, rotation_matrix};
use crate::names::BodyNames;
use crate::numbers::finite;

/// Largest distance between the two sides of a joint in the initial pose (m, or rad between the
/// axes). A micrometre is finer than any drawing. The remaining distance is closed before the first
/// step.
pub const MEETING_TOLERANCE: f64 = 1e-6;

/// A joint's two sides in the world, in the initial pose.
pub(crate) struct JointSides {
    pub point_a: Vec3,
    pub point_b: Vec3,
    /// Unit vectors; zero for joints without axis.
    pub axis_a: Vec3,
    pub axis_b: Vec3,
}

/// World point of a point given in a body's own coordinates.
fn world_point(bodies: &[Body], body: Option<MemberIndex>, local: Vec3) -> Vec3 {
    body.map_or(local, |k| {
        Vec3::from(bodies[k].position) + rotation_matrix(bodies[k].attitude()) * local
    })
}

fn world_direction(bodies: &[Body], body: Option<MemberIndex>, local: Vec3) -> Vec3 {
    body.map_or(local, |k| rotation_matrix(bodies[k].attitude()) * local)
}

/// The joint's points and axes on either side, checked to meet.
pub(crate) fn joint_sides(
    joint: &Joint,
    bodies: &[Body],
    names: &BodyNames,
    path: &dyn Display,
) -> Result<JointSides, Error> {
    let (a, b) = names.pair(&joint.body_a, &joint.body_b, path)?;
    let (point_a, point_b) = match (joint.position, joint.local_a, joint.local_b) {
        (Some(p), None, None) => (Vec3::from(p), Vec3::from(p)),
        (None, Some(pa), Some(pb)) => {
            (world_point(bodies, a, pa.into()), world_point(bodies, b, pb.into()))
        }
        _ => {
            return Err(invalid(path, "give either `position`, or both `local_a` and `local_b`"));
        }
    };
    finite(point_a.as_slice(), path)?;
    finite(point_b.as_slice(), path)?;
    let (axis_a, axis_b) = joint_axes(joint, bodies, a, b, path)?;
    let mut apart = point_b - point_a;
    if joint.kind == JointKind::Translational {
        apart -= axis_a * axis_a.dot(&apart);
    }
    if apart.norm() > MEETING_TOLERANCE {
        return Err(invalid(
            path,
            format!(
                "the two sides of joint `{}` do not meet in the initial pose: they are {:.3e} m \
                 apart, `{}` is off by ({:.3e}, {:.3e}, {:.3e}) m; correct `local_a`, `local_b` \
                 or a body's position",
                joint.name,
                apart.norm(),
                joint.body_b,
                apart.x,
                apart.y,
                apart.z
            ),
        ));
    }
    let angle = axis_a.cross(&axis_b).norm().atan2(axis_a.dot(&axis_b));
    if angle > MEETING_TOLERANCE {
        return Err(invalid(
            path,
            format!(
                "the two axes of joint `{}` are {angle:.3e} rad apart in the initial pose; correct \
                 `local_axis_a`, `local_axis_b` or a body's orientation",
                joint.name
            ),
        ));
    }
    Ok(JointSides { point_a, point_b, axis_a, axis_b })
}

fn joint_axes(
    joint: &Joint,
    bodies: &[Body],
    a: Option<MemberIndex>,
    b: Option<MemberIndex>,
    path: &dyn Display,
) -> Result<(Vec3, Vec3), Error> {
    let unit = |v: [f64; 3], field: &str| -> Result<Vec3, Error> {
        finite(&v, &format_args!("{path}.{field}"))?;
        let (v, largest) = (Vec3::from(v), Vec3::from(v).amax());
        if largest == 0.0 {
            let message = "the axis must not be zero";
            return Err(invalid(format!("{path}.{field}"), message));
        }
        // scaled first, so that no length overflows
        Ok((v / largest).normalize())
    };
    match (joint.axis, joint.local_axis_a, joint.local_axis_b) {
        (None, None, None) if !joint.kind.has_axis() => Ok((Vec3::zeros(), Vec3::zeros())),
        _ if !joint.kind.has_axis() => {
            Err(invalid(path, format!("a {} joint has no axis", joint.kind)))
        }
        (Some(n), None, None) => {
            let n = unit(n, "axis")?;
            Ok((n, n))
        }
        (None, Some(na), Some(nb)) => Ok((
            world_direction(bodies, a, unit(na, "local_axis_a")?),
            world_direction(bodies, b, unit(nb, "local_axis_b")?),
        )),
        _ => Err(invalid(
            path,
            format!(
                "a {} joint needs either `axis`, or both `local_axis_a` and `local_axis_b`",
                joint.kind
            ),
        )),
    }
}
