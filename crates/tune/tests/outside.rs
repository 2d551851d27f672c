//! A controller in a unit of its own, on the packaged units.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::path::Path;

use scenario::{Override, Scenario};
use tune::{Irregularity, NoiseOption, Request, TuneResult, Tuning, Varied, Watch, tune};

struct Silent;

impl Watch for Silent {
    fn stage(&self, _: &str) {}
    fn progress(&self, _: usize, _: usize) {}
}

fn tuned(file: &str, instance: &str) -> TuneResult {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let mut scenario = Scenario::load(&root.join("scenarios").join(file)).unwrap();
    let (target, value) = ("guideway.chirp_on".to_owned(), "false".to_owned());
    scenario.overrides.push(Override { target, value });
    let mut tuning = Tuning {
        irregularity: Some(Irregularity { speed: 1.4, amplitude: None }),
        samples: 4,
        starts: 1,
        evaluations: 30,
        front: 0,
        ..Tuning::default()
    };
    tuning.constraints.modulus = None;
    for range in ["gain_acceleration=1:30", "gain_velocity=20:80"] {
        let varied: Varied = format!("{instance}.{range}").parse().unwrap();
        tuning.vary.insert(varied.target, varied.bounds);
    }
    for noise in ["gap=1e-5:200", "acceleration=0.05:200"] {
        let noise: NoiseOption = noise.parse().unwrap();
        tuning.noise.insert(noise.input, noise.noise);
    }
    tune(&Request { scenario, tuning, threads: 2 }, None, &Silent).unwrap()
}

/// It is tuned like the one inside the magnet: the same loop is broken at the voltage, once inside the unit and once at
/// its output, and gains that act at once there act through the coil here.
#[test]
fn issue_18_a_controller_in_its_own_unit_is_tuned_alike() {
    let inside = tuned("one-magnet.json", "ems_*");
    let outside = tuned("one-magnet-controller.json", "controller_*");
    let (a, b) = (&inside.conditions[0], &outside.conditions[0]);
    // integrals over frequency have other places around modes, as other modes are left out: 30 per decade
    for (a, b, near) in [
        (a.before.damping, b.before.damping, 1e-4),
        (a.before.modulus_one, b.before.modulus_one, 1e-3),
        (a.before.delay_one, b.before.delay_one, 1e-3),
        (a.before.voltage_noise, b.before.voltage_noise, 2e-3),
        (a.before.voltage_track, b.before.voltage_track, 2e-3),
        // short searches, which end at nearly the same gains
        (a.after.damping, b.after.damping, 0.02),
    ] {
        assert!((a / b - 1.0).abs() < near, "{a} {b}");
    }
    // the gain on the acceleration, which acts at once, has changed
    let gain = &outside.parameters[0];
    assert!((gain.after / gain.before - 1.0).abs() > 0.1, "{gain:?}");
    // a new start, and margins of the whole system
    let verified = &b.verified;
    assert!(verified.distance < 1e-6, "{verified:?}");
    let [modulus, ..] = verified.margins.unwrap();
    assert!((modulus / b.after.modulus_one - 1.0).abs() < 0.01, "{verified:?} {:?}", b.after);
}
