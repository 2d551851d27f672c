//! From the description to the assembled model.

use std::fmt::Display;

use crate::attachments::Attachments;
use crate::composite::{Composite, Merged, merge};
use crate::contact::mobility;
use crate::counts::counts;
use crate::description::{Joint, JointKind, VehicleDescription};
use crate::elements::JointForceElement;
use crate::error::Error;
use crate::explain::{redundant, unusable};
use crate::index::{ComponentIndex, JointIndex};
use crate::joint::JointConstraint;
use crate::math::{Vec3, complement};
use crate::model::{Tolerances, VehicleModel};
use crate::names::BodyNames;
use crate::ordering::{SAFE_WHILE_MOVING, analyse};
use crate::rank::dependencies;
use crate::resolve::Anchors;
use crate::saddle::{places, sample};
use crate::scheme::Scheme;
use crate::sides::joint_sides;
use crate::state::Kinematics;

impl VehicleModel {
    /// Checks and assembles a description.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a JSON path, or [`Error::Redundant`] where joints repeat each other.
    pub fn new(description: &VehicleDescription) -> Result<Self, Error> {
        description.check()?;
        Self::assemble(description)
    }

    /// Assembles a description that has been checked.
    fn assemble(description: &VehicleDescription) -> Result<Self, Error> {
        let merged = merge(description)?;
        let names = BodyNames::new(&description.bodies);
        let joints = joints(description, &merged, &names)?;
        let rows = joints.iter().map(JointConstraint::equations).sum();
        let kin = kinematics(&merged.composites);
        let repeated = dependencies(&joints, &kin);
        if !repeated.is_empty() {
            return Err(redundant(&repeated, &joints, &kin));
        }
        let sample = sample(&merged.composites, &joints, &kin);
        let analysis = analyse(sample, SAFE_WHILE_MOVING, true)
            .map_err(|failure| unusable(failure, &merged.composites, &joints))?;
        let places = places(&analysis, merged.composites.len(), &joints);
        let groups = &analysis.components[..merged.composites.len()];
        let components = groups.iter().copied().map(ComponentIndex).collect();
        let groups = groups.iter().max().map_or(0, |k| k + 1);
        let counts = counts(description, &merged, rows, groups);
        let anchors = Anchors { merged: &merged, names: &names };
        let magnets = anchors.magnets(description)?;
        Ok(Self {
            name: description.name.clone(),
            bushings: anchors.bushings(description)?,
            springs: anchors.springs(description)?,
            joint_forces: joint_forces(description, &joints),
            drive: anchors.drive(description)?,
            mobilities: magnets
                .iter()
                .map(|magnet| mobility(&merged.composites[magnet.body], &magnet.local))
                .collect(),
            magnets,
            contact: description.contact.unwrap_or_default(),
            watched: anchors.watched(description)?,
            attachments: Attachments::new(description, &names)?,
            gravity: description.gravity.into(),
            nominal_gap: description.nominal_gap,
            rows,
            solver: analysis.factorisation,
            places,
            components,
            counts,
            total_mass: description.bodies.iter().filter(|b| !b.reference).map(|b| b.mass).sum(),
            tolerances: Tolerances::default(),
            scheme: Scheme::default(),
            keeps_above: f64::INFINITY,
            line: None,
            motors: None,
            composites: merged.composites,
            members: merged.members,
            joints,
        })
    }

    /// Reads, checks and assembles a vehicle file.
    ///
    /// # Errors
    /// Those of [`VehicleDescription::from_json`] and [`VehicleModel::new`].
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Ok(Self::described(text)?.1)
    }

    /// The same, with the description, which is checked only once.
    ///
    /// # Errors
    /// Those of [`VehicleDescription::from_json`] and [`VehicleModel::new`].
    pub fn described(text: &str) -> Result<(VehicleDescription, Self), Error> {
        let description = VehicleDescription::from_json(text)?;
        let model = Self::assemble(&description)?;
        Ok((description, model))
    }
}

/// Kinematics of the initial pose, the ground last.
fn kinematics(composites: &[Composite]) -> Vec<Kinematics> {
    let mut kin = vec![Kinematics::at_rest(); composites.len() + 1];
    for (kin, composite) in kin.iter_mut().zip(composites) {
        kin.set_pose(&composite.start);
    }
    kin
}

fn joints(
    description: &VehicleDescription,
    merged: &Merged,
    names: &BodyNames,
) -> Result<Vec<JointConstraint>, Error> {
    let mut joints = Vec::new();
    let mut row = 0;
    for (k, data) in description.joints.iter().enumerate() {
        if data.kind != JointKind::Bracket {
            let joint = joint(data, description, merged, names, &format_args!("joints[{k}]"), row)?;
            row += joint.equations();
            joints.push(joint);
        }
    }
    Ok(joints)
}

fn joint(
    data: &Joint,
    description: &VehicleDescription,
    merged: &Merged,
    names: &BodyNames,
    path: &dyn Display,
    row: usize,
) -> Result<JointConstraint, Error> {
    let sides = joint_sides(data, &description.bodies, names, path)?;
    let (a, b) = names.pair(&data.body_a, &data.body_b, path)?;
    let (a, b) = (merged.composite(a), merged.composite(b));
    let (frame_a, frame_b) = if data.kind.has_axis() {
        let (t1, t2) = complement(&sides.axis_a);
        // the axes may differ within the meeting tolerance: b's frame is made orthogonal to b's own
        // axis
        let u1 = (t1 - sides.axis_b * sides.axis_b.dot(&t1)).normalize();
        let u2 = sides.axis_b.cross(&u1);
        ([t1, t2, sides.axis_a], [u1, u2, sides.axis_b])
    } else {
        ([Vec3::zeros(); 3], [Vec3::zeros(); 3])
    };
    Ok(JointConstraint {
        name: data.name.clone(),
        kind: data.kind,
        a,
        b,
        point_a: merged.localise(a, &sides.point_a),
        point_b: merged.localise(b, &sides.point_b),
        frame_a: frame_a.map(|v| merged.localise_direction(a, &v)),
        frame_b: frame_b.map(|v| merged.localise_direction(b, &v)),
        row,
    })
}

fn joint_forces(
    description: &VehicleDescription,
    joints: &[JointConstraint],
) -> Vec<JointForceElement> {
    description
        .joint_forces
        .iter()
        .filter_map(|force| {
            // the check guarantees that the joint exists and has an axis, so it was not merged
            let joint = joints.iter().position(|j| j.name == force.joint).map(JointIndex)?;
            Some(JointForceElement {
                joint,
                stiffness: force.stiffness,
                damping: force.damping,
                preload: force.preload,
            })
        })
        .collect()
}
