//! Skids on a canted track, in a curve, and on rails that move sideways.
#![allow(clippy::unwrap_used, reason = "a test program")]

use multibody::{
    Contact, ContactLaw, LoadCourse, MagnetIndex, State, TrackContact, TrackCourse, Travel,
    VehicleDescription, VehicleModel,
};
use track_line::{Line, LineDescription};

const SLED: &str = r#"{ "name": "sled", "gravity": [0, 0, -9.81], "nominal_gap": 0.008,
    "bodies": [ { "name": "sled", "mass": 250, "inertia": [60, 120, 150], "position": [0, 0, 0.1] } ],
    "magnets": [ { "body": "sled", "position": [1.2, 0.8, -0.2] }, { "body": "sled", "position": [1.2, -0.8, -0.2] },
      { "body": "sled", "position": [-1.2, 0.8, -0.2] }, { "body": "sled", "position": [-1.2, -0.8, -0.2] } ],
    "observed": [ { "name": "sled", "body": "sled" } ] }"#;
const LAW: ContactLaw = ContactLaw { gap: 0.016, stiffness: 2e6, damping: 10.0, friction: 0.3 };
const SKID: Contact = Contact { stop: None, skid: Some(LAW), slip_speed: 0.01 };

fn circle(radius: f64, cant: f64) -> Line {
    let plan = if radius.is_finite() {
        format!(
            r#"{{ "kind": "clothoid", "length": 50, "to_radius": {radius} }},
            {{ "kind": "circle", "length": 100, "radius": {radius} }}, {{ "kind": "clothoid", "length": 50 }}"#
        )
    } else {
        r#"{ "kind": "straight", "length": 200 }"#.to_owned()
    };
    let text = format!(
        r#"{{ "name": "x", "plan": [ {plan} ], "cant": [ {{ "length": 50, "to": {cant} }} ] }}"#
    );
    Line::new(&LineDescription::from_json(&text).unwrap()).unwrap()
}

/// The sled on its skids at a place of a line, carried at a speed.
fn landed(line: &Line, speed: f64) -> (VehicleModel, State) {
    let description = VehicleDescription::from_json(SLED).unwrap();
    let model = VehicleModel::new(&description).unwrap().with_line(line.clone()).unwrap();
    let mut state = model.initial_state();
    state.travel = Some(Travel { place: 100.0, speed });
    let depth = 250.0 * 9.81 / (4.0 * LAW.stiffness);
    state.bodies[0].position.z -= LAW.gap - 0.008 + depth;
    let turning = line.frame(100.0).curvature * speed;
    state.bodies[0].velocity = turning.cross(&state.bodies[0].position);
    state.bodies[0].angular_velocity = turning;
    (model, state)
}

/// Steps under no forces but those of the rails, which move sideways.
fn slide(model: &VehicleModel, state: &mut State, side_rate: f64, h: f64, steps: u32) {
    let still = [[0.0; 4]; 4];
    let moving = [[side_rate, 0.0, 0.0, 0.0]; 4];
    let speed = [state.travel.map_or(0.0, |it| it.speed), 0.0, 0.0, 0.0];
    let track =
        TrackCourse { contact: SKID, speed, height: &still, rate: &still, side_rate: &moving };
    let loads = LoadCourse { vertical: &still, lateral: &still };
    let mut work = model.workspace();
    for _ in 0..steps {
        model.step_in_contact(state, h, h, &loads, Some(&track), &mut work).unwrap();
    }
}

/// On a canted track nothing but the smoothed friction holds the sled sideways: it creeps down at the speed s with
/// μ·cos(c)·s/√(s² + s₀²) = sin(c), towards the lower side. Rails that move sideways take it along.
#[test]
fn analytic_a_sled_creeps_down_a_canted_track() {
    for (cant, side_rate) in [(-0.06_f64, 0.0), (0.1, 0.0), (0.06, 0.02)] {
        let (model, mut state) = landed(&circle(f64::INFINITY, cant), 0.0);
        slide(&model, &mut state, side_rate, 1e-3, 600);
        let share = -cant.tan() / LAW.friction;
        let creep = side_rate + SKID.slip_speed * share / (1.0 - share * share).sqrt();
        let velocity = model.magnet(&state, MagnetIndex(1)).velocity.y;
        assert!((velocity - creep).abs() < 1e-6, "{cant}: {velocity} {creep}");
        let zeros = [0.0; 4];
        let rates = [side_rate; 4];
        let track = TrackContact {
            contact: SKID,
            speed: 0.0,
            height: &zeros,
            rate: &zeros,
            side_rate: &rates,
        };
        let sum = (0..4).map(|k| model.contact_force(&state, MagnetIndex(k), &track));
        let sum = sum.sum::<multibody::math::Vec3>();
        let weight = 250.0 * 9.81;
        assert!((sum.z - weight * cant.cos()).abs() < 1e-4 * weight);
        assert!((sum.y - weight * cant.sin()).abs() < 1e-4 * weight, "{}", sum.y);
        // the slope with the rail's lateral rate against a difference
        let slope = model.contact_side_slope(&state, MagnetIndex(0), &track);
        let at = |change: f64| {
            let rates = [side_rate + change; 4];
            let track = TrackContact { side_rate: &rates, ..track };
            model.contact_force(&state, MagnetIndex(0), &track)
        };
        let difference = (at(1e-6) - at(-1e-6)) / 2e-6;
        assert!((slope - difference).norm() < 1e-5 * slope.norm() && slope.y > 1e3, "{slope}");
    }
}

/// A sled that slides through a canted curve of 30 m at 6 m/s, on its skids alone, loses the energy that damping
/// and friction of the contact take: the rail is at rest.
#[test]
fn invariant_energy_of_a_sled_that_slides_through_a_curve() {
    let line = circle(30.0, -0.1);
    let (model, mut state) = landed(&line, 6.0);
    let mass = model.total_mass();
    let (zeros, mut work) = ([0.0; 4], model.workspace());
    let track =
        TrackContact { contact: SKID, speed: 6.0, height: &zeros, rate: &zeros, side_rate: &zeros };
    let mut balance = |state: &State| {
        let (momentum, _) = model.momentum(state);
        let power = model.contact_power(state, &track);
        let moving = momentum.x * 6.0 + 0.5 * mass * 36.0;
        (model.energy(state, &mut work).total() + moving + power.stored, power.dissipated)
    };
    let (before, mut power) = balance(&state);
    let (mut lost, h) = (0.0, 2e-4);
    let mut energy = before;
    for _ in 0..2000 {
        slide(&model, &mut state, 0.0, h, 1);
        let (now, taken) = balance(&state);
        lost += 0.5 * h * (power + taken);
        (energy, power) = (now, taken);
    }
    assert!(
        lost > 1000.0 && ((before - energy) / lost - 1.0).abs() < 1e-4,
        "{before} {energy} {lost}"
    );
    // it slides behind the frame, and outwards
    let motion = model.magnet(&state, MagnetIndex(0));
    assert!(motion.velocity.x < -0.5 && motion.displacement.y < -1e-2, "{motion:?}");
}
