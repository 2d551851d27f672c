//! The travelling frame gains or loses speed: the inertia of the bodies, and the force of the motor.
//!
//! In a frame with the acceleration a along the track each body feels −m a at its centre of mass (d'Alembert). The
//! linear motor applies M a, with M the mass of all bodies, in equal parts at the magnets, where the modules with its
//! windings are. So the centre of mass follows the frame, and the car bodies, which are pulled from below, pitch.
//! A jump of the speed by Δv is the limit of this: impulses −m Δv and M Δv at the same points. Force elements do not
//! transmit impulses, joints do.

use crate::dynamics::check_line;
use crate::error::Error;
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::state::{Kinematics, State, Wrench};
use crate::way::OnLine;
use crate::workspace::Workspace;

impl VehicleModel {
    /// Mass of all bodies, kg.
    pub(crate) fn moved_mass(&self) -> f64 {
        self.composites.iter().map(|it| it.mass).sum()
    }

    /// Force of the motor at each magnet for an acceleration of the frame, along the track (N).
    pub(crate) fn thrust(&self, acceleration: f64) -> f64 {
        self.moved_mass() * acceleration / self.magnets.len() as f64
    }

    /// Adds inertia and motor for an acceleration of the frame, m/s².
    pub(crate) fn apply_frame(
        &self,
        kin: &[Kinematics],
        acceleration: f64,
        on_line: &OnLine,
        wrenches: &mut [Wrench],
    ) {
        for (wrench, composite) in wrenches.iter_mut().zip(&self.composites) {
            wrench.force.x -= composite.mass * acceleration;
        }
        // motors of a motor file apply their own forces
        if self.magnets.is_empty() || self.motors.is_some() {
            return;
        }
        let force = Vec3::new(self.thrust(acceleration), 0.0, 0.0);
        for (k, magnet) in self.magnets.iter().enumerate() {
            let mut pull = force;
            if let Some((way, Some(meeting))) = on_line.way.zip(on_line.met.get(k)) {
                pull = way.outward(meeting, &force);
            }
            wrenches[magnet.body].add(&pull, &kin[magnet.body].turn(&magnet.local));
        }
    }

    /// Changes the velocities of a state as a jump of the frame's speed (m/s) does. Velocities are those relative to the
    /// frame.
    ///
    /// # Errors
    /// [`Error::Singular`], [`Error::NotFinite`], [`Error::Projection`] or [`Error::Argument`].
    pub fn jump(&self, state: &mut State, speed: f64, ws: &mut Workspace) -> Result<(), Error> {
        self.prepare(&state.bodies, state.time, ws)?;
        ws.wrenches.fill(Wrench::zero());
        self.follow_line(state.travel, ws);
        let Workspace { kin, wrenches, way, met, lost, .. } = &mut *ws;
        let mut on_line = OnLine { way: way.as_ref(), met, lost };
        self.meet_line(kin, &mut on_line);
        self.apply_frame(kin, speed, &on_line, wrenches);
        check_line(state.time, ws)?;
        self.respond_to_wrenches(state.time, ws)?;
        for (body, change) in state.bodies.iter_mut().zip(ws.solution.chunks_exact(6)) {
            body.velocity += Vec3::new(change[0], change[1], change[2]);
            body.angular_velocity += Vec3::new(change[3], change[4], change[5]);
        }
        self.close_joints(state, ws)
    }
}
