//! The unit through its C functions: it must be the physics, no more and no less.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use fmi2_export::testing::TestInstance;
use guideway::{Guideway, GuidewayDescription, Load, Workspace};

use crate::GuidewayFmu;

const SPEED: f64 = 5.0 / 3.6;

fn layout(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("resources").join(name)
}

pub(crate) fn unit(name: &str) -> TestInstance {
    TestInstance::new::<GuidewayFmu>(layout(name)).unwrap()
}

/// Place and force of magnet k (from 0) of a row, and their time derivatives.
fn place(k: usize, t: f64) -> f64 {
    0.3 + 0.7 * k as f64 + SPEED * t
}

fn force(k: usize, t: f64) -> f64 {
    5000.0 + 300.0 * (9.0 * t + k as f64).sin()
}

fn force_rate(k: usize, t: f64) -> f64 {
    2700.0 * (9.0 * t + k as f64).cos()
}

fn set(unit: &mut TestInstance, magnets: usize, t: f64) {
    for k in 0..magnets {
        unit.set_real(&format!("force_{:02}", k + 1), force(k, t)).unwrap();
        unit.set_real(&format!("position_{:02}", k + 1), place(k, t)).unwrap();
    }
    unit.set_real("speed", SPEED).unwrap();
}

/// Initializes a bogie on its span, rough if `rough`, and takes `steps` of `h`, forces linear.
fn bogie(rough: bool, steps: u32, h: f64) -> TestInstance {
    let mut unit = unit("one-bogie");
    unit.set_boolean("irregularity_on", rough).unwrap();
    unit.set_boolean("chirp_on", true).unwrap();
    unit.enter_initialization(0.0).unwrap();
    set(&mut unit, 8, 0.0);
    unit.exit_initialization().unwrap();
    for n in 0..steps {
        step(&mut unit, f64::from(n) * h, h);
    }
    unit
}

fn step(unit: &mut TestInstance, t: f64, h: f64) {
    set(unit, 8, t);
    for k in 0..8 {
        let name = format!("force_{:02}", k + 1);
        unit.set_input_derivative(&name, 1, force_rate(k, t)).unwrap();
        unit.set_input_derivative(&format!("position_{:02}", k + 1), 1, SPEED).unwrap();
    }
    unit.step(t, h).unwrap();
}

fn all_outputs(unit: &mut TestInstance) -> Vec<f64> {
    let mut values = Vec::new();
    for name in ["displacement", "rate", "deflection", "irregularity"] {
        for k in 1..=8 {
            values.push(unit.real(&format!("{name}_{k:02}")).unwrap());
        }
    }
    for name in ["displacement", "velocity", "acceleration"] {
        values.push(unit.real(&format!("midspan_{name}_01")).unwrap());
    }
    values
}

#[test]
fn invariant_every_layout_is_a_unit_with_its_counts() {
    for (name, magnets, spans, length) in [
        ("three-spans", 64, 3, 75.0),
        ("three-spans-3d", 64, 3, 75.0),
        ("one-magnet", 1, 1, 25.0),
        ("one-bogie", 8, 1, 25.0),
        ("one-car", 32, 1, 25.0),
        ("moving-force", 1, 1, 25.0),
        ("two-span-continuous", 8, 1, 50.0),
    ] {
        let mut unit = unit(name);
        unit.initialize(0.0).unwrap();
        assert!(unit.reference(&format!("force_{magnets:02}")).is_ok(), "{name}");
        assert!(unit.reference(&format!("force_{:02}", magnets + 1)).is_err(), "{name}");
        assert_eq!(unit.integer("span_count").unwrap(), spans);
        assert_eq!(unit.real("track_length").unwrap(), length);
    }
    let mut unit = unit("three-spans");
    unit.set_real("mass_factor", 2.0).unwrap();
    unit.initialize(0.0).unwrap();
    // Table 3: 34.76 t for either mode.
    assert!((unit.real("modal_mass_02").unwrap() - 69_520.0).abs() < 10.0);
}

