//! Scenes of runs whose FMUs contain the layout files that ship, and little else.

use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use multibody::train;
use serde_json::{Value, json};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;
use results::ScenarioAsRun;
use results::Table;

/// A unit's archive that holds some files.
fn archive(path: &Path, files: &[(&str, &str)]) -> PathBuf {
    let mut archive = ZipWriter::new(File::create(path).unwrap());
    for (name, text) in files {
        archive.start_file(*name, SimpleFileOptions::default()).unwrap();
        archive.write_all(text.as_bytes()).unwrap();
    }
    archive.finish().unwrap();
    path.to_owned()
}

const DESCRIPTION: &str = r#"<fmiModelDescription fmiVersion="2.0" modelName="v" guid="1">
    <CoSimulation modelIdentifier="v"/><ModelVariables>
    <ScalarVariable name="initial_position" valueReference="0" causality="parameter" variability="fixed">
    <Real start="12.5"/></ScalarVariable>
    </ModelVariables><ModelStructure/></fmiModelDescription>"#;

/// Times of the runs below (s).
const TIMES: [f64; 3] = [0.0, 0.5, 1.0];

const GUIDEWAY: &str = include_str!("../../../../fmu-guideway/resources/one-bogie/guideway.json");

/// One bogie on one span, with some signals.
fn run(folder: &Path, signals: &[(&str, [f64; 3])], parameters: &Value) -> RunResults {
    run_on(GUIDEWAY, folder, signals, parameters)
}

/// The same on a guideway of one's own.
fn run_on(
    guideway: &str,
    folder: &Path,
    signals: &[(&str, [f64; 3])],
    parameters: &Value,
) -> RunResults {
    run_along(guideway, None, folder, signals, parameters)
}

/// The same along a line.
fn run_along(
    guideway: &str,
    line: Option<&str>,
    folder: &Path,
    signals: &[(&str, [f64; 3])],
    parameters: &Value,
) -> RunResults {
    let vehicle = train::one_bogie().to_json().unwrap();
    let mut files =
        vec![("resources/vehicle.json", vehicle.as_str()), ("modelDescription.xml", DESCRIPTION)];
    files.extend(line.map(|text| ("resources/line.json", text)));
    let vehicle = archive(&folder.join("v.fmu"), &files);
    let guideway = archive(&folder.join("g.fmu"), &[("resources/guideway.json", guideway)]);
    let scenario = json!({
        "units": {"a": vehicle, "b": guideway},
        "instances": {
            "train": {"unit": "a", "parameters": parameters},
            "bridge": {"unit": "b"},
        },
    });
    let table = Table {
        names: signals.iter().map(|it| it.0.to_owned()).collect(),
        time: TIMES.to_vec(),
        columns: signals.iter().map(|it| it.1.to_vec()).collect(),
    };
    RunResults {
        verdicts: Vec::new(),
        folder: folder.to_owned(),
        summary: Value::Null,
        signals: Default::default(),
        scenario: Some(ScenarioAsRun::parse(scenario.to_string()).unwrap()),
        modes: None,
        response: None,
        table,
    }
}

/// The scene as the page gets it, and its arrays.
fn seen(run: &RunResults) -> (Value, Arrays) {
    let mut arrays = Arrays::default();
    let scene = build(run, 3000, &mut arrays).unwrap().unwrap();
    (serde_json::to_value(scene).unwrap(), arrays)
}

fn assert_close(values: &[f64], expected: &[f64]) {
    assert_eq!(values.len(), expected.len());
    for (value, expected) in values.iter().zip(expected) {
        // 32-bit floats
        assert!((value - expected).abs() <= 1e-6 * expected.abs() + 1e-12, "{values:?}");
    }
}

