//! Quantities that are changed without another file: stiffness of groups, masses, loads, levelling.
#![allow(clippy::unwrap_used, clippy::panic)] // helpers outside the test functions

mod common;

use common::{G, body, empty};
use multibody::{
    Dimension, Equilibrium, Holding, ObservedIndex, Spring, VehicleDescription, VehicleModel, train,
};

/// The vehicle with some quantities changed.
fn with(base: &VehicleDescription, changes: &[(&str, f64)], levelling: bool) -> VehicleDescription {
    let quantities = base.adjustables().unwrap();
    let mut values: Vec<f64> = quantities.iter().map(|q| q.start).collect();
    for (name, value) in changes {
        let k = quantities.iter().position(|q| q.name == *name).unwrap_or_else(|| panic!("{name}"));
        values[k] = *value;
    }
    base.adjusted(&quantities, &values, levelling).unwrap()
}

/// At rest, held sideways by springs of 1e6 N/m at the magnets.
fn at_rest(description: &VehicleDescription) -> (VehicleModel, Equilibrium) {
    let model = VehicleModel::new(description).unwrap();
    let flat = vec![0.0; model.counts().magnets];
    let guidance = |_: f64, _: f64, offset: f64| [-1e6 * offset, 1e6];
    let mut ws = model.workspace();
    let found = model.guided_equilibrium(&flat, &Holding::default(), &guidance, &mut ws).unwrap();
    (model, found)
}

#[test]
fn golden_quantities_of_the_shipped_train() {
    let base = train::two_car();
    let all = base.adjustables().unwrap();
    let value = |name: &str| {
        let found = all.iter().find(|q| q.name == name).unwrap_or_else(|| panic!("{name}"));
        (found.start, found.dimension)
    };
    for (name, expected) in [
        ("car_1_mass", (7700.0, Dimension::Mass)),
        ("car_2_load_mass", (0.0, Dimension::Mass)),
        ("car_1_load_y", (0.0, Dimension::Length)),
        ("air_spring_vertical_stiffness", (62e3, Dimension::Stiffness)),
        ("air_spring_lateral_stiffness", (140e3, Dimension::Stiffness)),
        ("air_spring_longitudinal_damping", (1300.0, Dimension::Damping)),
        ("traction_rod_longitudinal_stiffness", (4e5, Dimension::Stiffness)),
        ("anti_roll_end_rotational_stiffness", (2e4, Dimension::RotationalStiffness)),
        ("anti_roll_end_rotational_damping", (60.0, Dimension::RotationalDamping)),
        ("table_centring_stiffness", (5e4, Dimension::Stiffness)),
        ("coupler_hinge_stiffness", (5e3, Dimension::RotationalStiffness)),
        ("coupler_hinge_damping", (100.0, Dimension::RotationalDamping)),
    ] {
        assert_eq!(value(name), expected, "{name}");
    }
    assert_eq!(all.len(), 2 * 7 + 6 + 2 + 2 + 2 + 2);
    let mut names: Vec<&str> = all.iter().map(|q| q.name.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all.len());
    // nothing changed is nothing changed
    assert_eq!(with(&base, &[], true), base);
}

/// Members that differ are changed by a factor, in their proportion.
#[test]
fn golden_a_group_whose_members_differ_has_a_factor() {
    let mut base = train::one_bogie();
    let k = base.bushings.iter().position(|b| b.name.contains("air_spring")).unwrap();
    base.bushings[k].translational_stiffness[2] = 70e3;
    let changed = with(&base, &[("air_spring_vertical_stiffness_factor", 2.0)], true);
    let stiffness = |d: &VehicleDescription, k: usize| d.bushings[k].translational_stiffness;
    assert_eq!(stiffness(&changed, k), [140e3, 140e3, 140e3]);
    let other = base.bushings.iter().rposition(|b| b.name.contains("air_spring")).unwrap();
    assert_eq!(stiffness(&changed, other), [140e3, 140e3, 124e3]);
}

/// Other stiffness, same rest: elements keep the load that they carry.
#[test]
fn invariant_stiffness_does_not_move_the_equilibrium() {
    let base = train::one_car();
    let (_, found) = at_rest(&base);
    let changes = [
        ("air_spring_vertical_stiffness", 90e3),
        ("air_spring_lateral_stiffness", 1e5),
        ("traction_rod_longitudinal_stiffness", 1e6),
        ("anti_roll_end_rotational_stiffness", 1e4),
        ("table_centring_stiffness", 1e5),
    ];
    let (_, stiffer) = at_rest(&with(&base, &changes, true));
    for (a, b) in found.loads.iter().zip(&stiffer.loads) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
    for (a, b) in found.state.bodies.iter().zip(&stiffer.state.bodies) {
        assert!((a.position - b.position).amax() < 1e-9);
    }
    // while a line spring changes its free length
    let mut hung = empty("hung");
    hung.bodies.push(body("mass", 10.0, [1.0; 3], [0.0, 0.0, -1.0]));
    hung.springs.push(Spring {
        name: "wire".to_owned(),
        body_a: "ground".to_owned(),
        position_a: [0.0; 3],
        body_b: "mass".to_owned(),
        position_b: [0.0, 0.0, -1.0],
        stiffness: 1000.0,
        damping: 0.0,
        free_length: Some(1.0 - 10.0 * G / 1000.0),
    });
    hung.groups.push(multibody::ElementGroup {
        name: "wire".to_owned(),
        springs: vec!["wire".to_owned()],
        ..Default::default()
    });
    let harder = with(&hung, &[("wire_stiffness", 4000.0)], true);
    let free = harder.springs[0].free_length.unwrap();
    assert!((4000.0 * (1.0 - free) - 98.1).abs() < 1e-9);
    let soft = hung.adjustables().unwrap();
    let text = hung.adjusted(&soft, &[50.0, 0.0], true).unwrap_err().to_string();
    assert!(text.contains("springs[0]") && text.contains("wire_stiffness"), "{text}");
}

