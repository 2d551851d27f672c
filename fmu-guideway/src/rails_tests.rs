//! The unit with rails through the C functions: signs, derivatives, parameters, linearisation, joints.
#![allow(clippy::unwrap_used)]

use allocation_counter::measure;
use fmi2_export::testing::TestInstance;
use serde_json::Value;

use crate::GuidewayFmu;

const H: f64 = 1e-3;

/// Two girders under a bogie; files beside the layout by name and text.
fn unit_with(rails: &str, files: &[(&str, &str)]) -> Result<TestInstance, String> {
    let folder = tempfile::tempdir().unwrap();
    let layout = format!(
        r#"{{ "girders": {{"g": {{"length": 25, "mass_per_length": 2780.8, "damping": [0.01],
              "frequencies": [7.1, 24.9], "lateral": {{"frequencies": [8.2]}},
              "torsion": {{"modes": 2, "torsional_stiffness": 1.44e10, "polar_inertia": 3776}}}}}},
            "spans": [{{"girder": "g", "count": 2}}], "magnets": 8, "joints": true,
            "rails": {{"height": 1.2, {rails}}} }}"#
    );
    std::fs::write(folder.path().join("guideway.json"), layout).unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    TestInstance::new::<GuidewayFmu>(folder.path()).map_err(|error| error.to_string())
}

fn names(row: &str) -> Vec<String> {
    (1..=8).map(|k| format!("{row}_{k:02}")).collect()
}

fn set(unit: &mut TestInstance, row: &str, of: impl Fn(usize) -> f64) {
    for (k, name) in names(row).iter().enumerate() {
        unit.set_real(name, of(k)).unwrap();
    }
}

/// A bogie around x, its left magnets with twice the force, pushed to the left on the right side.
fn bogie(mut unit: TestInstance, x: f64) -> TestInstance {
    unit.enter_initialization(0.0).unwrap();
    set(&mut unit, "force", |k| if k < 4 { 8e3 } else { 4e3 });
    set(&mut unit, "lateral_force", |k| if k < 4 { 0.0 } else { 900.0 });
    set(&mut unit, "position", |k| x + 0.7 * (k % 4) as f64);
    unit.set_real("speed", 3.0).unwrap();
    unit.exit_initialization().unwrap();
    unit
}