/// The unit's outputs are those of the library with the same inputs, to the last bit.
#[test]
fn invariant_the_unit_is_the_library() {
    let h = 2e-3;
    let mut unit = bogie(true, 50, h);
    let text = std::fs::read_to_string(layout("one-bogie").join("guideway.json")).unwrap();
    let mut d = GuidewayDescription::from_json(&text).unwrap();
    (d.irregularity.on, d.chirp.on) = (true, true);
    let g = Guideway::new(&d, None).unwrap();
    let mut work = Workspace::new(&g);
    let loads = |t: f64| -> Vec<Load> {
        let load = |k| Load {
            force: [force(k, t), force_rate(k, t), 0.0, 0.0],
            position: [place(k, t), SPEED, 0.0, 0.0],
            ..Load::default()
        };
        (0..8).map(load).collect()
    };
    let mut state = g.initial_state(&mut work, &loads(0.0), SPEED, 0.0).unwrap();
    for n in 0..50 {
        let t = f64::from(n) * h;
        g.step(&mut work, &mut state, &loads(t), t, h).unwrap();
    }
    let mut a = vec![0.0; 2];
    set(&mut unit, 8, 50.0 * h);
    let now: Vec<Load> =
        (0..8).map(|k| Load::standing(force(k, 50.0 * h), place(k, 50.0 * h))).collect();
    g.accelerations(&mut work, &state, &now, 50.0 * h, &mut a);
    for (k, load) in now.iter().enumerate() {
        let s = g.surface(&mut work, &state, &a, load.position[0]);
        let output =
            |name: &str, unit: &mut TestInstance| unit.real(&format!("{name}_{:02}", k + 1));
        assert_eq!(output("displacement", &mut unit).unwrap(), s.displacement());
        assert_eq!(output("rate", &mut unit).unwrap(), s.rate(SPEED));
        assert_eq!(output("deflection", &mut unit).unwrap(), s.u);
        assert_eq!(output("irregularity", &mut unit).unwrap(), s.r);
    }
    let y = g.mid_span(&mut work, &state, &a, 0);
    assert_eq!(unit.real("midspan_acceleration_01").unwrap(), y.acceleration);
    assert!(y.acceleration != 0.0 && y.displacement < -1e-4);
    // φ₁ = sin(π/4) and φ₂ = 1 at the quarter, φ₁ = 1 and φ₂ = 0 in the middle
    let quarter = unit.real("quarter_displacement_01").unwrap();
    let expected = state.q[0] * std::f64::consts::FRAC_1_SQRT_2 + state.q[1];
    assert!((quarter - expected).abs() < 1e-12 * quarter.abs(), "{quarter} {expected}");
    assert!((state.q[1] / state.q[0]).abs() > 1e-3, "the second mode takes part");
}

/// A held position with `position_from_speed` moves as one with its derivative.
#[test]
fn invariant_held_positions_follow_the_speed() {
    let run = |derivative: bool, from_speed: bool| {
        let mut unit = unit("one-magnet");
        unit.set_boolean("position_from_speed", from_speed).unwrap();
        unit.enter_initialization(0.0).unwrap();
        unit.set_real("force_01", 1e5).unwrap();
        unit.set_real("speed", 20.0).unwrap();
        unit.exit_initialization().unwrap();
        for n in 0..20 {
            let t = f64::from(n) * 0.05;
            unit.set_real("position_01", 20.0 * t).unwrap();
            if derivative {
                unit.set_input_derivative("position_01", 1, 20.0).unwrap();
            }
            unit.step(t, 0.05).unwrap();
        }
        unit.real("midspan_displacement_01").unwrap()
    };
    let exact = run(true, true);
    assert_eq!(run(false, true), exact);
    assert_eq!(run(true, false), exact);
    // Held for good: half a step late, 0.5 m of 25 m.
    assert!((run(false, false) / exact - 1.0).abs() > 1e-3);
}

