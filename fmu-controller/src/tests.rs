//! The unit through its C functions: it must be the physics, no more and no less.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;
use magnet::{
    Controller, ControllerInputs, ControllerParameters, ControllerWorkspace, FilterDesign, Gains,
    InputCourse, Sampling, VoltageController,
};

use crate::ControllerFmu;

const STEP: f64 = 1.3e-3;
const ESTIMATES: [&str; 5] = [
    "estimate_gap",
    "estimate_gap_velocity",
    "estimate_acceleration",
    "estimate_velocity",
    "estimate_position",
];

/// A swing of 0.2 mm at 60 rad/s: value and three derivatives of gap and acceleration.
fn swing(t: f64) -> InputCourse {
    let (amplitude, w) = (2e-4, 60.0);
    let (s, c) = f64::sin_cos(w * t);
    let gap: [f64; 6] =
        std::array::from_fn(|k| amplitude * w.powi(k as i32) * [s, c, -s, -c][k % 4]);
    InputCourse {
        gap: [0.0083 + gap[0], gap[1], gap[2], gap[3]],
        acceleration: [gap[2], gap[3], gap[4], gap[5]],
        ..InputCourse::default()
    }
}

fn inputs(t: f64) -> ControllerInputs {
    let course = swing(t);
    ControllerInputs {
        gap: course.gap[0],
        gap_rate: course.gap[1],
        acceleration: course.acceleration[0],
    }
}

fn set(unit: &mut TestInstance, t: f64) {
    let ControllerInputs { gap, gap_rate, acceleration } = inputs(t);
    for (name, value) in [("gap", gap), ("gap_rate", gap_rate), ("acceleration", acceleration)] {
        unit.set_real(name, value).unwrap();
    }
}

fn step(unit: &mut TestInstance, t: f64, size: f64) {
    set(unit, t);
    let course = swing(t);
    for (name, polynomial) in [("gap", course.gap), ("acceleration", course.acceleration)] {
        for order in 1..=3 {
            unit.set_input_derivative(name, order, polynomial[order as usize]).unwrap();
        }
    }
    unit.step(t, size).unwrap();
}

fn outputs(unit: &mut TestInstance) -> [f64; 7] {
    let mut all = [0.0; 7];
    all[0] = unit.real("voltage").unwrap();
    assert_eq!(unit.real("held_voltage").unwrap(), all[0]);
    all[1] = unit.real("transient_voltage").unwrap();
    for (value, name) in all[2..].iter_mut().zip(ESTIMATES) {
        *value = unit.real(name).unwrap();
    }
    all
}

/// Parameters of which none has its default.
fn other(sampled: bool) -> (ControllerParameters, TestInstance) {
    let gains =
        Gains { acceleration: 8.0, velocity: 41.0, position: 5.0, gap_velocity: 42.0, gap: 9.0 };
    let parameters = ControllerParameters {
        nominal_gap: 0.0082,
        control: Controller {
            gains,
            sampling: sampled.then_some(Sampling { period: 7e-4, delay: 2 }),
        },
        filter: FilterDesign {
            gap_cutoff: 900.0,
            gap_damping: 0.6,
            velocity_cutoff: 11.0,
            velocity_damping: 0.55,
            position_cutoff: 12.0,
        },
    };
    let mut unit = TestInstance::new::<ControllerFmu>("resources").unwrap();
    for (name, value) in [
        ("nominal_gap", 0.0082),
        ("gain_acceleration", 8.0),
        ("gain_velocity", 41.0),
        ("gain_position", 5.0),
        ("gain_gap_velocity", 42.0),
        ("gain_gap", 9.0),
        ("filter_gap_cutoff", 900.0),
        ("filter_gap_damping", 0.6),
        ("filter_velocity_cutoff", 11.0),
        ("filter_velocity_damping", 0.55),
        ("filter_position_cutoff", 12.0),
        ("sample_time", if sampled { 7e-4 } else { 0.0 }),
    ] {
        unit.set_real(name, value).unwrap();
    }
    unit.set_integer("delay_samples", if sampled { 2 } else { 0 }).unwrap();
    (parameters, started(unit))
}

fn started(mut unit: TestInstance) -> TestInstance {
    unit.enter_initialization(0.0).unwrap();
    set(&mut unit, 0.0);
    unit.exit_initialization().unwrap();
    unit
}

fn units() -> Vec<(ControllerParameters, TestInstance)> {
    let paper = started(TestInstance::new::<ControllerFmu>("resources").unwrap());
    vec![(ControllerParameters::default(), paper), other(false), other(true)]
}

/// Every parameter and input arrives where it belongs: the unit shows the bits of the library.
#[test]
fn analytic_unit_is_the_library() {
    for (parameters, mut unit) in units() {
        let controller = VoltageController::new(parameters).unwrap();
        let mut state = controller.initialise(&inputs(0.0), 0.0).unwrap();
        let mut workspace = ControllerWorkspace::default();
        assert!(state.transient_voltage > 1.0);
        for n in 0..30 {
            let time = f64::from(n) * STEP;
            step(&mut unit, time, STEP);
            controller.step(&mut state, &swing(time), time, STEP, &mut workspace).unwrap();
            set(&mut unit, time + STEP);
            let now = controller.outputs(&state, &inputs(time + STEP));
            let y = now.estimates;
            let expected = [now.voltage, state.transient_voltage, y[0], y[1], y[2], y[3], y[4]];
            assert_eq!(outputs(&mut unit), expected, "{parameters:?}");
        }
    }
}

