//! Whether a description makes sense: each complaint names its JSON path.

use std::collections::HashMap;

use nalgebra::SymmetricEigen;

use crate::description::{Body, Description, GROUND, Inertia, Joint, JointKind};
use crate::error::Error;
use crate::math::{Mat3, Quat, Vec3, normalised, rotation_matrix};

/// How far the two sides of a joint may stand apart in the initial pose (m, or rad between the
/// axes). A micrometre is beyond any drawing; what is left is closed before the first step.
pub const MEETING_TOLERANCE: f64 = 1e-6;

fn invalid(path: impl Into<String>, message: impl Into<String>) -> Error {
    Error::Invalid { path: path.into(), message: message.into() }
}

impl Inertia {
    /// The full symmetric matrix.
    #[must_use]
    pub fn matrix(&self) -> Mat3 {
        match self {
            Self::Principal(d) => Mat3::from_diagonal(&Vec3::from(*d)),
            Self::Full(m) => Mat3::from_fn(|r, c| m[r][c]),
        }
    }
}

impl Body {
    /// Attitude as a unit quaternion.
    #[must_use]
    pub fn attitude(&self) -> Quat {
        self.orientation.map_or(crate::math::IDENTITY, normalised)
    }
}

/// A joint's two sides in the world, in the initial pose.
pub(crate) struct JointSides {
    pub point_a: Vec3,
    pub point_b: Vec3,
    /// Unit vectors; zero for joints without axis.
    pub axis_a: Vec3,
    pub axis_b: Vec3,
}

/// Bodies by name, `ground` as `None`.
pub(crate) struct Names<'a>(HashMap<&'a str, usize>);

impl<'a> Names<'a> {
    pub fn new(bodies: &'a [Body]) -> Self {
        Self(bodies.iter().enumerate().map(|(k, b)| (b.name.as_str(), k)).collect())
    }

    /// Index of the named body, `None` for the ground.
    pub fn find(&self, name: &str, path: &str) -> Result<Option<usize>, Error> {
        if name == GROUND {
            return Ok(None);
        }
        self.0.get(name).map(|k| Some(*k)).ok_or_else(|| {
            let known = self.0.keys().copied().chain([GROUND]);
            invalid(path, format!("no body is called `{name}`{}", meant(name, known)))
        })
    }

    /// Index of the named body, which must not be the ground.
    pub fn moving(&self, name: &str, path: &str) -> Result<usize, Error> {
        self.find(name, path)?
            .ok_or_else(|| invalid(path, "the ground cannot be used here, name a body"))
    }

    /// The two ends of a joint or element, which must differ.
    pub fn pair(
        &self,
        a: &str,
        b: &str,
        path: &str,
    ) -> Result<(Option<usize>, Option<usize>), Error> {
        let first = self.find(a, &format!("{path}.body_a"))?;
        let second = self.find(b, &format!("{path}.body_b"))?;
        if first == second {
            return Err(invalid(path, format!("both ends are on `{a}`")));
        }
        Ok((first, second))
    }
}

fn finite(values: &[f64], path: &str) -> Result<(), Error> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(invalid(path, "every number must be finite"))
    }
}

/// Which of the known names may have been meant: the closest, where it is close.
fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> String {
    // longer names than anybody types by mistake are not worth the search
    let near = |other: &str| (other.len() <= 64).then(|| distance(name, other));
    let found = if name.len() > 64 {
        None
    } else {
        known
            .filter_map(|other| near(other).map(|d| (d, other)))
            .min()
            .filter(|(d, _)| 3 * d <= name.chars().count())
    };
    found.map_or_else(String::new, |(_, other)| format!("; is `{other}` meant?"))
}

/// How many letters have to be put in, left out or exchanged (Levenshtein).
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let exchanged = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = exchanged.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

fn not_negative(values: &[f64], path: &str) -> Result<(), Error> {
    finite(values, path)?;
    match values.iter().find(|v| **v < 0.0) {
        Some(v) => Err(invalid(path, format!("must not be negative, but is {v}"))),
        None => Ok(()),
    }
}

fn unique<'a>(names: impl Iterator<Item = &'a str>, list: &str) -> Result<(), Error> {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (k, name) in names.enumerate() {
        let path = format!("{list}[{k}].name");
        if name.is_empty() {
            return Err(invalid(path, "a name is needed"));
        }
        if let Some(first) = seen.insert(name, k) {
            let message = format!("`{name}` is already {list}[{first}]; rename one of them");
            return Err(invalid(path, message));
        }
    }
    Ok(())
}

