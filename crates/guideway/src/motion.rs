//! State of the girders, exact stepping, and motion at magnets and mid-spans.

use serde::{Deserialize, Serialize};

use crate::loads::{Load, LoadChange, PointForce, check_further, taylor};
use crate::propagator::{NODES, PropagatorCache, SUBSTEP_PHASE, nodes};
use crate::rail_motion::ComponentRows;
use crate::shapes::{ShapeRow, sines_at_nodes};
use crate::{Error, Guideway, InitialDeflection};

/// Everything that changes: modal coordinates and their rates, span by span, mode by mode.
#[derive(Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct State {
    /// qₙ (m), up positive.
    pub q: Vec<f64>,
    /// q̇ₙ (m/s).
    pub v: Vec<f64>,
}

impl Clone for State {
    fn clone(&self) -> Self {
        Self { q: self.q.clone(), v: self.v.clone() }
    }

    /// Reuses the memory: saving and restoring must not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.q.clone_from(&source.q);
        self.v.clone_from(&source.v);
    }
}

/// Most sub-steps of one step.
const MAX_SUBSTEPS: u32 = 1_000_000;

/// Scratch memory and cached propagators. Results do not depend on its previous content.
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(crate) row: ShapeRow,
    /// For girders with rails.
    pub(crate) rows: ComponentRows,
    /// Per mode its force at the nodes of a sub-step.
    pub(crate) forces: Vec<[f64; NODES]>,
    /// For steps of modes that dampers couple.
    next: Vec<f64>,
    cache: PropagatorCache,
    substep_phase: f64,
}

impl Workspace {
    /// Memory for one guideway.
    pub fn new(guideway: &Guideway) -> Self {
        let modes = guideway.modes().len();
        Self {
            row: ShapeRow::with_modes(guideway.most_modes()),
            rows: ComponentRows::new(guideway.rails().map_or(0, |_| guideway.most_modes())),
            forces: vec![[0.0; NODES]; modes],
            next: vec![0.0; 2 * guideway.most_modes()],
            cache: PropagatorCache::new(modes),
            substep_phase: SUBSTEP_PHASE,
        }
    }

    /// Allows another phase per sub-step (rad) than [`SUBSTEP_PHASE`](crate::SUBSTEP_PHASE);
    /// infinity takes every step in one piece. For studies of convergence.
    #[must_use]
    pub fn with_substep_phase(mut self, phase: f64) -> Self {
        self.substep_phase = phase;
        self
    }
}

/// The track surface at one magnet: partial derivatives of deflection u(x, t) and irregularity
/// r(x). Subscripts name them: `u_tx` is ∂²u/∂t∂x. u is the mean over the magnet's discrete forces, r
/// over its pole, or at its centre if the description asks for that.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[allow(missing_docs, reason = "the subscripts say it")]
pub struct Surface {
    pub u: f64,
    pub u_x: f64,
    pub u_xx: f64,
    pub u_t: f64,
    pub u_tx: f64,
    pub u_tt: f64,
    pub r: f64,
    pub r_x: f64,
    pub r_xx: f64,
}

impl Surface {
    /// Displacement u + r (m), up positive.
    pub fn displacement(&self) -> f64 {
        self.u + self.r
    }

    /// Slope ∂(u + r)/∂x (1): how the displacement changes with the magnet's place.
    pub fn slope(&self) -> f64 {
        self.u_x + self.r_x
    }

    /// Rate as a magnet with speed v sees it (m/s): ∂u/∂t + v·∂(u + r)/∂x.
    pub fn rate(&self, v: f64) -> f64 {
        self.u_t + v * self.slope()
    }

    /// Change of [`rate`](Self::rate) with the magnet's place (1/s).
    pub fn rate_slope(&self, v: f64) -> f64 {
        self.u_tx + v * (self.u_xx + self.r_xx)
    }

    /// Second time derivative of the displacement as a magnet with speed v and acceleration a
    /// sees it (m/s²): u_tt + 2v·u_tx + v²(u + r)_xx + a(u + r)_x.
    pub fn acceleration(&self, v: f64, a: f64) -> f64 {
        self.u_tt + v * (self.u_tx + self.rate_slope(v)) + a * self.slope()
    }
}

