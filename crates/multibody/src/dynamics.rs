//! Equation 9 evaluated: M q̈ + Φ_qᵀ λ = Q, Φ_q q̈ = γ.

use crate::block::{ColumnWindow, Vanished};
use crate::contact::{ContactScratch, TrackContact};
use crate::error::Error;
use crate::index::{JointIndex, MagnetIndex};
use crate::joint::JacobianRow;
use crate::loads::{AppliedForces, ExternalLoad, Loads, copy_external};
use crate::math::Vec3;
use crate::model::VehicleModel;
use crate::motors::check_motors;
use crate::rate::BodyRate;
use crate::state::{BodyState, Kinematics, State, Wrench};
use crate::way::{OnLine, Travel};
use crate::workspace::Workspace;

impl VehicleModel {
    /// Scratch memory for this model.
    #[must_use]
    pub fn workspace(&self) -> Workspace {
        let bodies = self.composites.len();
        let start = self.initial_state().bodies;
        Workspace {
            kin: vec![Kinematics::at_rest(); bodies + 1],
            rows_a: vec![JacobianRow::default(); self.rows],
            rows_b: vec![JacobianRow::default(); self.rows],
            factors: vec![0.0; self.solver.storage],
            factored: None,
            factored_pose: vec![(Vec3::zeros(), crate::math::IDENTITY); bodies],
            evaluated: false,
            wrenches: vec![Wrench::zero(); bodies + 1],
            solution: vec![0.0; self.unknowns()],
            kept: Vec::with_capacity(self.unknowns()),
            spare: vec![0.0; self.unknowns()],
            bend: Vec::with_capacity(self.unknowns()),
            sum_of_bends: Vec::with_capacity(self.unknowns()),
            frame_bend: 0.0,
            residual: vec![0.0; self.rows],
            stage: start.clone(),
            sum: vec![BodyRate::zero(); bodies],
            touch: ContactScratch::new(self.magnets.len(), start.clone()),
            start,
            vertical: vec![0.0; self.magnets.len()],
            lateral: vec![0.0; self.magnets.len()],
            external: vec![[0.0; 6]; self.watched.len()],
            acceleration: 0.0,
            way: None,
            travel: None,
            met: self.line.as_ref().map_or(Vec::new(), |_| vec![None; self.magnets.len()]),
            lost: None,
            statics: None,
            motors: self.motor_scratch(),
        }
    }