/// 3 t beside the middle of the first car, on levelled springs: the cars stay level, the magnets carry the
/// weight, and the moments of their loads about the track's middle are those of the load.
#[test]
fn analytic_an_eccentric_load_on_levelled_springs() {
    for name in ["one-car", "two-car", "3-cars"] {
        let base = train::by_name(name).unwrap();
        let (bare, unloaded) = at_rest(&base);
        let changes = [
            ("car_1_load_mass", 3000.0),
            ("car_1_load_x", 2.0),
            ("car_1_load_y", 0.4),
            ("car_1_load_z", 0.3),
        ];
        let (model, found) = at_rest(&with(&base, &changes, true));
        let weight = 3000.0 * G;
        let sum: f64 = found.loads.iter().sum();
        assert!((sum - model.total_mass() * G).abs() < 1e-6, "{name}: {sum}");
        let moment = |axis: usize| -> f64 {
            let added = found.loads.iter().zip(&unloaded.loads).map(|(a, b)| a - b);
            added.zip(&base.magnets).map(|(load, magnet)| load * magnet.position[axis]).sum()
        };
        let car = base.bodies.iter().find(|b| b.name == "car_1").unwrap().position[0];
        // bodies of 370 kN and more move sideways and along by micrometres
        assert!((moment(1) - weight * 0.4).abs() < 2.0, "{name}: {} N·m", moment(1));
        assert!((moment(0) - weight * (car + 2.0)).abs() < 2.0, "{name}: {} N·m", moment(0));
        let pose = |model: &VehicleModel, state| {
            let [roll, pitch, _] = model.observed_attitude(state, ObservedIndex(0));
            [model.observed_motion(state, ObservedIndex(0)).displacement.z, roll, pitch]
        };
        let (before, after) = (pose(&bare, &unloaded.state), pose(&model, &found.state));
        for (a, b) in before.iter().zip(after) {
            assert!((a - b).abs() < 1e-7, "{name}: {before:?} {after:?}");
        }
    }
}

/// Without levelling the car sinks by m g/Σk, and leans towards the load.
#[test]
fn analytic_a_load_on_fixed_springs_compresses_them() {
    let base = train::one_car();
    let (model, found) = at_rest(&with(&base, &[("car_1_load_mass", 3000.0)], false));
    let sunk = -model.observed_motion(&found.state, ObservedIndex(0)).displacement.z;
    assert!((sunk - 3000.0 * G / (16.0 * 62e3)).abs() < 1e-9, "{sunk} m");
    let aside = [("car_1_load_mass", 1000.0), ("car_1_load_y", 0.5)];
    let (model, found) = at_rest(&with(&base, &aside, false));
    let roll = model.observed_attitude(&found.state, ObservedIndex(0))[0];
    // left side down; 16 springs at 0.95 m hold against it, and the load above them adds some
    let stiff = 1000.0 * G * 0.5 / (16.0 * 62e3 * 0.95 * 0.95);
    assert!(-roll > stiff && -roll < 1.5 * stiff, "{roll} rad, {stiff}");
    // a lighter car body rises
    let (model, found) = at_rest(&with(&base, &[("car_1_mass", 6700.0)], false));
    let risen = model.observed_motion(&found.state, ObservedIndex(0)).displacement.z;
    assert!((risen - 1000.0 * G / (16.0 * 62e3)).abs() < 1e-9, "{risen} m");
    // and on levelled springs stays
    let (model, found) = at_rest(&with(&base, &[("car_1_mass", 6700.0)], true));
    assert!((model.total_mass() - 17_800.0).abs() < 1e-9);
    assert!(model.observed_motion(&found.state, ObservedIndex(0)).displacement.z.abs() < 1e-9);
}

/// A car body of several segments: its mass is theirs together, and a load stands on the nearest.
#[test]
fn invariant_segments_share_the_mass_of_their_car() {
    let base = VehicleDescription::from_json(
        r#"{"train": {"cars": 1, "flexible_body": {"bending_frequency": 9, "torsion_frequency": 12}}}"#,
    )
    .unwrap();
    let all = base.adjustables().unwrap();
    let mass = all.iter().find(|q| q.name == "car_1_mass").unwrap().start;
    assert!((mass - 7700.0).abs() < 1e-9, "{mass}");
    let heavy = with(
        &base,
        &[("car_1_mass", 8700.0), ("car_1_load_mass", 500.0), ("car_1_load_x", 4.9)],
        true,
    );
    let model = VehicleModel::new(&heavy).unwrap();
    assert!((model.total_mass() - 18_800.0 - 1500.0).abs() < 1e-9);
    let bracket = heavy.joints.iter().find(|j| j.name == "car_1_load").unwrap();
    assert_eq!(bracket.body_a, "car_1_segment_1");
    let (model, found) = at_rest(&heavy);
    let sum: f64 = found.loads.iter().sum();
    assert!((sum - model.total_mass() * G).abs() < 1e-6);
}