/// A point of a span: y = [u, u̇, ü] of eq. 8.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SpanMotion {
    /// Displacement (m), up positive.
    pub displacement: f64,
    /// Velocity (m/s).
    pub velocity: f64,
    /// Acceleration (m/s²), with the feed-through of the forces (matrix D).
    pub acceleration: f64,
}

impl Guideway {
    /// State at `time` under the given forces and places, as [`InitialDeflection`] asks. `speed` (m/s) is
    /// that of the loads, for the quasi-static start.
    ///
    /// # Errors
    /// A force or position that is not finite.
    pub fn initial_state(
        &self,
        work: &mut Workspace,
        loads: &[Load],
        speed: f64,
        time: f64,
    ) -> Result<State, Error> {
        self.initial_state_with(work, loads, None, speed, time)
    }

    /// [`initial_state`](Self::initial_state) under a further force, held.
    ///
    /// # Errors
    /// As [`initial_state`](Self::initial_state).
    pub fn initial_state_with(
        &self,
        work: &mut Workspace,
        loads: &[Load],
        further: Option<PointForce>,
        speed: f64,
        time: f64,
    ) -> Result<State, Error> {
        self.check_loads(loads, time)?;
        check_further(further, time)?;
        let zeros = vec![0.0; self.modes().len()];
        let mut state = State { q: zeros.clone(), v: zeros };
        if self.initial() == InitialDeflection::Undeformed {
            return Ok(state);
        }
        let moving = if self.initial() == InitialDeflection::QuasiStatic { speed } else { 0.0 };
        if let Some(rails) = self.rails() {
            self.rest_on_rails(rails, work, loads, moving, &mut state);
        }
        for load in self.on_the_axis(loads) {
            let force = load.force[0];
            self.under_pole(load.position[0], &mut work.row, |span, row, share| {
                for (n, mode) in self.girders()[span.girder].vertical_modes().iter().enumerate() {
                    let flexibility = share * force / mode.stiffness();
                    state.q[span.first_mode + n] -= flexibility * row.value[n];
                    state.v[span.first_mode + n] -= flexibility * moving * row.slope[n];
                }
            });
        }
        for (position, force) in self.point_forces(further, time) {
            self.under_point(position, &mut work.row, |span, row| {
                for (n, mode) in self.girders()[span.girder].vertical_modes().iter().enumerate() {
                    state.q[span.first_mode + n] -= force / mode.stiffness() * row.value[n];
                }
            });
        }
        Ok(state)
    }

    /// Advances the state from `time` by `step` (s) under moving loads (eq. 7).
    ///
    /// Exact for modal forces that are polynomials of order up to 3 (standing loads); for moving
    /// loads see [`nodes`]. If loads travel far or the phase of the chirp changes fast, the step is
    /// divided into equal sub-steps of at most [`SUBSTEP_PHASE`](crate::SUBSTEP_PHASE). While a
    /// force passes a joint the modal force has a kink, and that step is of second order only.
    ///
    /// # Errors
    /// A step that is not positive and finite, loads that are not finite, or loads that move too
    /// fast.
    pub fn step(
        &self,
        work: &mut Workspace,
        state: &mut State,
        loads: &[Load],
        time: f64,
        step: f64,
    ) -> Result<(), Error> {
        self.step_with(work, state, loads, None, (time, step))
    }