/// u(L/2) = q₁ and u(L/4) = q₁/√2 + q₂ for the two sine modes.
#[test]
fn analytic_two_recorded_points_tell_two_modes() {
    let folder = tempfile::tempdir().unwrap();
    let (q1, q2) = ([-2e-3, -1e-3, 0.0], [1e-4, 0.0, -3e-4]);
    let quarter: [f64; 3] = std::array::from_fn(|k| q1[k] * 0.5_f64.sqrt() + q2[k]);
    let signals =
        [("bridge.midspan_displacement_01", q1), ("bridge.quarter_displacement_01", quarter)];
    let (scene, arrays) = seen(&run(folder.path(), &signals, &json!({})));
    let span = &scene["spans"][0];
    assert_eq!((&span["start"], &span["end"]), (&json!(0.0), &json!(25.0)));
    for (mode, expected) in [q1, q2].iter().enumerate() {
        assert_close(&arrays.read(&span["modes"][mode]), expected);
        let shape = span["shapes"][mode].as_array().unwrap();
        for (n, value) in shape.iter().enumerate() {
            let x = n as f64 / (shape.len() - 1) as f64;
            let phi = ((mode + 1) as f64 * std::f64::consts::PI * x).sin();
            assert!((value.as_f64().unwrap() - phi).abs() < 1e-12);
        }
    }
}

/// Tables may have their nodes where the deflection is recorded: there is no dividing by those. Shapes by
/// their values at 0, L/4, L/2, 3L/4 and L.
#[test]
fn issue_girders_with_tabulated_shapes_are_drawn_by_interpolation() {
    let folder = tempfile::tempdir().unwrap();
    let (u, w) = ([-2e-3, -1e-3, 0.0], [-1e-3, 1e-4, 3e-4]);
    let middle = ("bridge.midspan_displacement_01", u);
    let quarter = ("bridge.quarter_displacement_01", w);
    let drawn = |first: [f64; 5], second: [f64; 5], signals: &[(&str, [f64; 3])]| {
        let mut guideway: Value = serde_json::from_str(GUIDEWAY).unwrap();
        let girder = guideway["girders"].as_object_mut().unwrap().values_mut().next().unwrap();
        let length = girder["length"].as_f64().unwrap();
        let x: Vec<f64> = (0..5).map(|k| f64::from(k) * length / 4.0).collect();
        let shape = |phi: [f64; 5]| json!({"modal_mass": 3e4, "x": x, "phi": phi});
        girder["shapes"] = json!([shape(first), shape(second)]);
        girder.as_object_mut().unwrap().remove("mass_per_length");
        let run = run_on(&guideway.to_string(), folder.path(), signals, &json!({}));
        let (scene, arrays) = seen(&run);
        let span = scene["spans"][0].clone();
        let modes = span["modes"].as_array().unwrap().iter().map(|it| arrays.read(it)).collect();
        let shapes = span["shapes"].as_array().unwrap().clone();
        let at_quarter: Vec<f64> = shapes.iter().map(|it| it[16].as_f64().unwrap()).collect();
        let values: Vec<Vec<f64>> = modes;
        (values, at_quarter, scene["missing"].to_string())
    };
    let (wave, arch, nodes) =
        ([0.0, 1.0, 0.0, -1.0, 0.0], [0.0, 0.7, 1.0, 0.7, 0.0], [0.0, 0.5, 0.0, 0.5, 0.0]);
    // a wave first: the middle tells the arch, the quarter what is left
    let (modes, _, missing) = drawn(wave, arch, &[middle, quarter]);
    assert_close(&modes[0], &std::array::from_fn::<f64, 3, _>(|k| w[k] - 0.7 * u[k]));
    assert_close(&modes[1], &u);
    assert!(!missing.contains("modes"), "{missing}");
    // the middle alone tells nothing of the wave
    let (modes, shapes, missing) = drawn(wave, arch, &[middle]);
    assert_eq!((modes.len(), shapes), (1, vec![0.7]));
    assert_close(&modes[0], &u);
    assert!(missing.contains("1 of 2 modes, because the others have nodes"), "{missing}");
    // both have a node in the middle: the quarter tells the lower one
    let (modes, shapes, _) = drawn(wave, nodes, &[middle, quarter]);
    assert_eq!((modes.len(), shapes), (1, vec![1.0]));
    assert_close(&modes[0], &w);
    // and the middle alone tells nothing at all
    let (modes, _, missing) = drawn(wave, nodes, &[middle]);
    assert!(modes.is_empty() && missing.contains("drawn straight"), "{missing}");
}

