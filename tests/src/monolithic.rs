//! The whole system as one ordinary differential equation: the reference for co-simulation.
//!
//! The right-hand sides are those of the crates `magnet` (eqs 1-5), `guideway` (eqs 6-8, 13) and
//! `multibody` (eqs 9-12), evaluated at one instant with nothing held or extrapolated between them;
//! their own integrators are not used. The state is, one after the other,
//!
//! | part | entries | unit |
//! |---|---|---|
//! | bodies | r, p, v, ω: 13 each | m, 1, m/s, rad/s |
//! | magnets | x₁ … x₅, Δλ: 6 each | as in eq. 4, Wb |
//! | guideway | q₁ … qₙ, then q̇₁ … q̇ₙ | m, m/s |
//!
//! Integrated with the explicit Dormand-Prince scheme of order 8 with error control. Joints are
//! closed on the level of accelerations only; at the tolerances used here the poses drift by less
//! than [`Trajectory::opening`].

use std::cell::RefCell;

use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};
use faer::Mat;
use guideway::{Guideway, Load};
use magnet::Magnet;
use multibody::math::{Quat, rate};
use multibody::{BodyIndex, BodyState, Holding, Loads, MagnetIndex, VehicleModel};
use nalgebra::Complex;

const BODY: usize = 13;
const MAGNET: usize = 6;
/// The static state has converged when no height of the track changes by more than this (m):
/// rounding of positions of some ten metres.
const SETTLED: f64 = 1e-14;
const MOST_SWEEPS: usize = 100;
/// Eigenvalues below are those of coordinates without motion, 1/s: double zeros, which differences of
/// 1e-9 move by the root of that times the equations' size.
pub const STATIC: f64 = 0.5;

/// The coupled parts and the travel of the vehicle.
#[derive(Debug, Clone)]
pub struct MonolithicSetup {
    /// The vehicle.
    pub vehicle: multibody::VehicleDescription,
    /// The guideway.
    pub guideway: guideway::GuidewayDescription,
    /// Every magnet; the law must be linear and the controller continuous.
    pub magnet: magnet::MagnetParameters,
    /// Nominal speed (m/s).
    pub travel_speed: f64,
    /// Place of the vehicle's origin on the track at the start (m).
    pub initial_position: f64,
}

/// The coupled equations.
pub struct MonolithicSystem {
    vehicle: VehicleModel,
    guideway: Guideway,
    magnet: Magnet,
    travel_speed: f64,
    initial_position: f64,
    start: Vec<f64>,
    loads: Vec<f64>,
    scratch: RefCell<Scratch>,
}

struct Scratch {
    bodies: multibody::State,
    vehicle: multibody::Workspace,
    girders: guideway::State,
    guideway: guideway::Workspace,
    magnets: Vec<magnet::State>,
    places: Vec<Load>,
    modal: Vec<f64>,
    at: Vec<Instant>,
    lateral: Vec<f64>,
    vertical: Vec<f64>,
    failure: Option<String>,
}

/// One magnet at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instant {
    /// Air gap (m).
    pub gap: f64,
    /// Levitation force (N).
    pub force: f64,
}

/// Signals at the requested times.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    /// Times (s).
    pub time: Vec<f64>,
    /// Every magnet, at every time.
    pub magnets: Vec<Vec<Instant>>,
    /// Mid-span displacements (m), at every time.
    pub midspan: Vec<Vec<f64>>,
    /// Largest violation of a joint at the end (m or rad).
    pub opening: f64,
    /// Evaluations of the right-hand side.
    pub evaluations: usize,
}

fn told(error: impl std::fmt::Display) -> String {
    error.to_string()
}

impl MonolithicSystem {
    /// Assembles the parts at rest relative to the track, the girders deflected by the static loads.
    ///
    /// # Errors
    /// A part cannot be built or has no equilibrium.
    pub fn new(setup: &MonolithicSetup) -> Result<Self, String> {
        let vehicle = VehicleModel::new(&setup.vehicle).map_err(told)?;
        let guideway = Guideway::new(&setup.guideway, None).map_err(told)?;
        let magnet = Magnet::new(setup.magnet).map_err(told)?;
        if !magnet.is_exact() {
            return Err("the magnets must be linear, continuous and without limits".into());
        }
        let count = vehicle.counts().magnets;
        let modes = guideway.modes().len();
        let scratch = Scratch {
            bodies: vehicle.initial_state(),
            vehicle: vehicle.workspace(),
            girders: guideway::State { q: vec![0.0; modes], v: vec![0.0; modes] },
            guideway: guideway::Workspace::new(&guideway),
            magnets: Vec::new(),
            places: vec![Load::default(); count],
            modal: vec![0.0; modes],
            at: vec![Instant::default(); count],
            lateral: vec![0.0; count],
            vertical: vec![0.0; count],
            failure: None,
        };
        let mut system = Self {
            vehicle,
            guideway,
            magnet,
            travel_speed: setup.travel_speed,
            initial_position: setup.initial_position,
            start: Vec::new(),
            loads: vec![0.0; count],
            scratch: RefCell::new(scratch),
        };
        system.rest()?;
        Ok(system)
    }