fn orientation(q: Option<[f64; 4]>, path: &str) -> Result<(), Error> {
    let Some(q) = q else { return Ok(()) };
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    // a quaternion written with five digits is meant as one
    if (norm - 1.0).abs() <= 1e-4 {
        Ok(())
    } else {
        Err(invalid(path, format!("a unit quaternion (w, x, y, z) is needed, its norm is {norm}")))
    }
}

fn check_body(body: &Body, path: &str) -> Result<(), Error> {
    if body.name == GROUND {
        return Err(invalid(format!("{path}.name"), "`ground` is reserved"));
    }
    if !(body.mass.is_finite() && body.mass > 0.0) {
        let message = format!("the mass must be positive, but is {} kg", body.mass);
        return Err(invalid(format!("{path}.mass"), message));
    }
    finite(&body.position, &format!("{path}.position"))?;
    orientation(body.orientation, &format!("{path}.orientation"))?;
    check_inertia(&body.inertia.matrix(), &format!("{path}.inertia"))
}

fn check_inertia(inertia: &Mat3, path: &str) -> Result<(), Error> {
    finite(inertia.as_slice(), path)?;
    if (inertia - inertia.transpose()).amax() > 1e-9 * inertia.amax() {
        return Err(invalid(path, "the inertia matrix must be symmetric"));
    }
    let mut moments = SymmetricEigen::new(*inertia).eigenvalues;
    moments.as_mut_slice().sort_by(f64::total_cmp);
    let [small, middle, large] = [moments[0], moments[1], moments[2]];
    if small <= 1e-12 * large {
        return Err(invalid(
            path,
            format!("the inertia must be positive definite, a principal moment is {small} kg·m²"),
        ));
    }
    // equality is a flat plate; allow for its rounding
    if large > (small + middle) * (1.0 + 1e-9) {
        return Err(invalid(
            path,
            format!(
                "no body has the principal moments {small}, {middle}, {large} kg·m²: the largest \
                 exceeds the sum of the others"
            ),
        ));
    }
    Ok(())
}

impl Description {
    /// Checks everything that can be said without assembling the constraints.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the JSON path of the first thing that is wrong.
    pub fn check(&self) -> Result<(), Error> {
        if self.name.is_empty() {
            return Err(invalid("name", "a name is needed"));
        }
        finite(&self.gravity, "gravity")?;
        not_negative(&[self.nominal_gap], "nominal_gap")?;
        if self.bodies.is_empty() {
            return Err(invalid("bodies", "at least one body is needed"));
        }
        unique(self.bodies.iter().map(|b| b.name.as_str()), "bodies")?;
        for (k, body) in self.bodies.iter().enumerate() {
            check_body(body, &format!("bodies[{k}]"))?;
        }
        let names = Names::new(&self.bodies);
        unique(self.joints.iter().map(|j| j.name.as_str()), "joints")?;
        for (k, joint) in self.joints.iter().enumerate() {
            joint_sides(joint, &self.bodies, &names, &format!("joints[{k}]"))?;
        }
        self.check_elements(&names)?;
        self.check_points(&names)
    }

    fn check_elements(&self, names: &Names) -> Result<(), Error> {
        unique(self.bushings.iter().map(|b| b.name.as_str()), "bushings")?;
        for (k, bushing) in self.bushings.iter().enumerate() {
            let path = format!("bushings[{k}]");
            names.pair(&bushing.body_a, &bushing.body_b, &path)?;
            finite(&bushing.position, &format!("{path}.position"))?;
            finite(&bushing.preload, &format!("{path}.preload"))?;
            orientation(bushing.orientation, &format!("{path}.orientation"))?;
            for (field, values) in [
                ("translational_stiffness", &bushing.translational_stiffness),
                ("translational_damping", &bushing.translational_damping),
                ("rotational_stiffness", &bushing.rotational_stiffness),
                ("rotational_damping", &bushing.rotational_damping),
            ] {
                not_negative(values, &format!("{path}.{field}"))?;
            }
        }
        unique(self.springs.iter().map(|s| s.name.as_str()), "springs")?;
        for (k, spring) in self.springs.iter().enumerate() {
            let path = format!("springs[{k}]");
            names.pair(&spring.body_a, &spring.body_b, &path)?;
            finite(&spring.position_a, &format!("{path}.position_a"))?;
            finite(&spring.position_b, &format!("{path}.position_b"))?;
            not_negative(&[spring.stiffness], &format!("{path}.stiffness"))?;
            not_negative(&[spring.damping], &format!("{path}.damping"))?;
            if let Some(length) = spring.free_length {
                not_negative(&[length], &format!("{path}.free_length"))?;
            }
            if Vec3::from(spring.position_a) == Vec3::from(spring.position_b) {
                return Err(invalid(path, "the spring has no length, so no direction"));
            }
        }
        self.check_joint_forces()
    }