    /// Accelerations and multipliers of a state under given loads; read them from the workspace. If
    /// the workspace already holds them, this costs almost nothing.
    ///
    /// # Errors
    /// [`Error::Singular`], [`Error::NotFinite`], or [`Error::Argument`] for a wrong length.
    pub fn accelerations<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        self.accelerations_in_contact(state, forces, None, ws)
    }

    /// Like [`VehicleModel::accelerations`], with the contacts of the magnets with the rail.
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn accelerations_in_contact<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        track: Option<&TrackContact>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let forces = forces.into();
        self.check_forces(state, &forces)?;
        if let Some(track) = track {
            self.check_track(track.height.len(), track.rate.len())?;
        }
        if ws.has_solution(&state.bodies, &forces, track, state.travel) {
            return Ok(());
        }
        self.follow_line(state.travel, ws);
        ws.touch.set(track);
        ws.vertical.copy_from_slice(forces.magnets.vertical);
        ws.lateral.copy_from_slice(forces.magnets.lateral);
        copy_external(&mut ws.external, forces.external);
        ws.acceleration = forces.acceleration;
        self.feed_motors(0.0, ws);
        self.evaluate(&state.bodies, state.time, ws)
    }

    /// Takes the travelling frame of an instant.
    pub(crate) fn follow_line(&self, travel: Option<Travel>, ws: &mut Workspace) {
        ws.travel = travel;
        ws.way = self.way(travel);
    }

    pub(crate) fn check_forces(&self, state: &State, forces: &AppliedForces) -> Result<(), Error> {
        let Loads { vertical, lateral } = forces.magnets;
        self.check_lengths(state, [vertical.len(), lateral.len(), forces.external.len()])
    }

    /// Checks the numbers of vertical, lateral and external loads.
    pub(crate) fn check_lengths(
        &self,
        state: &State,
        [vertical, lateral, external]: [usize; 3],
    ) -> Result<(), Error> {
        let wrong = |what, expected: usize, found: usize| Error::Argument {
            what,
            expected: expected.to_string(),
            found: found.to_string(),
        };
        if state.bodies.len() != self.composites.len() {
            return Err(wrong("bodies of the state", self.composites.len(), state.bodies.len()));
        }
        for (what, found) in [("vertical loads", vertical), ("lateral loads", lateral)] {
            if found != self.magnets.len() {
                return Err(wrong(what, self.magnets.len(), found));
            }
        }
        if external != 0 && external != self.watched.len() {
            return Err(wrong("external loads", self.watched.len(), external));
        }
        Ok(())
    }

    /// Evaluates with the loads in `ws.vertical` and `ws.lateral`.
    pub(crate) fn evaluate(
        &self,
        bodies: &[BodyState],
        time: f64,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        ws.evaluated = false;
        let known = ws.has_factors(bodies);
        if known {
            self.set_motion(bodies, ws);
        } else {
            ws.forget();
            self.set_kinematics(bodies, ws);
        }
        self.apply_forces(ws);
        check_line(time, ws)?;
        self.applied(ws);
        if known {
            self.gammas(ws);
            self.solver.solve(&ws.factors, &mut ws.solution);
        } else {
            self.factor_and_solve(time, ws)?;
            ws.remember(bodies);
        }
        self.check_finite(time, ws)?;
        ws.evaluated = true;
        Ok(())
    }

    pub(crate) fn check_finite(&self, time: f64, ws: &Workspace) -> Result<(), Error> {
        if are_finite(&ws.solution) {
            return Ok(());
        }
        if let Some(k) = ws.vertical.iter().zip(&ws.lateral).position(|(v, l)| !(v + l).is_finite())
        {
            return Err(Error::NotFinite { what: format!("the force on magnet {}", k + 1), time });
        }
        if let Some(k) = ws.external.iter().position(|load| !load.iter().sum::<f64>().is_finite()) {
            let what = format!("the external force or moment on `{}`", self.watched[k].name);
            return Err(Error::NotFinite { what, time });
        }
        let body = ws.solution.chunks(6).position(|x| !x.iter().sum::<f64>().is_finite());
        let what = body
            .and_then(|k| self.composites.get(k))
            .map_or_else(|| "a multiplier".to_owned(), |c| format!("the motion of `{}`", c.name));
        Err(Error::NotFinite { what, time })
    }

    /// Sets poses, Jacobians and factors, unless the workspace holds those of the same pose.
    pub(crate) fn prepare(
        &self,
        bodies: &[BodyState],
        time: f64,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        if ws.has_factors(bodies) {
            return Ok(());
        }
        ws.forget();
        self.set_pose(bodies, ws);
        self.factor(time, ws)?;
        ws.remember(bodies);
        Ok(())
    }

    pub(crate) fn set_pose(&self, bodies: &[BodyState], ws: &mut Workspace) {
        for (kin, body) in ws.kin.iter_mut().zip(bodies) {
            kin.set_pose(body);
        }
    }

    pub(crate) fn set_motion(&self, bodies: &[BodyState], ws: &mut Workspace) {
        for (kin, body) in ws.kin.iter_mut().zip(bodies) {
            kin.set_motion(body);
        }
    }

    /// Poses and motions.
    pub(crate) fn set_kinematics(&self, bodies: &[BodyState], ws: &mut Workspace) {
        for (kin, body) in ws.kin.iter_mut().zip(bodies) {
            kin.set_pose(body);
            kin.set_motion(body);
        }
    }

    pub(crate) fn jacobians(&self, ws: &mut Workspace) {
        for joint in &self.joints {
            let range = joint.row..joint.row + joint.equations();
            joint.jacobian(&ws.kin, &mut ws.rows_a[range.clone()], &mut ws.rows_b[range]);
        }
    }

    /// Makes and factors the matrix of eq. 9 for the poses in the workspace.
    pub(crate) fn factor(&self, time: f64, ws: &mut Workspace) -> Result<(), Error> {
        self.solver.windows.iter().try_for_each(|window| self.factor_window(window, time, ws))
    }

    /// As `factor`, and solves for the forces in the workspace and γ, section by section while the
    /// factors are in the first-level cache.
    pub(crate) fn factor_and_solve(&self, time: f64, ws: &mut Workspace) -> Result<(), Error> {
        for section in &self.solver.sections {
            let windows = &self.solver.windows[section.clone()];
            for window in windows {
                self.factor_window(window, time, ws)?;
                self.gamma_of(window, ws);
                self.solver.forward_window(window, &ws.factors, &mut ws.solution);
            }
            self.solver.backward_section(windows, &ws.factors, &mut ws.solution);
        }
        Ok(())
    }

    fn factor_window(
        &self,
        window: &ColumnWindow,
        time: f64,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        let Workspace { kin, factors, .. } = ws;
        for range in &window.fresh {
            factors[range.start as usize..range.end as usize].fill(0.0);
        }
        let bodies = self.composites.len();
        for &node in &window.nodes {
            let node = node as usize;
            if let Some(joint) = node.checked_sub(bodies).map(JointIndex) {
                self.joints[joint].store_jacobian(kin, &self.places.joints[joint], factors);
            } else if let Some(offset) = self.places.bodies[node] {
                let composite = &self.composites[node];
                let block = &mut factors[offset as usize..][..36];
                for k in 0..3 {
                    block[7 * k] = composite.mass;
                    for i in 0..3 {
                        block[6 * (3 + k) + 3 + i] = composite.inertia[(i, k)];
                    }
                }
            }
        }
        self.solver.factor_window(window, factors).map_err(|vanished| self.singular(vanished, time))
    }

    pub(crate) fn singular(&self, vanished: Vanished, time: f64) -> Error {
        let bodies = self.composites.len();
        let name = vanished
            .node
            .checked_sub(bodies)
            .map_or_else(|| &self.composites[vanished.node].name, |j| &self.joints[j].name);
        Error::Singular { time, joint: name.clone(), row: vanished.row }
    }

    /// Forces of all elements, gravity, inertia in the frame, drive, magnets and contacts.
    pub(crate) fn apply_forces(&self, ws: &mut Workspace) {
        let Workspace { kin, wrenches, vertical, lateral, external, acceleration, .. } = ws;
        let mut on_line = OnLine { way: ws.way.as_ref(), met: &mut ws.met, lost: &mut ws.lost };
        let way = on_line.way;
        let gravity = way.map_or(self.gravity, |way| way.frame.axes.tr_mul(&self.gravity));
        wrenches.fill(Wrench::zero());
        for (wrench, composite) in wrenches.iter_mut().zip(&self.composites) {
            wrench.force = gravity * composite.mass;
        }
        for bushing in &self.bushings {
            bushing.apply(kin, wrenches);
        }
        for spring in &self.springs {
            spring.apply(kin, wrenches);
        }
        for force in &self.joint_forces {
            force.apply(&self.joints, kin, wrenches);
        }
        if let Some(drive) = &self.drive {
            for anchor in &drive.anchors {
                let body = &kin[anchor.body];
                let arm = body.turn(&anchor.local);
                if let Some(way) = way {
                    let (along, rate, axis) = self.driven(way, anchor, body, on_line.lost);
                    let force = -(drive.stiffness * along + drive.damping * rate);
                    wrenches[anchor.body].add(&(axis * force), &arm);
                    continue;
                }
                let way = body.r.x + arm.x - anchor.start.x;
                let rate = body.velocity_at(&arm).x;
                let force = -(drive.stiffness * way + drive.damping * rate);
                wrenches[anchor.body].add(&Vec3::new(force, 0.0, 0.0), &arm);
            }
        }
        let magnets = Loads { vertical, lateral };
        let forces = AppliedForces { magnets, external, acceleration: *acceleration };
        self.apply_loads(kin, &forces, &mut on_line, wrenches);
        self.apply_contact(ws);
        self.apply_motors(ws);
    }

    /// Q and γ.
    pub(crate) fn right_hand_side(&self, ws: &mut Workspace) {
        self.applied(ws);
        self.gammas(ws);
    }

    /// Q: the moments in body axes, minus ω × J ω.
    pub(crate) fn applied(&self, ws: &mut Workspace) {
        let Workspace { kin, wrenches, solution, .. } = ws;
        for (k, composite) in self.composites.iter().enumerate() {
            let (body, wrench) = (&kin[k], &wrenches[k]);
            let moment =
                body.a.tr_mul(&wrench.moment) - body.w.cross(&(composite.inertia * body.w));
            solution[6 * k..6 * k + 3].copy_from_slice(wrench.force.as_slice());
            solution[6 * k + 3..6 * k + 6].copy_from_slice(moment.as_slice());
        }
    }

    fn gammas(&self, ws: &mut Workspace) {
        for window in &self.solver.windows {
            self.gamma_of(window, ws);
        }
    }

    /// γ of the joints of a window.
    fn gamma_of(&self, window: &ColumnWindow, ws: &mut Workspace) {
        let Workspace { kin, solution, .. } = ws;
        let bodies = self.composites.len();
        for joint in window.nodes.iter().filter_map(|node| (*node as usize).checked_sub(bodies)) {
            let joint = &self.joints[joint];
            let first = 6 * bodies + joint.row;
            joint.gamma(kin, &mut solution[first..first + joint.equations()]);
        }
    }

    /// Φ into `ws.residual` for the poses in `ws.kin`; the largest violation and its joint.
    pub(crate) fn residuals(&self, ws: &mut Workspace) -> (f64, JointIndex) {
        for joint in &self.joints {
            let range = joint.row..joint.row + joint.equations();
            joint.residual(&ws.kin, &mut ws.residual[range]);
        }
        self.largest(&ws.residual)
    }

    /// Φ̇ into `ws.residual` for the poses and motions in `ws.kin`; the largest and its joint.
    pub(crate) fn rates(&self, ws: &mut Workspace) -> (f64, JointIndex) {
        for joint in &self.joints {
            let range = joint.row..joint.row + joint.equations();
            joint.rate(&ws.kin, &mut ws.residual[range]);
        }
        self.largest(&ws.residual)
    }

    /// Largest component and the joint it belongs to; NaN counts as largest.
    fn largest(&self, residual: &[f64]) -> (f64, JointIndex) {
        let mut found = (0.0, JointIndex(0));
        for (k, joint) in self.joints.iter().enumerate() {
            for value in &residual[joint.row..joint.row + joint.equations()] {
                let size = if value.is_nan() { f64::INFINITY } else { value.abs() };
                if size > found.0 {
                    found = (size, JointIndex(k));
                }
            }
        }
        found
    }

    /// Largest violation of the constraints of a state: position level (m, rad) and velocity level
    /// (m/s, rad/s).
    pub fn constraint_violation(&self, state: &State, ws: &mut Workspace) -> (f64, f64) {
        if !ws.has_factors(&state.bodies) {
            ws.forget();
            self.set_pose(&state.bodies, ws);
        }
        ws.evaluated &= ws.has_motion(&state.bodies);
        self.set_motion(&state.bodies, ws);
        (self.residuals(ws).0, self.rates(ws).0)
    }

    /// Accelerations and multipliers that additional loads alone would cause: the derivative of
    /// [`VehicleModel::accelerations`] in the direction of `forces`. Read it with
    /// [`VehicleModel::magnet_response`].
    ///
    /// # Errors
    /// As [`VehicleModel::accelerations`].
    pub fn load_response<'a>(
        &self,
        state: &State,
        forces: impl Into<AppliedForces<'a>>,
        ws: &mut Workspace,
    ) -> Result<(), Error> {
        self.respond(state, &forces.into(), ws, |_| Vec3::zeros())
    }

    /// As [`VehicleModel::load_response`], with further forces on the magnets, world axes, on a line its axes.
    pub(crate) fn respond(
        &self,
        state: &State,
        forces: &AppliedForces,
        ws: &mut Workspace,
        further: impl Fn(MagnetIndex) -> Vec3,
    ) -> Result<(), Error> {
        self.check_forces(state, forces)?;
        self.prepare(&state.bodies, state.time, ws)?;
        self.follow_line(state.travel, ws);
        let Workspace { kin, wrenches, way, met, lost, .. } = &mut *ws;
        let mut on_line = OnLine { way: way.as_ref(), met, lost };
        wrenches.fill(Wrench::zero());
        self.apply_loads(kin, forces, &mut on_line, wrenches);
        for k in self.magnets() {
            let force = further(k);
            if force != Vec3::zeros() {
                let magnet = &self.magnets[k];
                let meeting = on_line.way.zip(on_line.met.get(k.0).and_then(Option::as_ref));
                let force = meeting.map_or(force, |(way, meeting)| way.outward(meeting, &force));
                wrenches[magnet.body].add(&force, &kin[magnet.body].turn(&magnet.local));
            }
        }
        check_line(state.time, ws)?;
        self.respond_to_wrenches(state.time, ws)
    }

    /// Accelerations and multipliers that the wrenches in the workspace alone cause, for the pose whose factors it holds.
    pub(crate) fn respond_to_wrenches(&self, time: f64, ws: &mut Workspace) -> Result<(), Error> {
        ws.evaluated = false;
        let Workspace { kin, wrenches, solution, factors, .. } = &mut *ws;
        solution.fill(0.0);
        for (k, wrench) in wrenches[..self.composites.len()].iter().enumerate() {
            let moment = kin[k].a.tr_mul(&wrench.moment);
            solution[6 * k..6 * k + 3].copy_from_slice(wrench.force.as_slice());
            solution[6 * k + 3..6 * k + 6].copy_from_slice(moment.as_slice());
        }
        self.solver.solve(factors, solution);
        self.check_finite(time, ws)
    }

    fn apply_loads(
        &self,
        kin: &[Kinematics],
        forces: &AppliedForces,
        on_line: &mut OnLine,
        wrenches: &mut [Wrench],
    ) {
        let Loads { vertical, lateral } = forces.magnets;
        self.meet_line(kin, on_line);
        for (k, ((magnet, &up), &left)) in
            self.magnets.iter().zip(vertical).zip(lateral).enumerate()
        {
            let arm = kin[magnet.body].turn(&magnet.local);
            let mut force = Vec3::new(0.0, left, up);
            if let Some((way, Some(meeting))) = on_line.way.zip(on_line.met.get(k)) {
                force = way.outward(meeting, &force);
            }
            wrenches[magnet.body].add(&force, &arm);
        }
        for (watched, load) in self.watched.iter().zip(forces.external) {
            let Some((mut force, mut moment)) = external(load) else { continue };
            let member = &self.members[watched.member];
            if let Some(way) = on_line.way {
                let body = &kin[member.composite];
                for vector in [&mut force, &mut moment] {
                    *vector = self.turned(way, body, &member.offset, vector, on_line.lost);
                }
            }
            let wrench = &mut wrenches[member.composite];
            wrench.add(&force, &kin[member.composite].turn(&member.offset));
            wrench.moment += moment;
        }
        // without it no bit changes
        if forces.acceleration != 0.0 {
            self.apply_frame(kin, forces.acceleration, on_line, wrenches);
        }
    }
}

/// Whether all values are finite, by sums, which are cheaper than a test of each: several, so that they do not
/// wait for each other.
pub(crate) fn are_finite(values: &[f64]) -> bool {
    let (chunks, rest) = values.as_chunks::<8>();
    let mut sums = [0.0; 8];
    for chunk in chunks {
        for (sum, value) in sums.iter_mut().zip(chunk) {
            *sum += value;
        }
    }
    (sums.iter().sum::<f64>() + rest.iter().sum::<f64>()).is_finite()
}

/// Refuses an evaluation in which a point had no place on the line, or a motor no force.
pub(crate) fn check_line(time: f64, ws: &mut Workspace) -> Result<(), Error> {
    check_motors(time, ws)?;
    let Some(cause) = ws.lost.take() else { return Ok(()) };
    ws.forget();
    Err(Error::OffLine { time, cause })
}

/// Force and moment of an external load; `None` where there is none, which so changes no bit.
pub(crate) fn external(load: &ExternalLoad) -> Option<(Vec3, Vec3)> {
    let [fx, fy, fz, mx, my, mz] = *load;
    (*load != [0.0; 6]).then(|| (Vec3::new(fx, fy, fz), Vec3::new(mx, my, mz)))
}