/// A quarter of a circle of 20 m to the left: the line turns about (0, 20, 0).
#[test]
fn analytic_the_line_is_laid_out_in_space() {
    let line = r#"{"name": "bend", "start": 0, "plan": [{"kind": "straight", "length": 10},
        {"kind": "clothoid", "length": 1e-3, "to_radius": 20}, {"kind": "circle", "length": 40, "radius": 20}, {"kind": "clothoid", "length": 1e-3}]}"#;
    let folder = tempfile::tempdir().unwrap();
    let run = run_along(GUIDEWAY, Some(line), folder.path(), &[], &json!({}));
    let (scene, arrays) = seen(&run);
    let (start, step) =
        (scene["line"]["start"].as_f64().unwrap(), scene["line"]["step"].as_f64().unwrap());
    let points = arrays.read(&scene["line"]["points"]);
    let mut turned = 0;
    for (k, point) in points.chunks_exact(12).enumerate() {
        let s = start + step * k as f64;
        let angle = (s - 10.0) / 20.0;
        if (0.1..1.9).contains(&angle) {
            let (sin, cos) = angle.sin_cos();
            let place = [10.0 + 20.0 * sin, 20.0 * (1.0 - cos), 0.0];
            let expected = [place, [cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]].concat();
            assert!(point.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 2e-3), "{point:?}");
            turned += 1;
        }
    }
    // every half metre of 36 m
    assert!(turned > 60, "{turned}");
    let (straight, _) = seen(&run_along(GUIDEWAY, None, folder.path(), &[], &json!({})));
    assert_eq!(straight["line"], Value::Null);
}

/// φ₁ = sin πx/L of both components, scaled to the recorded middle.
#[test]
fn analytic_a_girder_shifts_and_twists_with_its_middle() {
    let mut guideway: Value = serde_json::from_str(GUIDEWAY).unwrap();
    let girder = guideway["girders"].as_object_mut().unwrap().values_mut().next().unwrap();
    girder["lateral"] = json!({"modes": 1, "frequencies": [8.0]});
    girder["torsion"] = json!({"modes": 1, "frequencies": [39.0], "polar_inertia": 3776.0});
    guideway["rails"] = json!({"height": 1.2});
    let folder = tempfile::tempdir().unwrap();
    let (shift, turn) = ([0.0, 1e-6, -2e-6], [0.0, 3e-6, 1e-6]);
    let signals = [("bridge.midspan_lateral_01", shift), ("bridge.midspan_twist_01", turn)];
    let (scene, arrays) = seen(&run_on(&guideway.to_string(), folder.path(), &signals, &json!({})));
    assert_eq!(scene["rail_height"], 1.2);
    for (component, values) in [("lateral", shift), ("twist", turn)] {
        let sway = &scene["spans"][0][component];
        assert_close(&arrays.read(&sway["values"]), &values);
        let shape = sway["shape"].as_array().unwrap();
        for (n, value) in shape.iter().enumerate() {
            let phi = (std::f64::consts::PI * n as f64 / (shape.len() - 1) as f64).sin();
            assert!((value.as_f64().unwrap() - phi).abs() < 1e-12);
        }
    }
    let (bare, _) = seen(&run_on(&guideway.to_string(), folder.path(), &[], &json!({})));
    assert_eq!(bare["spans"][0]["twist"], Value::Null);
    assert!(bare["missing"].to_string().contains("without lateral deflection or twist"));
}

/// With mid-span alone it is the first mode, and the view says so; with nothing it is straight.
#[test]
fn invariant_what_is_not_recorded_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let middle = [("bridge.midspan_displacement_01", [-2e-3; 3])];
    let (scene, arrays) = seen(&run(folder.path(), &middle, &json!({})));
    assert_eq!(scene["spans"][0]["modes"].as_array().unwrap().len(), 1);
    assert_close(&arrays.read(&scene["spans"][0]["modes"][0]), &[-2e-3; 3]);
    let missing = scene["missing"].to_string();
    assert!(missing.contains("1 of 2 modes"), "{missing}");
    assert!(missing.contains("8 of 8 gaps") && missing.contains("car_1_pitch"), "{missing}");
    let (bare, _) = seen(&run(folder.path(), &[], &json!({})));
    assert!(bare["missing"].to_string().contains("1 of 1 spans are drawn straight"));
    assert!(!bare["missing"].to_string().contains("smooth"));
}

