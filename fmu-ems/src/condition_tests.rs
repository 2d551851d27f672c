//! Sensors with faults, failures, lift-off and set-down through the C functions.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;
use magnet::{
    Conditions, FailedReading, InputCourse, Law, Magnet, MagnetInputs, MagnetParameters, Noise,
    PowerLimits, Range, Sampling, Sensor, SensorFailure, Sensors, Sequence, SupplyFailure,
    Workspace,
};

use crate::{EmsFmu, conditions::salt};

const LOAD: f64 = 38_000.0 * 9.81 / 64.0;

fn new() -> TestInstance {
    TestInstance::new::<EmsFmu>("resources").unwrap()
}

/// A magnet that starts with these parameters at 8.1 mm.
fn started(reals: &[(&str, f64)], integers: &[(&str, i32)], on: &[&str]) -> TestInstance {
    let mut unit = new();
    set(&mut unit, reals, integers, on);
    unit.set_real("gap", 0.0081).unwrap();
    unit.initialize(0.0).unwrap();
    unit
}

fn set(unit: &mut TestInstance, reals: &[(&str, f64)], integers: &[(&str, i32)], on: &[&str]) {
    for (name, value) in reals {
        unit.set_real(name, *value).unwrap();
    }
    for (name, value) in integers {
        unit.set_integer(name, *value).unwrap();
    }
    for name in on {
        unit.set_boolean(name, true).unwrap();
    }
}

fn step(unit: &mut TestInstance, n: u32) {
    unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
}

fn shown(unit: &mut TestInstance) -> [f64; 6] {
    ["force", "current", "voltage", "measured_gap", "measured_acceleration", "reference_gap"]
        .map(|name| unit.real(name).unwrap())
}