    /// Initial state, as in co-simulation: the vehicle in equilibrium below the track, each magnet
    /// at rest at its gap, the girders bent by the magnets' forces. Magnets on one frame cannot all
    /// be at c0 below a bent track, so some start with another gap.
    fn rest(&mut self) -> Result<(), String> {
        let scratch = self.scratch.get_mut();
        let mut track = vec![0.0; self.loads.len()];
        scratch.bodies = self.vehicle.initial_state();
        for _ in 0..MOST_SWEEPS {
            let pole_width = self.magnet.parameters().pole_width;
            let guidance = |load: f64, gap: f64, offset: f64| {
                pole_width.map_or([0.0; 2], |width| {
                    [
                        magnet::lateral_force(load, gap, offset, width),
                        magnet::lateral_stiffness(load, gap, offset, width),
                    ]
                })
            };
            let holding = Holding::default();
            let found = self
                .vehicle
                .guided_equilibrium(&track, &holding, &guidance, &mut scratch.vehicle)
                .map_err(told)?;
            (scratch.bodies, self.loads) = (found.state, found.loads);
            scratch.magnets.clear();
            for (k, &height) in track.iter().enumerate() {
                let motion = self.vehicle.magnet(&scratch.bodies, MagnetIndex(k));
                let x = self.initial_position + motion.position.x;
                let Scratch { guideway, girders, modal, .. } = scratch;
                let surface = self.guideway.surface(guideway, girders, modal, x);
                let inputs = magnet::MagnetInputs {
                    gap: self.vehicle.nominal_gap() + height - motion.displacement.z,
                    gap_rate: surface.rate(self.travel_speed) - motion.velocity.z,
                    acceleration: 0.0,
                    lateral_offset: motion.displacement.y,
                    static_force: self.loads[k],
                    ..magnet::MagnetInputs::default()
                };
                let magnet = self.magnet.initialise(&inputs, 0.0).map_err(told)?;
                let force = self.magnet.outputs(&magnet, &inputs).map_err(told)?.force;
                scratch.places[k] = Load::standing(force, x);
                scratch.magnets.push(magnet);
            }
            scratch.girders = self
                .guideway
                .initial_state(&mut scratch.guideway, &scratch.places, self.travel_speed, 0.0)
                .map_err(told)?;
            let mut moved = 0.0_f64;
            for (height, place) in track.iter_mut().zip(&scratch.places) {
                let Scratch { guideway, girders, modal, .. } = scratch;
                let surface = self.guideway.surface(guideway, girders, modal, place.position[0]);
                moved = moved.max((surface.displacement() - *height).abs());
                *height = surface.displacement();
            }
            if moved < SETTLED {
                self.start = self.packed();
                return Ok(());
            }
        }
        Err("the static state was not found".into())
    }

    /// The state in scratch memory as one vector.
    fn packed(&self) -> Vec<f64> {
        let scratch = self.scratch.borrow();
        let mut y = Vec::new();
        for body in &scratch.bodies.bodies {
            y.extend(body.position.iter());
            y.extend(body.attitude);
            y.extend(body.velocity.iter());
            y.extend(body.angular_velocity.iter());
        }
        for magnet in &scratch.magnets {
            y.extend(magnet.filter);
            y.push(magnet.flux_deviation);
        }
        y.extend(&scratch.girders.q);
        y.extend(&scratch.girders.v);
        y
    }

    /// The state at the start.
    #[must_use]
    pub fn start(&self) -> &[f64] {
        &self.start
    }

    /// Static loads (N), one per magnet.
    #[must_use]
    pub fn static_loads(&self) -> &[f64] {
        &self.loads
    }

