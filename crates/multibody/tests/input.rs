//! Bad vehicle files: each refused with the place and what is wrong.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{body, empty, joint};
use multibody::{Error, JointKind, LoadCourse, VehicleDescription, VehicleModel, train};

fn complaint(change: impl FnOnce(&mut serde_json::Value)) -> String {
    let mut value = serde_json::to_value(train::one_bogie()).unwrap();
    change(&mut value);
    VehicleModel::from_json(&value.to_string()).unwrap_err().to_string()
}

fn assert_says(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "`{part}` is missing in: {text}");
    }
}

#[test]
fn invariant_bad_files_are_refused_with_their_json_path() {
    let text = complaint(|v| v["joints"][2]["body_b"] = "nobody".into());
    assert_says(&text, &["joints[2].body_b", "nobody"]);
    let text = complaint(|v| v["bodies"][3]["mass"] = (-5.0).into());
    assert_says(&text, &["bodies[3].mass", "positive", "-5"]);
    let text = complaint(|v| v["bodies"][1]["inertia"] = vec![1.0, -1.0, 1.0].into());
    assert_says(&text, &["bodies[1].inertia", "positive definite"]);
    let text = complaint(|v| v["bodies"][1]["inertia"] = vec![1.0, 1.0, 3.0].into());
    assert_says(&text, &["bodies[1].inertia", "exceeds the sum"]);
    let text = complaint(|v| v["bodies"][1]["name"] = v["bodies"][0]["name"].clone());
    assert_says(&text, &["bodies[1].name", "also the name of bodies[0]"]);
    let text = complaint(|v| v["bodies"][0]["colour"] = "red".into());
    assert_says(&text, &["bodies[0]", "colour"]);
    let text = complaint(|v| v["joints"][0]["axis"] = vec![0.0, 0.0, 0.0].into());
    assert_says(&text, &["joints[0].axis", "zero"]);
    let text = complaint(|v| v["joints"][0]["kind"] = "glue".into());
    assert_says(&text, &["joints[0].kind", "glue"]);
    let text = complaint(|v| v["bushings"][0]["rotational_stiffness"][1] = (-1.0).into());
    assert_says(&text, &["bushings[0].rotational_stiffness", "negative"]);
    let text = complaint(|v| v["magnets"][4]["body"] = "ground".into());
    assert_says(&text, &["magnets[4].body", "ground"]);
    let text = complaint(|v| v["joint_forces"][0]["joint"] = "none".into());
    assert_says(&text, &["joint_forces[0].joint", "none"]);
    let text = complaint(|v| v["bodies"][0]["position"] = vec![0.0, 1.0].into());
    assert_says(&text, &["bodies[0].position"]);
}

/// serde_json alone would take the object as the word that is its only key.
#[test]
fn refusal_a_kind_of_joint_is_a_word() {
    for kind in [serde_json::json!({ "spherical": null }), serde_json::json!(3)] {
        let text = complaint(|v| v["joints"][0]["kind"] = kind);
        assert_says(&text, &["joints[0].kind", "expected a text"]);
    }
}

/// A file of a whole vehicle is read directly, one with a byte order mark by way of a document.
#[test]
fn invariant_both_ways_to_read_a_file_give_the_same_vehicle() {
    for vehicle in [train::one_magnet(), train::two_car()] {
        let text = vehicle.to_json().unwrap();
        let direct = VehicleDescription::from_json(&text).unwrap();
        assert_eq!(VehicleDescription::from_json(&format!("\u{feff}{text}")).unwrap(), direct);
        assert_eq!(direct, vehicle);
    }
}