/// The derivatives that the description promises are those of the outputs' course: steps that end
/// 10 µs earlier and later show it. Central differences err by (1e-5·1e3)²/6 of the fastest part.
#[test]
fn analytic_output_derivatives_are_those_of_the_course() {
    for (parameters, mut unit) in units() {
        for n in 0..5 {
            step(&mut unit, f64::from(n) * STEP, STEP);
        }
        assert_eq!(unit.declared_derivatives().unwrap(), 7);
        if parameters.control.sampling.is_some() {
            // A sample is a step of the voltage, which is constant between.
            assert_eq!(unit.output_derivative("voltage", 1).unwrap(), 0.0);
            continue;
        }
        unit.save().unwrap();
        let (time, d) = (5.0 * STEP, 1e-5);
        let [before, after] = [-d, d].map(|more| {
            unit.restore().unwrap();
            step(&mut unit, time, STEP + more);
            outputs(&mut unit)
        });
        unit.restore().unwrap();
        step(&mut unit, time, STEP);
        let names = ["voltage", "transient_voltage"].into_iter().chain(ESTIMATES);
        for (k, output) in names.enumerate() {
            let derivative = unit.output_derivative(output, 1).unwrap();
            let difference = (after[k] - before[k]) / (2.0 * d);
            let near = (derivative - difference).abs() < 1e-4 * difference.abs().max(1e-2);
            assert!(near, "{output}: {derivative} is not {difference}, {parameters:?}");
        }
        assert!(unit.output_derivative("voltage", 2).is_err());
    }
}

/// Only the acceleration feeds through, to the voltage and to its own estimate.
#[test]
fn analytic_directional_derivatives_are_those_of_the_outputs() {
    for (parameters, mut unit) in units() {
        for n in 0..5 {
            step(&mut unit, f64::from(n) * STEP, STEP);
        }
        for input in ["gap", "gap_rate", "acceleration"] {
            let centre = unit.real(input).unwrap();
            let mut show = |value: f64| {
                unit.set_real(input, value).unwrap();
                outputs(&mut unit)
            };
            let (before, after) = (show(centre - 1e-3), show(centre + 1e-3));
            show(centre);
            let names = ["voltage", "transient_voltage"].into_iter().chain(ESTIMATES);
            for (k, output) in names.enumerate() {
                let difference = (after[k] - before[k]) / 2e-3;
                let through = input == "acceleration"
                    && (output == "estimate_acceleration" || output == "voltage");
                if !through {
                    assert_eq!(difference, 0.0, "{output} by {input}, {parameters:?}");
                    continue;
                }
                let derivative = unit.derivative(output, input).unwrap();
                assert!((derivative - difference).abs() < 1e-9, "{output}: {derivative}");
                if output == "voltage" {
                    assert_eq!(unit.derivative("held_voltage", input).unwrap(), derivative);
                }
            }
        }
    }
}

/// A saved state is complete: the run after it repeats bit for bit, in another instance too.
#[test]
fn invariant_saved_states_are_complete() {
    let run = |unit: &mut TestInstance| {
        (5..25)
            .map(|n| {
                step(unit, f64::from(n) * STEP, STEP);
                outputs(unit).map(f64::to_bits)
            })
            .collect::<Vec<_>>()
    };
    for (_, mut first) in units() {
        for n in 0..5 {
            step(&mut first, f64::from(n) * STEP, STEP);
        }
        first.set_real("gain_gap", 8.5).unwrap();
        first.save().unwrap();
        let bytes = first.serialize().unwrap();
        let expected = run(&mut first);
        first.set_real("gain_gap", 20.0).unwrap();
        first.restore().unwrap();
        assert_eq!(run(&mut first), expected);
        let (_, mut second) = other(false);
        second.deserialize(&bytes).unwrap();
        assert_eq!(run(&mut second), expected);
        first.restore().unwrap();
        first.set_real("gain_gap", 20.0).unwrap();
        assert_ne!(run(&mut first), expected);
    }
}

#[test]
fn issue_15_bad_parameters_are_named() {
    for (name, value, reason) in [
        ("nominal_gap", 0.0, "nominal gap (m) is 0, but must be positive"),
        ("filter_gap_cutoff", 0.0, "cut-off of the gap filter (rad/s) is 0"),
        (
            "sample_time",
            1e-7,
            "sample time (s) is 0.0000001, but must be at least 1e-6: each sample",
        ),
    ] {
        let mut unit = TestInstance::new::<ControllerFmu>("resources").unwrap();
        unit.set_real(name, value).unwrap();
        let failure = unit.initialize(0.0).unwrap_err().to_string();
        assert!(failure.contains(reason), "{failure}");
    }
    let mut unit = TestInstance::new::<ControllerFmu>("resources").unwrap();
    unit.set_integer("delay_samples", 5).unwrap();
    let failure = unit.initialize(0.0).unwrap_err().to_string();
    let reason = "delay (samples) is 5, which needs a sampled controller, whose samples it counts";
    assert!(failure.contains(reason) && failure.contains("set sample_time"), "{failure}");
    let mut unit = TestInstance::new::<ControllerFmu>("resources").unwrap();
    assert!(unit.set_real("nominal_gap", -0.001).is_err());
    assert!(unit.set_real("gain_gap", f64::NAN).is_err());
}
