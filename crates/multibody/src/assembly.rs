//! From the description to the assembled model.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix6};

use crate::block::Size;
use crate::check::{Names, joint_sides};
use crate::composite::{Composite, Merged, merge};
use crate::description::{Description, Joint as JointData, JointKind};
use crate::elements::{Bushing, JointForce, Rotation, Spring, Translation};
use crate::error::{Error, Redundancy};
use crate::integrate::Scheme;
use crate::joint::{Joint, Row};
use crate::math::{Mat3, Vec3, complement, conjugate, multiply, rotation_matrix};
use crate::model::{Anchor, Counts, DriveForce, Model, Places, Tolerances, Watched};
use crate::ordering::{Dependency, Failure, Ordering, SAFE_WHILE_MOVING, Sample, analyse};
use crate::reactions::Attachments;
use crate::state::Kinematics;

impl Model {
    /// Checks and assembles a description.
    ///
    /// # Errors
    /// [`Error::Invalid`] with a JSON path, or [`Error::Redundant`] where joints repeat each other.
    pub fn new(description: &Description) -> Result<Self, Error> {
        description.check()?;
        let merged = merge(description)?;
        let names = Names::new(&description.bodies);
        let joints = joints(description, &merged, &names)?;
        let rows = joints.iter().map(Joint::equations).sum();
        let kin = kinematics(&merged.composites);
        let sample = sample(&merged.composites, &joints, &kin);
        let ordering = analyse(sample, SAFE_WHILE_MOVING, true)
            .map_err(|failure| explain(&failure, &merged.composites, &joints, &kin))?;
        let places = places(&ordering, merged.composites.len(), &joints);
        let components = ordering.components[..merged.composites.len()].to_vec();
        let groups = components.iter().max().map_or(0, |k| k + 1);
        let counts = counts(description, &merged, rows, groups);
        let anchors = Anchors { merged: &merged, names: &names };
        Ok(Self {
            name: description.name.clone(),
            bushings: anchors.bushings(description)?,
            springs: anchors.springs(description)?,
            joint_forces: joint_forces(description, &joints),
            drive: anchors.drive(description)?,
            magnets: anchors.magnets(description)?,
            watched: anchors.watched(description)?,
            attachments: Attachments::new(description, &names)?,
            gravity: description.gravity.into(),
            nominal_gap: description.nominal_gap,
            rows,
            solver: ordering.factorisation,
            places,
            components,
            counts,
            total_mass: description.bodies.iter().filter(|b| !b.reference).map(|b| b.mass).sum(),
            tolerances: Tolerances::default(),
            scheme: Scheme::default(),
            composites: merged.composites,
            members: merged.members,
            joints,
        })
    }