/// Parameters of sensors, supply and controller, none of which has its default, and their variables.
type Variables = (Vec<(&'static str, f64)>, Vec<(&'static str, i32)>, Vec<&'static str>);

fn faulty() -> (MagnetParameters, Variables) {
    let seed = salt("unit").wrapping_add(5);
    let sensor = |noise: [f64; 2], bias, resolution, time, reading, stream| Sensor {
        bias,
        noise: Noise { rms: noise[0], bandwidth: noise[1], seed, stream },
        resolution,
        failure: SensorFailure { failed: false, time: Some(time), reading },
    };
    let sensors = Sensors {
        gap: sensor([2e-5, 300.0], 1e-5, 2e-6, 0.0123, FailedReading::Last, 0),
        acceleration: sensor([0.2, 150.0], 0.03, 0.01, 0.017, FailedReading::Value(7.5), 1),
    };
    let mut parameters = MagnetParameters::default();
    parameters.control.sampling = Some(Sampling { period: 7e-4, delay: 3 });
    parameters.conditions = Conditions {
        sensors: Some(sensors),
        supply: Some(SupplyFailure { failed: false, time: Some(0.0255) }),
        sequence: None,
    };
    let reals = vec![
        ("sample_time", 7e-4),
        ("gap_sensor_noise", 2e-5),
        ("gap_sensor_bandwidth", 300.0),
        ("gap_sensor_bias", 1e-5),
        ("gap_sensor_resolution", 2e-6),
        ("gap_sensor_failure_time", 0.0123),
        ("acceleration_sensor_noise", 0.2),
        ("acceleration_sensor_bandwidth", 150.0),
        ("acceleration_sensor_bias", 0.03),
        ("acceleration_sensor_resolution", 0.01),
        ("acceleration_sensor_failure_time", 0.017),
        ("acceleration_sensor_open_reading", 7.5),
        ("supply_failure_time", 0.0255),
    ];
    let integers =
        vec![("noise_seed", 5), ("delay_samples", 3), ("acceleration_sensor_failure_mode", 3)];
    (parameters, (reals, integers, vec!["sample_delay"]))
}

fn lifting() -> (MagnetParameters, Variables) {
    let mut parameters = MagnetParameters { law: Law::Nonlinear, ..MagnetParameters::default() };
    parameters.limits = PowerLimits { current: Some(Range { min: 0.0, max: 60.0 }), voltage: None };
    parameters.conditions.sequence = Some(Sequence {
        lift_off: Some(0.0045),
        set_down: Some(0.02),
        transition: 0.0101,
        landing_gap: 0.0165,
    });
    let reals = vec![
        ("lift_off_time", 0.0045),
        ("set_down_time", 0.02),
        ("transition_time", 0.0101),
        ("landing_gap", 0.0165),
    ];
    (parameters, (reals, vec![], vec!["nonlinear", "limit_current", "start_without_current"]))
}

/// Every parameter arrives where it belongs: the unit shows the bits of the library, before and after
/// the failures and in all phases.
#[test]
fn analytic_unit_with_conditions_is_the_library() {
    for (parameters, (reals, integers, on)) in [faulty(), lifting()] {
        let mut unit = started(&reals, &integers, &on);
        let magnet = Magnet::new(parameters).unwrap();
        let mut inputs =
            MagnetInputs { gap: 0.0081, static_force: LOAD, ..MagnetInputs::default() };
        let mut state = magnet.initialise(&inputs, 0.0).unwrap();
        let mut workspace = Workspace::default();
        let mut gaps = Vec::new();
        for n in 0..35 {
            let time = f64::from(n) * 1e-3;
            inputs.gap = 0.0081 + 1e-4 * (50.0 * time).sin();
            inputs.acceleration = -0.25 * (50.0 * time).sin();
            unit.set_real("gap", inputs.gap).unwrap();
            unit.set_real("acceleration", inputs.acceleration).unwrap();
            step(&mut unit, n);
            let course = InputCourse::constant(&inputs);
            magnet.step(&mut state, &course, time, 1e-3, &mut workspace).unwrap();
            let now = magnet.outputs(&state, &inputs).unwrap();
            let [gap, acceleration] = now.readings;
            let expected =
                [now.force, now.current, now.voltage, gap, acceleration, now.reference_gap];
            assert_eq!(shown(&mut unit), expected, "{time} {parameters:?}");
            gaps.push(gap);
        }
        if parameters.conditions.supply.is_some() {
            assert_eq!(gaps[13..], vec![gaps[13]; 22], "the failed sensor's reading stays");
            assert_eq!(shown(&mut unit)[..3], [0.0; 3]);
            assert_eq!(shown(&mut unit)[4], 7.5);
        }
    }
}

/// Failures are switched between steps, and off again.
#[test]
fn issue_15_failures_can_be_switched_during_a_run() {
    let mut unit = started(&[], &[("gap_sensor_failure_mode", 2)], &["nonlinear"]);
    step(&mut unit, 0);
    let [force, current, ..] = shown(&mut unit);
    unit.set_boolean("supply_failed", true).unwrap();
    let now = shown(&mut unit);
    assert_eq!(now[..3], [force, current, 0.0], "the flux stays, the voltage is gone at once");
    step(&mut unit, 1);
    // one step of 1 ms at R/L(8.1 mm)
    let rate = 0.6 / (unit.real("inductance").unwrap() * 0.008 / 0.0081);
    let decayed = current * (-rate * 1e-3).exp();
    assert!((shown(&mut unit)[1] / decayed - 1.0).abs() < 1e-10);
    unit.set_boolean("supply_failed", false).unwrap();
    unit.set_boolean("gap_sensor_failed", true).unwrap();
    assert_eq!(shown(&mut unit)[3], 0.0);
    step(&mut unit, 2);
    assert!(shown(&mut unit)[2] != 0.0);
    unit.set_boolean("gap_sensor_failed", false).unwrap();
    assert_eq!(shown(&mut unit)[3], 0.0081);

    let mut linear = started(&[], &[], &[]);
    linear.set_boolean("supply_failed", true).unwrap();
    assert_eq!(shown(&mut linear)[..3], [0.0; 3]);
    assert_eq!(linear.output_derivative("force", 1).unwrap(), 0.0);
    assert_eq!(linear.derivative("force", "static_force").unwrap(), 0.0);
}

/// Times of lift-off and set-down can be changed before they are reached, and not afterwards.
#[test]
fn issue_15_times_that_would_make_the_reference_jump_are_refused() {
    let (_, (reals, integers, on)) = lifting();
    let changed = |steps: u32, name: &str, time: f64| {
        let mut unit = started(&reals, &integers, &on);
        (0..steps).for_each(|n| step(&mut unit, n));
        unit.set_real(name, time)?;
        unit.step(f64::from(steps) * 1e-3, 1e-3)
    };
    changed(3, "lift_off_time", 0.0046).unwrap();
    changed(18, "set_down_time", 0.018).unwrap();
    changed(18, "set_down_time", 0.0).unwrap();
    for (steps, name, time, reason) in [
        (18, "set_down_time", 0.017, "set-down time (s) cannot change from 0.02 s to 0.017 s"),
        (25, "set_down_time", 0.0, "set-down time (s) cannot change from 0.02 s to never"),
        (7, "lift_off_time", 0.009, "lift-off time (s) cannot change from 0.0045 s to 0.009 s"),
    ] {
        let text = changed(steps, name, time).unwrap_err().to_string();
        assert!(text.contains(reason) && text.contains("would jump"), "{text}");
    }
}

/// A saved state holds noise, failures and phases: the run after it repeats bit for bit, here and in
/// an instance of another name, even if a parameter is changed on the way.
#[test]
fn invariant_saved_states_hold_the_conditions() {
    let run = |unit: &mut TestInstance| {
        (10..35)
            .map(|n| {
                if n == 12 {
                    unit.set_real("gain_gap", 7.5).unwrap();
                }
                step(unit, n);
                shown(unit).map(f64::to_bits)
            })
            .collect::<Vec<_>>()
    };
    for (_, (reals, integers, on)) in [faulty(), lifting()] {
        let mut first = started(&reals, &integers, &on);
        (0..10).for_each(|n| step(&mut first, n));
        first.save().unwrap();
        let bytes = first.serialize().unwrap();
        let expected = run(&mut first);
        first.restore().unwrap();
        assert_eq!(run(&mut first), expected);
        let mut second = TestInstance::named::<EmsFmu>("resources", "other").unwrap();
        second.initialize(0.0).unwrap();
        second.deserialize(&bytes).unwrap();
        assert_eq!(run(&mut second), expected);
    }
}

/// Magnets with one seed differ by their names; with another seed, one magnet differs from itself.
#[test]
fn invariant_noise_differs_by_name_and_seed() {
    let reading = |name: &str, seed: i32| {
        let mut unit = TestInstance::named::<EmsFmu>("resources", name).unwrap();
        set(&mut unit, &[("gap_sensor_noise", 1e-5)], &[("noise_seed", seed)], &[]);
        unit.initialize(0.0).unwrap();
        unit.real("measured_gap").unwrap()
    };
    assert_eq!(reading("ems_01", 1), reading("ems_01", 1));
    assert_ne!(reading("ems_01", 1), reading("ems_02", 1));
    assert_ne!(reading("ems_01", 1), reading("ems_01", 2));
}

/// Values that do not fit the others yet can be set and read back one by one; what the model computes
/// from them cannot be read.
#[test]
fn invariant_values_read_back_before_they_fit() {
    let mut unit = new();
    unit.enter_initialization(0.0).unwrap();
    unit.set_real("gap_sensor_resolution", 1e-6).unwrap();
    assert_eq!(unit.real("gap_sensor_resolution").unwrap(), 1e-6);
    assert!(!unit.boolean("nonlinear").unwrap());
    assert!(unit.real("force").unwrap_err().to_string().contains("needs a sampled controller"));
}

#[test]
fn refusal_bad_conditions_say_why() {
    let refused = |reals: &[(&str, f64)], integers: &[(&str, i32)], on: &[&str]| {
        let mut unit = new();
        set(&mut unit, reals, integers, on);
        unit.initialize(0.0).unwrap_err().to_string()
    };
    for (reals, on, expected) in [
        (vec![("gap_sensor_resolution", 1e-6)], vec![], "needs a sampled controller"),
        (
            vec![("gap_sensor_noise", 1e-5), ("gap_sensor_bandwidth", 0.0)],
            vec![],
            "bandwidth of the gap sensor's noise (Hz) is 0",
        ),
        (vec![], vec!["start_without_current"], "the linear law"),
        (vec![("set_down_time", 3.0)], vec!["nonlinear"], "set limit_current to true"),
        (
            vec![("set_down_time", 1.0)],
            vec!["nonlinear", "limit_current", "start_without_current"],
            "at or after the end of the lift-off",
        ),
        (
            vec![("lift_off_time", -1.0)],
            vec!["nonlinear", "limit_current", "start_without_current"],
            "lift-off time (s) is -1",
        ),
        (
            vec![("transition_time", 0.0), ("set_down_time", 1.0)],
            vec!["nonlinear", "limit_current"],
            "transition time (s) is 0",
        ),
        (
            vec![("gap_sensor_bias", 1e-5)],
            vec!["external_controller"],
            "sensors with an external controller",
        ),
        (vec![("sample_time", 9e-7)], vec![], "sample time (s) is 0.0000009, but must be at least"),
        (
            vec![("lift_off_time", 15.0)],
            vec![],
            "lift-off time (s) is 15, which needs a magnet that starts without current",
        ),
        (
            vec![("set_down_time", 2.0), ("landing_gap", 0.004)],
            vec!["nonlinear", "limit_current"],
            "landing gap (m) is 0.004, but must be above the nominal gap",
        ),
        (vec![], vec!["sample_delay"], "delay (samples) is 1, which needs a sampled controller"),
    ] {
        let text = refused(&reals, &[], &on);
        assert!(text.contains(expected), "{text}");
    }
    let text = refused(&[], &[("delay_samples", 15)], &["external_controller"]);
    assert!(text.contains("delay (samples) is 15, which needs a sampled controller"), "{text}");
    assert!(text.contains("set sample_time") && text.contains("set both there"), "{text}");
    let mut unit = new();
    for (name, value) in [("delay_samples", 16), ("gap_sensor_failure_mode", 4), ("noise_seed", -1)]
    {
        let text = unit.set_integer(name, value).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
    }
    for (name, value) in [("gap_sensor_noise", -1e-6), ("supply_failure_time", -1.0)] {
        let text = unit.set_real(name, value).unwrap_err().to_string();
        assert!(text.contains(name), "{text}");
    }
}