fn irregular() -> TestInstance {
    let part = r#"{"psd": {"form": "german-low"}, "coherence": {"corner": 0.3}}"#;
    let rails = format!(r#""irregularity": {{"on": true, "vertical": {part}, "lateral": {part}}}"#);
    unit_with(&rails, &[]).unwrap()
}

/// Heavier left rail: it sinks, the girder twists left side down; the magnets' force to the left pushes
/// the girder to the right and turns its top to the right.
#[test]
fn analytic_static_signs_of_twist_and_lateral_deflection() {
    let mut unit = bogie(
        unit_with(
            r#""sides": ["left", "left", "left", "left", "right", "right", "right", "right"]"#,
            &[],
        )
        .unwrap(),
        11.0,
    );
    let [left, right] = ["displacement_02", "displacement_06"].map(|n| unit.real(n).unwrap());
    assert!(left < right && right < 0.0, "{left} {right}");
    // static: Σ φᵢ(x)·φᵢ(11.5)…, by hand for the twist of the first mode only: sign and size
    let twist = unit.real("midspan_twist_01").unwrap();
    let torque = 0.95 * 4.0 * 4e3 - 1.2 * 4.0 * 900.0;
    let stiffness = (std::f64::consts::PI / 25.0f64).powi(2) * 1.44e10 * 12.5;
    assert!(twist < 0.0 && (-twist * stiffness / torque - 1.0).abs() < 0.03, "{twist}");
    let lateral = unit.real("midspan_lateral_01").unwrap();
    assert!(lateral < 0.0);
    let at_rail = unit.real("lateral_displacement_02").unwrap();
    assert!(
        (at_rail - (lateral - 1.2 * twist)).abs() < 0.02 * at_rail.abs(),
        "{at_rail} {lateral} {twist}"
    );
    assert_eq!(unit.real("midspan_lateral_02").unwrap(), 0.0);
    // the joints: both ends of span 1 turn downward from the ground, nothing steps
    let kinks = [1, 2, 3].map(|k| unit.real(&format!("joint_kink_{k:02}")).unwrap());
    assert!(kinks[0] < 0.0 && kinks[1] < 0.0 && kinks[2] == 0.0, "{kinks:?}");
    assert!(unit.real("joint_step_02").unwrap().abs() < 1e-18);
    assert!(unit.real("joint_lateral_kink_02").unwrap() != 0.0);
    assert!(
        (unit.real("torsion_natural_frequency_01").unwrap() - (1.44e10f64 / 3776.0).sqrt() / 50.0)
            .abs()
            < 1e-9
    );
}

#[test]
fn order_lateral_outputs_are_each_others_derivatives() {
    let mut unit = bogie(irregular(), 12.0);
    set(&mut unit, "lateral_force", |k| 200.0 * k as f64);
    for n in 0..40 {
        set(&mut unit, "position", |k| 12.0 + 0.7 * (k % 4) as f64 + 3.0 * H * f64::from(n));
        unit.step(f64::from(n) * H, H).unwrap();
    }
    let e = 1e-4;
    let place = |t: f64| move |k: usize| 12.0 + 0.7 * (k % 4) as f64 + 3.0 * t;
    set(&mut unit, "position", place(40.0 * H));
    for k in [2, 7] {
        for row in ["displacement", "lateral_displacement"] {
            let rate = row.replace("displacement", "rate");
            let [x, v] = [row.to_owned(), rate].map(|row| format!("{row}_{k:02}"));
            let now = [unit.real(&x).unwrap(), unit.real(&v).unwrap()];
            assert_eq!(unit.output_derivative(&x, 1).unwrap(), now[1]);
            let second = unit.output_derivative(&x, 2).unwrap();
            assert_eq!(unit.output_derivative(&v, 1).unwrap(), second);
            unit.save().unwrap();
            unit.step(40.0 * H, e).unwrap();
            set(&mut unit, "position", place(40.0 * H + e));
            let after = [unit.real(&x).unwrap(), unit.real(&v).unwrap()];
            unit.restore().unwrap();
            set(&mut unit, "position", place(40.0 * H));
            let difference = (after[0] - now[0]) / e;
            assert!(
                (difference - now[1] - 0.5 * e * second).abs() < 1e-6,
                "{x}: {difference} {}",
                now[1]
            );
            assert!(((after[1] - now[1]) / e - second).abs() < 2e-2, "{x} {second}");
            // directional: by place and by speed
            for (known, by) in [(format!("position_{k:02}"), 1e-5), ("speed".to_owned(), 1e-3)] {
                let analytic = unit.derivative(&v, &known).unwrap();
                let start = unit.real(&known).unwrap();
                unit.set_real(&known, start + by).unwrap();
                let high = unit.real(&v).unwrap();
                unit.set_real(&known, start - by).unwrap();
                let low = unit.real(&v).unwrap();
                unit.set_real(&known, start).unwrap();
                let found = (high - low) / (2.0 * by);
                assert!(
                    (found - analytic).abs() < 1e-6 + 1e-6 * analytic.abs(),
                    "{v} by {known}: {found} {analytic}"
                );
            }
        }
        let twist = "midspan_twist_01";
        let [now, rate] = [unit.real(twist).unwrap(), unit.output_derivative(twist, 1).unwrap()];
        unit.save().unwrap();
        unit.step(40.0 * H, e).unwrap();
        let found = (unit.real(twist).unwrap() - now) / e;
        unit.restore().unwrap();
        assert!((found - rate).abs() < 0.05 * rate.abs() + 1e-7, "{found} {rate}");
    }
}

/// Inputs and outputs of the report, and its response to a lateral force against steps of the unit.
#[test]
fn analytic_the_linear_report_has_lateral_inputs_states_and_outputs() {
    let mut unit = bogie(irregular(), 11.0);
    let linear: Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let states: Vec<&str> =
        linear["states"].as_array().unwrap().iter().map(|s| s.as_str().unwrap()).collect();
    let index = |name: &str| states.iter().position(|s| *s == name).unwrap();
    assert_eq!(states.len(), 2 * 2 * 6);
    let twist = index("span 1, torsion mode 1");
    let (rate, lateral) =
        (index("span 1, rate of torsion mode 1"), index("span 1, rate of lateral mode 1"));
    assert!(index("span 2, rate of torsion mode 2") == 23);
    let column = |list: &str, name: &str, unit: &TestInstance| {
        let reference = unit.reference(name).unwrap();
        linear[list].as_array().unwrap().iter().position(|r| *r == reference).unwrap()
    };
    let entry = |matrix: &str, i: usize, j: usize| -> f64 {
        linear[matrix]
            .as_array()
            .unwrap()
            .iter()
            .filter_map(|e| {
                let e = e.as_array().unwrap();
                (e[0] == i && e[1] == j).then(|| e[2].as_f64().unwrap())
            })
            .sum()
    };
    let force = column("inputs", "lateral_force_03", &unit);
    let phi = (std::f64::consts::PI * (11.0 + 1.4) / 25.0).sin();
    // modal masses ρI_p·L/2 and ρA·L/2; a force to the left on the magnet turns the top to the right
    let exact = 1.2 * phi / (3776.0 * 12.5);
    assert!((entry("b", rate, force) / exact - 1.0).abs() < 2e-3, "{}", entry("b", rate, force));
    let exact = -phi / (2780.8 * 12.5);
    assert!((entry("b", lateral, force) / exact - 1.0).abs() < 2e-3);
    let (up, left) = (
        column("outputs", "displacement_07", &unit),
        column("outputs", "lateral_displacement_07", &unit),
    );
    let phi = entry("c", left, twist) / -1.2;
    assert!((entry("c", up, twist) / (-0.95 * phi) - 1.0).abs() < 1e-12 && phi > 0.9);
    let kink = column("outputs", "joint_kink_02", &unit);
    assert!(
        (entry("c", kink, index("span 1, mode 1")) - std::f64::consts::PI / 25.0).abs() < 1e-15
    );
    let motions = unit.report("motions").unwrap();
    assert!(motions.contains("\"rx\"") && motions.contains("torsion mode 2"));
}

#[test]
fn issue_stepping_with_rails_does_not_allocate() {
    let mut unit = bogie(irregular(), 20.0);
    unit.save().unwrap();
    unit.step(0.0, H).unwrap();
    let counted = measure(|| {
        for n in 1..60 {
            unit.set_real("position_01", 20.0 + 0.1 * f64::from(n)).unwrap();
            unit.step(f64::from(n) * H, H).unwrap();
            unit.real("lateral_rate_07").unwrap();
            unit.save().unwrap();
            unit.restore().unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}

/// Parameters move the rails, and lateral motion vanishes where nothing pushes sideways.
#[test]
fn analytic_parameters_of_the_rails() {
    let twist = |gauge: f64, frequency: f64| {
        let mut unit = unit_with(r#""half_gauge": 0.95"#, &[]).unwrap();
        unit.set_real("half_gauge", gauge).unwrap();
        unit.set_real("torsion_frequency_01", frequency).unwrap();
        bogie_without_sideways(unit).real("midspan_twist_01").unwrap()
    };
    let base = twist(0.95, 40.0);
    assert!((twist(1.9, 40.0) / base - 2.0).abs() < 1e-12);
    // the second mode has a node at mid-span
    assert!((twist(0.95, 20.0) / base - 4.0).abs() < 1e-12);
    let mut unit = bogie_without_sideways(unit_with(r#""half_gauge": 0.95"#, &[]).unwrap());
    assert_eq!(unit.real("midspan_lateral_01").unwrap(), 0.0);
    assert!(unit.real("lateral_displacement_01").unwrap() != 0.0);
    let mut unit = irregular();
    unit.set_boolean("rail_irregularity_on", false).unwrap();
    assert_eq!(bogie(unit, 11.0).real("irregularity_05").unwrap(), 0.0);
    let mut unit = irregular();
    unit.set_real("half_gauge", 0.0).unwrap();
    unit.enter_initialization(0.0).unwrap();
    assert!(unit.exit_initialization().is_err());
}

fn bogie_without_sideways(mut unit: TestInstance) -> TestInstance {
    unit.enter_initialization(0.0).unwrap();
    set(&mut unit, "force", |k| if k < 4 { 8e3 } else { 4e3 });
    set(&mut unit, "position", |k| 11.0 + 0.7 * (k % 4) as f64);
    unit.exit_initialization().unwrap();
    unit
}

#[test]
fn issue_measured_profiles_of_rails_come_from_files() {
    let rails = r#""irregularity": {"on": true, "averaged": false, "vertical": {"left": {"file": "left.csv"}}}"#;
    let csv = "x,z\n-20,0.003\n0,0.003\n30,0.003\n90,0.003\n";
    let mut unit = bogie(unit_with(rails, &[("left.csv", csv)]).unwrap(), 14.0);
    assert!((unit.real("irregularity_02").unwrap() - 0.003).abs() < 1e-12);
    assert_eq!(unit.real("irregularity_06").unwrap(), 0.0);
    let missing = unit_with(rails, &[]).unwrap_err();
    assert!(missing.contains("left.csv"), "{missing}");
    let broken = unit_with(rails, &[("left.csv", "x,z\n0,1\nnonsense\n")]).unwrap_err();
    assert!(broken.contains("left.csv") && broken.contains("line 3"), "{broken}");
}