    /// Reads, checks and assembles a vehicle file.
    ///
    /// # Errors
    /// Those of [`Description::from_json`] and [`Model::new`].
    pub fn from_json(text: &str) -> Result<Self, Error> {
        Self::new(&Description::from_json(text)?)
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

fn joints(description: &Description, merged: &Merged, names: &Names) -> Result<Vec<Joint>, Error> {
    let mut joints = Vec::new();
    let mut row = 0;
    for (k, data) in description.joints.iter().enumerate() {
        if data.kind != JointKind::Bracket {
            let joint = joint(data, description, merged, names, &format!("joints[{k}]"), row)?;
            row += joint.equations();
            joints.push(joint);
        }
    }
    Ok(joints)
}

fn joint(
    data: &JointData,
    description: &Description,
    merged: &Merged,
    names: &Names,
    path: &str,
    row: usize,
) -> Result<Joint, Error> {
    let sides = joint_sides(data, &description.bodies, names, path)?;
    let (a, b) = names.pair(&data.body_a, &data.body_b, path)?;
    let (a, b) = (merged.composite(a), merged.composite(b));
    let (frame_a, frame_b) = if data.kind.has_axis() {
        let (t1, t2) = complement(&sides.axis_a);
        // the axes may differ within the meeting tolerance: b's frame is squared up to its own
        let u1 = (t1 - sides.axis_b * sides.axis_b.dot(&t1)).normalize();
        let u2 = sides.axis_b.cross(&u1);
        ([t1, t2, sides.axis_a], [u1, u2, sides.axis_b])
    } else {
        ([Vec3::zeros(); 3], [Vec3::zeros(); 3])
    };
    Ok(Joint {
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

fn joint_forces(description: &Description, joints: &[Joint]) -> Vec<JointForce> {
    description
        .joint_forces
        .iter()
        .filter_map(|force| {
            // the check has made sure that the joint exists and has an axis, so is not merged away
            let joint = joints.iter().position(|j| j.name == force.joint)?;
            Some(JointForce {
                joint,
                stiffness: force.stiffness,
                damping: force.damping,
                preload: force.preload,
            })
        })
        .collect()
}

struct Anchors<'a> {
    merged: &'a Merged,
    names: &'a Names<'a>,
}

impl Anchors<'_> {
    fn anchor(&self, body: &str, point: [f64; 3], path: &str) -> Result<Anchor, Error> {
        let composite = self.merged.composite(Some(self.names.moving(body, path)?));
        let start = Vec3::from(point);
        Ok(Anchor { body: composite, local: self.merged.localise(composite, &start), start })
    }

    /// As `anchor`, on a body that is not fixed to the ground.
    fn movable(&self, body: &str, point: [f64; 3], path: &str) -> Result<Anchor, Error> {
        let anchor = self.anchor(body, point, path)?;
        if anchor.body == self.merged.composites.len() {
            return Err(Error::Invalid {
                path: path.to_owned(),
                message: format!("`{body}` is fixed to the ground, so a force there does nothing"),
            });
        }
        Ok(anchor)
    }

    fn bushings(&self, description: &Description) -> Result<Vec<Bushing>, Error> {
        description
            .bushings
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let path = format!("bushings[{k}]");
                let (a, b) = self.names.pair(&data.body_a, &data.body_b, &path)?;
                let (a, b) = (self.merged.composite(a), self.merged.composite(b));
                let point = Vec3::from(data.position);
                let world = data
                    .orientation
                    .map_or(Mat3::identity(), |q| rotation_matrix(crate::math::normalised(q)));
                let (pa, pb) = (self.merged.attitude(a), self.merged.attitude(b));
                let axes = rotation_matrix(pa).tr_mul(&world);
                let relative = multiply(conjugate(pa), pb);
                let translation = Translation {
                    point_a: self.merged.localise(a, &point),
                    point_b: self.merged.localise(b, &point),
                    stiffness: data.translational_stiffness.into(),
                    damping: data.translational_damping.into(),
                    preload: data.preload.into(),
                };
                let rotation = Rotation {
                    stiffness: data.rotational_stiffness.into(),
                    damping: data.rotational_damping.into(),
                    untwist: (relative != crate::math::IDENTITY)
                        .then(|| Box::new(conjugate(relative))),
                };
                let acts = |values: &[Vec3]| values.iter().any(|v| *v != Vec3::zeros());
                let translates =
                    acts(&[translation.stiffness, translation.damping, translation.preload]);
                let rotates = acts(&[rotation.stiffness, rotation.damping]);
                Ok(Bushing {
                    a,
                    b,
                    axes: (axes != Mat3::identity()).then(|| Box::new(axes)),
                    translation: translates.then(|| Box::new(translation)),
                    rotation: rotates.then(|| Box::new(rotation)),
                })
            })
            .collect()
    }

    fn springs(&self, description: &Description) -> Result<Vec<Spring>, Error> {
        description
            .springs
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let (a, b) =
                    self.names.pair(&data.body_a, &data.body_b, &format!("springs[{k}]"))?;
                let (a, b) = (self.merged.composite(a), self.merged.composite(b));
                let (pa, pb) = (Vec3::from(data.position_a), Vec3::from(data.position_b));
                Ok(Spring {
                    a,
                    b,
                    point_a: self.merged.localise(a, &pa),
                    point_b: self.merged.localise(b, &pb),
                    stiffness: data.stiffness,
                    damping: data.damping,
                    free_length: data.free_length.unwrap_or_else(|| (pb - pa).norm()),
                })
            })
            .collect()
    }

    fn drive(&self, description: &Description) -> Result<Option<DriveForce>, Error> {
        let Some(data) = &description.drive else { return Ok(None) };
        let anchors = data
            .bodies
            .iter()
            .enumerate()
            .map(|(k, name)| {
                let path = format!("drive.bodies[{k}]");
                let body = self.names.moving(name, &path)?;
                self.movable(name, description.bodies[body].position, &path)
            })
            .collect::<Result<_, _>>()?;
        Ok(Some(DriveForce { anchors, stiffness: data.stiffness, damping: data.damping }))
    }

    fn magnets(&self, description: &Description) -> Result<Vec<Anchor>, Error> {
        description
            .magnets
            .iter()
            .enumerate()
            .map(|(k, m)| self.movable(&m.body, m.position, &format!("magnets[{k}].body")))
            .collect()
    }

    fn watched(&self, description: &Description) -> Result<Vec<Watched>, Error> {
        description
            .observed
            .iter()
            .enumerate()
            .map(|(k, data)| {
                let path = format!("observed[{k}].body");
                let points = data
                    .points
                    .iter()
                    .map(|p| self.anchor(&data.body, *p, &path))
                    .collect::<Result<_, _>>()?;
                let member = self.names.moving(&data.body, &path)?;
                Ok(Watched { name: data.name.clone(), member, points })
            })
            .collect()
    }
}

