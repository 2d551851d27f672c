//! Energy over long runs of a vehicle without dampers.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{Noise, run_free};
use multibody::math::Vec3;
use multibody::{
    Bushing, GROUND, Holding, Loads, MagnetSprings, State, VehicleModel, Workspace,
    natural_frequency, train,
};

/// One bogie without any damper; under each magnet stands a spring of 7e5 N/m and 1e5 N/m across,
/// preloaded by the magnet's static load. Moving at up to 0.05 m/s and rad/s about its equilibrium.
fn undamped() -> (VehicleModel, State, Workspace) {
    let mut d = train::one_bogie();
    let plain = VehicleModel::new(&d).unwrap();
    let zero = vec![0.0; d.magnets.len()];
    let found = plain.equilibrium(&zero, &Holding::default(), &mut plain.workspace()).unwrap();
    for (k, magnet) in d.magnets.iter().enumerate() {
        d.bushings.push(Bushing {
            name: format!("magnet_{k}"),
            body_a: GROUND.to_owned(),
            body_b: magnet.body.clone(),
            position: magnet.position,
            orientation: None,
            translational_stiffness: [1e5, 1e5, 7e5],
            translational_damping: [0.0; 3],
            rotational_stiffness: [0.0; 3],
            rotational_damping: [0.0; 3],
            // on the ground, so the opposite of what the magnet feels
            preload: [0.0, 0.0, -found.loads[k]],
        });
    }
    for bushing in &mut d.bushings {
        bushing.translational_damping = [0.0; 3];
        bushing.rotational_damping = [0.0; 3];
    }
    for force in &mut d.joint_forces {
        force.damping = 0.0;
    }
    for spring in &mut d.springs {
        spring.damping = 0.0;
    }
    if let Some(drive) = &mut d.drive {
        drive.damping = 0.0;
    }
    let model = VehicleModel::new(&d).unwrap();
    let mut ws = model.workspace();
    let mut state = found.state;
    let mut noise = Noise(5);
    let mut vector = || Vec3::new(noise.next(), noise.next(), noise.next()) * 0.05;
    for body in &mut state.bodies {
        (body.velocity, body.angular_velocity) = (vector(), vector());
    }
    model.close_joints(&mut state, &mut ws).unwrap();
    (model, state, ws)
}

/// Nothing takes energy but the scheme: the classical one multiplies the square of an oscillation by
/// |R(iωh)|² = 1 − (ωh)⁶/72 + (ωh)⁸/576 a step. So over a given time the loss falls by 2⁵ with each
/// halving of the step, and a long run loses no larger share of the motion's energy than its fastest
/// mode does: n (ωh)⁶/72.
#[test]
fn order_energy_loss_of_an_undamped_bogie() {
    let (model, start, mut ws) = undamped();
    let zero = vec![0.0; model.counts().magnets];
    let loads = Loads { vertical: &zero, lateral: &zero };
    let modes = model.linearise(&start, &loads, &MagnetSprings::default(), &mut ws).unwrap();
    let fastest = modes.eigenvalues.iter().copied().map(natural_frequency).fold(0.0, f64::max);
    let moving = model.kinetic_energy(&start);
    let begin = model.energy(&start, &mut ws).total();
    let mut lost = |h: f64, steps: usize| {
        let mut state = start.clone();
        run_free(&model, &mut state, h, steps);
        (begin - model.energy(&state, &mut ws).total()) / moving
    };
    let losses = [lost(1e-3, 500), lost(0.5e-3, 1000), lost(0.25e-3, 2000)];
    println!(
        "fastest mode {fastest} 1/s, share of the {moving} J of motion lost in 0.5 s: {losses:?}"
    );
    for pair in losses.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 5.0).abs() < 0.3, "{order} of {losses:?}");
    }
    let (h, steps) = (0.25e-3, 120_000);
    let (long, most) = (lost(h, steps), steps as f64 * (fastest * h).powi(6) / 72.0);
    println!("in {} s at {h} s: {long:e}, at most {most:e}", steps as f64 * h);
    assert!(long > 0.0 && long < most, "{long:e} {most:e}");
}
