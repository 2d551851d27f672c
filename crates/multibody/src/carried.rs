//! Steady motion along a line: what a body does that the line carries along.
//!
//! A body that keeps its place and attitude relative to the line at its own foot, while the foot moves with
//! the speed v, has in the axes of the line there, with c its coordinates across the line,
//!
//! u = v·(e_x + κ × c),  ω = v·κ,  u̇ = v²·(κ × (e_x + κ × c) + κ′ × c),  ω̇ = v²·κ′.
//!
//! Where curvature, slope and cant are constant this is one rigid motion for all bodies, a rotation or a
//! screw, and the motion in equilibrium is steady: forces balance m·u̇ and J·ω̇ + ω × J ω. In a transition
//! bodies at different places are carried in different ways, and the same balance is quasi-steady: what
//! joints and elements do while the curve develops is left out, but for dampers, which see these velocities.

use track_line::Line;

use crate::error::Error;
use crate::math::{Mat3, Vec3, from_rotation_matrix, multiply, rotation_matrix};
use crate::model::VehicleModel;
use crate::state::{BodyState, State};
use crate::way::{Travel, Way};
use crate::workspace::Workspace;

/// Motion of a carried body in the axes of the travelling frame.
struct Carried {
    /// Velocity less v along the track, as in [`BodyState`], m/s.
    velocity: Vec3,
    /// ω, rad/s.
    spin: Vec3,
    /// u̇, m/s².
    acceleration: Vec3,
    /// ω̇, rad/s².
    spin_rate: Vec3,
}

impl Way {
    fn carried(&self, line: &Line, point: &Vec3) -> Result<Carried, track_line::Error> {
        let meeting = self.meet(line, point)?;
        let (bend, bend_rate) = (meeting.frame.curvature, meeting.frame.curvature_rate);
        let (c, v) = (meeting.across, self.speed);
        let along = Vec3::x() + bend.cross(&c);
        let outward = |vector: Vec3| self.outward(&meeting, &vector);
        Ok(Carried {
            velocity: outward(along * v) - Vec3::new(v, 0.0, 0.0),
            spin: outward(bend * v),
            acceleration: outward((bend.cross(&along) + bend_rate.cross(&c)) * (v * v)),
            spin_rate: outward(bend_rate * (v * v)),
        })
    }
}

impl VehicleModel {
    /// The vehicle of the description with every body at its own place along the line, carried along.
    pub(crate) fn placed(&self, travel: Option<Travel>) -> Result<State, Error> {
        let mut state = self.initial_state();
        state.travel = travel;
        let Some((line, way)) = self.line.as_ref().zip(self.way(travel)) else { return Ok(state) };
        for body in &mut state.bodies {
            let frame = line.frame(way.frame.s + body.position.x);
            let across = Vec3::new(0.0, body.position.y, body.position.z);
            // differences of positions lose no digits far from the line's start
            let from = frame.position - way.frame.position + frame.axes * across;
            body.position = way.frame.axes.tr_mul(&from);
            let turn = from_rotation_matrix(&way.frame.axes.tr_mul(&frame.axes));
            body.attitude = multiply(turn, body.attitude);
        }
        self.carry(&mut state)?;
        Ok(state)
    }

    /// Gives the bodies of a state on a line the velocities of carried ones.
    pub(crate) fn carry(&self, state: &mut State) -> Result<(), Error> {
        let Some((line, way)) = self.line.as_ref().zip(self.way(state.travel)) else {
            return Ok(());
        };
        let time = state.time;
        for body in &mut state.bodies {
            let carried = way
                .carried(line, &body.position)
                .map_err(|cause| Error::OffLine { time, cause })?;
            body.velocity = carried.velocity;
            body.angular_velocity = rotation_matrix(body.attitude).tr_mul(&carried.spin);
        }
        Ok(())
    }

    /// Takes the inertia of carried bodies from the right-hand side in the workspace.
    pub(crate) fn carried_inertia(
        &self,
        bodies: &[BodyState],
        ws: &mut Workspace,
    ) -> Result<(), track_line::Error> {
        let Some((line, way)) = self.line.as_ref().zip(ws.way) else { return Ok(()) };
        for (k, (composite, body)) in self.composites.iter().zip(bodies).enumerate() {
            let carried = way.carried(line, &body.position)?;
            let (axes, rows) = (&ws.kin[k].a, &mut ws.solution[6 * k..6 * k + 6]);
            let (w, turned) = (axes.tr_mul(&carried.spin), axes.tr_mul(&carried.spin_rate));
            let force = carried.acceleration * composite.mass;
            let moment = composite.inertia * turned + w.cross(&(composite.inertia * w));
            for (i, value) in force.iter().chain(moment.iter()).enumerate() {
                rows[i] -= value;
            }
        }
        Ok(())
    }

    /// Axes of the line `ahead` of the travelling frame (m), in those of the frame; those of the frame
    /// without a line.
    pub(crate) fn axes_ahead(&self, way: Option<&Way>, ahead: f64) -> Mat3 {
        self.line.as_ref().zip(way).map_or_else(Mat3::identity, |(line, way)| {
            way.frame.axes.tr_mul(&line.frame(way.frame.s + way.shift + ahead).axes)
        })
    }
}
