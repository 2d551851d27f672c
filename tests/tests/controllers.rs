//! Magnet and controller as two units, and the controller of the template in Rust.

// A helper of a test fails as the test does.
#![allow(clippy::unwrap_used)]

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::{Value, json};
use system_tests::{FinishedRun, root, scenario, start};

type Columns = BTreeMap<String, Vec<f64>>;

fn run(file: &Path, options: &[&str]) -> Columns {
    FinishedRun::of(file, options).unwrap().columns().unwrap()
}

/// Largest deviation of the gaps of two runs.
fn apart(a: &Columns, b: &Columns) -> f64 {
    let gaps: Vec<_> = a.keys().filter(|name| name.starts_with("vehicle.gap_0")).collect();
    assert!(!gaps.is_empty());
    let deviations = gaps.iter().flat_map(|&name| {
        assert_eq!(a[name].len(), b[name].len());
        a[name].iter().zip(&b[name]).map(|(a, b)| (a - b).abs())
    });
    deviations.fold(0.0, f64::max)
}

/// Largest deviation of the gaps from their starts.
fn swing(a: &Columns) -> f64 {
    let gaps = a.iter().filter(|(name, _)| name.starts_with("vehicle.gap_0"));
    let deviations = gaps.flat_map(|(_, gap)| gap.iter().map(|value| (value - gap[0]).abs()));
    deviations.fold(0.0, f64::max)
}

/// The border between magnet and controller costs a coupling error, which falls with the third power of
/// the step as that of the other borders does.
#[test]
fn order_magnet_and_controller_apart_are_ems_to_the_coupling_error() {
    let difference = |algorithm: &str, step: &str| {
        let options =
            ["--algorithm", algorithm, "--step", step, "--record-interval", "0.04", "--no-report"];
        let whole = run(&scenario("one-magnet.json"), &options);
        assert!(swing(&whole) > 3e-4);
        apart(&whole, &run(&scenario("one-magnet-controller.json"), &options))
    };
    let [coarse, middle, fine] =
        ["0.002", "0.001", "0.0005"].map(|step| difference("gauss-seidel", step));
    // 0.23 µm, 8.6 nm and 0.5 nm; factors of 27 and 16, at least the 8 of third order
    assert!(coarse < 5e-7 && middle < 2e-8 && fine < 2e-9, "{coarse:e} {middle:e} {fine:e}");
    assert!(coarse / middle > 8.0 && middle / fine > 8.0, "{coarse:e} {middle:e} {fine:e}");
    let iterated = difference("iterated", "0.004");
    assert!(iterated < 2e-8, "{iterated:e}");
}

/// A start in motion on a rough girder: the gap's rate sets the filter and leaves the current alone, as
/// inside of ems. Without the transient voltage the current would start somewhere else.
#[test]
fn analytic_a_start_in_motion_is_that_of_ems() {
    for law in ["ems_*.nonlinear=false", "ems_*.nonlinear=true"] {
        let options = [
            "--set",
            law,
            "--set",
            "guideway.irregularity_on=true",
            "--set",
            "vehicle.initial_position=10",
            "--stop",
            "1",
            "--no-report",
        ];
        let whole = run(&scenario("one-bogie.json"), &options);
        let units = run(&scenario("one-bogie-controllers.json"), &options);
        assert!(swing(&whole) > 5e-5, "{}", swing(&whole));
        assert!(apart(&whole, &units) < 1e-6, "{law}: {:e}", apart(&whole, &units));
        // the same forces at the first instant
        for name in ["ems_01.force", "ems_08.force"] {
            let (a, b) = (whole[name][0], units[name][0]);
            assert!((a - b).abs() < 1e-6 * a, "{name}: {a} {b}");
        }
    }
}

/// A sampled controller as a unit of its own: by the discrete output its samples act when those of ems do.
#[test]
fn analytic_samples_act_when_those_of_ems_do() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("held.json");
    let base = scenario("one-magnet-controller.json");
    let mut connections: Value = serde_json::from_slice(&fs::read(&base).unwrap()).unwrap();
    let mut connections = connections["connections"].take();
    for connection in connections.as_array_mut().unwrap() {
        if connection["from"] == "controller_[01..01].voltage" {
            connection["from"] = "controller_[01..01].held_voltage".into();
        }
    }
    let held = json!({ "extends": base, "connections": connections });
    fs::write(&file, held.to_string()).unwrap();
    for delay in [0, 1] {
        let settings = |unit: &str| {
            [format!("{unit}.sample_time=0.001"), format!("{unit}.delay_samples={delay}")]
        };
        let at = |file: &Path, unit: &str| {
            let [time, delay] = settings(unit);
            run(file, &["--set", &time, "--set", &delay, "--no-report"])
        };
        let whole = at(&scenario("one-magnet.json"), "ems_01");
        let difference = apart(&whole, &at(&file, "controller_01"));
        // 0.8 µm, of 320; 7 nm at 0.125 ms
        assert!(difference < 2e-6, "{delay}: {difference:e}");
        // the samples themselves change far more
        let continuous = run(&scenario("one-magnet.json"), &["--no-report"]);
        assert!(apart(&whole, &continuous) > 1e-5);
    }
}