    fn unpack(&self, t: f64, y: &[f64], scratch: &mut Scratch) {
        let (bodies, rest) = y.split_at(BODY * scratch.bodies.bodies.len());
        scratch.bodies.time = t;
        for (body, y) in scratch.bodies.bodies.iter_mut().zip(bodies.chunks_exact(BODY)) {
            let three = |k: usize| nalgebra::Vector3::new(y[k], y[k + 1], y[k + 2]);
            *body = BodyState {
                position: three(0),
                attitude: [y[3], y[4], y[5], y[6]],
                velocity: three(7),
                angular_velocity: three(10),
            };
        }
        let (magnets, girders) = rest.split_at(MAGNET * scratch.magnets.len());
        for (magnet, y) in scratch.magnets.iter_mut().zip(magnets.chunks_exact(MAGNET)) {
            magnet.filter.copy_from_slice(&y[..5]);
            magnet.flux_deviation = y[5];
        }
        let (q, v) = girders.split_at(scratch.girders.q.len());
        scratch.girders.q.copy_from_slice(q);
        scratch.girders.v.copy_from_slice(v);
    }

    /// Computes gaps, forces and accelerations for the state in scratch memory.
    fn evaluate(&self, t: f64, scratch: &mut Scratch) -> Result<(), String> {
        for k in 0..scratch.places.len() {
            let motion = self.vehicle.magnet(&scratch.bodies, MagnetIndex(k));
            let x = self.initial_position + self.travel_speed * t + motion.position.x;
            let Scratch { guideway, girders, modal, .. } = scratch;
            // only the position matters here, not the accelerations
            let surface = self.guideway.surface(guideway, girders, modal, x);
            let gap = self.vehicle.nominal_gap() + surface.displacement() - motion.displacement.z;
            let inputs = magnet::MagnetInputs {
                gap,
                lateral_offset: motion.displacement.y,
                static_force: self.loads[k],
                ..magnet::MagnetInputs::default()
            };
            let outputs = self.magnet.outputs(&scratch.magnets[k], &inputs).map_err(told)?;
            scratch.at[k] = Instant { gap, force: outputs.force };
            scratch.vertical[k] = outputs.force;
            scratch.lateral[k] = outputs.lateral_force;
            scratch.places[k] = Load::standing(outputs.force, x);
        }
        let loads = Loads { vertical: &scratch.vertical, lateral: &scratch.lateral };
        self.vehicle.accelerations(&scratch.bodies, &loads, &mut scratch.vehicle).map_err(told)?;
        let Scratch { guideway, girders, places, modal, .. } = scratch;
        self.guideway.accelerations(guideway, girders, places, t, modal);
        Ok(())
    }

    /// ẏ from the results of [`MonolithicSystem::evaluate`].
    fn write_rates(&self, scratch: &Scratch, rates: &mut [f64]) {
        let (bodies, rest) = rates.split_at_mut(BODY * scratch.bodies.bodies.len());
        for (k, (body, out)) in
            scratch.bodies.bodies.iter().zip(bodies.chunks_exact_mut(BODY)).enumerate()
        {
            let (linear, angular) = scratch.vehicle.acceleration(BodyIndex(k));
            let turning: Quat = rate(body.attitude, &body.angular_velocity);
            out[..3].copy_from_slice(body.velocity.as_slice());
            out[3..7].copy_from_slice(&turning);
            out[7..10].copy_from_slice(linear.as_slice());
            out[10..].copy_from_slice(angular.as_slice());
        }
        let (magnets, girders) = rest.split_at_mut(MAGNET * scratch.magnets.len());
        let linear = self.magnet.linear_system();
        let nominal = self.magnet.electromagnet().nominal_gap;
        for (k, (state, out)) in
            scratch.magnets.iter().zip(magnets.chunks_exact_mut(MAGNET)).enumerate()
        {
            let x = &state.filter;
            let z = [x[0], x[1], x[2], x[3], x[4], state.flux_deviation];
            let down = -self.vehicle.magnet_acceleration(&scratch.vehicle, MagnetIndex(k)).z;
            let w = [scratch.at[k].gap - nominal, down];
            for (out, (a, b)) in out.iter_mut().zip(linear.a.iter().zip(&linear.b)) {
                *out =
                    a.iter().zip(&z).map(|(a, z)| a * z).sum::<f64>() + b[0] * w[0] + b[1] * w[1];
            }
        }
        let (q, v) = girders.split_at_mut(scratch.girders.q.len());
        q.copy_from_slice(&scratch.girders.v);
        v.copy_from_slice(&scratch.modal);
    }

    /// ẏ at t and y.
    ///
    /// # Errors
    /// The state cannot be evaluated.
    pub fn rates(&self, t: f64, y: &[f64], rates: &mut [f64]) -> Result<(), String> {
        let mut scratch = self.scratch.borrow_mut();
        self.unpack(t, y, &mut scratch);
        self.evaluate(t, &mut scratch)?;
        self.write_rates(&scratch, rates);
        Ok(())
    }