    /// [`step`](Self::step) under a further force, from the first time over the second.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn step_with(
        &self,
        work: &mut Workspace,
        state: &mut State,
        loads: &[Load],
        further: Option<PointForce>,
        (time, step): (f64, f64),
    ) -> Result<(), Error> {
        check_further(further, time)?;
        if !(step > 0.0 && step.is_finite()) {
            return Err(Error::StepSize { time, step });
        }
        self.check_loads(loads, time)?;
        let standing = loads.iter().all(Load::stands);
        let count = self.substeps(work.substep_phase, loads, time, step)?;
        let h = step / f64::from(count);
        let propagator = work.cache.get(h, self.modes(), self.girders());
        for k in 0..count {
            let begin = h * f64::from(k);
            work.forces.fill([0.0; NODES]);
            if let Some(rails) = self.rails() {
                self.add_loads_on_rails(rails, work, loads, begin, h);
            } else if standing {
                self.add_standing_loads(work, loads, begin, h);
            } else {
                self.add_moving_loads(work, loads, begin, h);
            }
            self.add_chirp(work, time + begin, h);
            if let Some(PointForce { position, force }) = further {
                self.add_at(
                    work,
                    position,
                    nodes().map(|node| taylor(&force, &[0.0; 2], begin + node * h)),
                );
            }
            let entry = work.cache.entry(propagator);
            entry.advance(self, state, &work.forces, &mut work.next);
        }
        Ok(())
    }

    /// Number of sub-steps that limits the phase of motion and chirp.
    fn substeps(&self, limit: f64, loads: &[Load], time: f64, step: f64) -> Result<u32, Error> {
        let travel = loads
            .iter()
            .map(|l| {
                let [_, v, a, j] = l.position.map(f64::abs);
                let [s, c] = l.further[1].map(f64::abs);
                let j = j + step * (s / 4.0 + step * c / 20.0);
                step * (v + step * (a / 2.0 + step * j / 6.0))
            })
            .fold(0.0, f64::max);
        let chirp = self.chirp().map_or(0.0, |c| c.phase(time, step));
        let needed = ((travel * self.wavenumber()).max(chirp) / limit).ceil().max(1.0);
        // Also false for NaN.
        if needed <= f64::from(MAX_SUBSTEPS) {
            return Ok(needed as u32);
        }
        Err(Error::TooManySubsteps { time, step, needed, limit: MAX_SUBSTEPS })
    }

    /// `add(i, φᵢ)` for all modes that a pole at x loads.
    fn add_load(&self, x: f64, row: &mut ShapeRow, mut add: impl FnMut(usize, f64)) {
        self.under_pole(x, row, |span, row, share| {
            let modes = self.girders()[span.girder].vertical_modes().len();
            for n in 0..modes {
                add(span.first_mode + n, share * row.value[n]);
            }
        });
    }

    /// Moving loads: shapes at every node, evaluated for all nodes together if the pole stays on
    /// its span.
    fn add_moving_loads(&self, work: &mut Workspace, loads: &[Load], begin: f64, h: f64) {
        let times = nodes().map(|node| begin + node * h);
        let forces = &mut work.forces;
        for load in loads {
            let force = times.map(|tau| load.force_at(tau));
            let places = times.map(|tau| load.position_at(tau));
            if let Some((span, length, filter)) = self.sines_under_poles(&places) {
                let local = places.map(|x| x - span.start);
                sines_at_nodes(length, local, filter, |n, phi| {
                    let modal = &mut forces[span.first_mode + n];
                    *modal = std::array::from_fn(|j| modal[j] - force[j] * phi[j]);
                });
                continue;
            }
            for (j, (x, force)) in places.into_iter().zip(force).enumerate() {
                self.add_load(x, &mut work.row, |i, phi| forces[i][j] -= force * phi);
            }
        }
    }

    /// Standing loads: the shapes are evaluated once for all nodes.
    fn add_standing_loads(&self, work: &mut Workspace, loads: &[Load], begin: f64, h: f64) {
        let times = nodes().map(|node| begin + node * h);
        let forces = &mut work.forces;
        for load in loads {
            let force = times.map(|tau| load.force_at(tau));
            self.add_load(load.position[0], &mut work.row, |i, phi| {
                for j in 0..NODES {
                    forces[i][j] -= force[j] * phi;
                }
            });
        }
    }

    fn add_chirp(&self, work: &mut Workspace, time: f64, h: f64) {
        let Some(chirp) = self.chirp() else { return };
        self.add_at(work, chirp.position(), nodes().map(|node| chirp.at(time + node * h)));
    }

    /// Adds a force at the nodes (N, down positive) at one place.
    fn add_at(&self, work: &mut Workspace, position: f64, force: [f64; NODES]) {
        let forces = &mut work.forces;
        self.under_point(position, &mut work.row, |span, row| {
            for n in 0..self.girders()[span.girder].vertical_modes().len() {
                for j in 0..NODES {
                    forces[span.first_mode + n][j] -= force[j] * row.value[n];
                }
            }
        });
    }

    /// Modal accelerations q̈ = M⁻¹(φᵀP − C·q̇ − K·q) at `time`, into `accelerations`.
    pub fn accelerations(
        &self,
        work: &mut Workspace,
        state: &State,
        loads: &[Load],
        time: f64,
        accelerations: &mut [f64],
    ) {
        self.accelerations_with(work, (state, time), loads, None, accelerations);
    }

    /// [`accelerations`](Self::accelerations) of a state at a time, under a further force.
    pub fn accelerations_with(
        &self,
        work: &mut Workspace,
        (state, time): (&State, f64),
        loads: &[Load],
        further: Option<PointForce>,
        accelerations: &mut [f64],
    ) {
        accelerations.fill(0.0);
        if let Some(rails) = self.rails() {
            self.add_forces_on_rails(rails, work, loads, accelerations);
        }
        for load in self.on_the_axis(loads) {
            self.add_load(load.position[0], &mut work.row, |i, phi| {
                accelerations[i] -= load.force[0] * phi;
            });
        }
        for (position, force) in self.point_forces(further, time) {
            self.under_point(position, &mut work.row, |span, row| {
                for n in 0..self.girders()[span.girder].vertical_modes().len() {
                    accelerations[span.first_mode + n] -= force * row.value[n];
                }
            });
        }
        for (i, mode) in self.modes().iter().enumerate() {
            let damped = 2.0 * mode.zeta * mode.omega * state.v[i];
            accelerations[i] =
                accelerations[i] / mode.mass - damped - mode.omega * mode.omega * state.q[i];
        }
        for span in self.spans() {
            let girder = &self.girders()[span.girder];
            let Some(coupling) = girder.coupling() else { continue };
            let range = span.first_mode..span.first_mode + girder.modes().len();
            for (i, acceleration) in accelerations[range.clone()].iter_mut().enumerate() {
                for (rate, v) in coupling.row(i).iter().zip(&state.v[range.clone()]) {
                    *acceleration -= rate * v;
                }
            }
        }
    }

    /// Place and force now of the chirp and of a further force.
    fn point_forces(
        &self,
        further: Option<PointForce>,
        time: f64,
    ) -> impl Iterator<Item = (f64, f64)> + use<> {
        let chirp = self.chirp().map(|chirp| (chirp.position(), chirp.at(time)));
        chirp.into_iter().chain(further.map(|it| (it.position, it.force[0])))
    }

    /// The loads, if the track has no rails.
    fn on_the_axis<'a>(&self, loads: &'a [Load]) -> &'a [Load] {
        if self.rails().is_some() { &[] } else { loads }
    }

    /// How the modal accelerations change with small changes of the loads, into `change`:
    /// −M⁻¹Σ(δF·φ(x) + F·φ′(x)·δx), the feed-through matrix D of eq. 8 by mode.
    pub fn acceleration_change(
        &self,
        work: &mut Workspace,
        loads: &[Load],
        changes: impl Iterator<Item = LoadChange>,
        change: &mut [f64],
    ) {
        change.fill(0.0);
        for (k, (load, by)) in loads.iter().zip(changes).enumerate() {
            if by == LoadChange::default() {
                continue;
            }
            if let Some(rails) = self.rails() {
                self.change_on_rails(rails, work, (k, load), by, change);
                continue;
            }
            let LoadChange { force, place, .. } = by;
            self.under_pole(load.position[0], &mut work.row, |span, row, share| {
                for (n, mode) in self.girders()[span.girder].vertical_modes().iter().enumerate() {
                    let push = force * row.value[n] + load.force[0] * row.slope[n] * place;
                    change[span.first_mode + n] -= share * push / mode.mass;
                }
            });
        }
    }

    /// How the modal accelerations change with a force (N, down positive) at one point of the track,
    /// into `change`: −M⁻¹·F·φ(x).
    pub fn acceleration_under(
        &self,
        work: &mut Workspace,
        position: f64,
        force: f64,
        change: &mut [f64],
    ) {
        change.fill(0.0);
        self.add_acceleration_under(work, position, force, change);
    }

    /// Adds to `change` how the modal accelerations change with a force: see
    /// [`acceleration_under`](Self::acceleration_under).
    pub fn add_acceleration_under(
        &self,
        work: &mut Workspace,
        position: f64,
        force: f64,
        change: &mut [f64],
    ) {
        self.under_point(position, &mut work.row, |span, row| {
            for (n, mode) in self.girders()[span.girder].vertical_modes().iter().enumerate() {
                change[span.first_mode + n] -= force * row.value[n] / mode.mass;
            }
        });
    }

    /// The surface in the middle of the track under a magnet centred at x; `accelerations` is the result of
    /// [`accelerations`](Self::accelerations).
    pub fn surface(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        x: f64,
    ) -> Surface {
        let mut s = Surface::default();
        self.under_pole(x, &mut work.row, |span, row, share| {
            for n in 0..self.girders()[span.girder].vertical_modes().len() {
                let i = span.first_mode + n;
                let (q, v) = (share * state.q[i], share * state.v[i]);
                s.u += q * row.value[n];
                s.u_x += q * row.slope[n];
                s.u_xx += q * row.curvature[n];
                s.u_t += v * row.value[n];
                s.u_tx += v * row.slope[n];
                s.u_tt += share * accelerations[i] * row.value[n];
            }
        });
        if let Some(profile) = self.profile() {
            [s.r, s.r_x, s.r_xx] = profile.at(x);
        }
        s
    }

    /// Displacement, velocity and acceleration in the middle of span `k` (from 0).
    pub fn mid_span(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
    ) -> SpanMotion {
        self.span_motion(work, state, accelerations, k, 0.5)
    }

    /// Displacement, velocity and acceleration of span `k` (from 0) at `part` of its length, 0 … 1.
    pub fn span_motion(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
        part: f64,
    ) -> SpanMotion {
        let length = self.girders()[self.spans()[k].girder].length();
        self.motion_at(work, state, accelerations, k, part * length)
    }

    /// Displacement, velocity and acceleration of the named point `k` (from 0).
    pub fn point(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
    ) -> SpanMotion {
        let point = &self.points()[k];
        self.motion_at(work, state, accelerations, point.span, point.x)
    }

    /// Motion of span `k` (from 0) at x m from its start.
    fn motion_at(
        &self,
        work: &mut Workspace,
        state: &State,
        accelerations: &[f64],
        k: usize,
        x: f64,
    ) -> SpanMotion {
        let span = self.spans()[k];
        let girder = &self.girders()[span.girder];
        girder.shape_at(x, &mut work.row);
        let mut y = SpanMotion::default();
        for n in 0..girder.vertical_modes().len() {
            let (i, phi) = (span.first_mode + n, work.row.value[n]);
            y.displacement += phi * state.q[i];
            y.velocity += phi * state.v[i];
            y.acceleration += phi * accelerations[i];
        }
        y
    }

    /// Kinetic plus strain energy Σ ½M·q̇² + ½K·q² (J).
    pub fn energy(&self, state: &State) -> f64 {
        let modes = self.modes().iter().zip(state.q.iter().zip(&state.v));
        modes.map(|(m, (q, v))| 0.5 * m.mass * (v * v + m.omega * m.omega * q * q)).sum()
    }
}

impl Guideway {
    /// Refuses loads that are not finite. Lateral forces count on rails only.
    fn check_loads(&self, loads: &[Load], time: f64) -> Result<(), Error> {
        let fail = |quantity, k: usize, values: &[f64; 4], further: &[f64; 2]| {
            let value = values.iter().chain(further).find(|v| !v.is_finite());
            value.map_or(Ok(()), |&value| Err(Error::Load { time, quantity, magnet: k + 1, value }))
        };
        for (k, load) in loads.iter().enumerate() {
            fail("force", k, &load.force, &load.further[0])?;
            fail("position", k, &load.position, &load.further[1])?;
            if self.rails().is_some() {
                fail("lateral force", k, &load.lateral, &load.further[2])?;
            }
        }
        Ok(())
    }
}