/// What the description promises of derivatives is kept from the start on: 3 outputs of order 2 and
/// one of order 1 per magnet, 2 and 1 per span.
#[test]
fn invariant_declared_derivatives_are_given() {
    for steps in [0, 2] {
        let mut unit = bogie(true, steps, 1e-3);
        let spans = unit.integer("span_count").unwrap() as usize;
        assert_eq!(unit.declared_derivatives().unwrap(), 8 * 7 + spans * 5);
    }
}

/// Order 1 and 2 output derivatives against differences of stepped outputs.
#[test]
fn order_output_derivatives_are_the_slopes_of_the_outputs() {
    let (h, e) = (1e-3, 1e-4);
    // The chirp (2π·0.2 s of phase rate) and ω₂ = 156 1/s bound the third derivative: differences
    // over ±e err by (156e)²/6 = 4e-5 of the derivative.
    let sample = |order: usize, name: &str| -> [f64; 3] {
        let mut unit = bogie(true, 200, h);
        let t = 200.0 * h;
        set(&mut unit, 8, t);
        let derivative = unit.output_derivative(name, order as i32).unwrap();
        let before = if order == 1 { unit.real(name) } else { unit.output_derivative(name, 1) };
        // Inputs held, magnets moving, as the derivative is defined.
        for k in 1..=8 {
            unit.set_input_derivative(&format!("position_{k:02}"), 1, SPEED).unwrap();
        }
        unit.step(t, e).unwrap();
        let after = if order == 1 { unit.real(name) } else { unit.output_derivative(name, 1) };
        let later = unit.output_derivative(name, order as i32).unwrap();
        [(after.unwrap() - before.unwrap()) / e, derivative, later]
    };
    for (name, scale) in [
        ("displacement_01", 1e-3),
        ("deflection_04", 1e-3),
        ("irregularity_08", 1e-3),
        ("midspan_displacement_01", 1e-3),
        ("quarter_displacement_01", 1e-3),
        ("rate_05", 0.1),
        ("midspan_velocity_01", 0.1),
    ] {
        let [difference, d0, d1] = sample(1, name);
        // Trapezoidal mean of the derivative at both ends: error e²/12 times its second
        // derivative, 156²·1e-8/12 = 2e-5 of the scale of the vibration.
        assert!(
            (difference - 0.5 * (d0 + d1)).abs() < 1e-4 * scale,
            "{name}: {difference} {d0} {d1}"
        );
    }
    let rows = ["displacement_01", "deflection_04", "irregularity_08", "midspan_displacement_01"];
    for name in rows.into_iter().chain(["quarter_displacement_01"]) {
        let [difference, d0, d1] = sample(2, name);
        assert!((difference - 0.5 * (d0 + d1)).abs() < 1e-4, "{name}: {difference} {d0} {d1}");
    }
    let mut unit = bogie(true, 1, h);
    assert!(unit.output_derivative("rate_01", 2).is_err());
    assert!(unit.output_derivative("midspan_acceleration_01", 1).is_err());
}

/// Claim: analytic directional derivatives are the slopes of the outputs, in both modes.
#[test]
fn invariant_directional_derivatives_agree_with_differences() {
    let mut stepped = bogie(true, 100, 1e-3);
    set(&mut stepped, 8, 0.1);
    let mut fresh = unit("one-bogie");
    fresh.set_boolean("irregularity_on", true).unwrap();
    fresh.enter_initialization(0.0).unwrap();
    set(&mut fresh, 8, 0.0);
    for unit in [&mut stepped, &mut fresh] {
        for known in ["force_02", "position_02", "position_07", "speed"] {
            let x = unit.real(known).unwrap();
            let e = 1e-4 * x.abs().max(1.0);
            for unknown in [
                "displacement_02",
                "rate_02",
                "rate_05",
                "deflection_07",
                "irregularity_02",
                "midspan_displacement_01",
                "midspan_acceleration_01",
                "quarter_displacement_01",
            ] {
                let Ok(analytic) = unit.derivative(unknown, known) else {
                    // The kit refuses what is declared independent at first.
                    assert!(unknown.starts_with("irregularity"), "{unknown} {known}");
                    continue;
                };
                let mut at = |x: f64| {
                    unit.set_real(known, x).unwrap();
                    unit.real(unknown).unwrap()
                };
                let difference = (at(x + e) - at(x - e)) / (2.0 * e);
                at(x);
                // All outputs are linear in forces and speed; over ±0.1 mm of place they curve by
                // (Ωe)²/6 ≤ 3e-7. Accelerations are sums of terms of some m/s²: rounding of
                // 4e-16/e.
                let tolerance = 1e-6 * analytic.abs() + 4e-12;
                assert!(
                    (difference - analytic).abs() < tolerance,
                    "{unknown}/{known}: {difference} {analytic}"
                );
            }
        }
    }
}

