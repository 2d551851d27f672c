//! Own girders through the C functions: points, kinds, shapes from a file, static start, linearisation.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;

use crate::GuidewayFmu;

fn two_spans() -> TestInstance {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/resources/two-span-continuous");
    TestInstance::new::<GuidewayFmu>(folder).unwrap()
}

/// A unit of a layout of its own; files beside it by name and text.
fn unit(layout: &str, files: &[(&str, &str)]) -> Result<TestInstance, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("guideway.json"), layout).unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    TestInstance::new::<GuidewayFmu>(folder.path()).map_err(|error| error.to_string())
}

fn set_bogie(unit: &mut TestInstance, force: f64, first: f64) {
    for k in 0..8 {
        unit.set_real(&format!("force_{:02}", k + 1), force).unwrap();
        unit.set_real(&format!("position_{:02}", k + 1), first + 0.7 * k as f64).unwrap();
    }
}

fn bogie(first: f64) -> TestInstance {
    let mut unit = two_spans();
    unit.enter_initialization(0.0).unwrap();
    set_bogie(&mut unit, 5800.0, first);
    unit.exit_initialization().unwrap();
    unit
}

const POINTS: [&str; 3] = ["field_1", "pier_2", "field_2"];

/// In equilibrium from the start: rounding alone moves it, also over an end that moves.
#[test]
fn invariant_the_continuous_girder_starts_without_a_transient() {
    for first in [-2.0, 8.0, 22.5, 44.0] {
        let mut unit = bogie(first);
        let names: Vec<String> = POINTS.iter().map(|p| format!("{p}_displacement")).collect();
        let start: Vec<f64> = names.iter().map(|n| unit.real(n).unwrap()).collect();
        for n in 0..500 {
            unit.step(f64::from(n) * 2e-3, 2e-3).unwrap();
            for (name, start) in names.iter().zip(&start) {
                assert!((unit.real(name).unwrap() - start).abs() < 1e-14, "{first} {name}");
            }
        }
        let largest = start.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        assert!(largest > 1e-6, "{first}: {start:?}");
    }
    // loaded in the first field, the second one rises
    let mut unit = bogie(10.0);
    let [loaded, pier, other] = POINTS.map(|p| unit.real(&format!("{p}_displacement")).unwrap());
    assert!(loaded < -2e-4 && pier < 0.0 && pier > 0.2 * loaded && other > 2e-5);
}

/// Derivatives of the named points against differences, and directional derivatives.
#[test]
fn order_outputs_of_points_are_each_others_derivatives() {
    let (h, e) = (1e-3, 1e-4);
    let mut unit = bogie(8.0);
    set_bogie(&mut unit, 7000.0, 8.0);
    for n in 0..50 {
        unit.step(f64::from(n) * h, h).unwrap();
    }
    for point in POINTS {
        let [x, v, a] =
            ["displacement", "velocity", "acceleration"].map(|name| format!("{point}_{name}"));
        let before = [&x, &v].map(|name| unit.real(name).unwrap());
        let derivatives = [(&x, 1), (&x, 2), (&v, 1)]
            .map(|(name, order)| unit.output_derivative(name, order).unwrap());
        let acceleration = unit.real(&a).unwrap();
        assert_eq!(derivatives, [before[1], acceleration, acceleration]);
        assert!(unit.output_derivative(&a, 1).is_err());
        assert!(acceleration != 0.0);
        unit.save().unwrap();
        unit.step(50.0 * h, e).unwrap();
        let after = [&x, &v].map(|name| unit.real(name).unwrap());
        let later = unit.real(&a).unwrap();
        unit.restore().unwrap();
        // trapezoidal means: e²/12 of the third derivative, ω ≤ 300 1/s
        let mean = 0.5 * (before[1] + after[1]);
        assert!(((after[0] - before[0]) / e - mean).abs() < 1e-7, "{point}");
        let mean = 0.5 * (acceleration + later);
        assert!(((after[1] - before[1]) / e - mean).abs() < 1e-4 * acceleration.abs().max(0.1));
        let analytic = unit.derivative(&a, "force_03").unwrap();
        let force = unit.real("force_03").unwrap();
        unit.set_real("force_03", force + 1000.0).unwrap();
        let difference = (unit.real(&a).unwrap() - acceleration) / 1000.0;
        unit.set_real("force_03", force).unwrap();
        assert!((difference - analytic).abs() < 1e-12 + 1e-9 * analytic.abs(), "{point}");
    }
    assert_eq!(unit.declared_derivatives().unwrap(), 8 * 7 + 5 + 3 * 3);
}

