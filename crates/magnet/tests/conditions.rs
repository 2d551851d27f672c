//! Sensors with faults, failure of the supply, lift-off and set-down.
#![allow(clippy::unwrap_used)] // in the helpers of tests, too

mod common;

use common::{LOAD, at, distance, lively, nominal, stepped};
use magnet::{
    Conditions, FailedReading, InputCourse, InputRates, Law, Magnet, MagnetInputs,
    MagnetParameters, Noise, PowerLimits, Range, Sampling, Sensor, SensorFailure, Sensors,
    Sequence, State, SupplyFailure, Workspace,
};

fn sensor(stream: u64) -> Sensor {
    let failure = SensorFailure { failed: false, time: None, reading: FailedReading::Last };
    let noise = Noise { rms: 0.0, bandwidth: 200.0, seed: 1, stream };
    Sensor { bias: 0.0, noise, resolution: 0.0, failure }
}

fn sensors() -> Sensors {
    Sensors { gap: sensor(0), acceleration: sensor(1) }
}

fn with(change: impl FnOnce(&mut MagnetParameters)) -> Magnet {
    let mut parameters = MagnetParameters::default();
    change(&mut parameters);
    Magnet::new(parameters).unwrap()
}

fn sensing(change: impl FnOnce(&mut Sensors)) -> Conditions {
    let mut sensors = sensors();
    change(&mut sensors);
    Conditions { sensors: Some(sensors), ..Conditions::default() }
}

fn refusal(change: impl FnOnce(&mut MagnetParameters)) -> String {
    let mut parameters = MagnetParameters::default();
    change(&mut parameters);
    Magnet::new(parameters).unwrap_err().to_string()
}

/// Steps of `size` from t = 0 with inputs from `course` of the whole.
fn run(magnet: &Magnet, start: &State, course: &InputCourse, size: f64, count: u32) -> State {
    let mut state = *start;
    for n in 0..count {
        let time = f64::from(n) * size;
        let end = f64::from(n + 1) * size;
        let rest = course.after(time);
        magnet.step(&mut state, &rest, time, end - time, &mut Workspace::default()).unwrap();
    }
    state
}

/// Sensors without faults are no sensors: the same course up to the difference of the exact and the
/// Runge-Kutta integration (1e-7), and the readings are the inputs.
#[test]
fn invariant_faultless_sensors_change_nothing() {
    let plain = Magnet::new(MagnetParameters::default()).unwrap();
    let sensing = with(|p| p.conditions = sensing(|_| {}));
    let start = |magnet: &Magnet| magnet.initialise(&at(&lively(), 0.0), 0.0).unwrap();
    assert_eq!(start(&plain).filter, start(&sensing).filter);
    let [a, b] = [&plain, &sensing].map(|m| run(m, &start(m), &lively(), 1e-3, 5));
    assert!(distance(&a, &b) < 1e-7, "{}", distance(&a, &b));
    let now = at(&lively(), 5e-3);
    assert_eq!(sensing.outputs(&b, &now).unwrap().readings, [now.gap, now.acceleration]);
}

/// Noise belongs to the time: any cutting into steps gives the same course, up to the Runge-Kutta
/// method's error (its own steps are cut differently).
#[test]
fn invariant_noise_does_not_depend_on_the_steps() {
    let magnet = with(|p| {
        p.conditions = sensing(|s| {
            s.gap.noise.rms = 2e-5;
            s.acceleration.noise.rms = 0.5;
        });
    });
    let start = magnet.initialise(&nominal(), 0.0).unwrap();
    let course = InputCourse::constant(&nominal());
    let whole = run(&magnet, &start, &course, 0.02, 1);
    let quiet = Magnet::new(MagnetParameters::default()).unwrap();
    let still = run(&quiet, &quiet.initialise(&nominal(), 0.0).unwrap(), &course, 0.02, 1);
    assert!(distance(&whole, &still) > 0.1, "{}", distance(&whole, &still));
    for count in [7, 20, 33] {
        let other = run(&magnet, &start, &course, 0.02 / f64::from(count), count);
        assert!(distance(&whole, &other) < 1e-5, "{count}: {}", distance(&whole, &other));
    }
}