#[test]
fn invariant_saved_states_continue_bit_for_bit_in_another_instance() {
    let mut first = bogie(true, 30, 1e-3);
    let bytes = first.serialize().unwrap();
    let go_on = |unit: &mut TestInstance| {
        for n in 30..60 {
            step(unit, f64::from(n) * 1e-3, 1e-3);
        }
        all_outputs(unit)
    };
    let expected = go_on(&mut first);
    first.restore().unwrap();
    assert_eq!(go_on(&mut first), expected);
    // Another instance, of other parameters before: the state brings its own.
    let mut other = unit("one-bogie");
    other.set_real("frequency_01", 3.0).unwrap();
    other.initialize(0.0).unwrap();
    other.deserialize(&bytes).unwrap();
    assert_eq!(go_on(&mut other), expected);
}

/// Derivatives asked for at every step, again and between other questions have the bits of those
/// that an instance gives which was never asked before.
#[test]
fn invariant_derivatives_have_the_same_bits_from_a_cold_cache() {
    let mut warm = bogie(true, 0, 1e-3);
    let ask = |unit: &mut TestInstance| -> Vec<u64> {
        let orders = [("displacement", 1), ("displacement", 2), ("rate", 1), ("irregularity", 2)];
        let names = orders
            .iter()
            .flat_map(|&(row, order)| (1..=8).map(move |k| (format!("{row}_{k:02}"), order)))
            .chain([("midspan_velocity_01".to_owned(), 1)]);
        names.map(|(name, n)| unit.output_derivative(&name, n).unwrap().to_bits()).collect()
    };
    let mut seen = Vec::new();
    for n in 0..10 {
        step(&mut warm, f64::from(n) * 1e-3, 1e-3);
        seen.push(ask(&mut warm));
        let mut cold = unit("one-bogie");
        cold.deserialize(&warm.serialize().unwrap()).unwrap();
        assert_eq!(seen[n as usize], ask(&mut cold), "step {n}");
    }
    assert_ne!(seen[8], seen[9]);
    warm.derivative("midspan_acceleration_01", "force_02").unwrap();
    assert_eq!(ask(&mut warm), seen[9]);
    let force = warm.real("force_05").unwrap();
    warm.set_real("force_05", force + 100.0).unwrap();
    assert_ne!(ask(&mut warm), seen[9]);
    warm.set_real("force_05", force).unwrap();
    assert_eq!(ask(&mut warm), seen[9]);
}

#[test]
fn invariant_the_train_starts_without_a_transient() {
    let mut unit = unit("one-bogie");
    unit.enter_initialization(0.0).unwrap();
    for k in 0..8 {
        unit.set_real(&format!("force_{:02}", k + 1), 5800.0).unwrap();
        unit.set_real(&format!("position_{:02}", k + 1), 10.0 + 0.7 * k as f64).unwrap();
    }
    let start = unit.real("midspan_displacement_01").unwrap();
    unit.exit_initialization().unwrap();
    for n in 0..500 {
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
        // In equilibrium up to rounding, which rings undamped at worst.
        assert!((unit.real("midspan_displacement_01").unwrap() - start).abs() < 1e-15);
    }
    assert!(start < -4e-4);
}

