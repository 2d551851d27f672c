//! The whole system as one ordinary differential equation: the reference for co-simulation.
//!
//! The right-hand sides are those of the crates `magnet` (eqs 1-5, either law, with lateral guidance and
//! lift loss), `guideway` (eqs 6-8, 13, as a line or with two rails) and `multibody` (eqs 9-12), evaluated
//! at one instant with nothing held or extrapolated between them; their own integrators are not used. On a
//! track line the bodies' coordinates are those of the travelling frame, whose turning is added here. The
//! state is, one after the other,
//!
//! | part | entries | unit |
//! |---|---|---|
//! | bodies | r, p, v, ω: 13 each | m, 1, m/s, rad/s |
//! | magnets | x₁ … x₅, Δλ: 6 each | as in eq. 4, Wb |
//! | girders | q₁ … qₙ, then q̇₁ … q̇ₙ: vertical, lateral, torsional modes | m or rad, per s |
//!
//! Integrated with the explicit Dormand-Prince scheme of order 8 with error control. Joints are
//! closed on the level of accelerations only; at the tolerances used here the poses drift by less
//! than [`Trajectory::opening`].

mod comparison;
mod equations;
mod setup;
mod solution;
mod start;
mod track;

use std::cell::RefCell;

use guideway::Load;
use magnet::{Conditions, Magnet, PowerLimits};
use multibody::VehicleModel;

use self::equations::Scratch;
use self::track::Track;

pub use self::comparison::Quantity;
pub use self::setup::{MonolithicSetup, merge};
pub use self::solution::{STATIC, Trajectory};

/// The coupled equations.
pub struct MonolithicSystem {
    vehicle: VehicleModel,
    magnet: Magnet,
    travel_speed: f64,
    initial_position: f64,
    start: Vec<f64>,
    loads: Vec<f64>,
    scratch: RefCell<Scratch>,
}

/// One magnet at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Instant {
    /// Air gap (m).
    pub gap: f64,
    /// Place to the left of its rail (m).
    pub offset: f64,
    /// Levitation force (N).
    pub force: f64,
    /// Lateral force on the magnet (N), left positive.
    pub lateral_force: f64,
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
        let mut vehicle = VehicleModel::new(&setup.vehicle).map_err(told)?;
        if let Some(line) = &setup.line {
            let line = track_line::Line::new(line).map_err(told)?;
            vehicle = vehicle.with_line(line).map_err(told)?;
        }
        let magnet = Magnet::new(setup.magnet).map_err(told)?;
        let given = &setup.magnet;
        let smooth = given.control.sampling.is_none() && !given.external_controller;
        if !smooth
            || given.limits != PowerLimits::default()
            || given.conditions != Conditions::default()
        {
            return Err("the magnets must be continuous and without limits or failures".into());
        }
        let count = vehicle.counts().magnets;
        let scratch = Scratch {
            bodies: vehicle.initial_state(),
            vehicle: vehicle.workspace(),
            track: Track::new(setup.guideway.as_ref())?,
            magnets: Vec::new(),
            places: vec![Load::default(); count],
            at: vec![Instant::default(); count],
            currents: vec![0.0; count],
            lateral: vec![0.0; count],
            vertical: vec![0.0; count],
            failure: None,
        };
        let mut system = Self {
            vehicle,
            magnet,
            travel_speed: setup.travel_speed,
            initial_position: setup.initial_position,
            start: Vec::new(),
            loads: vec![0.0; count],
            scratch: RefCell::new(scratch),
        };
        let (start, loads) = system.rest(&mut system.scratch.borrow_mut())?;
        (system.start, system.loads) = (start, loads);
        Ok(system)
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
}