/// Courses of the same noise with steps of `step` and of a 20th of it, up to the method's error of 4e-5
/// of the force's RMS: three times that. At 2.5 times the bandwidth, where it would be far more, it
/// is refused, and each of the two remedies that the message names is accepted.
#[test]
fn issue_15_noise_that_the_integration_does_not_resolve_is_refused() {
    let noisy = |bandwidth: f64, step: f64| MagnetParameters {
        integration_step: step,
        conditions: sensing(|s| {
            s.gap.noise = Noise { rms: 1e-5, bandwidth, ..s.gap.noise };
            s.acceleration.noise = Noise { rms: 0.1, bandwidth, ..s.acceleration.noise };
        }),
        ..MagnetParameters::default()
    };
    let forces = |step: f64| {
        let magnet = Magnet::new(noisy(2000.0, step)).unwrap();
        let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
        (0..100)
            .map(|n| {
                let course = InputCourse::constant(&nominal());
                state = stepped(&magnet, &state, &course, f64::from(n) * 1e-3, 1e-3);
                magnet.outputs(&state, &nominal()).unwrap().force - LOAD
            })
            .collect::<Vec<_>>()
    };
    let rms = |all: &[f64]| (all.iter().map(|it| it * it).sum::<f64>() / all.len() as f64).sqrt();
    let [coarse, fine] = [5e-5, 2.5e-6].map(forces);
    let error: Vec<f64> = coarse.iter().zip(&fine).map(|(a, b)| a - b).collect();
    assert!(rms(&fine) > 1.0 && rms(&error) < 1.2e-4 * rms(&fine), "{}", rms(&error));

    let text = Magnet::new(noisy(5000.0, 5e-5)).unwrap_err().to_string();
    assert_eq!(
        text,
        "bandwidth of the gap sensor's noise (Hz) is 5000, which the integration step of 0.00005 s \
         does not resolve: take an integration_step of at most 0.00002 s or a bandwidth of at most \
         2000 Hz"
    );
    assert!(noisy(5000.0, 2e-5).check().is_ok());
    // a sampled controller's filter is continuous; what is read at samples only need not be resolved
    let mut sampled = noisy(5000.0, 5e-5);
    sampled.control.sampling = Some(Sampling { period: 1e-3, delay: 0 });
    assert!(sampled.check().is_err());
    let mut sensors = sampled.conditions.sensors.unwrap();
    sensors.gap.resolution = 1e-6;
    sensors.acceleration.resolution = 1e-3;
    sampled.conditions.sensors = Some(sensors);
    assert!(sampled.check().is_ok());
    sensors.gap.noise.bandwidth = 1e300;
    sampled.conditions.sensors = Some(sensors);
    let text = sampled.check().unwrap_err().to_string();
    assert!(text.contains("but must be at most 1e9"), "{text}");
}

/// The filter cannot tell a bias of the gap from a gap: at rest a sensor that reads 0.1 mm too much
/// acts like a gap that is 0.1 mm larger, so that the voltage is that of Δc = 0.1 mm.
#[test]
fn analytic_bias_acts_like_a_deviation() {
    let magnet = with(|p| p.conditions = sensing(|s| s.gap.bias = 1e-4));
    let plain = Magnet::new(MagnetParameters::default()).unwrap();
    let wide = MagnetInputs { gap: 0.0081, ..nominal() };
    let [biased, shifted] = [(&magnet, nominal()), (&plain, wide)].map(|(magnet, inputs)| {
        let state = magnet.initialise(&inputs, 0.0).unwrap();
        magnet.outputs(&state, &inputs).unwrap()
    });
    assert!((biased.voltage - shifted.voltage).abs() < 1e-12);
    assert_eq!(biased.readings[0], 0.0081);
    // An accelerometer's bias that is there from the start is its rest (eq. 4's x3).
    let tilted = with(|p| p.conditions = sensing(|s| s.acceleration.bias = 0.3));
    let mut state = tilted.initialise(&nominal(), 0.0).unwrap();
    state = stepped(&tilted, &state, &InputCourse::constant(&nominal()), 0.0, 0.1);
    let now = tilted.outputs(&state, &nominal()).unwrap();
    assert!((now.force - LOAD).abs() < 1e-9 * LOAD, "{now:?}");
}