#[test]
fn invariant_frequency_parameters_move_the_girder() {
    // Static mid-span deflection of the first mode goes with 1/(M·ω²).
    let deflection = |name: &str, value: f64| {
        let mut unit = unit("one-magnet");
        unit.set_integer("modes", 1).unwrap();
        unit.set_real(name, value).unwrap();
        unit.enter_initialization(0.0).unwrap();
        unit.set_real("force_01", 1e5).unwrap();
        unit.set_real("position_01", 12.5).unwrap();
        unit.real("midspan_displacement_01").unwrap()
    };
    let reference = deflection("frequency_01", 7.1);
    for (name, value, factor) in [
        ("frequency_01", 5.0, (7.1f64 / 5.0).powi(2)),
        ("stiffness_factor", 0.5, 2.0),
        // More mass lowers the frequency, not the stiffness.
        ("mass_factor", 2.0, 1.0),
    ] {
        let ratio = deflection(name, value) / reference;
        assert!((ratio / factor - 1.0).abs() < 1e-12, "{name}: {ratio}");
    }
}

#[test]
fn invariant_an_irregularity_file_is_read_and_a_missing_one_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("profil mit Lücke.csv");
    let mut text = String::from("x,z\n");
    for i in 0..=4000 {
        let x = f64::from(i) * 0.025 - 20.0;
        text.push_str(&format!("{x},{}\n", 1e-3 * (4.0 * x).sin()));
    }
    std::fs::write(&file, text).unwrap();
    let with = |file: &Path, averaged: Option<bool>| {
        let mut unit = unit("one-magnet");
        unit.set_boolean("irregularity_on", true).unwrap();
        unit.set_string("irregularity_file", file.to_str().unwrap()).unwrap();
        unit.set_real("irregularity_start", -20.0).unwrap();
        if let Some(averaged) = averaged {
            unit.set_boolean("irregularity_averaged", averaged).unwrap();
        }
        unit.enter_initialization(0.0)?;
        unit.set_real("position_01", 30.0)?;
        let height = unit.real("irregularity_01")?;
        let mut rate = |speed: f64| {
            unit.set_real("speed", speed)?;
            unit.real("rate_01")
        };
        // The girder's own part of the rate is the same at rest and on its way, but for the start
        // with the rate of rolling loads: a load of 0 N has none.
        Ok::<_, fmi2_export::testing::CallFailure>([height, rate(SPEED)? - rate(0.0)?])
    };
    // A pole of 0.65 m feels sin(Ωℓ/2)/(Ωℓ/2) of the wave, 74 %, and of its slope.
    let half = 0.5 * 0.65 * 4.0;
    for (averaged, remains) in [(None, f64::sin(half) / half), (Some(false), 1.0)] {
        let [height, rate] = with(&file, averaged).unwrap();
        // Spline through points of 0.1 rad: 5/384·1e-4 of the amplitude, 1/24·1e-3 of the slope.
        assert!((height - remains * 1e-3 * 120f64.sin()).abs() < 2e-9, "{averaged:?}: {height}");
        let slope = remains * 4e-3 * 120f64.cos();
        assert!((rate - SPEED * slope).abs() < 4e-5 * SPEED * 4e-3, "{averaged:?}: {rate}");
    }
    let message = with(&folder.path().join("none.csv"), None).unwrap_err().to_string();
    assert!(message.contains("none.csv") && message.contains("two columns"), "{message}");
}

/// Every layout has the irregularity of the library's default: averaged, and of the amplitude that
/// gives the paper's RMS of the gaps.
#[test]
fn invariant_layouts_share_the_default_irregularity() {
    let default = guideway::description::IrregularityDescription::default();
    for name in ["three-spans", "one-magnet", "one-bogie", "one-car", "moving-force"] {
        let mut unit = unit(name);
        unit.initialize(0.0).unwrap();
        assert!(unit.boolean("irregularity_averaged").unwrap() && default.averaged, "{name}");
        assert_eq!(unit.real("irregularity_amplitude").unwrap(), default.amplitude, "{name}");
    }
}