/// M of one body: (m I, J).
pub(crate) fn mass_block(composite: &Composite) -> Matrix6<f64> {
    let mut block = Matrix6::zeros();
    for k in 0..3 {
        block[(k, k)] = composite.mass;
    }
    block.fixed_view_mut::<3, 3>(3, 3).copy_from(&composite.inertia);
    block
}

/// The nodes' sizes: bodies, then joints.
pub(crate) fn sizes(bodies: usize, joints: &[Joint]) -> Vec<Size> {
    let joint = |j: &Joint| if j.kind == JointKind::Spherical { Size::Three } else { Size::Five };
    std::iter::repeat_n(Size::Six, bodies).chain(joints.iter().map(joint)).collect()
}

/// Adds the joints' Jacobians to a matrix for the analysis.
pub(crate) fn add_jacobians(sample: &mut Sample, joints: &[Joint], kin: &[Kinematics]) {
    let bodies = sample.bodies;
    for (k, joint) in joints.iter().enumerate() {
        let n = joint.equations();
        let (mut rows_a, mut rows_b) = ([Row::default(); 6], [Row::default(); 6]);
        joint.jacobian(kin, &mut rows_a[..n], &mut rows_b[..n]);
        for (body, rows) in [(joint.a, rows_a), (joint.b, rows_b)] {
            if body < bodies {
                let block = DMatrix::from_fn(n, 6, |r, c| rows[r][c]);
                sample.couple(bodies + k, body, &block);
            }
        }
    }
}

/// The matrix of eq. 9 in the initial pose.
fn sample(composites: &[Composite], joints: &[Joint], kin: &[Kinematics]) -> Sample {
    let mut sample = Sample::new(sizes(composites.len(), joints), composites.len());
    for (diagonal, composite) in sample.diagonal.iter_mut().zip(composites) {
        diagonal.copy_from(&mass_block(composite));
    }
    add_jacobians(&mut sample, joints, kin);
    sample
}

/// Where the blocks of bodies and joints are stored.
pub(crate) fn places(ordering: &Ordering, bodies: usize, joints: &[Joint]) -> Places {
    Places {
        bodies: (0..bodies).map(|k| ordering.place(k, k).map(|place| place.offset)).collect(),
        joints: joints
            .iter()
            .enumerate()
            .map(|(k, j)| {
                // the ground's index is no node
                [j.a, j.b].map(|b| (b < bodies).then(|| ordering.place(bodies + k, b)).flatten())
            })
            .collect(),
    }
}

fn counts(
    description: &Description,
    merged: &Merged,
    reduced_equations: usize,
    components: usize,
) -> Counts {
    let mut joints = BTreeMap::new();
    for kind in
        [JointKind::Bracket, JointKind::Translational, JointKind::Spherical, JointKind::Revolute]
    {
        joints.insert(kind, description.joints.iter().filter(|j| j.kind == kind).count());
    }
    let equations = description.joints.iter().map(|j| j.kind.equations()).sum();
    Counts {
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

/// Puts names to what the analysis found.
pub(crate) fn explain(
    failure: &Failure,
    composites: &[Composite],
    joints: &[Joint],
    kin: &[Kinematics],
) -> Error {
    match failure {
        Failure::Dependent(found) => Error::Redundant(name_dependencies(found, joints, kin)),
        Failure::Unusable(node) => {
            let (path, name) = composites.get(*node).map_or_else(
                || ("joints", &joints[node - composites.len()].name),
                |composite| ("bodies", &composite.name),
            );
            Error::Invalid {
                path: path.to_owned(),
                message: format!(
                    "the equations about `{name}` cannot be solved: masses, inertias, stiffnesses \
                     and lengths there differ too much in size, or overflow"
                ),
            }
        }
    }
}

/// Says in words what dependent equations constrain twice.
fn name_dependencies(
    found: &[Dependency],
    joints: &[Joint],
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

fn describe_reaction(joint: &Joint, kin: &[Kinematics], multipliers: &[f64]) -> String {
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