/// Between samples the reading stays, and it is a multiple of the resolution. Without samples the
/// resolution is refused.
#[test]
fn analytic_resolution_rounds_at_samples() {
    let magnet = with(|p| {
        p.control.sampling = Some(Sampling { period: 1e-3, delay: 0 });
        p.conditions = sensing(|s| s.gap.resolution = 1e-5);
    });
    let course = InputCourse { gap: [0.008, 0.05, 0.0, 0.0], ..InputCourse::default() };
    let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
    for n in 0..40 {
        let time = f64::from(n) * 2.5e-4;
        state = stepped(&magnet, &state, &course.after(time), time, 2.5e-4);
        let end = time + 2.5e-4;
        let inputs = MagnetInputs { gap: 0.008 + 0.05 * end, ..nominal() };
        let reading = magnet.outputs(&state, &inputs).unwrap().readings[0];
        // a sample at the end of a step is taken in the next one
        let sample = f64::from(n / 4) * 1e-3;
        let expected = ((0.008 + 0.05 * sample) / 1e-5).round() * 1e-5;
        assert!((reading - expected).abs() < 1e-15, "{end}: {reading} is not {expected}");
    }
    let text = refusal(|p| p.conditions = sensing(|s| s.gap.resolution = 1e-5));
    assert!(text.contains("resolution of the gap sensor (m) is 0.00001"), "{text}");
    assert!(text.contains("sampled controller"), "{text}");
}

/// A failure in the middle of a step acts from its instant on: the same course as with steps that end
/// there.
#[test]
fn analytic_failures_begin_at_their_time_within_a_step() {
    let failing = |reading| {
        move |s: &mut Sensors| {
            s.gap.failure = SensorFailure { failed: false, time: Some(3.7e-3), reading }
        }
    };
    for reading in [FailedReading::Last, FailedReading::Value(0.0), FailedReading::Value(0.02)] {
        let magnet = with(|p| p.conditions = sensing(failing(reading)));
        let start = magnet.initialise(&at(&lively(), 0.0), 0.0).unwrap();
        let whole = stepped(&magnet, &start, &lively(), 0.0, 8e-3);
        let half = stepped(&magnet, &start, &lively(), 0.0, 3.7e-3);
        let half = stepped(&magnet, &half, &lively().after(3.7e-3), 3.7e-3, 4.3e-3);
        assert!(distance(&whole, &half) < 1e-12, "{reading:?}");
        // by hand: healthy up to there, then the switch
        let healthy = with(|p| p.conditions = sensing(|_| {}));
        let mut state = stepped(&healthy, &start, &lively(), 0.0, 3.7e-3);
        let failed = with(|p| {
            p.conditions = sensing(|s| {
                s.gap.failure = SensorFailure { failed: true, time: None, reading };
            })
        });
        failed.apply_changes(&mut state, &at(&lively(), 3.7e-3));
        let state = stepped(&failed, &state, &lively().after(3.7e-3), 3.7e-3, 4.3e-3);
        assert!(distance(&whole, &state) < 1e-12, "{reading:?}");
        let expected = match reading {
            FailedReading::Last => at(&lively(), 3.7e-3).gap,
            FailedReading::Value(value) => value,
        };
        let now = failed.outputs(&state, &at(&lively(), 8e-3)).unwrap();
        assert!((now.readings[0] - expected).abs() < 1e-15, "{reading:?} {now:?}");
    }
}

fn nonlinear(conditions: Conditions) -> Magnet {
    with(|p| {
        p.law = Law::Nonlinear;
        p.limits = current_from_zero();
        p.conditions = conditions;
    })
}

fn current_from_zero() -> PowerLimits {
    PowerLimits { current: Some(Range { min: 0.0, max: 60.0 }), voltage: None }
}

fn supply(failed: bool, time: Option<f64>) -> Conditions {
    Conditions { supply: Some(SupplyFailure { failed, time }), ..Conditions::default() }
}