#[test]
fn invariant_coupled_modes_step_without_allocation() {
    let mut unit = bogie(8.0);
    set_bogie(&mut unit, 7000.0, 8.0);
    unit.save().unwrap();
    unit.step(0.0, 1e-3).unwrap();
    let counted = measure(|| {
        for n in 1..50 {
            unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
            unit.real("field_1_acceleration").unwrap();
            unit.save().unwrap();
            unit.restore().unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}

/// Parameters of computed modes: factors move what they name, an imposed frequency is taken.
#[test]
fn invariant_parameters_of_a_computed_girder() {
    let read = |set: &[(&str, f64)]| {
        let mut unit = two_spans();
        for (name, value) in set {
            unit.set_real(name, *value).unwrap();
        }
        unit.initialize(0.0).unwrap();
        ["natural_frequency_01", "damping_ratio_01", "modal_mass_01", "natural_frequency_03"]
            .map(|name| unit.real(name).unwrap())
    };
    let base = read(&[]);
    // a bit below π/2·√(EI/m)/L² = 6.5 Hz of a field alone, as piers give way
    assert!((5.5..6.5).contains(&base[0]), "{base:?}");
    assert!(base[1] > 0.0108, "{base:?}");
    let all = read(&[("stiffness_factor", 4.0)]);
    assert!((all[0] / base[0] - 2.0).abs() < 1e-12 && all[1] == base[1]);
    let beam = read(&[("beam_stiffness_factor", 2.0)]);
    assert!(beam[0] > 1.2 * base[0] && beam[0] < 1.42 * base[0]);
    let soft = read(&[("support_stiffness_factor", 0.1)]);
    assert!(soft[0] < 0.9 * base[0], "{soft:?}");
    let undamped = read(&[("support_damping_factor", 0.0)]);
    assert_eq!(undamped[1], 0.0108);
    let imposed = read(&[("frequency_01", 5.0), ("damping_01", 0.02)]);
    assert!((imposed[0] - 5.0).abs() < 1e-12 && imposed[3] == base[3]);
    assert!((imposed[1] - 0.02) > 0.5 * (base[1] - 0.0108), "{imposed:?}");
    let mut unit = two_spans();
    assert!(unit.set_real("beam_stiffness_factor", -1.0).is_err());
    unit.initialize(0.0).unwrap();
    assert_eq!(unit.real("frequency_01").unwrap(), 0.0);
}

/// Each kind has its own factors; they do not move the other's spans.
#[test]
fn invariant_kinds_have_their_own_factors() {
    let layout = r#"{"girders": {
        "old": {"length": 25, "mass_per_length": 2000, "frequencies": [7], "damping": [0.01]},
        "new": {"length": 30, "mass_per_length": 2100, "frequencies": [4.8], "damping": [0.009]}},
        "spans": [{"girder": "old"}, {"girder": "new"}], "magnets": 1}"#;
    let deflections = |set: Option<(&str, f64)>| {
        [12.5, 40.0].map(|x| {
            let mut unit = unit(layout, &[]).unwrap();
            if let Some((name, value)) = set {
                unit.set_real(name, value).unwrap();
            }
            unit.enter_initialization(0.0).unwrap();
            unit.set_real("force_01", 1e5).unwrap();
            unit.set_real("position_01", x).unwrap();
            unit.real("deflection_01").unwrap()
        })
    };
    let base = deflections(None);
    let soft = deflections(Some(("new_stiffness_factor", 0.5)));
    assert_eq!(soft[0], base[0]);
    assert!((soft[1] / base[1] - 2.0).abs() < 1e-12);
    let heavy = deflections(Some(("old_mass_factor", 3.0)));
    assert_eq!(heavy, base);
    let mut unit = unit(layout, &[]).unwrap();
    unit.set_real("old_mass_factor", 3.0).unwrap();
    unit.initialize(0.0).unwrap();
    assert_eq!(unit.real("old_modal_mass_01").unwrap(), 3.0 * 25_000.0);
    assert_eq!(unit.real("new_modal_mass_01").unwrap(), 31_500.0);
}

#[test]
fn invariant_shapes_come_from_a_file_of_the_resources() {
    let layout = |file: &str| {
        format!(
            r#"{{"girders": {{"fe": {{"length": 20, "mass_per_length": 1000, "frequencies": [6],
                "damping": [0.01], "shapes_file": "{file}"}}}}, "spans": [{{"girder": "fe"}}],
                "magnets": 1, "points": [{{"name": "middle", "span": 1, "x": 10}}]}}"#
        )
    };
    let table = "x,phi_1\n0,0\n5,0.7071067811865476\n10,1\n15,0.7071067811865476\n20,0\n";
    let mut unit = unit(&layout("modes.csv"), &[("modes.csv", table)]).unwrap();
    unit.enter_initialization(0.0).unwrap();
    unit.set_real("force_01", 1e4).unwrap();
    unit.set_real("position_01", 10.0).unwrap();
    let middle = unit.real("middle_displacement").unwrap();
    // F/(M·ω²) with M = mL/2
    let exact = -1e4 / (1e4 * (2.0 * std::f64::consts::PI * 6.0).powi(2));
    assert!((middle / exact - 1.0).abs() < 5e-3, "{middle} {exact}");
    let refused = |text: &str, files: &[(&str, &str)]| self::unit(text, files).unwrap_err();
    assert!(refused(&layout("none.csv"), &[]).contains("none.csv"));
    assert!(refused(&layout("../modes.csv"), &[]).contains("inside"));
    let message = refused(&layout("m.csv"), &[("m.csv", "0,0\n10,1\n5,1\n20,0\n")]);
    assert!(message.contains("m.csv, line 3") && message.contains("guideway.json"), "{message}");
}

