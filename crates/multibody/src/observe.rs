//! Quantities of a state: motion of magnets and observed bodies, energies, momentum.

use crate::anchor::Anchor;
use crate::index::{ComponentIndex, MagnetIndex, ObservedIndex};
use crate::math::{Vec3, multiply, roll_pitch_yaw, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::{BodyState, State};
use crate::workspace::Workspace;

/// Motion of a point relative to its place in the description, in the travelling frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMotion {
    /// Displacement from the initial pose, m.
    pub displacement: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Place in the travelling frame, m.
    pub position: Vec3,
}

/// Energies in J; gravity counts from z = 0, on a line from the height of its start, springs from their unloaded state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// ½ m v² + ½ ω·J ω.
    pub kinetic: f64,
    /// −m g·r.
    pub gravitational: f64,
    /// Springs, bushings and the drive's spring.
    pub elastic: f64,
}

impl Energy {
    /// Total mechanical energy; constant without damping and magnet forces.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.kinetic + self.gravitational + self.elastic
    }
}

impl VehicleModel {
    /// Motion of magnet k.
    #[must_use]
    pub fn magnet(&self, state: &State, k: MagnetIndex) -> PointMotion {
        self.anchor_motion(state, &self.magnets[k])
    }

    /// Inertial acceleration of magnet k after an evaluation of this state, m/s².
    #[must_use]
    pub fn magnet_acceleration(&self, ws: &Workspace, k: MagnetIndex) -> Vec3 {
        self.in_axes_at_magnet(ws, k, self.anchor_acceleration(ws, &self.magnets[k]))
    }

    /// Acceleration of magnet k after [`VehicleModel::load_response`], m/s².
    #[must_use]
    pub fn magnet_response(&self, ws: &Workspace, k: MagnetIndex) -> Vec3 {
        self.in_axes_at_magnet(ws, k, self.response(ws, &self.magnets[k]))
    }

    /// Acceleration of the centre of mass of observed body k after [`VehicleModel::load_response`], m/s².
    #[must_use]
    pub fn observed_response(&self, ws: &Workspace, k: ObservedIndex) -> Vec3 {
        self.on_track(ws, &self.observed_centre(k), Self::response)
    }

    /// Acceleration of point i of observed body k after [`VehicleModel::load_response`], m/s².
    #[must_use]
    pub fn point_response(&self, ws: &Workspace, k: ObservedIndex, i: usize) -> Vec3 {
        self.on_track(ws, &self.watched[k].points[i], Self::response)
    }

    /// Group of jointed bodies that carries magnet k.
    #[must_use]
    pub fn magnet_component(&self, k: MagnetIndex) -> ComponentIndex {
        self.components[self.magnets[k].body]
    }

    /// Group of jointed bodies that observed body k belongs to; `None` if it is fixed to the ground.
    #[must_use]
    pub fn observed_component(&self, k: ObservedIndex) -> Option<ComponentIndex> {
        self.components.get(self.members[self.watched[k].member].composite.0).copied()
    }

    /// Prefixes and numbers of further points of the observed bodies.
    pub fn observed(&self) -> impl Iterator<Item = (&str, usize)> {
        self.watched.iter().map(|w| (w.name.as_str(), w.points.len()))
    }

    /// Motion of the centre of mass of observed body k.
    #[must_use]
    pub fn observed_motion(&self, state: &State, k: ObservedIndex) -> PointMotion {
        self.anchor_motion(state, &self.observed_centre(k))
    }

    /// Roll, pitch and yaw of observed body k, rad.
    #[must_use]
    pub fn observed_attitude(&self, state: &State, k: ObservedIndex) -> [f64; 3] {
        let member = &self.members[self.watched[k].member];
        let attitude = state
            .bodies
            .get(member.composite.0)
            .map_or(member.twist, |body| multiply(body.attitude, member.twist));
        roll_pitch_yaw(self.attitude_on_line(state, &self.observed_centre(k), attitude))
    }

    /// Acceleration of the centre of mass of observed body k after an evaluation, m/s².
    #[must_use]
    pub fn observed_acceleration(&self, ws: &Workspace, k: ObservedIndex) -> Vec3 {
        self.on_track(ws, &self.observed_centre(k), Self::anchor_acceleration)
    }

    /// Acceleration of point i of observed body k after an evaluation, m/s².
    #[must_use]
    pub fn point_acceleration(&self, ws: &Workspace, k: ObservedIndex, i: usize) -> Vec3 {
        self.on_track(ws, &self.watched[k].points[i], Self::anchor_acceleration)
    }

    /// Mean velocity along the track relative to the nominal speed: the mean of the driven bodies,
    /// or without a drive the mass-weighted mean of all bodies, m/s.
    #[must_use]
    pub fn relative_speed(&self, state: &State) -> f64 {
        if let Some(drive) = self.drive.as_ref().filter(|d| !d.anchors.is_empty()) {
            let sum: f64 =
                drive.anchors.iter().map(|a| self.anchor_motion(state, a).velocity.x).sum();
            return sum / drive.anchors.len() as f64;
        }
        let mass: f64 = self.composites.iter().map(|c| c.mass).sum();
        let momentum: f64 =
            self.composites.iter().zip(&state.bodies).map(|(c, b)| c.mass * b.velocity.x).sum();
        momentum / mass
    }