/// Without supply the current decays by L/R, from the instant of the failure within a step, and its
/// sign stays.
#[test]
fn analytic_current_decays_by_inductance_over_resistance() {
    let magnet = nonlinear(supply(false, Some(0.0123)));
    let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
    let course = InputCourse::constant(&nominal());
    let begin = magnet.outputs(&state, &nominal()).unwrap().current;
    let coil = magnet.electromagnet();
    let rate = coil.resistance / coil.inductance;
    for n in 0..300 {
        let time = f64::from(n) * 0.01;
        state = stepped(&magnet, &state, &course, time, 0.01);
        let now = magnet.outputs(&state, &nominal()).unwrap();
        let failed = (time + 0.01 - 0.0123).max(0.0);
        let expected = begin * (-rate * failed).exp();
        // Runge-Kutta at 50 µs and 1.3 1/s: rounding
        assert!((now.current - expected).abs() < 1e-11 * begin, "{time}: {now:?} {expected}");
        assert!(now.current > 0.0 && now.force > 0.0);
        if failed > 0.0 {
            assert_eq!(now.voltage, 0.0);
            let rates = magnet.rates(&state, &nominal(), &InputRates::default()).unwrap();
            assert!((rates.current + rate * now.current).abs() < 1e-9 * begin);
            assert!((rates.force + 2.0 * rate * now.force).abs() < 1e-9 * now.force.max(1.0));
        }
    }
}

/// In the linear law zero voltage would drive the force negative; the failure switches it off, and its
/// end switches it on again where it was.
#[test]
fn analytic_failed_supply_switches_the_linear_force_off() {
    let healthy = Magnet::new(MagnetParameters::default()).unwrap();
    let failed = with(|p| p.conditions = supply(true, None));
    let mut state = healthy.initialise(&nominal(), 0.0).unwrap();
    let course = InputCourse::constant(&nominal());
    state = stepped(&healthy, &state, &course, 0.0, 1e-3);
    failed.apply_changes(&mut state, &nominal());
    for n in 1..5 {
        let now =
            failed.outputs(&state, &MagnetInputs { lateral_offset: 1e-3, ..nominal() }).unwrap();
        let off = [now.force, now.lateral_force, now.current, now.voltage];
        assert!(off.iter().all(|value| *value == 0.0), "{now:?}");
        let rates = InputRates { static_force_rate: 1.0, ..InputRates::default() };
        assert_eq!(failed.rates(&state, &nominal(), &rates).unwrap().force, 0.0);
        let partials = failed.partials(&state, &nominal()).unwrap();
        assert_eq!(partials.force_by_static_force, 0.0);
        state = stepped(&failed, &state, &course, f64::from(n) * 1e-3, 1e-3);
    }
    healthy.apply_changes(&mut state, &nominal());
    assert_eq!(healthy.outputs(&state, &nominal()).unwrap().force, LOAD);
}

/// A voltage reaches the coil `delay` samples after the sample that it was computed at: with the
/// control law's inputs at rest but for a step of the filter's state, that is an exact instant.
#[test]
fn analytic_delay_of_several_samples() {
    for delay in [0, 1, 3, 15] {
        let magnet = with(|p| p.control.sampling = Some(Sampling { period: 1e-3, delay }));
        let mut state = magnet.initialise(&nominal(), 0.0).unwrap();
        let rest = state.hold.applied;
        state.filter[0] = 1.0;
        let course = InputCourse::constant(&nominal());
        let mut first = None;
        for n in 0..20 {
            let time = f64::from(n) * 1e-3;
            state = stepped(&magnet, &state, &course, time, 1e-3);
            if first.is_none() && state.hold.applied != rest {
                first = Some(n);
            }
        }
        assert_eq!(first, Some(delay as i32), "{delay}");
    }
    let text = refusal(|p| p.control.sampling = Some(Sampling { period: 1e-3, delay: 16 }));
    assert!(text.contains("delay (samples) is 16, but must be at most 15"), "{text}");
}

/// The derivatives at a sampling instant are those after the sample: the force's slope over the first
/// tenth of the next step, not the one before.
#[test]
fn analytic_derivatives_at_a_sample_are_those_after_it() {
    let magnet = with(|p| p.control.sampling = Some(Sampling { period: 1e-3, delay: 0 }));
    let start = magnet.initialise(&at(&lively(), 0.0), 0.0).unwrap();
    let state = stepped(&magnet, &start, &lively(), 0.0, 1e-3);
    let now = at(&lively(), 1e-3);
    let rates = magnet.rates(&state, &now, &InputRates::default()).unwrap();
    let force =
        |state: &State, time: f64| magnet.outputs(state, &at(&lively(), time)).unwrap().force;
    let later = stepped(&magnet, &state, &lively().after(1e-3), 1e-3, 1e-6);
    let slope = (force(&later, 1e-3 + 1e-6) - force(&state, 1e-3)) / 1e-6;
    let earlier = stepped(&magnet, &start, &lively(), 0.0, 1e-3 - 1e-6);
    let before = (force(&state, 1e-3) - force(&earlier, 1e-3 - 1e-6)) / 1e-6;
    assert!((rates.force / slope - 1.0).abs() < 1e-4, "{} is not {slope}", rates.force);
    assert!((before / slope - 1.0).abs() > 0.05, "the slope does not jump: {before} {slope}");
}

