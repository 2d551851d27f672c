//! Validation of a description. Every error names its JSON path.

use std::collections::HashMap;
use std::fmt::Display;

use nalgebra::SymmetricEigen;

use crate::description::{Body, GROUND, Inertia, VehicleDescription};
use crate::error::{Error, invalid};
use crate::groups::check_signal_name;
use crate::math::{Mat3, Quat, Vec3, normalised};
use crate::names::{BodyNames, meant};
use crate::numbers::{finite, not_negative};
use crate::sides::joint_sides;

/// Most bodies of a vehicle.
const MAX_BODIES: usize = 8192;
/// Most magnets of a vehicle: the size of a unit's description grows with their square.
const MAX_MAGNETS: usize = 4096;

fn check_size(count: usize, path: &str, what: &str, most: usize) -> Result<(), Error> {
    if count <= most {
        return Ok(());
    }
    Err(invalid(path, format!("{count} {what}, but a vehicle has at most {most}")))
}

/// Refuses a vehicle that is too large, before its bodies are made. `path` is the place of what it is made of.
pub(crate) fn check_sizes(bodies: usize, magnets: usize, path: &str) -> Result<(), Error> {
    check_size(bodies, path, "bodies", MAX_BODIES)?;
    check_size(magnets, path, "magnets", MAX_MAGNETS)
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

fn unique<'a>(names: impl Iterator<Item = &'a str>, list: &str) -> Result<(), Error> {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    for (k, name) in names.enumerate() {
        let path = format_args!("{list}[{k}].name");
        if name.is_empty() {
            return Err(invalid(path, "the name is empty"));
        }
        if let Some(first) = seen.insert(name, k) {
            let message = format!(
                "duplicate name: `{name}` is also the name of {list}[{first}]; rename one of them"
            );
            return Err(invalid(path, message));
        }
    }
    Ok(())
}

fn orientation(q: Option<[f64; 4]>, path: &dyn Display) -> Result<(), Error> {
    let Some(q) = q else { return Ok(()) };
    let norm = q.iter().map(|v| v * v).sum::<f64>().sqrt();
    // a quaternion written with five digits is accepted as a unit quaternion
    if (norm - 1.0).abs() <= 1e-4 {
        Ok(())
    } else {
        Err(invalid(path, format!("not a unit quaternion (w, x, y, z): its norm is {norm}")))
    }
}

fn check_body(body: &Body, path: &dyn Display) -> Result<(), Error> {
    if body.name == GROUND {
        return Err(invalid(format!("{path}.name"), "`ground` is reserved"));
    }
    if !(body.mass.is_finite() && body.mass > 0.0) {
        let message = format!("the mass must be positive, but is {} kg", body.mass);
        return Err(invalid(format!("{path}.mass"), message));
    }
    finite(&body.position, &format_args!("{path}.position"))?;
    orientation(body.orientation, &format_args!("{path}.orientation"))?;
    check_inertia(&body.inertia.matrix(), &format_args!("{path}.inertia"))
}

fn check_inertia(inertia: &Mat3, path: &dyn Display) -> Result<(), Error> {
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
            format!("the inertia must be positive definite; a principal moment is {small} kg·m²"),
        ));
    }
    // equality is a flat plate; allow for its rounding
    if large > (small + middle) * (1.0 + 1e-9) {
        return Err(invalid(
            path,
            format!(
                "the principal moments {small}, {middle}, {large} kg·m² are impossible: the largest \
                 exceeds the sum of the others"
            ),
        ));
    }
    Ok(())
}

/// Largest nominal gap, m: a larger one is in millimetres.
const LARGEST_GAP: f64 = 0.1;

impl VehicleDescription {
    /// Checks everything that does not need the assembled constraints.
    ///
    /// # Errors
    /// [`Error::Invalid`] with the JSON path of the first fault.
    pub fn check(&self) -> Result<(), Error> {
        if self.name.is_empty() {
            return Err(invalid("name", "the name is empty"));
        }
        finite(&self.gravity, &"gravity")?;
        if self.gravity[2] > 0.0 {
            let message = format!(
                "{} m/s² along z is upward; gravity points down, so give a negative number",
                self.gravity[2]
            );
            return Err(invalid("gravity", message));
        }
        not_negative(&[self.nominal_gap], &"nominal_gap")?;
        if self.nominal_gap > LARGEST_GAP {
            let message =
                format!("{} m is more than {LARGEST_GAP} m; give it in metres", self.nominal_gap);
            return Err(invalid("nominal_gap", message));
        }
        check_size(self.bodies.len(), "bodies", "bodies", MAX_BODIES)?;
        check_size(self.magnets.len(), "magnets", "magnets", MAX_MAGNETS)?;
        if self.bodies.is_empty() {
            return Err(invalid("bodies", "at least one body is needed"));
        }
        unique(self.bodies.iter().map(|b| b.name.as_str()), "bodies")?;
        for (k, body) in self.bodies.iter().enumerate() {
            check_body(body, &format_args!("bodies[{k}]"))?;
        }
        let names = BodyNames::new(&self.bodies);
        unique(self.joints.iter().map(|j| j.name.as_str()), "joints")?;
        for (k, joint) in self.joints.iter().enumerate() {
            joint_sides(joint, &self.bodies, &names, &format_args!("joints[{k}]"))?;
        }
        self.check_elements(&names)?;
        if let Some(contact) = &self.contact {
            contact.check(self.nominal_gap)?;
        }
        self.check_points(&names)
    }

