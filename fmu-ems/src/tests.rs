//! The unit through its C functions: it must be the physics, no more and no less.
#![allow(clippy::unwrap_used)]

use fmi2_export::{sys::fmi2Status, testing::TestInstance};
use magnet::{
    Conditions, FilterDesign, Gains, InputCourse, Law, Magnet, MagnetInputs, MagnetParameters,
    PowerLimits, Range, Sampling, Workspace,
};

use crate::EmsFmu;

const OUTPUTS: [&str; 9] = [
    "force",
    "lateral_force",
    "current",
    "voltage",
    "estimate_gap",
    "estimate_gap_velocity",
    "estimate_acceleration",
    "estimate_velocity",
    "estimate_position",
];
const INPUTS: [&str; 6] =
    ["gap", "gap_rate", "acceleration", "lateral_offset", "static_force", "voltage_command"];

/// A swing of 0.2 mm at 60 rad/s and what goes with it: value and three derivatives of each input.
/// Over a step the gap rate is the derivative of the gap's polynomial.
fn swing(t: f64) -> [[f64; 4]; 6] {
    let (amplitude, w) = (2e-4, 60.0);
    let (s, c) = (f64::sin(w * t), f64::cos(w * t));
    let gap: [f64; 6] =
        std::array::from_fn(|k| amplitude * w.powi(k as i32) * [s, c, -s, -c][k % 4]);
    [
        [0.0083 + gap[0], gap[1], gap[2], gap[3]],
        [gap[1], gap[2], gap[3], 0.0],
        [gap[2], gap[3], gap[4], gap[5]],
        [1e-3 * (9.0 * t).sin(), 0.0, 0.0, 0.0],
        [5000.0 + 2000.0 * t, 2000.0, 0.0, 0.0],
        [0.3 + 40.0 * t - 500.0 * t * t, 40.0 - 1000.0 * t, -1000.0, 0.0],
    ]
}

fn inputs(t: f64) -> MagnetInputs {
    let [gap, gap_rate, acceleration, lateral_offset, static_force, voltage_command] =
        swing(t).map(|u| u[0]);
    MagnetInputs {
        gap,
        gap_rate,
        acceleration,
        lateral_offset,
        static_force,
        voltage_command,
        transient_voltage: 0.0,
    }
}

fn set(unit: &mut TestInstance, t: f64) {
    for (name, course) in INPUTS.iter().zip(swing(t)) {
        unit.set_real(name, course[0]).unwrap();
    }
}

fn step(unit: &mut TestInstance, t: f64, size: f64) {
    set(unit, t);
    for (name, course) in INPUTS.iter().zip(swing(t)) {
        for order in 1..=3 {
            unit.set_input_derivative(name, order, course[order as usize]).unwrap();
        }
    }
    unit.step(t, size).unwrap();
}

fn outputs(unit: &mut TestInstance) -> [f64; 9] {
    OUTPUTS.map(|name| unit.real(name).unwrap())
}