#[test]
fn refusal_bad_sensors_say_which_and_why() {
    type Change = fn(&mut Sensors);
    let cases: [(Change, &str); 6] = [
        (
            |s| s.gap.noise.rms = -1e-5,
            "noise of the gap sensor (m) is -0.00001, but must be at least 0",
        ),
        (
            |s| s.acceleration.noise = Noise { rms: 1.0, bandwidth: 0.0, ..s.acceleration.noise },
            "bandwidth of the acceleration sensor's noise (Hz) is 0, but must be positive",
        ),
        (|s| s.gap.bias = f64::NAN, "bias of the gap sensor (m) is NaN, but must be finite"),
        (|s| s.gap.resolution = -1e-6, "resolution of the gap sensor (m) is -0.000001"),
        (
            |s| s.acceleration.failure.reading = FailedReading::Value(f64::INFINITY),
            "reading of the failed acceleration sensor (m/s²) is inf",
        ),
        (
            |s| s.acceleration.resolution = 0.1,
            "acceleration sensor (m/s²) is 0.1, which needs a sampled",
        ),
    ];
    for (change, expected) in cases {
        let text = refusal(|p| p.conditions = sensing(change));
        assert!(text.contains(expected), "{text}");
    }
    let text = refusal(|p| {
        p.external_controller = true;
        p.conditions = sensing(|_| {});
    });
    assert!(text.contains("sensors with an external controller"), "{text}");
}

fn sequence() -> Sequence {
    Sequence { lift_off: Some(0.5), set_down: Some(5.0), transition: 2.0, landing_gap: 0.0165 }
}

fn sequenced(sequence: Sequence) -> Conditions {
    Conditions { sequence: Some(sequence), ..Conditions::default() }
}

#[test]
fn refusal_lift_off_needs_the_nonlinear_law_and_a_positive_current() {
    type Change = fn(&mut MagnetParameters);
    let cases: [(Change, &str); 10] = [
        (|p| p.law = Law::Linear, "lift-off and set-down with the linear law"),
        (|p| p.limits.current = None, "set limit_current to true and current_min to 0"),
        (|p| p.limits.current = Some(Range { min: -1.0, max: 60.0 }), "current_min to 0"),
        (|p| p.external_controller = true, "with an external controller"),
        (|p| p.conditions.sequence.as_mut().unwrap().transition = 0.0, "transition time (s) is 0"),
        (|p| p.conditions.sequence.as_mut().unwrap().landing_gap = -1.0, "landing gap (m) is -1"),
        (
            |p| p.conditions.sequence.as_mut().unwrap().landing_gap = 0.0079,
            "landing gap (m) is 0.0079, but must be above the nominal gap",
        ),
        (|p| p.conditions.sequence.as_mut().unwrap().landing_gap = 17.0, "landing gap (m) is 17"),
        (
            |p| p.conditions.sequence.as_mut().unwrap().set_down = Some(2.4),
            "lift_off_time + transition_time",
        ),
        (
            |p| p.conditions.sequence.as_mut().unwrap().lift_off = Some(f64::NAN),
            "lift-off time (s) is NaN",
        ),
    ];
    for (change, expected) in cases {
        let text = refusal(|p| {
            p.law = Law::Nonlinear;
            p.limits = current_from_zero();
            p.conditions = sequenced(sequence());
            change(p);
        });
        assert!(text.contains(expected), "{text}");
    }
    let late = nonlinear(sequenced(sequence()));
    let text = late.initialise(&nominal(), 0.6).unwrap_err().to_string();
    assert!(text.contains("lift-off time (s) is 0.5"), "{text}");
    let down = nonlinear(sequenced(Sequence { lift_off: None, ..sequence() }));
    let text = down.initialise(&nominal(), 5.1).unwrap_err().to_string();
    assert!(text.contains("set-down time (s) is 5, but must be at or after the time"), "{text}");
}