    /// Solves from t = 0 to each of `times` (s, ascending, the first may be 0) with relative
    /// tolerance `tolerance`; the absolute tolerances are derived from it and the size of each kind
    /// of state.
    ///
    /// # Errors
    /// A gap closed, a joint became singular, or the integrator failed.
    pub fn solve(&self, times: &[f64], tolerance: f64) -> Result<Trajectory, String> {
        let stop = times.last().copied().unwrap_or(0.0);
        let method = ExplicitRungeKutta::dop853()
            .rtol(tolerance)
            .atol(self.absolute_tolerances(tolerance))
            .h_max(2e-3)
            .max_steps(usize::MAX);
        let solution = IVP::ode(self, 0.0, stop, self.start.clone())
            .t_eval(times)
            .method(method)
            .solve()
            .map_err(|e| self.failure().unwrap_or_else(|| format!("{e:?}")))?;
        let mut trajectory =
            Trajectory { evaluations: solution.evals.function, ..Trajectory::default() };
        let mut scratch = self.scratch.borrow_mut();
        let scratch = &mut *scratch;
        for (&t, y) in solution.t.iter().zip(&solution.y) {
            self.unpack(t, y, scratch);
            self.evaluate(t, scratch)?;
            let middle = |scratch: &mut Scratch, k| {
                let Scratch { guideway, girders, modal, .. } = scratch;
                self.guideway.mid_span(guideway, girders, modal, k).displacement
            };
            trajectory.time.push(t);
            trajectory.magnets.push(scratch.at.clone());
            let spans = 0..self.guideway.spans().len();
            trajectory.midspan.push(spans.map(|k| middle(scratch, k)).collect());
        }
        trajectory.opening =
            self.vehicle.constraint_violation(&scratch.bodies, &mut scratch.vehicle).0;
        Ok(trajectory)
    }

    /// Eigenvalues (1/s) of the equations linearised about the start by central differences,
    /// largest magnitude first. Those near zero come from coordinates without motion: violated
    /// joints, lengths of quaternions; only |λ| > [`STATIC`] is returned.
    ///
    /// # Errors
    /// A state near the initial state cannot be evaluated.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, String> {
        let n = self.start.len();
        let mut jacobian = Mat::zeros(n, n);
        let (mut y, mut above, mut below) = (self.start.clone(), vec![0.0; n], vec![0.0; n]);
        for (k, size) in self.absolute_tolerances(1.0).into_iter().enumerate() {
            // a thousandth of the usual size of the state: forces are nonlinear over millimetres
            let by = 1e-3 * size;
            y[k] = self.start[k] + by;
            self.rates(0.0, &y, &mut above)?;
            y[k] = self.start[k] - by;
            self.rates(0.0, &y, &mut below)?;
            y[k] = self.start[k];
            for (i, (a, b)) in above.iter().zip(&below).enumerate() {
                jacobian[(i, k)] = (a - b) / (2.0 * by);
            }
        }
        let mut values = jacobian.eigenvalues().map_err(|e| format!("{e:?}"))?;
        values.retain(|value| value.norm() > STATIC);
        values.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        Ok(values)
    }

    fn failure(&self) -> Option<String> {
        self.scratch.borrow_mut().failure.take()
    }

    /// Sizes that the tolerance is relative to, for states near zero: 1 mm, 1 mm/s, 1e-3 rad; the
    /// filter's states and the flux as they answer to a gap that is 0.1 mm off.
    fn absolute_tolerances(&self, tolerance: f64) -> Vec<f64> {
        let bodies = self.scratch.borrow().bodies.bodies.len();
        let mut sizes = vec![1e-3; BODY * bodies];
        let inputs = magnet::MagnetInputs {
            gap: self.vehicle.nominal_gap() + 1e-4,
            static_force: self.loads[0],
            ..magnet::MagnetInputs::default()
        };
        let size = self.magnet.initialise(&inputs, 0.0).map_or(1e-3, |state| {
            state.filter.iter().chain([&state.flux_deviation]).fold(0.0_f64, |m, x| m.max(x.abs()))
        });
        sizes.extend(std::iter::repeat_n(size, MAGNET * self.loads.len()));
        sizes.extend(std::iter::repeat_n(1e-3, 2 * self.guideway.modes().len()));
        sizes.iter().map(|size| size * tolerance).collect()
    }
}

impl ODE<f64, Vec<f64>> for MonolithicSystem {
    fn diff(&self, t: f64, y: &Vec<f64>, rates: &mut Vec<f64>) {
        if let Err(message) = self.rates(t, y, rates) {
            self.scratch.borrow_mut().failure.get_or_insert(message);
            rates.fill(f64::NAN);
        }
    }
}