    fn check_joint_forces(&self) -> Result<(), Error> {
        for (k, force) in self.joint_forces.iter().enumerate() {
            let path = format!("joint_forces[{k}]");
            let Some(joint) = self.joints.iter().find(|j| j.name == force.joint) else {
                let known = self.joints.iter().map(|j| j.name.as_str());
                let hint = meant(&force.joint, known);
                let message = format!("no joint is called `{}`{hint}", force.joint);
                return Err(invalid(format!("{path}.joint"), message));
            };
            if !joint.kind.has_axis() {
                return Err(invalid(
                    format!("{path}.joint"),
                    format!("`{}` is {}, which has no free coordinate", joint.name, joint.kind),
                ));
            }
            not_negative(&[force.stiffness], &format!("{path}.stiffness"))?;
            not_negative(&[force.damping], &format!("{path}.damping"))?;
            finite(&[force.preload], &format!("{path}.preload"))?;
        }
        Ok(())
    }

    fn check_points(&self, names: &Names) -> Result<(), Error> {
        if let Some(drive) = &self.drive {
            not_negative(&[drive.stiffness], "drive.stiffness")?;
            not_negative(&[drive.damping], "drive.damping")?;
            for (k, body) in drive.bodies.iter().enumerate() {
                let path = format!("drive.bodies[{k}]");
                names.moving(body, &path)?;
                if let Some(first) = drive.bodies[..k].iter().position(|b| b == body) {
                    let message = format!("`{body}` is already drive.bodies[{first}]");
                    return Err(invalid(path, message));
                }
            }
        }
        for (k, magnet) in self.magnets.iter().enumerate() {
            names.moving(&magnet.body, &format!("magnets[{k}].body"))?;
            finite(&magnet.position, &format!("magnets[{k}].position"))?;
        }
        unique(self.observed.iter().map(|o| o.name.as_str()), "observed")?;
        for (k, observed) in self.observed.iter().enumerate() {
            let path = format!("observed[{k}]");
            names.moving(&observed.body, &format!("{path}.body"))?;
            for (i, point) in observed.points.iter().enumerate() {
                finite(point, &format!("{path}.points[{i}]"))?;
            }
            let well_named = observed.name.starts_with(|c: char| c.is_ascii_lowercase())
                && observed
                    .name
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_')
                && observed.name.len() <= 24;
            if !well_named {
                return Err(invalid(
                    format!("{path}.name"),
                    "it becomes part of signal names: use up to 24 lower-case letters, digits and \
                     underscores, beginning with a letter",
                ));
            }
        }
        Ok(())
    }
}

/// World point of a point given in a body's own coordinates.
fn world_point(bodies: &[Body], body: Option<usize>, local: Vec3) -> Vec3 {
    body.map_or(local, |k| {
        Vec3::from(bodies[k].position) + rotation_matrix(bodies[k].attitude()) * local
    })
}

fn world_direction(bodies: &[Body], body: Option<usize>, local: Vec3) -> Vec3 {
    body.map_or(local, |k| rotation_matrix(bodies[k].attitude()) * local)
}

/// The joint's points and axes on either side, checked to meet.
pub(crate) fn joint_sides(
    joint: &Joint,
    bodies: &[Body],
    names: &Names,
    path: &str,
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
                 apart, `{}` stands off by ({:.3e}, {:.3e}, {:.3e}) m; correct `local_a`, `local_b` \
                 or a body's place",
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
    a: Option<usize>,
    b: Option<usize>,
    path: &str,
) -> Result<(Vec3, Vec3), Error> {
    let unit = |v: [f64; 3], field: &str| -> Result<Vec3, Error> {
        finite(&v, &format!("{path}.{field}"))?;
        let (v, largest) = (Vec3::from(v), Vec3::from(v).amax());
        if largest == 0.0 {
            let message = "the axis must not be zero; any length will do";
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