/// A change that is accepted leaves reference gap and voltage where they are at its instant, to the last
/// bit; all that would move them is refused.
#[test]
fn issue_15_a_reference_that_would_jump_is_refused() {
    let (up, down) = (0.5, 5.0);
    let magnet =
        |lift_off, set_down| nonlinear(sequenced(Sequence { lift_off, set_down, ..sequence() }));
    let old = magnet(Some(up), Some(down));
    let (mut accepted, mut refused) = (0, 0);
    for time in [0.25, 0.5, 0.7, 1.6, 3.0, 5.0, 5.5, 6.9, 7.5] {
        let mut state = old.initialise(&nominal(), 0.0).unwrap();
        state.time = time;
        old.apply_changes(&mut state, &nominal());
        let shown = |magnet: &Magnet, state: &State| {
            let now = magnet.outputs(state, &nominal()).unwrap();
            [now.reference_gap, now.voltage]
        };
        let before = shown(&old, &state);
        let others = [0.1, 0.45, 0.6, 1.0, 2.0].map(|it| (Some(it), Some(down)));
        let later = [None, Some(2.6), Some(4.0), Some(4.9), Some(5.1), Some(9.0)];
        for (lift_off, set_down) in others.into_iter().chain(later.map(|it| (Some(up), it))) {
            let new = magnet(lift_off, set_down);
            let change =
                old.parameters().conditions.check_change(&new.parameters().conditions, time);
            let mut changed = state;
            new.apply_changes(&mut changed, &nominal());
            let after = shown(&new, &changed);
            let case = format!("{time}: {lift_off:?} {set_down:?} {before:?} {after:?}");
            match change {
                Ok(()) => {
                    accepted += 1;
                    assert_eq!(before, after, "{case}");
                }
                Err(error) => {
                    refused += 1;
                    assert!(error.to_string().contains("would jump"), "{error}");
                }
            }
        }
    }
    assert!(accepted > 20 && refused > 20, "{accepted} {refused}");
}

/// A magnet of 250 kg under its share of a car, which soft springs pass on as a constant force, and a
/// skid: gap c downward from the rail, skid at 16 mm.
struct Hanging {
    gap: f64,
    rate: f64,
    state: State,
    time: f64,
}

const MASS: f64 = 250.0;
const SKID_GAP: f64 = 0.016;

/// Force of the skid, upward: 20 kN/mm with damping, no pull.
fn skid(gap: f64, rate: f64) -> f64 {
    (2e7 * (gap - SKID_GAP) + 5e4 * rate).max(0.0) * f64::from(u8::from(gap > SKID_GAP))
}

impl Hanging {
    /// At rest on the skid, which carries the load.
    fn start(magnet: &Magnet, time: f64) -> Self {
        let gap = SKID_GAP + LOAD / 2e7;
        let inputs = MagnetInputs { gap, ..nominal() };
        Self { gap, rate: 0.0, state: magnet.initialise(&inputs, time).unwrap(), time }
    }

    fn acceleration(&self, force: f64) -> f64 {
        (LOAD - force - skid(self.gap, self.rate)) / MASS
    }

    fn inputs(&self, magnet: &Magnet) -> MagnetInputs {
        let inputs = MagnetInputs { gap: self.gap, gap_rate: self.rate, ..nominal() };
        let force = magnet.outputs(&self.state, &inputs).unwrap().force;
        MagnetInputs { acceleration: self.acceleration(force), ..inputs }
    }

    /// A step of 0.1 ms: the magnet with the motion at its start, then the mass with the mean force.
    fn step(&mut self, magnet: &Magnet, size: f64) -> MagnetInputs {
        let now = self.inputs(magnet);
        let course = InputCourse {
            gap: [now.gap, now.gap_rate, now.acceleration, 0.0],
            acceleration: [now.acceleration, 0.0, 0.0, 0.0],
            ..InputCourse::default()
        };
        let before = magnet.outputs(&self.state, &now).unwrap().force;
        self.state = stepped(magnet, &self.state, &course, self.time, size);
        let end = MagnetInputs { gap: course.after(size).gap[0], ..now };
        let force = 0.5 * (before + magnet.outputs(&self.state, &end).unwrap().force);
        let parts = 10;
        for _ in 0..parts {
            self.rate += size / f64::from(parts) * self.acceleration(force);
            self.gap += size / f64::from(parts) * self.rate;
        }
        self.time += size;
        self.inputs(magnet)
    }
}