#[test]
fn invariant_the_train_is_where_it_was_recorded_or_set_out_for() {
    let folder = tempfile::tempdir().unwrap();
    let position = |signals: &[(&str, [f64; 3])], parameters: Value| {
        let (scene, arrays) = seen(&run(folder.path(), signals, &parameters));
        arrays.read(&scene["position"])
    };
    // the unit's start value, the scenario's parameters, and magnet 3, at x = −0.35 m of the vehicle
    assert_close(&position(&[], json!({})), &[12.5; 3]);
    let moving = json!({"initial_position": -4.0, "travel_speed": 2.0});
    assert_close(&position(&[], moving.clone()), &[-4.0, -3.0, -2.0]);
    let recorded = [("train.position_03", [5.0, 6.0, 7.5])];
    assert_close(&position(&recorded, moving), &[5.35, 6.35, 7.85]);
}

/// Offsets y = 1 mm + 0.2 mrad·x along a side frame.
#[test]
fn analytic_a_frame_turns_with_its_magnets_offsets() {
    let folder = tempfile::tempdir().unwrap();
    let offset = |x: f64| [1e-3 + 2e-4 * x; 3];
    let signals = [
        ("train.lateral_offset_01", offset(1.05)),
        ("train.lateral_offset_02", offset(0.35)),
        ("train.lateral_offset_04", offset(-1.05)),
    ];
    let (scene, arrays) = seen(&run(folder.path(), &signals, &json!({})));
    assert_eq!(scene["groups"][0]["kind"], "frame");
    assert_close(&arrays.read(&scene["poses"][0]["lateral"]), &[1e-3; 3]);
    assert_close(&arrays.read(&scene["poses"][0]["yaw"]), &[2e-4; 3]);
}

/// The surface lies where the magnets met it: heights over recorded places.
#[test]
fn analytic_the_irregularity_is_laid_out_along_the_track() {
    let folder = tempfile::tempdir().unwrap();
    let signals =
        [("train.position_01", [10.0, 10.5, 11.0]), ("bridge.irregularity_01", [0.0, 5e-3, 0.0])];
    let (scene, arrays) = seen(&run(folder.path(), &signals, &json!({})));
    let profile = &scene["irregularity"][0];
    assert!((profile["start"].as_f64().unwrap() - 10.0).abs() < 1e-12);
    let up = [0.0, 1e-3, 2e-3, 3e-3, 4e-3, 5e-3];
    let expected: Vec<f64> = up.into_iter().chain(up.into_iter().rev().skip(1)).collect();
    assert_close(&arrays.read(&profile["values"]), &expected);
}

/// An irregularity that was there but not recorded is not passed over in silence.
#[test]
fn issue_an_irregularity_that_is_not_recorded_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut rough = run(folder.path(), &[], &json!({}));
    let text = rough.scenario.as_ref().unwrap().text();
    let mut scenario: Value = serde_json::from_str(text).unwrap();
    scenario["instances"]["bridge"]["parameters"] = json!({"irregularity_on": true});
    rough.scenario = Some(ScenarioAsRun::parse(scenario.to_string()).unwrap());
    let (scene, _) = seen(&rough);
    assert!(scene["missing"].to_string().contains("drawn smooth"), "{}", scene["missing"]);
}

#[test]
fn invariant_what_is_no_train_has_no_scene() {
    let folder = tempfile::tempdir().unwrap();
    let mut other = run(folder.path(), &[], &json!({}));
    other.scenario = None;
    assert!(build(&other, 3000, &mut Arrays::default()).unwrap().is_none());
    let unit = archive(&folder.path().join("m.fmu"), &[("modelDescription.xml", "")]);
    let scenario = json!({"units": {"m": unit}, "instances": {"m": {"unit": "m"}}});
    other.scenario = Some(ScenarioAsRun::parse(scenario.to_string()).unwrap());
    assert!(build(&other, 3000, &mut Arrays::default()).unwrap().is_none());
}

#[test]
fn issue_a_unit_that_is_gone_or_broken_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let lost = run(folder.path(), &[], &json!({}));
    archive(&folder.path().join("v.fmu"), &[("resources/vehicle.json", "{\"bodies\": 3}")]);
    let error = build(&lost, 3000, &mut Arrays::default()).unwrap_err().to_string();
    assert!(error.contains("v.fmu") && error.contains("vehicle.json"), "{error}");
    std::fs::remove_file(folder.path().join("v.fmu")).unwrap();
    let error = build(&lost, 3000, &mut Arrays::default()).unwrap_err().to_string();
    assert!(error.contains("v.fmu"), "{error}");
}
