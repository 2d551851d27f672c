//! Reactions of the joints: force and moment that a joint passes from body a to body b.
//!
//! A joint that is left after merging carries −Φ_qᵀ λ. A bracket has no multipliers; its load
//! follows from the Newton-Euler equations of all bodies on one side of it: mass times acceleration
//! minus all other forces on them.

use crate::anchor::Anchor;
use crate::attachments::End;
use crate::contact::TrackContact;
use crate::dynamics::external;
use crate::error::Error;
use crate::index::{BodyIndex, JointIndex, MemberIndex};
use crate::loads::AppliedForces;
use crate::math::{Vec3, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::{Kinematics, State, Wrench};
use crate::workspace::Workspace;

/// Force and moment on body b of a joint, world axes. The opposite acts on body a.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reaction {
    /// N.
    pub force: Vec3,
    /// About `point`, N·m.
    pub moment: Vec3,
    /// The joint's point on b in the travelling world frame, m.
    pub point: Vec3,
}

/// Wrenches about one point, summed over a set of described bodies.
struct WrenchSum<'a> {
    inside: &'a [bool],
    point: Vec3,
    wrench: Wrench,
}

impl WrenchSum<'_> {
    fn has(&self, end: End) -> bool {
        end.is_some_and(|k| self.inside[k])
    }

    /// Adds a wrench about the point r.
    fn add(&mut self, wrench: &Wrench, r: &Vec3) {
        self.wrench.moment += wrench.moment;
        self.wrench.add(&wrench.force, &(r - self.point));
    }
}