    fn check_elements(&self, names: &BodyNames) -> Result<(), Error> {
        unique(self.bushings.iter().map(|b| b.name.as_str()), "bushings")?;
        for (k, bushing) in self.bushings.iter().enumerate() {
            let path = format_args!("bushings[{k}]");
            names.pair(&bushing.body_a, &bushing.body_b, &path)?;
            finite(&bushing.position, &format_args!("{path}.position"))?;
            finite(&bushing.preload, &format_args!("{path}.preload"))?;
            orientation(bushing.orientation, &format_args!("{path}.orientation"))?;
            for (field, values) in [
                ("translational_stiffness", &bushing.translational_stiffness),
                ("translational_damping", &bushing.translational_damping),
                ("rotational_stiffness", &bushing.rotational_stiffness),
                ("rotational_damping", &bushing.rotational_damping),
            ] {
                not_negative(values, &format_args!("{path}.{field}"))?;
            }
        }
        unique(self.springs.iter().map(|s| s.name.as_str()), "springs")?;
        for (k, spring) in self.springs.iter().enumerate() {
            let path = format_args!("springs[{k}]");
            names.pair(&spring.body_a, &spring.body_b, &path)?;
            finite(&spring.position_a, &format_args!("{path}.position_a"))?;
            finite(&spring.position_b, &format_args!("{path}.position_b"))?;
            not_negative(&[spring.stiffness], &format_args!("{path}.stiffness"))?;
            not_negative(&[spring.damping], &format_args!("{path}.damping"))?;
            if let Some(length) = spring.free_length {
                not_negative(&[length], &format_args!("{path}.free_length"))?;
            }
            if Vec3::from(spring.position_a) == Vec3::from(spring.position_b) {
                return Err(invalid(path, "the spring has zero length and so no direction"));
            }
        }
        self.check_joint_forces()
    }

    fn check_joint_forces(&self) -> Result<(), Error> {
        for (k, force) in self.joint_forces.iter().enumerate() {
            let path = format_args!("joint_forces[{k}]");
            let Some(joint) = self.joints.iter().find(|j| j.name == force.joint) else {
                let known = self.joints.iter().map(|j| j.name.as_str());
                let hint = meant(&force.joint, known);
                let message = format!("there is no joint `{}`{hint}", force.joint);
                return Err(invalid(format!("{path}.joint"), message));
            };
            if !joint.kind.has_axis() {
                return Err(invalid(
                    format!("{path}.joint"),
                    format!(
                        "`{}` is a {} joint, which has no free coordinate",
                        joint.name, joint.kind
                    ),
                ));
            }
            not_negative(&[force.stiffness], &format_args!("{path}.stiffness"))?;
            not_negative(&[force.damping], &format_args!("{path}.damping"))?;
            finite(&[force.preload], &format_args!("{path}.preload"))?;
        }
        Ok(())
    }

    fn check_points(&self, names: &BodyNames) -> Result<(), Error> {
        if let Some(drive) = &self.drive {
            not_negative(&[drive.stiffness], &"drive.stiffness")?;
            not_negative(&[drive.damping], &"drive.damping")?;
            for (k, body) in drive.bodies.iter().enumerate() {
                let path = format_args!("drive.bodies[{k}]");
                names.moving(body, &path)?;
                if let Some(first) = drive.bodies[..k].iter().position(|b| b == body) {
                    let message = format!("duplicate body: `{body}` is also drive.bodies[{first}]");
                    return Err(invalid(path, message));
                }
            }
        }
        for (k, magnet) in self.magnets.iter().enumerate() {
            names.moving(&magnet.body, &format_args!("magnets[{k}].body"))?;
            finite(&magnet.position, &format_args!("magnets[{k}].position"))?;
        }
        unique(self.observed.iter().map(|o| o.name.as_str()), "observed")?;
        for (k, observed) in self.observed.iter().enumerate() {
            let path = format_args!("observed[{k}]");
            names.moving(&observed.body, &format_args!("{path}.body"))?;
            for (i, point) in observed.points.iter().enumerate() {
                finite(point, &format_args!("{path}.points[{i}]"))?;
            }
            check_signal_name(&observed.name, &format_args!("{path}.name"))?;
            for (list, bodies) in
                [("point_bodies", &observed.point_bodies), ("parts", &observed.parts)]
            {
                for (i, body) in bodies.iter().enumerate() {
                    names.moving(body, &format_args!("{path}.{list}[{i}]"))?;
                }
            }
        }
        self.check_groups()
    }
}