/// Eigenvalues as `maglev modes` states them.
fn eigenvalues(file: &Path) -> Vec<(f64, f64)> {
    let output = start(&["modes", "--json", &file.display().to_string()]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    let number = |mode: &Value, part: &str| mode["continuous"][part].as_f64().unwrap();
    let modes = report["modes"]["modes"].as_array().unwrap();
    modes.iter().map(|mode| (number(mode, "real"), number(mode, "imaginary"))).collect()
}

/// The linearisations of magnet and controller, joined by the scenario, have the eigenvalues of ems.
#[test]
fn analytic_modes_do_not_see_the_border() {
    for (whole, units) in [
        ("one-magnet.json", "one-magnet-controller.json"),
        ("one-bogie.json", "one-bogie-controllers.json"),
    ] {
        let (whole, mut units) = (eigenvalues(&scenario(whole)), eigenvalues(&scenario(units)));
        assert_eq!(whole.len(), units.len());
        for (re, im) in whole {
            let off = |&(a, b): &(f64, f64)| (a - re).hypot(b - im);
            let nearest = units.iter().enumerate().min_by(|a, b| off(a.1).total_cmp(&off(b.1)));
            let (k, found) = nearest.unwrap();
            assert!(off(found) < 1e-8 * re.hypot(im).max(1.0), "{re} {im}: {found:?}");
            units.swap_remove(k);
        }
    }
}

#[test]
fn issue_15_bad_values_of_magnet_and_controller_are_named() {
    for (setting, reason) in [
        ("ems_01.sample_time=0.001", "sample time (s) is 0.001, but must be zero with an external"),
        ("controller_01.nominal_gap=0", "nominal gap (m) is 0, but must be positive"),
        ("controller_01.filter_gap_cutoff=0", "cut-off of the gap filter (rad/s) is 0"),
        ("ems_01.external_controller=1", "1 is not a valid Boolean for ems_01.external_controller"),
        ("controller_01.gain_gap=high", "\"high\" is not a valid Real for controller_01.gain_gap"),
    ] {
        let file = scenario("one-magnet-controller.json");
        let error = FinishedRun::of(&file, &["--set", setting]).err().unwrap();
        assert!(error.contains(reason), "{setting}: {error}");
    }
}

/// Builds and packs examples/controllers/rust as its README says.
fn template(folder: &Path) -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let build = Command::new(cargo)
        .args(["build", "--release", "--package=state-feedback"])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(build.status.success(), "{}", String::from_utf8_lossy(&build.stderr));
    let (before, after) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    let built = system_tests::maglev().with_file_name(format!("{before}state_feedback{after}"));
    let description = fmi2_package::describe(&built, None).unwrap();
    let mut archive = fmi2_package::Archive::new(&description).unwrap();
    archive.binary(fmi2_package::host().unwrap(), &built).unwrap();
    let file = folder.join("state-feedback.fmu");
    archive.write(&file).unwrap();
    file
}

/// The template in Rust: conforms, starts at rest, is stable by its modes and by runs, and holds the gap
/// with the stiffness that its law says.
#[test]
fn analytic_the_template_in_rust_holds_the_gap() {
    let folder = tempfile::tempdir().unwrap();
    let unit = template(folder.path());
    let output = start(&["validate", "--dynamic", &unit.display().to_string()]).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    let own = |base: &str, name: &str| {
        let file = folder.path().join(name);
        let patch = json!({ "extends": scenario(base), "units": { "controller": unit } });
        fs::write(&file, patch.to_string()).unwrap();
        file
    };
    let bogie = own("one-bogie-controllers.json", "bogie.json");
    for (re, im) in eigenvalues(&bogie) {
        // the bogie's place along the track has no stiffness
        assert!(re < 1e-6, "{re} {im}");
    }
    let crossing = run(&bogie, &["--stop", "10", "--no-report"]);
    assert!(swing(&crossing) < 5e-6, "{:e}", swing(&crossing));
    let voltage = crossing["controller_01.voltage"].iter();
    assert!(voltage.fold(0.0, |most: f64, v| most.max(v.abs())) > 1e-3);
    let first = run(&bogie, &["--stop", "1", "--set", "vehicle.travel_speed=0", "--no-report"]);
    assert!(swing(&first) < 1e-6, "{:e}", swing(&first));

    // a magnet that starts with 95 % of its load: the static stiffness is kᵢ·k_gap/R − k_c
    let magnet = own("one-magnet-controller.json", "magnet.json");
    let mut text: Value = serde_json::from_slice(&fs::read(&magnet).unwrap()).unwrap();
    let base = fs::read(scenario("one-magnet-controller.json")).unwrap();
    let base: Value = serde_json::from_slice(&base).unwrap();
    text["connections"] = base["connections"].clone();
    for connection in text["connections"].as_array_mut().unwrap() {
        if connection["from"] == "vehicle.static_load_[01..01]" {
            connection["factor"] = 0.95.into();
        }
    }
    fs::write(&magnet, text.to_string()).unwrap();
    let settled =
        run(&magnet, &["--stop", "20", "--set", "guideway.chirp_on=false", "--no-report"]);
    let magnet = magnet::Magnet::new(magnet::MagnetParameters::default()).unwrap();
    let coil = magnet.electromagnet();
    let stiffness = coil.current_stiffness * 4000.0 / coil.resistance - coil.gap_stiffness;
    let wanted = 0.008 + 0.05 * 250.0 * 9.81 / stiffness;
    let last = *settled["vehicle.gap_01"].last().unwrap();
    // the girder rings out with 0.57 1/s, from 3 µm
    assert!((last - wanted).abs() < 1e-9, "{last} is not {wanted}");
}
