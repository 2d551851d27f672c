//! `maglev inspect --modes` on the packaged units.

// A helper of a test fails as the test does.
#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;
use std::path::Path;

use serde_json::{Value, json};
use system_tests::curves::CarOnLine;
use system_tests::monolithic::{MonolithicSetup, MonolithicSystem};
use system_tests::rails::{bogie_on_rails, with_rails};
use system_tests::{root, scenario, start};

const HELD: &str = r#"{"magnet_stiffness": 7e5, "magnet_damping": 8e3}"#;

fn unit(name: &str) -> String {
    root().join(format!("target/fmu/{name}.fmu")).display().to_string()
}

/// The two-car train on 7e5 N/m and 8e3 N·s/m per magnet: 128 degrees of freedom by rank 502 of 630,
/// 256 states, and the fastest pair of a prototype written apart.
#[test]
fn golden_modes_of_the_two_car_train() {
    let vehicle = unit("vehicle");
    let asked = ["inspect", "--modes", &vehicle, "--options", HELD, "--json"];
    let output = start(&asked).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["bodies"], 105);
    assert_eq!(report["constraint_rank"], 502);
    assert_eq!(report["degrees_of_freedom"], 128);
    let modes = report["modes"].as_array().unwrap();
    let fastest = modes.last().unwrap();
    // two digits behind the point are the prototype's
    assert!((fastest["real"].as_f64().unwrap() + 209.48).abs() < 0.005, "{fastest}");
    assert!((fastest["imaginary"].as_f64().unwrap() - 308.47).abs() < 0.005, "{fastest}");
    for mode in modes {
        let shares: f64 = mode["participation"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p["share"].as_f64().unwrap())
            .sum();
        // shares below 1e-3 are left out; there are 80 bodies
        assert!(shares > 0.92 && shares < 1.0 + 1e-9, "{mode}");
    }

    let page = start(&asked[..5]).unwrap();
    let page = String::from_utf8(page.stdout).unwrap();
    let last = page.lines().last().unwrap();
    assert!(last.contains("-209.4") && last.contains("± 308.4"), "{last}");
}

/// Units that offer no modes, and wrong options, end with status 2 and a reason.
#[test]
fn invariant_what_has_no_modes_says_so() {
    for (name, options, reason) in [
        ("ems", "{}", "offers no report"),
        ("guideway", "{}", "offers no report"),
        ("vehicle", r#"{"stiffness": 1}"#, "unknown field `stiffness`"),
    ] {
        let output = start(&["inspect", "--modes", &unit(name), "--options", options]).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(reason), "{text}");
        assert!(output.stdout.is_empty());
    }
}

/// What `maglev modes` says of a scenario with values set.
fn coupled(file: &Path, settings: &[&str]) -> Value {
    let file = file.display().to_string();
    let mut all = vec!["modes", &file, "--json"];
    for setting in settings {
        all.extend(["--set", setting]);
    }
    let output = start(&all).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// The modes of a report are those of the monolithic model, all of them; and stepped at 1 ms the coupled
/// modes of girder and magnets keep theirs to 0.05 %. Returns their number and the largest distance.
fn check_modes(setup: &MonolithicSetup, report: &Value) -> (usize, f64) {
    let mut wanted = MonolithicSystem::new(setup).unwrap().eigenvalues().unwrap();
    let modes = report["modes"]["modes"].as_array().unwrap();
    assert_eq!(report["modes"]["states"], wanted.len());
    let number = |value: &Value| value.as_f64().unwrap();
    let (mut coupled, mut largest) = (0, 0.0_f64);
    for mode in modes {
        let (re, im) =
            (number(&mode["continuous"]["real"]), number(&mode["continuous"]["imaginary"]));
        for im in if im == 0.0 { vec![0.0] } else { vec![im, -im] } {
            let distance = |w: &nalgebra::Complex<f64>| (w.re - re).hypot(w.im - im);
            let nearest = wanted
                .iter()
                .enumerate()
                .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)))
                .unwrap()
                .0;
            let off = distance(&wanted.swap_remove(nearest)) / re.hypot(im);
            // both linearise by differences, good to 1e-7; equal magnets have eigenvalues that are
            // nearly defective, and there the root of that counts; where magnets cannot all be at their
            // gaps, the start is no exact equilibrium and the choice of coordinates counts, 1e-5
            assert!(off < 1e-3, "{mode}: {off:e}");
            largest = largest.max(off);
        }
        let girder = mode["participation"]["guideway"].as_f64().unwrap_or(0.0);
        if girder > 0.2 {
            coupled += 1;
            assert!(number(&mode["relative_error"]) < 5e-4, "{mode}");
        }
    }
    assert!(wanted.is_empty(), "{wanted:?}");
    assert_eq!(report["modes"]["stable"], true);
    assert_eq!(report["modes"]["stepped_stable"], true);
    (coupled, largest)
}