impl VehicleModel {
    /// Force and moment that a joint, bracket or not, exerts on its body b under given loads.
    /// Springs, dampers and drives in the joint's free coordinate are not included.
    ///
    /// # Errors
    /// [`Error::Argument`] if no joint has that name, or those of [`VehicleModel::accelerations`].
    pub fn reaction<'a>(
        &self,
        joint: &str,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
    ) -> Result<Reaction, Error> {
        self.reaction_in_contact(joint, state, forces, None, ws)
    }

    /// Like [`VehicleModel::reaction`], with the contacts of the magnets with the rail.
    ///
    /// # Errors
    /// As [`VehicleModel::reaction`].
    pub fn reaction_in_contact<'a>(
        &self,
        joint: &str,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        track: Option<&TrackContact>,
        ws: &mut Workspace,
    ) -> Result<Reaction, Error> {
        self.refuse_line(state, "a joint's reaction")?;
        self.accelerations_in_contact(state, forces, track, ws)?;
        if let Some(k) = self.joints.iter().position(|j| j.name == joint) {
            return Ok(self.joint_reaction(JointIndex(k), ws));
        }
        let brackets = &self.attachments.brackets;
        brackets.iter().position(|b| b.name == joint).map(|k| self.bracket_reaction(k, ws)).ok_or(
            Error::Argument {
                what: "joint",
                expected: "the name of a joint".to_owned(),
                found: joint.to_owned(),
            },
        )
    }

    fn joint_reaction(&self, k: JointIndex, ws: &Workspace) -> Reaction {
        let joint = &self.joints[k];
        let rows = joint.row..joint.row + joint.equations();
        let (force, moment) = joint.reaction(&ws.kin, &ws.multipliers()[rows]);
        let body = &ws.kin[joint.b];
        Reaction { force, moment, point: body.r + body.turn(&joint.point_b) }
    }

    fn bracket_reaction(&self, k: usize, ws: &Workspace) -> Reaction {
        let bracket = &self.attachments.brackets[k];
        let [a, b] = bracket.ends;
        // both ends are on the same composite, and not both are the ground
        let composite = b.or(a).map_or(self.ground(), |end| self.members[end].composite);
        let body = &ws.kin[composite];
        let point = self.composites.get(composite.0).map_or(bracket.point, |c| {
            let local =
                rotation_matrix(c.start.attitude).tr_mul(&(bracket.point - c.start.position));
            body.r + body.turn(&local)
        });
        // the forces on the ground are unknown: take the side without it
        let (inside, grounded) = self.attachments.side(b, k);
        if grounded {
            let (inside, _) = self.attachments.side(a, k);
            let Wrench { force, moment } = self.needed(&inside, point, ws);
            return Reaction { force: -force, moment: -moment, point };
        }
        let Wrench { force, moment } = self.needed(&inside, point, ws);
        Reaction { force, moment, point }
    }

    /// Force and moment about a point that must act on these bodies in addition to all known
    /// forces.
    fn needed(&self, inside: &[bool], point: Vec3, ws: &Workspace) -> Wrench {
        let mut sum = WrenchSum { inside, point, wrench: Wrench::zero() };
        for (k, member) in self.members.iter().enumerate() {
            if inside[k] {
                let kin = &ws.kin[member.composite];
                let (wrench, r) = self.inertial(MemberIndex(k), kin, ws);
                sum.add(&wrench, &r);
            }
        }
        let mut known = WrenchSum { inside, point, wrench: Wrench::zero() };
        self.add_elements(&mut known, ws);
        self.add_points(&mut known, ws);
        for (k, ends) in self.attachments.joints.iter().enumerate() {
            let Reaction { force, moment, point } = self.joint_reaction(JointIndex(k), ws);
            if known.has(ends[0]) {
                known.add(&Wrench { force: -force, moment: -moment }, &point);
            }
            if known.has(ends[1]) {
                known.add(&Wrench { force, moment }, &point);
            }
        }
        Wrench {
            force: sum.wrench.force - known.wrench.force,
            moment: sum.wrench.moment - known.wrench.moment,
        }
    }

    /// m (a − g) and J α + ω × J ω of a described body, about its centre of mass, and where that is.
    fn inertial(&self, k: MemberIndex, kin: &Kinematics, ws: &Workspace) -> (Wrench, Vec3) {
        let member = &self.members[k];
        let arm = kin.turn(&member.offset);
        let (linear, angular) = if member.composite != self.ground() {
            let (v, w) = ws.acceleration(member.composite);
            (v, kin.turn(&w))
        } else {
            (Vec3::zeros(), Vec3::zeros())
        };
        let frame = Vec3::new(ws.acceleration, 0.0, 0.0);
        let acceleration = linear + angular.cross(&arm) + kin.centripetal(&arm) + frame;
        let turn = kin.a * rotation_matrix(member.twist);
        let inertia = turn * self.attachments.inertias[k] * turn.transpose();
        let wrench = Wrench {
            force: (acceleration - self.gravity) * self.attachments.masses[k],
            moment: inertia * angular + kin.w_world.cross(&(inertia * kin.w_world)),
        };
        (wrench, kin.r + arm)
    }

    /// Forces of springs, bushings and joint springs on the bodies of the sum.
    fn add_elements(&self, sum: &mut WrenchSum, ws: &Workspace) {
        // each element is evaluated alone to separate its two ends; if both are on the same
        // composite, the second end uses a copy of the composite, stored after the ground
        let mut kin = ws.kin.clone();
        let double = BodyIndex(kin.len());
        kin.push(Kinematics::at_rest());
        let mut wrenches = vec![Wrench::zero(); kin.len()];
        let mut take = |ends: &[End; 2], composites: [BodyIndex; 2], wrenches: &mut [Wrench]| {
            for (end, composite) in ends.iter().zip(composites) {
                if sum.has(*end) {
                    let place = if composite == double { composites[0] } else { composite };
                    sum.add(&wrenches[composite], &ws.kin[place].r);
                }
                wrenches[composite] = Wrench::zero();
            }
        };
        for (bushing, ends) in self.bushings.iter().zip(&self.attachments.bushings) {
            let mut bushing = bushing.clone();
            if bushing.a == bushing.b {
                (kin[double], bushing.b) = (kin[bushing.a], double);
            }
            bushing.apply(&kin, &mut wrenches);
            take(ends, [bushing.a, bushing.b], &mut wrenches);
        }
        for (spring, ends) in self.springs.iter().zip(&self.attachments.springs) {
            let mut spring = spring.clone();
            if spring.a == spring.b {
                (kin[double], spring.b) = (kin[spring.a], double);
            }
            spring.apply(&kin, &mut wrenches);
            take(ends, [spring.a, spring.b], &mut wrenches);
        }
        for force in &self.joint_forces {
            let joint = &self.joints[force.joint];
            force.apply(&self.joints, &kin, &mut wrenches);
            take(&self.attachments.joints[force.joint], [joint.a, joint.b], &mut wrenches);
        }
    }

    /// Forces of magnets, contacts and drive on the bodies of the sum.
    fn add_points(&self, sum: &mut WrenchSum, ws: &Workspace) {
        let point = |anchor: &Anchor| {
            let body = &ws.kin[anchor.body];
            let arm = body.turn(&anchor.local);
            (body.r + arm, body.velocity_at(&arm))
        };
        for (k, (magnet, end)) in self.magnets.iter().zip(&self.attachments.magnets).enumerate() {
            if sum.inside[*end] {
                let mut force =
                    Vec3::new(self.thrust(ws.acceleration), ws.lateral[k], ws.vertical[k]);
                if ws.touch.contact.is_some() {
                    force += ws.touch.force[k];
                }
                sum.add(&Wrench { force, moment: Vec3::zeros() }, &point(magnet).0);
            }
        }
        for (watched, load) in self.watched.iter().zip(&ws.external) {
            let Some((force, moment)) = external(load).filter(|_| sum.inside[watched.member])
            else {
                continue;
            };
            let member = &self.members[watched.member];
            let body = &ws.kin[member.composite];
            sum.add(&Wrench { force, moment }, &(body.r + body.turn(&member.offset)));
        }
        let Some(drive) = &self.drive else { return };
        for (anchor, end) in drive.anchors.iter().zip(&self.attachments.drive) {
            if sum.inside[*end] {
                let (r, v) = point(anchor);
                let pull = drive.stiffness * (r.x - anchor.start.x) + drive.damping * v.x;
                let force = Vec3::new(-pull, 0.0, 0.0);
                sum.add(&Wrench { force, moment: Vec3::zeros() }, &r);
            }
        }
    }
}