    /// Kinetic, gravitational and elastic energy.
    #[must_use]
    pub fn energy(&self, state: &State, ws: &mut Workspace) -> Energy {
        ws.forget();
        self.set_pose(&state.bodies, ws);
        let way = self.way(state.travel);
        let mut energy =
            Energy { kinetic: self.kinetic_energy(state), gravitational: 0.0, elastic: 0.0 };
        for (composite, body) in self.composites.iter().zip(&state.bodies) {
            let place = way
                .map_or(body.position, |way| way.frame.position + way.frame.axes * body.position);
            energy.gravitational -= composite.mass * self.gravity.dot(&place);
        }
        energy.elastic += self.bushings.iter().map(|b| b.energy(&ws.kin)).sum::<f64>();
        energy.elastic += self.springs.iter().map(|s| s.energy(&ws.kin)).sum::<f64>();
        energy.elastic +=
            self.joint_forces.iter().map(|f| f.energy(&self.joints, &ws.kin)).sum::<f64>();
        if let Some(drive) = &self.drive {
            for anchor in &drive.anchors {
                let way = self.anchor_motion(state, anchor).displacement.x;
                energy.elastic += 0.5 * drive.stiffness * way * way;
            }
        }
        energy
    }

    /// ½ m v² + ½ ω·J ω over all bodies, in the travelling frame, J.
    #[must_use]
    pub fn kinetic_energy(&self, state: &State) -> f64 {
        self.composites
            .iter()
            .zip(&state.bodies)
            .map(|(c, b)| {
                let w = b.angular_velocity;
                0.5 * c.mass * b.velocity.norm_squared() + 0.5 * w.dot(&(c.inertia * w))
            })
            .sum()
    }

    /// Momentum and moment of momentum about the origin, travelling frame.
    #[must_use]
    pub fn momentum(&self, state: &State) -> (Vec3, Vec3) {
        let mut linear = Vec3::zeros();
        let mut angular = Vec3::zeros();
        for (c, b) in self.composites.iter().zip(&state.bodies) {
            let p = b.velocity * c.mass;
            linear += p;
            angular += b.position.cross(&p)
                + rotation_matrix(b.attitude) * (c.inertia * b.angular_velocity);
        }
        (linear, angular)
    }

    pub(crate) fn observed_centre(&self, k: ObservedIndex) -> Anchor {
        let member = &self.members[self.watched[k].member];
        Anchor { body: member.composite, local: member.offset, start: member.start }
    }

    /// Motion of magnet k for given motions of the bodies.
    pub(crate) fn magnet_motion(&self, bodies: &[BodyState], k: MagnetIndex) -> PointMotion {
        // magnets are on bodies that move
        point_motion(&bodies[self.magnets[k].body.0], &self.magnets[k])
    }

    pub(crate) fn anchor_motion(&self, state: &State, anchor: &Anchor) -> PointMotion {
        let Some(body) = state.bodies.get(anchor.body.0) else {
            let still = Vec3::zeros();
            return PointMotion { displacement: still, velocity: still, position: anchor.start };
        };
        self.motion_on_line(state, anchor, point_motion(body, anchor))
    }

    /// An acceleration of a point, in the axes of the track there.
    fn on_track(
        &self,
        ws: &Workspace,
        anchor: &Anchor,
        of: impl Fn(&Self, &Workspace, &Anchor) -> Vec3,
    ) -> Vec3 {
        self.in_line_axes(ws, anchor, of(self, ws, anchor))
    }

    pub(crate) fn response(&self, ws: &Workspace, anchor: &Anchor) -> Vec3 {
        if anchor.body == self.ground() {
            return Vec3::zeros();
        }
        let kin = &ws.kin[anchor.body];
        let (linear, angular) = ws.acceleration(anchor.body);
        linear + kin.turn(&angular).cross(&kin.turn(&anchor.local))
    }

    pub(crate) fn anchor_acceleration(&self, ws: &Workspace, anchor: &Anchor) -> Vec3 {
        let frame = Vec3::new(ws.acceleration, 0.0, 0.0);
        if anchor.body == self.ground() {
            return frame;
        }
        let kin = &ws.kin[anchor.body];
        let relative = self.response(ws, anchor) + kin.centripetal(&kin.turn(&anchor.local));
        if ws.acceleration == 0.0 { relative } else { relative + frame }
    }
}

pub(crate) fn point_motion(body: &BodyState, anchor: &Anchor) -> PointMotion {
    let turn = rotation_matrix(body.attitude);
    let position = body.position + turn * anchor.local;
    let velocity = body.velocity + turn * body.angular_velocity.cross(&anchor.local);
    PointMotion { displacement: position - anchor.start, velocity, position }
}
