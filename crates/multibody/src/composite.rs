//! Merging of brackets: bodies that are fixed to each other become one composite body.

use nalgebra::Matrix6;

use crate::description::{Body, JointKind, VehicleDescription};
use crate::error::{Error, Redundancy};
use crate::index::{BodyIndex, MemberIndex};
use crate::math::{Mat3, Quat, Vec3, conjugate, multiply, rotation_matrix};
use crate::names::BodyNames;
use crate::state::BodyState;

/// A rigid body of the equations of motion.
#[derive(Debug, Clone)]
pub(crate) struct Composite {
    /// Name of the first of its bodies.
    pub name: String,
    /// kg.
    pub mass: f64,
    /// About the centre of mass, in the axes of the first body, kg·m².
    pub inertia: Mat3,
    /// Initial pose, at rest.
    pub start: BodyState,
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

/// A described body in its composite.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    pub name: String,
    /// The composite, or the ground.
    pub composite: BodyIndex,
    /// The body's centre of mass in the composite's axes, from its centre of mass, m.
    pub offset: Vec3,
    /// The body's attitude relative to the composite's.
    pub twist: Quat,
    /// Initial position of its centre of mass, m.
    pub start: Vec3,
}

/// The result of merging.
pub(crate) struct Merged {
    pub composites: Vec<Composite>,
    pub members: Vec<Member>,
}

impl Merged {
    /// Composite of a described body (`None`: the ground).
    pub fn composite(&self, body: Option<MemberIndex>) -> BodyIndex {
        body.map_or(BodyIndex(self.composites.len()), |k| self.members[k].composite)
    }

    /// A world point of the initial pose in the axes of a composite, from its centre of mass.
    pub fn localise(&self, composite: BodyIndex, point: &Vec3) -> Vec3 {
        self.composites.get(composite.0).map_or(*point, |c| {
            rotation_matrix(c.start.attitude).tr_mul(&(point - c.start.position))
        })
    }

    /// A world direction of the initial pose in the axes of a composite.
    pub fn localise_direction(&self, composite: BodyIndex, direction: &Vec3) -> Vec3 {
        self.composites
            .get(composite.0)
            .map_or(*direction, |c| rotation_matrix(c.start.attitude).tr_mul(direction))
    }

    /// Initial attitude of a composite.
    pub fn attitude(&self, composite: BodyIndex) -> Quat {
        self.composites.get(composite.0).map_or(crate::math::IDENTITY, |c| c.start.attitude)
    }
}

/// Smallest index of the bodies that brackets connect with k.
fn root(parent: &[usize], mut k: usize) -> usize {
    while parent[k] != k {
        k = parent[k];
    }
    k
}

/// Merges bodies along brackets. Redundant brackets are an error.
pub(crate) fn merge(description: &VehicleDescription) -> Result<Merged, Error> {
    let bodies = &description.bodies;
    let names = BodyNames::new(bodies);
    // the ground has the largest index, so that it becomes a root only of a group without bodies
    let ground = bodies.len();
    let mut parent: Vec<usize> = (0..=ground).collect();
    let mut redundant = Vec::new();
    for (k, joint) in description.joints.iter().enumerate() {
        if joint.kind != JointKind::Bracket {
            continue;
        }
        let (a, b) = names.pair(&joint.body_a, &joint.body_b, &format_args!("joints[{k}]"))?;
        let (a, b) =
            (root(&parent, a.map_or(ground, |k| k.0)), root(&parent, b.map_or(ground, |k| k.0)));
        if a == b {
            redundant.push(all_repeated(&joint.name, &joint.body_a, &joint.body_b));
        }
        parent[a.max(b)] = a.min(b);
    }
    let fixed = root(&parent, ground);
    let group = |k: usize| root(&parent, k);
    for joint in description.joints.iter().filter(|j| j.kind != JointKind::Bracket) {
        let (a, b) = names.pair(&joint.body_a, &joint.body_b, &joint.name)?;
        if group(a.map_or(ground, |k| k.0)) == group(b.map_or(ground, |k| k.0)) {
            redundant.push(all_repeated(&joint.name, &joint.body_a, &joint.body_b));
        }
    }
    if !redundant.is_empty() {
        return Err(Error::Redundant(redundant));
    }
    let roots: Vec<usize> =
        (0..bodies.len()).filter(|&k| group(k) == k && (k != fixed || fixed == ground)).collect();
    let composites: Vec<Composite> = roots
        .iter()
        .map(|&r| {
            let members: Vec<&Body> =
                (0..bodies.len()).filter(|&k| group(k) == r).map(|k| &bodies[k]).collect();
            compose(&members)
        })
        .collect();
    let members = bodies
        .iter()
        .enumerate()
        .map(|(k, body)| {
            let composite = roots.iter().position(|r| *r == group(k)).unwrap_or(roots.len());
            member(body, BodyIndex(composite), composites.get(composite))
        })
        .collect();
    Ok(Merged { composites, members })
}

fn all_repeated(joint: &str, a: &str, b: &str) -> Redundancy {
    Redundancy {
        joint: joint.to_owned(),
        direction: format!("all directions (`{a}` and `{b}` are already fixed to each other)"),
        together_with: Vec::new(),
    }
}

/// Mass, centre of mass and inertia of bodies that are fixed to each other (parallel axes).
fn compose(members: &[&Body]) -> Composite {
    let mass: f64 = members.iter().map(|b| b.mass).sum();
    let centre = members.iter().map(|b| Vec3::from(b.position) * b.mass).sum::<Vec3>() / mass;
    let attitude = members[0].attitude();
    let frame = rotation_matrix(attitude);
    let mut inertia = Mat3::zeros();
    for body in members {
        let turn = frame.transpose() * rotation_matrix(body.attitude());
        let d = frame.tr_mul(&(Vec3::from(body.position) - centre));
        inertia += turn * body.inertia.matrix() * turn.transpose();
        inertia += (Mat3::identity() * d.norm_squared() - d * d.transpose()) * body.mass;
    }
    // the products above leave a rounding asymmetry
    let inertia = (inertia + inertia.transpose()) * 0.5;
    Composite {
        name: members[0].name.clone(),
        mass,
        inertia,
        start: BodyState {
            position: centre,
            attitude,
            velocity: Vec3::zeros(),
            angular_velocity: Vec3::zeros(),
        },
    }
}

fn member(body: &Body, index: BodyIndex, composite: Option<&Composite>) -> Member {
    let position = Vec3::from(body.position);
    let (offset, twist) = composite.map_or((position, body.attitude()), |c| {
        (
            rotation_matrix(c.start.attitude).tr_mul(&(position - c.start.position)),
            multiply(conjugate(c.start.attitude), body.attitude()),
        )
    });
    Member { name: body.name.clone(), composite: index, offset, twist, start: position }
}