/// The report's A, with coupled damping, and C of a point and D of its acceleration.
#[test]
fn analytic_the_linearisation_is_the_unit() {
    let mut unit = bogie(8.0);
    let report = unit.report("linear").unwrap();
    let system: serde_json::Value = serde_json::from_str(&report).unwrap();
    let entries = |name: &str| -> Vec<(usize, usize, f64)> {
        serde_json::from_value(system[name].clone()).unwrap()
    };
    let outputs: Vec<u32> = serde_json::from_value(system["outputs"].clone()).unwrap();
    let inputs: Vec<u32> = serde_json::from_value(system["inputs"].clone()).unwrap();
    let row = |name: &str| {
        let reference = unit.reference(name).unwrap();
        outputs.iter().position(|r| *r == reference).unwrap()
    };
    let (y, a) = (row("field_1_displacement"), row("field_1_acceleration"));
    let force = unit.reference("force_03").unwrap();
    let force = inputs.iter().position(|r| *r == force).unwrap();
    let d: f64 = entries("d").iter().filter(|e| (e.0, e.1) == (a, force)).map(|e| e.2).sum();
    let analytic = unit.derivative("field_1_acceleration", "force_03").unwrap();
    assert!((d / analytic - 1.0).abs() < 1e-12, "{d} {analytic}");
    // between rates of different modes: dampers of piers
    let coupled = entries("a").into_iter().filter(|e| e.0 >= 6 && e.1 >= 6 && e.0 != e.1);
    assert!(coupled.map(|e| e.2.abs()).fold(0.0, f64::max) > 1e-3);
    // static deflection −C·A⁻¹·B: rates are 0, so q = f/ω²
    let (b, c) = (entries("b"), entries("c"));
    let stiffness: Vec<f64> = (0..6)
        .map(|i| -entries("a").iter().find(|e| (e.0, e.1) == (6 + i, i)).unwrap().2)
        .collect();
    let per_newton: f64 = (0..6)
        .map(|i| {
            let b: f64 = b.iter().filter(|e| e.0 == 6 + i && e.1 < 8).map(|e| e.2).sum();
            let c: f64 = c.iter().filter(|e| (e.0, e.1) == (y, i)).map(|e| e.2).sum();
            c * b / stiffness[i]
        })
        .sum();
    let deflection = unit.real("field_1_displacement").unwrap();
    assert!((5800.0 * per_newton / deflection - 1.0).abs() < 1e-12, "{per_newton} {deflection}");
}

#[test]
fn refusal_a_girder_that_its_supports_do_not_hold() {
    let text = std::fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("resources/two-span-continuous/guideway.json"),
    )
    .unwrap();
    let mut layout: serde_json::Value = serde_json::from_str(&text).unwrap();
    layout["girders"]["continuous"]["supports"].as_array_mut().unwrap().truncate(1);
    let message = unit(&layout.to_string(), &[]).unwrap_err();
    assert!(message.contains("girders.continuous.supports"), "{message}");
    assert!(message.contains("mechanism"), "{message}");
}