#[test]
fn invariant_bad_parameters_and_layouts_are_refused_by_name() {
    let mut unit = unit("one-magnet");
    unit.set_boolean("irregularity_on", true).unwrap();
    unit.set_real("irregularity_shortest_wave", 80.0).unwrap();
    let message = unit.initialize(0.0).unwrap_err().to_string();
    assert!(message.contains("irregularity.shortest_wave"), "{message}");

    let folder = tempfile::tempdir().unwrap();
    let refused = |text: &str| {
        std::fs::write(folder.path().join("guideway.json"), text).unwrap();
        TestInstance::new::<GuidewayFmu>(folder.path()).unwrap_err().to_string()
    };
    assert!(refused("{").contains("guideway.json"));
    let text = r#"{"girders": {"a": {"length": 25.0, "modes": 1, "mass_per_length": 1.0,
        "frequencies": [1.0], "damping": [0.1]}, "b": {"length": 30.0, "modes": 2,
        "mass_per_length": 1.0, "frequencies": [1.0], "damping": [0.1]}},
        "spans": [{"girder": "a"}, {"girder": "B"}], "magnets": 1}"#;
    let message = refused(text);
    assert!(message.contains("spans[1].girder") && message.contains('B'), "{message}");
    // Two kinds of span: their parameters carry the kind's name.
    std::fs::write(folder.path().join("guideway.json"), text.replace("\"B\"", "\"b\"")).unwrap();
    let mut unit = TestInstance::new::<GuidewayFmu>(folder.path()).unwrap();
    unit.initialize(0.0).unwrap();
    assert_eq!(unit.real("b_frequency_02").unwrap(), 4.0);
    assert!(unit.reference("a_frequency_02").is_err() && unit.reference("frequency_01").is_err());
}

#[test]
fn invariant_a_step_that_cannot_be_resolved_is_discarded_unharmed() {
    let mut unit = unit("one-magnet");
    unit.initialize(0.0).unwrap();
    unit.save().unwrap();
    unit.set_real("speed", 1e12).unwrap();
    let failure = unit.step(0.0, 1e-3).unwrap_err();
    assert_eq!(failure.status, fmi2_export::sys::fmi2Status::fmi2Discard);
    assert!(failure.to_string().contains("sub-steps"), "{failure}");
    unit.restore().unwrap();
    unit.step(0.0, 1e-3).unwrap();
}

/// The report `motions` draws what the outputs measure: the deflection at midspan of every span by the same
/// states, which it names by their span; the ends rest on their supports.
#[test]
fn invariant_motions_agree_with_the_linearised_outputs() {
    let mut unit = bogie(false, 0, 0.01);
    let read = |text: String| -> serde_json::Value { serde_json::from_str(&text).unwrap() };
    let (linear, motions) =
        (read(unit.report("linear").unwrap()), read(unit.report("motions").unwrap()));
    assert_eq!(linear["states"][0], "span 1, mode 1");
    let row = |entries: &serde_json::Value, i: usize| -> Vec<(u64, f64)> {
        let entries = entries.as_array().unwrap().iter();
        let mine = entries
            .filter(|it| it[0] == i)
            .map(|it| (it[1].as_u64().unwrap(), it[2].as_f64().unwrap()));
        mine.filter(|it| it.1.abs() > 1e-12).collect()
    };
    let parts = motions["parts"].as_array().unwrap();
    let at =
        |at: f64| parts.iter().position(|it| it["at"] == at && it["part"] == "span 1").unwrap();
    let reference = unit.reference("midspan_displacement_01").unwrap();
    let output = linear["outputs"].as_array().unwrap().iter().position(|it| *it == reference);
    let measured = row(&linear["c"], output.unwrap());
    assert_eq!(row(&motions["rows"], at(0.5)), measured);
    assert!(!measured.is_empty());
    for end in [0.0, 1.0] {
        assert_eq!(row(&motions["rows"], at(end)), []);
    }
    let first = parts.iter().position(|it| it["direction"] == "mode 1").unwrap();
    assert_eq!(row(&motions["rows"], first), [(0, 1.0)]);
}