/// Parameters of which none has its default, and their variables.
fn other(
    law: Law,
    sampling: bool,
) -> (MagnetParameters, Vec<(&'static str, f64)>, Vec<&'static str>) {
    let gains =
        Gains { acceleration: 8.0, velocity: 41.0, position: 5.0, gap_velocity: 42.0, gap: 9.0 };
    let parameters = MagnetParameters {
        turns: 390.0,
        pole_area: 0.037,
        resistance: 0.7,
        nominal_gap: 0.0082,
        operating_current: 23.0,
        law,
        control: magnet::Controller {
            gains,
            sampling: sampling.then_some(Sampling { period: 7e-4, delay: 1 }),
        },
        external_controller: false,
        filter: FilterDesign {
            gap_cutoff: 900.0,
            gap_damping: 0.6,
            velocity_cutoff: 11.0,
            velocity_damping: 0.55,
            position_cutoff: 12.0,
        },
        limits: PowerLimits {
            voltage: Some(Range { min: -150.0, max: 150.0 }),
            current: Some(Range { min: 1.0, max: 50.0 }),
        },
        pole_width: Some(0.03),
        lift_loss: false,
        integration_step: 1e-4,
        conditions: Conditions::default(),
    };
    let reals = vec![
        ("turns", 390.0),
        ("pole_area", 0.037),
        ("resistance", 0.7),
        ("nominal_gap", 0.0082),
        ("operating_current", 23.0),
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
        ("voltage_min", -150.0),
        ("voltage_max", 150.0),
        ("current_min", 1.0),
        ("current_max", 50.0),
        ("sample_time", if sampling { 7e-4 } else { 0.0 }),
        ("pole_width", 0.03),
        ("integration_step", 1e-4),
    ];
    let mut on = vec!["limit_voltage", "limit_current"];
    if law == Law::Nonlinear {
        on.push("nonlinear");
    }
    if sampling {
        on.push("sample_delay");
    }
    (parameters, reals, on)
}

fn unit(reals: &[(&'static str, f64)], on: &[&'static str]) -> TestInstance {
    let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
    for (name, value) in reals {
        unit.set_real(name, *value).unwrap();
    }
    for name in on {
        unit.set_boolean(name, true).unwrap();
    }
    unit.enter_initialization(0.0).unwrap();
    set(&mut unit, 0.0);
    unit.exit_initialization().unwrap();
    unit
}

fn units() -> Vec<(MagnetParameters, TestInstance)> {
    let mut units = vec![(MagnetParameters::default(), unit(&[], &[]))];
    for (law, sampling) in [(Law::Linear, false), (Law::Nonlinear, false), (Law::Linear, true)] {
        let (parameters, reals, on) = other(law, sampling);
        units.push((parameters, unit(&reals, &on)));
    }
    for law in [Law::Linear, Law::Nonlinear] {
        let (mut parameters, reals, mut on) = other(law, false);
        parameters.external_controller = true;
        on.push("external_controller");
        units.push((parameters, unit(&reals, &on)));
    }
    let (mut parameters, reals, mut on) = other(Law::Nonlinear, false);
    parameters.lift_loss = true;
    on.push("lift_loss");
    units.push((parameters, unit(&reals, &on)));
    let exact = MagnetParameters { external_controller: true, ..MagnetParameters::default() };
    units.push((exact, unit(&[], &["external_controller"])));
    units
}

/// Every parameter and input arrives where it belongs: the unit shows the bits of the library. A
/// parameter read from a wrong variable, or an input's derivative lost, changes some output.
#[test]
fn analytic_unit_is_the_library() {
    for (parameters, mut unit) in units() {
        let magnet = Magnet::new(parameters).unwrap();
        let mut state = magnet.initialise(&inputs(0.0), 0.0).unwrap();
        let mut workspace = Workspace::default();
        let constants = magnet.electromagnet();
        for (name, value) in [
            ("inductance", constants.inductance),
            ("current_stiffness", constants.current_stiffness),
            ("gap_stiffness", constants.gap_stiffness),
            ("nominal_force", constants.nominal_force),
        ] {
            assert_eq!(unit.real(name).unwrap(), value, "{name}");
        }
        for n in 0..30 {
            let time = f64::from(n) * 1.3e-3;
            let [gap, _, acceleration, offset_course, _, voltage_command] = swing(time);
            let course = InputCourse {
                gap,
                acceleration,
                voltage_command,
                lateral_offset: offset_course,
                ..InputCourse::default()
            };
            step(&mut unit, time, 1.3e-3);
            magnet.step(&mut state, &course, time, 1.3e-3, &mut workspace).unwrap();
            set(&mut unit, time + 1.3e-3);
            let now = magnet.outputs(&state, &inputs(time + 1.3e-3)).unwrap();
            let y = now.estimates;
            let expected = [
                now.force,
                now.lateral_force,
                now.current,
                now.voltage,
                y[0],
                y[1],
                y[2],
                y[3],
                y[4],
            ];
            assert_eq!(outputs(&mut unit), expected, "{parameters:?}");
        }
    }
}

/// Directional derivatives are the outputs' derivatives by the inputs, and so the declared
/// dependencies are the true ones: what is not listed does not change.
#[test]
fn analytic_directional_derivatives_are_those_of_the_outputs() {
    let dependent = [
        ("force", "gap"),
        ("force", "static_force"),
        ("lateral_force", "gap"),
        ("lateral_force", "lateral_offset"),
        ("lateral_force", "static_force"),
        ("current", "gap"),
        ("force", "lateral_offset"),
        ("current", "lateral_offset"),
        ("voltage", "acceleration"),
        ("voltage", "voltage_command"),
        ("estimate_acceleration", "acceleration"),
    ];
    for (parameters, mut unit) in units() {
        for n in 0..5 {
            step(&mut unit, f64::from(n) * 1.3e-3, 1.3e-3);
        }
        let time = 5.0 * 1.3e-3;
        set(&mut unit, time);
        for (input, width) in INPUTS.into_iter().zip([1e-7, 1e-4, 1e-2, 1e-7, 1.0, 1e-3]) {
            let center = unit.real(input).unwrap();
            unit.set_real(input, center - width).unwrap();
            let before = outputs(&mut unit);
            unit.set_real(input, center + width).unwrap();
            let after = outputs(&mut unit);
            unit.set_real(input, center).unwrap();
            for (k, output) in OUTPUTS.into_iter().enumerate() {
                let difference = (after[k] - before[k]) / (2.0 * width);
                if !dependent.contains(&(output, input)) {
                    assert_eq!(difference, 0.0, "{output} by {input}");
                    continue;
                }
                let derivative = unit.derivative(output, input).unwrap();
                // A width of 1e-5 of the gap errs by 1e-10, rounding of 1e-12 N/1e-7 m by 1e-5.
                let near = (derivative - difference).abs() < 1e-6 * difference.abs() + 1e-4;
                assert!(
                    near,
                    "{output} by {input}: {derivative} is not {difference}, {parameters:?}"
                );
            }
        }
    }
}

/// What the description promises of derivatives is kept from the start on, in every law: force 2,
/// current, voltage and five estimates 1.
#[test]
fn invariant_declared_derivatives_are_given() {
    for (parameters, mut unit) in units() {
        assert_eq!(unit.declared_derivatives().unwrap(), 9, "{parameters:?}");
        step(&mut unit, 0.0, 1.3e-3);
        assert_eq!(unit.declared_derivatives().unwrap(), 9, "{parameters:?}");
    }
}

/// Derivatives of the outputs at the end of a step are those of steps that end 10 µs earlier and
/// later: the inputs' own slopes at the end are part of them. Central differences err by
/// (1e-5·1e3)²/6 = 2e-5 of the fastest part.
#[test]
fn analytic_output_derivatives_are_those_of_the_course() {
    // Samples of the controller would be steps in the voltage.
    for (parameters, mut unit) in units() {
        if parameters.control.sampling.is_some() {
            continue;
        }
        for n in 0..5 {
            step(&mut unit, f64::from(n) * 1.3e-3, 1.3e-3);
        }
        unit.save().unwrap();
        let time = 5.0 * 1.3e-3;
        let d = 1e-5;
        let [before, now, after] = [-d, 0.0, d].map(|more| {
            unit.restore().unwrap();
            step(&mut unit, time, 1.3e-3 + more);
            outputs(&mut unit)
        });
        unit.restore().unwrap();
        step(&mut unit, time, 1.3e-3);
        for (k, output) in OUTPUTS.into_iter().enumerate() {
            let derivative = unit.output_derivative(output, 1).unwrap();
            let difference = (after[k] - before[k]) / (2.0 * d);
            let near = (derivative - difference).abs() < 1e-4 * difference.abs().max(1e-2);
            assert!(near, "{output}: {derivative} is not {difference}, {parameters:?}");
        }
        let second = unit.output_derivative("force", 2).unwrap();
        let difference = (after[0] - 2.0 * now[0] + before[0]) / (d * d);
        assert!(
            (second - difference).abs() < 1e-3 * difference.abs().max(1e5),
            "{second} {difference}"
        );
    }
}

/// A saved state is complete: the run after it repeats bit for bit, with a gain changed in between,
/// and in another instance that was started with other parameters.
#[test]
fn invariant_saved_states_are_complete() {
    let run = |unit: &mut TestInstance| {
        (5..25)
            .map(|n| {
                step(unit, f64::from(n) * 1.3e-3, 1.3e-3);
                outputs(unit).map(f64::to_bits)
            })
            .collect::<Vec<_>>()
    };
    for (parameters, mut first) in units() {
        for n in 0..5 {
            step(&mut first, f64::from(n) * 1.3e-3, 1.3e-3);
        }
        first.set_real("gain_gap", 8.5).unwrap();
        first.save().unwrap();
        let bytes = first.serialize().unwrap();
        let expected = run(&mut first);
        first.set_real("gain_gap", 20.0).unwrap();
        first.restore().unwrap();
        assert_eq!(run(&mut first), expected);

        let mut second = unit(&[("turns", 300.0)], &[]);
        second.deserialize(&bytes).unwrap();
        assert_eq!(run(&mut second), expected);

        first.restore().unwrap();
        first.set_real("gain_gap", 20.0).unwrap();
        // an external controller has gains of its own
        assert_eq!(run(&mut first) == expected, parameters.external_controller);
    }
}

/// In initialization mode the static force moves the operating point, the acceleration nothing but
/// the filter's rest.
#[test]
fn analytic_initial_values_follow_the_inputs() {
    let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
    unit.set_boolean("nonlinear", true).unwrap();
    unit.enter_initialization(0.0).unwrap();
    for (load, current) in [(5824.6875, 14.353), (4.0 * 5824.6875, 2.0 * 14.353)] {
        unit.set_real("static_force", load).unwrap();
        assert!((unit.real("force").unwrap() - load).abs() < 1e-9 * load);
        assert!((unit.real("current").unwrap() - current).abs() < 1e-3);
    }
    let before = outputs(&mut unit);
    unit.set_real("acceleration", 2.0).unwrap();
    for (before, after) in before.iter().zip(outputs(&mut unit)) {
        // The estimated acceleration is a difference of numbers of the size of 0.25·2.
        assert!((before - after).abs() < 1e-15);
    }
}

/// A gap that closes on the way ends the run as a result; parameters that cannot be are an error that names them.
#[test]
fn analytic_refusals_say_why() {
    let mut levitating = unit(&[], &[]);
    levitating.set_real("gap", 0.008).unwrap();
    levitating.set_input_derivative("gap", 1, -1.0).unwrap();
    let failure = levitating.step(0.0, 0.01).unwrap_err();
    assert_eq!(failure.status, fmi2Status::fmi2Discard);
    assert!(failure.to_string().contains("reached the rail"), "{failure}");
    let (kind, mut ended) = (fmi2_export::sys::fmi2StatusKind::fmi2Terminated, 0);
    // SAFETY: the component is alive and the place is there.
    unsafe { fmi2_export::ffi::get_boolean_status(levitating.component(), kind, &raw mut ended) };
    assert_eq!(ended, 1);

    let mut impossible = TestInstance::new::<EmsFmu>("resources").unwrap();
    impossible.set_real("pole_area", 0.0).unwrap();
    let failure = impossible.initialize(0.0).unwrap_err();
    assert!(failure.to_string().contains("pole area (m²) is 0"), "{failure}");

    let mut sampled = TestInstance::new::<EmsFmu>("resources").unwrap();
    sampled.set_boolean("external_controller", true).unwrap();
    sampled.set_real("sample_time", 1e-3).unwrap();
    let failure = sampled.initialize(0.0).unwrap_err().to_string();
    assert!(failure.contains("sample time (s) is 0.001, but must be zero"), "{failure}");
    assert!(sampled.set_real("voltage_command", f64::NAN).is_err());
}

/// An offset of a pole's width ends the run as a result, with lift loss only.
#[test]
fn issue_20_lost_guidance_ends_the_run_as_a_result() {
    let slide = |on: &[&'static str]| {
        let mut unit = unit(&[], on);
        unit.set_real("lateral_offset", 0.0275).unwrap();
        unit.set_input_derivative("lateral_offset", 1, 0.1).unwrap();
        (unit.step(0.0, 0.01), unit)
    };
    let (outcome, unit) = slide(&["nonlinear", "lift_loss"]);
    let failure = outcome.unwrap_err();
    assert_eq!(failure.status, fmi2Status::fmi2Discard);
    assert!(failure.to_string().contains("guidance is lost"), "{failure}");
    let (kind, mut ended) = (fmi2_export::sys::fmi2StatusKind::fmi2Terminated, 0);
    // SAFETY: the component is alive and the place is there.
    unsafe { fmi2_export::ffi::get_boolean_status(unit.component(), kind, &raw mut ended) };
    assert_eq!(ended, 1);
    slide(&["nonlinear"]).0.unwrap();
}

/// Lift loss without what it needs is refused; the fraction is shown in every law.
#[test]
fn refusal_lift_loss_without_its_law() {
    for (on, off, reason) in [
        (vec!["lift_loss"], None, "second order"),
        (vec!["lift_loss", "nonlinear"], Some("lateral_guidance"), "one co-energy"),
    ] {
        let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
        for name in on {
            unit.set_boolean(name, true).unwrap();
        }
        if let Some(name) = off {
            unit.set_boolean(name, false).unwrap();
        }
        let failure = unit.initialize(0.0).unwrap_err().to_string();
        assert!(failure.contains(reason), "{failure}");
    }
    let mut linear = unit(&[], &[]);
    linear.set_real("gap", 0.008).unwrap();
    linear.set_real("lateral_offset", 0.008).unwrap();
    // (2y/πw)·atan(1) = y/(2w)
    assert!((linear.real("lost_lift").unwrap() - 0.5 * 0.008 / 0.028).abs() < 1e-15);
}

/// The transient voltage moves the start of the coil, and nothing afterwards.
#[test]
fn issue_15_a_transient_voltage_does_not_move_the_start() {
    let start = |command: f64, transient: f64| {
        let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
        unit.set_boolean("external_controller", true).unwrap();
        unit.enter_initialization(0.0).unwrap();
        unit.set_real("voltage_command", command).unwrap();
        unit.set_real("transient_voltage", transient).unwrap();
        unit.exit_initialization().unwrap();
        ["current", "force", "voltage"].map(|name| unit.real(name).unwrap())
    };
    let [still, passing, lasting] = [start(0.0, 0.0), start(1.5, 1.5), start(1.5, 0.0)];
    assert_eq!(still[..2], passing[..2]);
    assert!((lasting[0] - still[0] - 1.5 / 0.6).abs() < 1e-12);
    assert_eq!([passing[2], lasting[2]], [still[2] + 1.5; 2]);
}