/// A magnet on a skid at 16 mm lifts off to 8 mm and sets down again. The gap follows its
/// reference within 0.5 mm while it moves, is at 8 mm to 10 µm two seconds after the lift-off,
/// touches down below 10 mm/s, and in the end the skid carries everything. The force is never negative.
#[test]
fn analytic_magnet_lifts_off_and_sets_down() {
    for sampling in [None, Some(Sampling { period: 1e-3, delay: 1 })] {
        let magnet = with(|p| {
            p.law = Law::Nonlinear;
            p.limits = current_from_zero();
            p.control.sampling = sampling;
            p.conditions = sequenced(sequence());
        });
        let mut it = Hanging::start(&magnet, 0.0);
        let first = magnet.outputs(&it.state, &it.inputs(&magnet)).unwrap();
        assert_eq!([first.force, first.current, first.voltage], [0.0; 3]);
        let (mut touchdown, mut worst, mut settled) = (None, 0.0_f64, 0.0_f64);
        for n in 1..=90_000 {
            let rate = it.rate;
            let now = it.step(&magnet, 1e-4);
            let out = magnet.outputs(&it.state, &now).unwrap();
            let time = f64::from(n) * 1e-4;
            assert!(out.force >= 0.0 && out.current >= 0.0, "{time}: {out:?}");
            if time < 0.5 {
                assert!(
                    out.force == 0.0 && (it.gap - SKID_GAP - LOAD / 2e7).abs() < 1e-9,
                    "{time}"
                );
            }
            if (1.1..5.0).contains(&time) {
                worst = worst.max((it.gap - out.reference_gap).abs());
            }
            if (4.5..5.0).contains(&time) {
                settled = settled.max((it.gap - 0.008).abs());
            }
            if time > 5.0 && touchdown.is_none() && it.gap > SKID_GAP {
                touchdown = Some(rate);
            }
        }
        let now = it.inputs(&magnet);
        let out = magnet.outputs(&it.state, &now).unwrap();
        let touchdown = touchdown.unwrap();
        assert!(worst < 5e-4 && settled < 1e-5, "{worst} {settled}");
        assert!(touchdown < 0.01, "{touchdown}");
        assert!(out.force < 1e-3 * LOAD && out.voltage == 0.0, "{out:?}");
        assert!((skid(it.gap, it.rate) / LOAD - 1.0).abs() < 1e-3 && it.rate.abs() < 1e-5);
    }
}

/// The reference and its voltage are consistent: a mass that follows c_r exactly needs no correction.
/// The flux under v_r is λ_r, from zero to the one that carries the load at any gap.
#[test]
fn analytic_reference_voltage_builds_the_flux() {
    let magnet = nonlinear(sequenced(Sequence { set_down: None, ..sequence() }));
    let start = MagnetInputs { gap: 0.016, ..nominal() };
    let mut state = magnet.initialise(&start, 0.0).unwrap();
    for n in 0..3000_u32 {
        let time = f64::from(n) * 1e-3;
        // the gap follows the reference: value, slope and curvature of the quintic by differences
        let reference = |t: f64| reference_gap(&magnet, &state, t);
        let (c, up, down) = (reference(time), reference(time + 1e-4), reference(time - 1e-4));
        let (rate, second) = ((up - down) / 2e-4, (up - 2.0 * c + down) / 1e-8);
        let course = InputCourse {
            gap: [c, rate, second, 0.0],
            acceleration: [second, 0.0, 0.0, 0.0],
            ..InputCourse::default()
        };
        state = stepped(&magnet, &state, &course, time, 1e-3);
    }
    let inputs = nominal();
    let out = magnet.outputs(&state, &inputs).unwrap();
    assert!((out.force / LOAD - 1.0).abs() < 1e-3, "{out:?}");
    assert_eq!(out.reference_gap, 0.008);
}

/// c_r of the lift-off in [`sequence`] from 16 mm: the quintic over the last three quarters.
fn reference_gap(_: &Magnet, _: &State, time: f64) -> f64 {
    let u = ((time - 1.0) / 1.5).clamp(0.0, 1.0);
    0.016 - 0.008 * u * u * u * (10.0 + u * (6.0 * u - 15.0))
}
