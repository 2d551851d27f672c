//! The right-hand sides, and the order of the state.

use guideway::Load;
use multibody::math::{Quat, Vec3, multiply, rate};
use multibody::{BodyIndex, BodyState, Loads, MagnetIndex, Travel};

use super::track::Track;
use super::{Instant, MonolithicSystem, told};

pub(super) const BODY: usize = 13;
pub(super) const MAGNET: usize = 6;

/// The parts at one instant.
pub(super) struct Scratch {
    pub bodies: multibody::State,
    pub vehicle: multibody::Workspace,
    pub track: Track,
    pub magnets: Vec<magnet::State>,
    pub places: Vec<Load>,
    pub at: Vec<Instant>,
    /// i − i_op of every magnet (A).
    pub currents: Vec<f64>,
    pub lateral: Vec<f64>,
    pub vertical: Vec<f64>,
    pub failure: Option<String>,
}

impl Scratch {
    /// The parts' states as one vector.
    pub fn packed(&self) -> Vec<f64> {
        let mut y = Vec::new();
        for body in &self.bodies.bodies {
            y.extend(body.position.iter());
            y.extend(body.attitude);
            y.extend(body.velocity.iter());
            y.extend(body.angular_velocity.iter());
        }
        for magnet in &self.magnets {
            y.extend(magnet.filter);
            y.push(magnet.flux_deviation);
        }
        if let Some(girders) = self.track.girders() {
            y.extend(&girders.state.q);
            y.extend(&girders.state.v);
        }
        y
    }
}

impl MonolithicSystem {
    /// The travelling frame at a time, on a line.
    pub(super) fn travel(&self, t: f64) -> Option<Travel> {
        let place = self.initial_position + self.travel_speed * t;
        self.vehicle.line().map(|_| Travel { place, speed: self.travel_speed })
    }

    pub(super) fn unpack(&self, t: f64, y: &[f64], scratch: &mut Scratch) {
        let (bodies, rest) = y.split_at(BODY * scratch.bodies.bodies.len());
        scratch.bodies.time = t;
        scratch.bodies.travel = self.travel(t);
        for (body, y) in scratch.bodies.bodies.iter_mut().zip(bodies.chunks_exact(BODY)) {
            let three = |k: usize| Vec3::new(y[k], y[k + 1], y[k + 2]);
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
        scratch.track.set(girders);
    }

    /// Computes gaps, offsets, forces and accelerations for the state in scratch memory.
    pub(super) fn evaluate(&self, t: f64, scratch: &mut Scratch) -> Result<(), String> {
        for k in 0..scratch.places.len() {
            let motion = self.vehicle.magnet(&scratch.bodies, MagnetIndex(k));
            let x = self.initial_position + self.travel_speed * t + motion.position.x;
            let rail = scratch.track.rail(k, x);
            let gap =
                self.vehicle.nominal_gap() + rail.vertical.displacement() - motion.displacement.z;
            let offset = motion.displacement.y - rail.lateral.displacement();
            if self.magnet.lift_loss().is_some_and(|law| offset.abs() >= law.limit()) {
                return Err(format!("guidance of magnet {} is lost at t = {t} s", k + 1));
            }
            let inputs = magnet::MagnetInputs {
                gap,
                lateral_offset: offset,
                static_force: self.loads[k],
                ..magnet::MagnetInputs::default()
            };
            let state = &scratch.magnets[k];
            let outputs = self.magnet.outputs(state, &inputs).map_err(told)?;
            let (force, lateral_force) = (outputs.force, outputs.lateral_force);
            scratch.at[k] = Instant { gap, offset, force, lateral_force };
            scratch.currents[k] = outputs.current - state.operating_current;
            (scratch.vertical[k], scratch.lateral[k]) = (force, lateral_force);
            let lateral = [lateral_force, 0.0, 0.0, 0.0];
            scratch.places[k] = Load { lateral, ..Load::standing(force, x) };
        }
        let loads = Loads { vertical: &scratch.vertical, lateral: &scratch.lateral };
        self.vehicle.accelerations(&scratch.bodies, &loads, &mut scratch.vehicle).map_err(told)?;
        scratch.track.accelerate(&scratch.places, t);
        Ok(())
    }

    /// ẏ from the results of [`MonolithicSystem::evaluate`].
    fn write_rates(&self, t: f64, scratch: &Scratch, rates: &mut [f64]) {
        let (bodies, rest) = rates.split_at_mut(BODY * scratch.bodies.bodies.len());
        // of the axes in which the bodies' coordinates are, rad/s
        let turning = match self.vehicle.line().zip(self.travel(t)) {
            Some((line, travel)) => line.frame(travel.place).curvature * travel.speed,
            None => Vec3::zeros(),
        };
        for (k, (body, out)) in
            scratch.bodies.bodies.iter().zip(bodies.chunks_exact_mut(BODY)).enumerate()
        {
            let (linear, angular) = scratch.vehicle.acceleration(BodyIndex(k));
            let absolute = body.velocity + Vec3::x() * self.travel_speed;
            let spin: Quat = rate(body.attitude, &body.angular_velocity);
            let carried = multiply([0.0, turning.x, turning.y, turning.z], body.attitude);
            let spin: Quat = std::array::from_fn(|i| spin[i] - 0.5 * carried[i]);
            let velocity = body.velocity - turning.cross(&body.position);
            out[..3].copy_from_slice(velocity.as_slice());
            out[3..7].copy_from_slice(&spin);
            out[7..10].copy_from_slice((linear - turning.cross(&absolute)).as_slice());
            out[10..].copy_from_slice(angular.as_slice());
        }
        let (magnets, girders) = rest.split_at_mut(MAGNET * scratch.magnets.len());
        let linear = self.magnet.linear_system();
        let coil = self.magnet.electromagnet();
        for (k, (state, out)) in
            scratch.magnets.iter().zip(magnets.chunks_exact_mut(MAGNET)).enumerate()
        {
            let down = -self.vehicle.magnet_acceleration(&scratch.vehicle, MagnetIndex(k)).z;
            let w = [scratch.at[k].gap - coil.nominal_gap, down];
            let row = |a: &[f64; 6], by: [f64; 2]| {
                a.iter().zip(&state.filter).map(|(a, x)| a * x).sum::<f64>()
                    + by[0] * w[0]
                    + by[1] * w[1]
            };
            for (out, (a, b)) in out[..5].iter_mut().zip(linear.a.iter().zip(&linear.b)) {
                *out = row(a, *b);
            }
            // eqs 2 and 3 for any law: λ' = R·i_op + Δv − R·i
            let [.., control] = linear.a;
            let [.., [_, by_acceleration]] = linear.b;
            out[5] = row(&control, [0.0, by_acceleration]) - coil.resistance * scratch.currents[k];
        }
        if let Some(modes) = scratch.track.girders() {
            let (q, v) = girders.split_at_mut(modes.state.q.len());
            q.copy_from_slice(&modes.state.v);
            v.copy_from_slice(&modes.accelerations);
        }
    }

    /// ẏ at t and y.
    ///
    /// # Errors
    /// The state cannot be evaluated.
    pub fn rates(&self, t: f64, y: &[f64], rates: &mut [f64]) -> Result<(), String> {
        let mut scratch = self.scratch.borrow_mut();
        self.unpack(t, y, &mut scratch);
        self.evaluate(t, &mut scratch)?;
        self.write_rates(t, &scratch, rates);
        Ok(())
    }
}