/// The units' own linearisations of the standing train, put together by the scenario's connections, have
/// the eigenvalues of the monolithic model, all 652 of them.
#[test]
fn analytic_coupled_modes_are_those_of_the_monolithic_model() {
    let mut setup = MonolithicSetup::of_layouts("two-car", "three-spans", &json!({})).unwrap();
    setup.initial_position = 37.5;
    setup.guideway.as_mut().unwrap().irregularity.on = false;
    let settings = [
        "vehicle.travel_speed=0",
        "vehicle.initial_position=37.5",
        "guideway.irregularity_on=false",
    ];
    let report = coupled(&scenario("low-speed.json"), &settings);
    // two modes of three spans; the train couples those of the middle one with its magnets
    assert!(check_modes(&setup, &report).0 >= 6);
}

/// The same of a bogie that stands on a girder with two rails, away from the middle: two modes each of
/// vertical bending, lateral bending and torsion.
#[test]
fn analytic_coupled_modes_on_rails_are_those_of_the_monolithic_model() {
    let folder = tempfile::tempdir().unwrap();
    let layout = with_rails(&json!({ "height": 1.2 }));
    let mut setup = MonolithicSetup::of_layouts("one-bogie", "one-bogie", &layout).unwrap();
    setup.initial_position = 9.0;
    let file = bogie_on_rails(folder.path(), "standing", &layout).unwrap();
    let report = coupled(&file, &["vehicle.travel_speed=0", "vehicle.initial_position=9"]);
    let (coupled, largest) = check_modes(&setup, &report);
    println!("{} states, {coupled} modes of the girder, {largest:.1e}", report["modes"]["states"]);
    assert!(coupled >= 6, "{coupled}");
}

/// The train of girder-3d, standing on the middle span.
#[test]
#[ignore = "half a minute"]
fn analytic_coupled_modes_of_the_train_on_rails_are_those_of_the_monolithic_model() {
    let smooth =
        json!({ "irregularity": { "on": false }, "rails": { "irregularity": { "on": false } } });
    let mut setup = MonolithicSetup::of_layouts("two-car", "three-spans-3d", &smooth).unwrap();
    setup.initial_position = 37.5;
    let settings = [
        "vehicle.travel_speed=0",
        "vehicle.initial_position=37.5",
        "guideway.rail_irregularity_on=false",
    ];
    let report = coupled(&scenario("girder-3d.json"), &settings);
    let (coupled, largest) = check_modes(&setup, &report);
    println!("{} states, {coupled} modes of girders, {largest:.1e}", report["modes"]["states"]);
    assert!(coupled >= 18, "{coupled}");
}

/// A car in a canted circle: standing on a girder with two rails, whose modes it couples all, and in motion on
/// rigid ground.
#[test]
fn analytic_coupled_modes_in_a_curve_are_those_of_the_monolithic_model() {
    let line = json!({
        "name": "circle", "start": -40,
        "plan": [{ "kind": "clothoid", "length": 20, "to_radius": 200 }, { "kind": "circle", "length": 80, "radius": 200 },
            { "kind": "clothoid", "length": 20 }],
        "cant": [{ "length": 20, "to": -0.0157 }],
    });
    let girder = with_rails(&json!({ "height": 1.2 }));
    let standing =
        CarOnLine { line, girder: Some(girder), lift_loss: false, speed: 0.0, place: 9.0 };
    let moving = CarOnLine { girder: None, speed: 20.0 / 3.6, ..standing.clone() };
    for (car, girders) in [(standing, 6), (moving, 0)] {
        let folder = tempfile::tempdir().unwrap();
        let report = coupled(&car.written(folder.path()).unwrap(), &[]);
        let (coupled, largest) = check_modes(&car.setup().unwrap(), &report);
        println!(
            "{} states, {coupled} modes of the girder, {largest:.1e}",
            report["modes"]["states"]
        );
        assert!(coupled >= girders, "{coupled}");
    }
}