/// One damaged place a line: what is put there, and what the message has to contain.
#[test]
fn invariant_each_complaint_names_place_and_cure() {
    use serde_json::json;
    for (pointer, new, parts) in [
        // names
        ("/joints/1/body_a", json!("car1"), &["joints[1].body_a", "did you mean `car_1`?"][..]),
        ("/bushings/2/body_b", json!("nobody"), &["bushings[2].body_b", "no body", "`nobody`"]),
        ("/joints/0/body_b", json!("ground"), &["joints[0]", "both ends are on `ground`"]),
        ("/observed/0/body", json!("roof"), &["observed[0].body", "`roof`"]),
        ("/observed/0/name", json!("Car 1"), &["observed[0].name", "lower-case"]),
        (
            "/joint_forces/0/joint",
            json!("car_1_table_1_left_slid"),
            &["joint_forces[0].joint", "slide`?"],
        ),
        (
            "/joint_forces/0/joint",
            json!("guid"),
            &["joint_forces[0].joint", "did you mean `guide`?"],
        ),
        ("/bodies/2/name", json!("ground"), &["bodies[2].name", "reserved"]),
        ("/bodies/2/name", json!(""), &["bodies[2].name", "name is empty"]),
        (
            "/joints/3/name",
            json!("guide"),
            &["joints[3].name", "also the name of joints[0]", "rename"],
        ),
        (
            "/bushings/1/name",
            json!("bogie_1_1_beam_front_upper_left"),
            &["bushings[1].name", "also the name of bushings[0]"],
        ),
        // numbers
        ("/bodies/0/mass", json!(0.0), &["bodies[0].mass", "positive", "0 kg"]),
        (
            "/bodies/0/mass",
            json!("heavy"),
            &["bodies[0].mass", "\"heavy\"", "expected a number", "line"],
        ),
        ("/bodies/0/mass", json!(null), &["bodies[0].mass", "null"]),
        ("/gravity", json!(9.81), &["gravity", "expected an array of length 3"]),
        (
            "/bodies/0/inertia",
            json!([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            &["bodies[0].inertia", "symmetric"],
        ),
        (
            "/bodies/0/inertia",
            json!([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
            &["bodies[0].inertia", "positive definite", "-1"],
        ),
        (
            "/bodies/0/inertia",
            json!([1.0, 2.0]),
            &["bodies[0].inertia", "three principal moments", "three rows"],
        ),
        (
            "/bodies/0/orientation",
            json!([1.0, 1.0, 0.0, 0.0]),
            &["bodies[0].orientation", "unit quaternion", "1.414"],
        ),
        ("/joints/0/axis", json!([0.0, 0.0]), &["joints[0].axis", "length 3"]),
        ("/joints/0/axis", json!(null), &["joints[0]", "needs either `axis`"]),
        (
            "/joints/0/position",
            json!(null),
            &["joints[0]", "either `position`", "`local_a` and `local_b`"],
        ),
        ("/joints/0/local_a", json!([0.0, 0.0, 0.0]), &["joints[0]", "either `position`"]),
        (
            "/joint_forces/0/joint",
            json!("bogie_1_1_beam_front_upper_left"),
            &["joint_forces[0].joint", "no free coordinate"],
        ),
        (
            "/joint_forces/0/stiffness",
            json!(-1.0),
            &["joint_forces[0].stiffness", "negative", "-1"],
        ),
        ("/nominal_gap", json!(-0.008), &["nominal_gap", "negative"]),
        ("/nominal_gap", json!(8), &["nominal_gap", "metres"]),
        ("/magnets/3/body", json!("magnet"), &["magnets[3].body", "`magnet`"]),
        // shapes
        ("/bodies", json!([]), &["bodies", "at least one body"]),
        ("/bodies", json!({}), &["bodies", "expected a list"]),
        ("/joints/2", json!(7), &["joints[2]", "expected an object"]),
        (
            "/drive",
            json!({"bodies": ["car_1", "car_1"], "stiffness": 1.0, "damping": 1.0}),
            &["drive.bodies[1]", "also drive.bodies[0]"],
        ),
        (
            "/drive",
            json!({"bodies": ["car_1"], "stiffnes": 1.0}),
            &["drive.stiffnes", "unknown field `stiffnes`", "did you mean `stiffness`?"],
        ),
    ] {
        let text = complaint(|v| {
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            match v.pointer_mut(parent).unwrap() {
                serde_json::Value::Array(items) => items[key.parse::<usize>().unwrap()] = new,
                serde_json::Value::Object(fields) => drop(fields.insert(key.to_owned(), new)),
                other => panic!("{pointer}: {other}"),
            }
        });
        println!("{text}");
        assert_says(&text, parts);
    }
}

/// What no JSON value can express: numbers beyond the range, doubled and missing keys, no object.
#[test]
fn invariant_complaints_about_the_text_name_their_place() {
    let text = train::one_magnet().to_json().unwrap();
    for (old, new, parts) in [
        ("\"mass\":250.0", "\"mass\":1e400", &["bodies[0].mass", "out of range", "line 7"][..]),
        ("\"mass\":250.0", "\"mass\":NaN", &["bodies[0].mass", "expected", "line"]),
        ("\"mass\":250.0", "\"mass\":250.0,\"mass\":1.0", &["bodies[0]", "\"mass\" occurs twice"]),
        ("\"mass\":250.0,", "", &["bodies[0]", "missing field `mass`"]),
        (
            "\"gravity\"",
            "\"gravty\"",
            &["gravty", "unknown field `gravty`", "line 4", "did you mean `gravity`?"],
        ),
    ] {
        assert!(text.contains(old), "{old}");
        let error = VehicleModel::from_json(&text.replacen(old, new, 1)).unwrap_err().to_string();
        println!("{error}");
        assert_says(&error, parts);
    }
    for text in ["", "null", "[]", "{}", "\u{feff}{}", "{\"\": 1}"] {
        let error = VehicleModel::from_json(text).unwrap_err().to_string();
        println!("{error}");
        assert_says(&error, &["`$`", "line 1"]);
    }
}

/// Axes of any length are axes: nothing over- or underflows.
#[test]
fn invariant_axes_may_have_any_length() {
    let mut d = train::one_magnet();
    let wanted = VehicleModel::new(&d).unwrap();
    for length in [1e-300, 5e-324, 1e-9, 3.0, 1e200, f64::MAX] {
        d.joints[0].axis = Some([0.0, 0.0, length]);
        let model = VehicleModel::new(&d).unwrap();
        assert_eq!(model.counts(), wanted.counts());
    }
    d.joints[0].axis = Some([0.0, 0.0, f64::INFINITY]);
    assert_says(&VehicleModel::new(&d).unwrap_err().to_string(), &["joints[0].axis", "finite"]);
}

#[test]
fn invariant_truncated_text_is_refused() {
    let text = train::one_magnet().to_json().unwrap();
    for end in [0, 1, 50, text.len() / 2, text.len() - 3] {
        assert!(matches!(VehicleModel::from_json(&text[..end]), Err(Error::Read { .. })), "{end}");
    }
    assert!(matches!(VehicleModel::from_json(&format!("{text} x")), Err(Error::Read { .. })));
}

#[test]
fn invariant_written_files_read_back_the_same() {
    for name in train::NAMES {
        let description = train::by_name(name).unwrap();
        let back = VehicleDescription::from_json(&description.to_json().unwrap()).unwrap();
        assert_eq!(back, description);
    }
}

#[test]
fn invariant_joints_that_do_not_meet_are_named() {
    let mut d = empty("apart");
    d.bodies.push(body("a", 1.0, [1.0; 3], [0.0; 3]));
    d.bodies.push(body("b", 1.0, [1.0; 3], [1.0, 0.0, 0.0]));
    let mut ball = joint("ball", JointKind::Spherical, ["a", "b"], [0.0; 3], None);
    ball.position = None;
    ball.local_a = Some([0.5, 0.0, 0.0]);
    ball.local_b = Some([-0.4, 0.0, 0.0]);
    d.joints.push(ball);
    let text = VehicleModel::new(&d).unwrap_err().to_string();
    assert_says(
        &text,
        &["joints[0]", "`ball`", "1.000e-1 m apart", "(1.000e-1, 0.000e0, 0.000e0)"],
    );
    d.joints[0].local_b = Some([-0.5, 0.0, 0.0]);
    assert_eq!(VehicleModel::new(&d).unwrap().counts().degrees_of_freedom, 9);
}

/// Four parallel beams between two side frames tie pitch twice: lengths of parallel rods.
#[test]
fn invariant_redundant_parallel_beams_are_named() {
    let mut d = train::one_bogie();
    for joint in d.joints.iter_mut().filter(|j| j.kind == JointKind::Spherical) {
        let beam = d.bodies.iter().find(|b| b.name == joint.body_b).unwrap();
        // straighten the beam: its ends get the x of its middle
        joint.position = joint.position.map(|p| [beam.position[0], p[1], p[2]]);
    }
    let error = VehicleModel::new(&d).unwrap_err();
    let Error::Redundant(found) = &error else { panic!("{error}") };
    assert_eq!(found.len(), 1, "{error}");
    assert_says(&found[0].joint, &["beam"]);
    assert_says(&found[0].direction, &["translation along (0, 1, 0)"]);
    // all four beams take part, with both ends
    assert_eq!(found[0].together_with.len(), 7, "{error}");
}

#[test]
fn invariant_repeated_fixed_joints_are_named() {
    let mut d = empty("twice");
    d.bodies.push(body("a", 1.0, [1.0; 3], [0.0; 3]));
    d.bodies.push(body("b", 1.0, [1.0; 3], [1.0, 0.0, 0.0]));
    d.joints.push(joint("weld", JointKind::Bracket, ["a", "b"], [0.5, 0.0, 0.0], None));
    d.joints.push(joint("ball", JointKind::Spherical, ["b", "a"], [0.0; 3], None));
    assert_says(&VehicleModel::new(&d).unwrap_err().to_string(), &["`ball`", "already"]);
    d.joints[1] = joint("weld 2", JointKind::Bracket, ["b", "a"], [0.0; 3], None);
    assert_says(&VehicleModel::new(&d).unwrap_err().to_string(), &["`weld 2`", "already"]);
}

/// A planar four-bar with four parallel hinges: three equations too many in space.
#[test]
fn invariant_redundant_hinges_of_a_planar_loop_are_counted() {
    let y = Some([0.0, 1.0, 0.0]);
    let mut d = empty("four-bar");
    let moments = [0.1; 3];
    d.bodies.push(body("a", 1.0, moments, [0.0, 0.0, 0.5]));
    d.bodies.push(body("b", 1.0, moments, [0.5, 0.0, 1.0]));
    d.bodies.push(body("c", 1.0, moments, [1.0, 0.0, 0.5]));
    for (name, ends, at) in [
        ("1", ["ground", "a"], [0.0, 0.0, 0.0]),
        ("2", ["a", "b"], [0.0, 0.0, 1.0]),
        ("3", ["b", "c"], [1.0, 0.0, 1.0]),
        ("4", ["c", "ground"], [1.0, 0.0, 0.0]),
    ] {
        d.joints.push(joint(name, JointKind::Revolute, ends, at, y));
    }
    let error = VehicleModel::new(&d).unwrap_err();
    let Error::Redundant(found) = &error else { panic!("{error}") };
    assert_eq!(found.len(), 3, "{error}");
}

#[test]
fn invariant_forces_that_are_no_numbers_are_named() {
    let model = VehicleModel::new(&train::one_magnet()).unwrap();
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let course = LoadCourse { vertical: &[[f64::NAN, 0.0, 0.0, 0.0]], lateral: &[[0.0; 4]] };
    let error = model.step(&mut state, 1e-3, 1e-3, &course, &mut ws).unwrap_err();
    assert_says(&error.to_string(), &["the force on magnet 1", "t = 0 s"]);
    let fine = LoadCourse { vertical: &[[0.0; 4]], lateral: &[[0.0; 4]] };
    for size in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let mut state = model.initial_state();
        assert!(matches!(
            model.step(&mut state, size, 1e-3, &fine, &mut ws),
            Err(Error::Argument { .. })
        ));
    }
    let none = LoadCourse { vertical: &[], lateral: &[] };
    let mut state = model.initial_state();
    assert!(matches!(
        model.step(&mut state, 1e-3, 1e-3, &none, &mut ws),
        Err(Error::Argument { .. })
    ));
}

/// A slider-crank in its dead centre: stretched crank and coupler repeat what the guide does.
/// Started in it, the model is refused by name rather than stepped.
#[test]
fn invariant_singular_start_is_refused_by_name() {
    let y = Some([0.0, 1.0, 0.0]);
    let mut d = empty("folded");
    // crank and coupler stretched along x, the far end slides along z: neither can fix the other
    d.bodies.push(body("crank", 1.0, [0.01, 0.1, 0.1], [0.5, 0.0, 0.0]));
    d.bodies.push(body("coupler", 1.0, [0.01, 0.1, 0.1], [1.5, 0.0, 0.0]));
    d.bodies.push(body("slider", 1.0, [0.1; 3], [2.0, 0.0, 0.0]));
    d.joints.push(joint("pivot", JointKind::Revolute, ["ground", "crank"], [0.0; 3], y));
    d.joints.push(joint("knee", JointKind::Spherical, ["crank", "coupler"], [1.0, 0.0, 0.0], None));
    d.joints.push(joint("pin", JointKind::Spherical, ["coupler", "slider"], [2.0, 0.0, 0.0], None));
    d.joints.push(joint(
        "guide",
        JointKind::Translational,
        ["ground", "slider"],
        [2.0, 0.0, 0.0],
        Some([0.0, 0.0, 1.0]),
    ));
    let error = VehicleModel::new(&d).unwrap_err();
    let Error::Redundant(found) = &error else { panic!("{error}") };
    assert_eq!(found.len(), 1, "{error}");
    assert_says(&found[0].direction, &["translation along (1, 0, 0)"]);
}