/// Held inputs take damping from the magnet, until large steps make it grow: told by the modes and
/// shown by a run.
#[test]
fn analytic_modes_tell_which_step_is_too_large() {
    let file = scenario("one-magnet.json").display().to_string();
    let held = ["--algorithm", "jacobi", "--extrapolation", "0"];
    let modes = |step: &str| {
        let mut all = vec!["modes", &file, "--step", step];
        all.extend(held);
        start(&all).unwrap().status.code()
    };
    let largest = |step: &str| {
        let mut all = vec!["--step", step, "--stop", "4", "--record-interval", "0.08"];
        all.extend(held);
        let run = system_tests::FinishedRun::of(Path::new(&file), &all);
        // a magnet that touches the rail ends the run
        run.map_or(1.0, |run| {
            let gap = |name| run.statistic("vehicle.gap_01", name).unwrap();
            (gap("max") - 8e-3).max(8e-3 - gap("min"))
        })
    };
    assert_eq!(modes("0.001"), Some(0));
    assert!(largest("0.001") < 1e-4);
    assert_eq!(modes("0.01"), Some(1));
    assert!(largest("0.01") > 1e-3);
}

/// A girder of six modes under one magnet at 5 ms: three of them are above 100 Hz, half a period per step.
/// Those that have a node at the magnet are stepped without error, and the others keep their multipliers.
#[test]
fn issue_modes_above_half_a_period_per_step_are_matched() {
    let folder = tempfile::tempdir().unwrap();
    let girder = serde_json::json!({
        "magnets": 1, "start": 0.0, "spans": [{"girder": "g", "count": 1}],
        "girders": {"g": {"length": 25, "mass_per_length": 2780.8, "bending_stiffness": 3.6e10,
            "damping": [0.01], "modes": 6, "supports": [{"x": 0}, {"x": 25}]}},
        "pole": {"length": 0.65, "forces": 8},
    });
    std::fs::write(folder.path().join("guideway.json"), girder.to_string()).unwrap();
    let file = folder.path().join("six.json");
    let six = serde_json::json!({
        "extends": scenario("one-magnet.json"),
        "units": {"guideway": {"fmu": unit("guideway-one-magnet"),
            "resources": {"guideway.json": "guideway.json"}}},
    });
    std::fs::write(&file, six.to_string()).unwrap();
    let file = file.display().to_string();
    let output = start(&["modes", &file, "--step", "0.005", "--json"]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let modes = report["modes"]["modes"].as_array().unwrap();
    let (mut exact, mut above) = (0, 0);
    for mode in modes {
        let girder = mode["participation"]["guideway"].as_f64().unwrap_or(0.0);
        if girder > 0.99 {
            let error = mode["relative_error"].as_f64().unwrap();
            assert!(error < 2e-3, "{mode}");
            exact += u32::from(error < 1e-9);
            above += u32::from(mode["continuous"]["imaginary"].as_f64().unwrap() > 200.0 * PI);
        }
    }
    assert_eq!((exact, above), (3, 3));
    // the largest multiplier of the girder's modes above 100 Hz is 0.956
    assert!(report["modes"]["coupling_multiplier"].as_f64().unwrap() < 0.9, "{report}");
    let page = start(&["modes", &file, "--step", "0.005"]).unwrap();
    let page = String::from_utf8(page.stdout).unwrap();
    assert!(page.contains("4 modes are above 100 Hz"), "{page}");
}

/// A stiff girder whose modes have many periods per step is not taken for an algebraic loop.
#[test]
fn issue_a_stiff_girder_is_no_algebraic_loop() {
    let file = scenario("one-magnet.json").display().to_string();
    let output = start(&["modes", &file, "--set", "guideway.stiffness_factor=1e4"]).unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
}

/// A unit that does not tell its linearisation is named.
#[test]
fn invariant_modes_need_units_that_tell_their_linearisation() {
    let file = scenario("one-magnet.json").display().to_string();
    let output = start(&["modes", &file, "--set", "ems_01.sample_time=0.001"]).unwrap();
    assert_eq!(output.status.code(), Some(2));
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(text.contains("ems_01") && text.contains("sampled"), "{text}");
}

/// The nonlinear law with a gap gain of 12 is unstable on every girder (damping ratios down to −0.0098), but
/// the low-speed scenario starts on rigid ground, where no girder has a part in it: stability there is
/// called what it is.
#[test]
fn issue_12_stability_says_where_it_holds_and_what_takes_no_part() {
    let file = scenario("low-speed.json").display().to_string();
    let asked = |more: &[&str]| {
        let mut all = vec!["modes", &file];
        all.extend(["--set", "ems_[01..64].nonlinear=true", "--set", "ems_[01..64].gain_gap=12"]);
        all.extend(more);
        let output = start(&all).unwrap();
        (output.status.code(), String::from_utf8(output.stdout).unwrap())
    };
    let (status, text) = asked(&[]);
    assert_eq!(status, Some(0), "{text}");
    assert!(text.contains("t = 0 s, the start of the scenario"), "{text}");
    assert!(text.contains("stable at this operating point, WITHOUT guideway"), "{text}");
    assert!(text.contains("none of its 12 states is coupled"), "{text}");
    // where the magnets are
    assert!(text.contains("position_# -25.70"), "{text}");
    let (_, text) = asked(&["--json"]);
    let report: Value = serde_json::from_str(&text).unwrap();
    let apart = report["modes"]["apart"].as_array().unwrap();
    assert_eq!((apart.len(), &apart[0]["instance"]), (1, &Value::from("guideway")));
    assert_eq!(apart[0]["states"].as_array().unwrap().len(), 12);
    assert_eq!(report["modes"]["operating_point"]["time"], 0.0);

    let girder = ["--set", "vehicle.initial_position=37.5", "--set", "vehicle.travel_speed=0"];
    let (status, text) = asked(&girder);
    assert_eq!(status, Some(1), "{text}");
    assert!(text.contains("UNSTABLE at this operating point"), "{text}");
    // the outer spans carry nothing: two modes each
    assert!(text.contains("8 of 12 states of guideway are coupled with no other unit"), "{text}");
}

/// Largest errors of frequency and damping ratio as stepped, of vibrations up to 30 Hz.
fn errors(modes: &Value) -> [f64; 2] {
    let number = |value: &Value| value.as_f64().unwrap();
    let modes = modes["modes"]["modes"].as_array().unwrap();
    modes.iter().fold([0.0, 0.0], |[frequency, damping]: [f64; 2], mode| {
        let (exact, stepped) = (&mode["continuous"], &mode["stepped"]);
        if number(&exact["imaginary"]) == 0.0 || number(&exact["frequency_hz"]) > 30.0 {
            return [frequency, damping];
        }
        let apart = |name: &str| (number(&stepped[name]) / number(&exact[name]) - 1.0).abs();
        [frequency.max(apart("frequency_hz")), damping.max(apart("damping_ratio"))]
    })
}

fn printed(arguments: &[&str]) -> Value {
    let output = start(arguments).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// All six orders of three kinds of units, the most exact first, each with the errors of its modes.
#[test]
fn invariant_orders_are_compared_by_their_modes() {
    let one_magnet = root().join("scenarios/one-magnet.json").display().to_string();
    let compared = printed(&["modes", &one_magnet, "--orders", "--extrapolation", "2", "--json"]);
    let orders = compared["orders"].as_array().unwrap();
    assert_eq!(orders.len(), 6);
    let numbers =
        |it: &Value| ["frequency_error", "damping_error"].map(|n| it[n].as_f64().unwrap());
    let ranks: Vec<f64> = orders.iter().map(numbers).map(|[f, d]| 10.0 * f + d).collect();
    assert!(ranks.is_sorted() && ranks[0] < ranks[5], "{ranks:?}");
    let own = printed(&["modes", &one_magnet, "--json"]);
    let shipped = json!(["ems", "vehicle", "guideway"]);
    let found = orders.iter().find(|it| it["order"] == shipped).unwrap();
    assert_eq!(numbers(found), errors(&own));

    let output = start(&["modes", &one_magnet, "--orders", "--positions", "0:1:1"]).unwrap();
    assert_eq!(output.status.code(), Some(2));
}

/// The modes of the standing train below 30 Hz, within 0.1 % in frequency and 1 % in damping: in steps of 5 ms by
/// Gauss-Seidel with the guideway first (0.087 and 0.21 %; in the shipped order 8 %), of 10 ms by iteration of
/// order 6.
#[test]
fn issue_21_modes_of_the_train_in_large_steps() {
    let folder = tempfile::tempdir().unwrap();
    let order = ["guideway", "vehicle", "ems_[01..64]"];
    let cases = [
        (json!({ "name": "gauss-seidel", "extrapolation": 3, "order": order }), "0.005"),
        (json!({ "name": "iterated", "iteration": { "order": 6, "tolerance": 1e-9 } }), "0.01"),
    ];
    for (algorithm, step) in cases {
        let base = root().join("scenarios/standstill.json");
        let file = folder.path().join("standstill.json");
        let text = json!({ "extends": base, "algorithm": algorithm }).to_string();
        std::fs::write(&file, text).unwrap();
        let found = printed(&["modes", &file.display().to_string(), "--step", step, "--json"]);
        let [frequency, damping] = errors(&found);
        assert!(frequency < 1e-3 && damping < 1e-2, "{step}: {frequency} {damping}");
    }
}
