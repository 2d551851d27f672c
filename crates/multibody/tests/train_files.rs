//! Vehicle files that are a train: its numbers, its balance, its bending car bodies, changes by name.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

use std::f64::consts::TAU;

use multibody::{
    Holding, Loads, MagnetSprings, ObservedIndex, VehicleDescription, VehicleModel,
    natural_frequency, train,
};

fn read(text: &str) -> VehicleDescription {
    VehicleDescription::from_json(text).unwrap()
}

fn refusal(text: &str) -> String {
    VehicleDescription::from_json(text).unwrap_err().to_string()
}

/// Every key may be left out, and stands for the paper's train to the last bit.
#[test]
fn golden_an_empty_train_is_the_shipped_one() {
    let whole = train::two_car().to_json().unwrap();
    assert_eq!(read(r#"{"train": {}}"#).to_json().unwrap(), whole);
    // and so is one with all keys
    let spelled = serde_json::to_string(&train::TrainDescription::default()).unwrap();
    assert_eq!(read(&format!(r#"{{"train": {spelled}}}"#)).to_json().unwrap(), whole);
    let three = read(r#"{"train": {"cars": 3}}"#);
    assert_eq!(three, train::cars(3));
    // what is printed is read back as it was
    assert_eq!(read(&three.to_json().unwrap()), three);
}

/// Trains of other numbers: their counts by formula; the magnets carry the weight; every car stands where the
/// file has it, so the preloads balance it; nothing accelerates.
#[test]
fn analytic_trains_of_any_numbers_start_in_balance() {
    for [cars, bogies, magnets, springs] in
        [[3, 4, 4, 1], [1, 1, 2, 1], [2, 3, 5, 2], [4, 2, 3, 3], [2, 4, 1, 1], [1, 5, 8, 4]]
    {
        let case = format!("{cars} cars, {bogies} bogies, {magnets} magnets, {springs} springs");
        let description = read(&format!(
            r#"{{"train": {{"cars": {cars}, "bogies_per_car": {bogies}, "magnets_per_side": {magnets},
                "air_springs_per_corner": {springs}, "masses": {{"car_body": 9000}}}}}}"#
        ));
        let model = VehicleModel::new(&description).unwrap();
        let counts = model.counts();
        assert_eq!(counts.magnets, 2 * cars * bogies * magnets, "{case}");
        let bodies = 1 + cars * (1 + bogies + 2 * (bogies + 1) + 8 * bogies) + 10 * (cars - 1);
        assert_eq!(counts.bodies, bodies, "{case}");
        let air = description.bushings.iter().filter(|b| b.name.contains("air_spring"));
        assert_eq!(air.count(), 4 * cars * bogies * springs, "{case}");
        let mut ws = model.workspace();
        let flat = vec![0.0; counts.magnets];
        let found = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap();
        assert!(found.acceleration < 1e-9, "{case}: {}", found.acceleration);
        let sum: f64 = found.loads.iter().sum();
        assert!((sum - 9.81 * model.total_mass()).abs() < 1e-6, "{case}: {sum}");
        assert!(found.loads.iter().all(|load| *load > 0.0), "{case}");
        for k in 0..cars {
            let place = model.observed_motion(&found.state, ObservedIndex(k)).displacement;
            let attitude = model.observed_attitude(&found.state, ObservedIndex(k));
            // preloads are written to 1e-6 N; couplers hang between their hinges, which pull the cars
            // together by half a millimetre and turn them by 0.2 mrad
            let most = if cars == 1 { 1e-9 } else { 1e-3 };
            assert!(place.amax() < most, "{case}: car {k} off by {place}");
            assert!(place.z.abs() < 0.1 * most, "{case}: car {k} off by {place}");
            assert!(attitude.iter().all(|a| a.abs() < most), "{case}: {attitude:?}");
        }
    }
}

#[test]
fn refusal_of_bad_trains_has_path_and_reason() {
    let text = refusal(r#"{"trian": {"cars": 3}}"#);
    assert!(text.contains("`trian`") && text.contains("did you mean `train`?"), "{text}");
    for (train, parts) in [
        (r#"{"cars": 0}"#, &["train.cars", "1 to 100 cars, not 0"][..]),
        (r#"{"cars": -1}"#, &["train.cars", "-1"]),
        (r#"{"cars": 2.5}"#, &["train.cars", "2.5"]),
        (r#"{"cars": 1000000}"#, &["train.cars", "1000000"]),
        (r#"{"bogies_per_car": 0}"#, &["train.bogies_per_car", "1 to 20"]),
        (r#"{"magnets_per_side": 0}"#, &["train.magnets_per_side", "1 to 20"]),
        (r#"{"air_springs_per_corner": 0}"#, &["train.air_springs_per_corner", "1 to 8"]),
        (r#"{"masses": {"table": -70}}"#, &["train.masses.table", "positive", "-70 kg"]),
        (r#"{"masses": {"tabel": 70}}"#, &["train.masses", "did you mean `table`?"]),
        (r#"{"car": 3}"#, &["at `train.car`", "did you mean `cars`?", "line 1 column"]),
        (r#"{"nominal_gap": -0.008}"#, &["train.nominal_gap", "positive"]),
        (r#"{"nominal_gap": 0}"#, &["train.nominal_gap", "positive"]),
        (r#"{"cars": "2"}"#, &["train.cars", "text \"2\", expected a whole number"]),
        (
            r#"{"cars": 20, "bogies_per_car": 20, "magnets_per_side": 20}"#,
            &["`train`", "16000 magnets, but a vehicle has at most 4096"],
        ),
        (
            r#"{"cars": 100, "bogies_per_car": 20, "magnets_per_side": 1}"#,
            &["`train`", "23291 bodies, but a vehicle has at most 8192"],
        ),
        (r#"{"dimensions": {"half_gauge": 0.1}}"#, &["train.dimensions.half_gauge", "beams"]),
        (r#"{"dimensions": {"bogie_pitch": 0}}"#, &["train.dimensions", "positive"]),
        (r#"{"dimensions": {"car_gap": -0.3}}"#, &["train.dimensions.car_gap", "-0.3 m"]),
        (
            r#"{"air_spring": {"vertical_stiffness": 0}}"#,
            &["train.air_spring.vertical_stiffness", "positive"],
        ),
        (
            r#"{"traction_rod": {"longitudinal_damping": -1}}"#,
            &["train.traction_rod.longitudinal_damping"],
        ),
        (r#"{"flexible_body": {"bending_frequency": 9}}"#, &["flexible_body", "torsion_frequency"]),
        (
            r#"{"flexible_body": {"bending_frequency": 9, "torsion_frequency": 12, "segments": 3}}"#,
            &["train.flexible_body.segments", "even"],
        ),
        (
            r#"{"flexible_body": {"bending_frequency": 9, "torsion_frequency": 12, "damping": 2}}"#,
            &["train.flexible_body.damping", "between 0 and 1"],
        ),
        (
            r#"{"flexible_body": {"bending_frequency": -9, "torsion_frequency": 12}}"#,
            &["train.flexible_body.bending_frequency", "-9 Hz"],
        ),
        ("null", &["`train`", "null"]),
        ("3", &["`train`"]),
        (r#"{}, "trian": {}"#, &["`trian`"]),
    ] {
        let text = refusal(&format!(r#"{{"train": {train}}}"#));
        for part in parts {
            assert!(text.contains(part), "`{part}` is missing for {train}: {text}");
        }
    }
}

/// The other keys of the file change what the train expands to, by name; mistakes name the item.
#[test]
fn golden_a_train_is_changed_by_name() {
    let changed = read(
        r#"{"train": {"cars": 1}, "name": "mine",
            "bodies": [{"name": "car_1_equipment_2", "mass": 900.0}],
            "bushings": {"bogie_1_1_air_spring_*": {"translational_damping": [1300, 1300, 3200]}}}"#,
    );
    let mut expected = train::one_car();
    expected.name = "mine".to_owned();
    for body in expected.bodies.iter_mut().filter(|b| b.name == "car_1_equipment_2") {
        body.mass = 900.0;
    }
    let softer = |name: &str| name.starts_with("bogie_1_1_air_spring_");
    for bushing in expected.bushings.iter_mut().filter(|b| softer(&b.name)) {
        bushing.translational_damping[2] = 3200.0;
    }
    assert_ne!(expected, train::one_car());
    assert_eq!(changed, expected);
    for (file, parts) in [
        (
            r#"{"train": {}, "bodies": [{"name": "car_2_equipment_3", "mass": -1}]}"#,
            &["bodies[car_2_equipment_3].mass", "positive"][..],
        ),
        (r#"{"train": {}, "bodies": {"car_9": {"mass": 1}}}"#, &["bodies[car_9]", "inertia"]),
        (r#"{"train": {}, "bodies": {"car_9": null}}"#, &["bodies", "car_9"]),
        (r#"{"train": {}, "gravity": [0, 0, 9.81]}"#, &["gravity", "upward", "9.81 m/s²"]),
        (r#"{"train": {}, "bodys": []}"#, &["bodys", "did you mean `bodies`?"]),
        (
            r#"{"train": {}, "groups": [{"name": "coupler_hinge", "bushings": ["*"]}]}"#,
            &["give one of"],
        ),
    ] {
        let text = refusal(file);
        for part in parts {
            assert!(text.contains(part), "`{part}` is missing for {file}: {text}");
        }
    }
}

/// Patching a shipped file with a train would mix the bodies of both.
#[test]
fn refusal_of_a_train_beside_a_whole_vehicle() {
    let mut whole = serde_json::to_value(train::two_car()).unwrap();
    whole["train"] = serde_json::json!({"cars": 3});
    let text = refusal(&whole.to_string());
    assert!(text.contains("at `train`") && text.contains("replaces this one"), "{text}");
}

#[test]
fn refusal_of_bad_groups_and_observed_bodies_has_path_and_reason() {
    for (change, parts) in [
        (
            r#""groups": [{"name": "air_spring", "bushings": ["bogie_*_airspring_*"]}]"#,
            &["groups[air_spring].bushings[0]", "no bushing matches"][..],
        ),
        (r#""groups": [{"name": "Spring", "bushings": ["*"]}]"#, &["name", "lower-case"]),
        (r#""groups": [{"name": "all", "joint_forces": ["*"]}]"#, &["different kinds"]),
        (r#""groups": [{"name": "none"}]"#, &["groups[none]", "give one of"]),
        (
            r#""observed": [{"name": "car_1", "levelled_by": ["spring"]}]"#,
            &["observed[car_1].levelled_by[0]", "no bushing matches `spring`"],
        ),
        (r#""observed": [{"name": "car_1", "parts": ["roof"]}]"#, &["parts[0]", "`roof`"]),
        (
            r#""observed": [{"name": "car_1", "point_bodies": ["car_1"]}]"#,
            &["observed[car_1].point_bodies", "1 bodies for 4 points"],
        ),
    ] {
        let text = refusal(&format!(r#"{{"train": {{}}, {change}}}"#));
        for part in parts {
            assert!(text.contains(part), "`{part}` is missing for {change}: {text}");
        }
    }
}

/// The car body of a train alone, free and weightless.
fn body_alone(train: &str) -> VehicleDescription {
    let mut d = read(train);
    let is_part = |name: &str| name == "car_1" || name.starts_with("car_1_segment");
    d.bodies.retain(|b| is_part(&b.name));
    d.joints.retain(|j| is_part(&j.body_a) && is_part(&j.body_b));
    d.bushings.retain(|b| is_part(&b.body_a) && is_part(&b.body_b));
    d.joint_forces.clear();
    d.groups.clear();
    (d.drive, d.magnets, d.observed, d.gravity) = (None, Vec::new(), Vec::new(), [0.0; 3]);
    d
}

/// The free chain has the frequencies and damping ratios of the data, whatever the number of segments, and
/// the mass and moments of inertia of the rigid body.
#[test]
fn analytic_a_bending_car_body_has_the_frequencies_of_its_data() {
    for segments in [2, 4, 6, 10] {
        let model = VehicleModel::new(&body_alone(&format!(
            r#"{{"train": {{"cars": 1, "flexible_body": {{"bending_frequency": 9.0,
                "lateral_bending_frequency": 10.5, "torsion_frequency": 12.0, "damping": 0.03,
                "segments": {segments}}}}}}}"#
        )))
        .unwrap();
        assert_eq!(model.counts().bodies, segments + 1);
        assert!((model.total_mass() - 7700.0).abs() < 1e-9);
        let none = Loads { vertical: &[], lateral: &[] };
        let state = model.initial_state();
        let springs = MagnetSprings::default();
        let found = model.linearise(&state, &none, &springs, &mut model.workspace()).unwrap();
        let elastic: Vec<_> =
            found.eigenvalues.iter().filter(|v| natural_frequency(**v) > 1.0).collect();
        // three for each joint
        assert_eq!(elastic.len(), 3 * segments, "{segments}");
        for (expected, value) in [9.0, 10.5, 12.0].into_iter().zip(&elastic) {
            let frequency = natural_frequency(**value) / TAU;
            assert!((frequency / expected - 1.0).abs() < 1e-6, "{segments}: {frequency} Hz");
            let ratio = multibody::damping_ratio(**value);
            assert!((ratio - 0.03).abs() < 1e-6, "{segments}: {ratio}");
        }
    }
}

/// With many joints the chain is the uniform free beam, whose second bending frequency is (7.8532/4.7300)²
/// of its first. The car's depth adds rotary inertia, so a slender one is taken.
#[test]
fn analytic_a_bending_car_body_approaches_the_uniform_beam() {
    let second = |segments: usize| {
        let model = VehicleModel::new(&body_alone(&format!(
            r#"{{"train": {{"cars": 1, "dimensions": {{"car_width": 0.05, "car_height": 0.05}},
                "flexible_body": {{"bending_frequency": 5.0, "lateral_bending_frequency": 5.0,
                "torsion_frequency": 1000.0, "segments": {segments}}}}}}}"#
        )))
        .unwrap();
        let none = Loads { vertical: &[], lateral: &[] };
        let state = model.initial_state();
        let springs = MagnetSprings::default();
        let found = model.linearise(&state, &none, &springs, &mut model.workspace()).unwrap();
        let above = found.eigenvalues.iter().map(|v| natural_frequency(*v) / TAU);
        above.filter(|f| *f > 5.1).fold(f64::INFINITY, f64::min)
    };
    let exact = 5.0 * (7.853_204_624_1_f64 / 4.730_040_744_9).powi(2);
    let errors = [8, 16].map(|n| (second(n) / exact - 1.0).abs());
    assert!(errors[0] < 0.05 && errors[1] < 0.3 * errors[0], "{errors:?}");
}

/// Bending changes the outputs' values, not their number; and the train hangs as still as a rigid one.
#[test]
fn invariant_a_train_with_bending_cars_starts_in_equilibrium() {
    let flexible = read(
        r#"{"train": {"cars": 2, "flexible_body": {"bending_frequency": 9, "torsion_frequency": 12}}}"#,
    );
    let rigid = VehicleModel::new(&train::two_car()).unwrap();
    let model = VehicleModel::new(&flexible).unwrap();
    let listed = |model: &VehicleModel| -> Vec<(String, usize)> {
        model.observed().map(|(name, points)| (name.to_owned(), points)).collect()
    };
    assert_eq!(listed(&model), listed(&rigid));
    // each joint of the four in a car adds its three rotations
    let dof = |model: &VehicleModel| model.counts().degrees_of_freedom;
    assert_eq!(dof(&model), dof(&rigid) + 2 * 4 * 3);
    assert!((model.total_mass() - 38_000.0).abs() < 1e-9);
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 64], &Holding::default(), &mut ws).unwrap();
    assert!(found.acceleration < 1e-9, "{}", found.acceleration);
    let sum: f64 = found.loads.iter().sum();
    assert!((sum - 9.81 * 38_000.0).abs() < 1e-6);
    // the car bends under its own weight between its springs, by less than a millimetre
    let sag = model.observed_motion(&found.state, ObservedIndex(0)).displacement.z.abs();
    assert!(sag > 1e-8 && sag < 1e-3, "{sag} m");
    // equipment above a bogie stands on the segment there
    let box_of = |k: usize| {
        let name = format!("car_1_equipment_{k}");
        flexible.joints.iter().find(|j| j.name == name).unwrap().body_a.clone()
    };
    assert_eq!([1, 2, 3, 4].map(box_of), ["car_1_segment_2", "car_1", "car_1", "car_1_segment_4"]);
}

/// What a null removes must be there, also beside a train.
#[test]
fn issue_null_beside_a_train_removes_what_exists() {
    let with = |changes: &str| format!(r#"{{"train": {{"cars": 3}}, {changes}}}"#);
    assert_eq!(read(&with(r#""observed": {"car_3": null}"#)).observed.len(), 2);
    assert!(read(&with(r#""groups": null, "$schema": null"#)).groups.is_empty());
    for (changes, part) in [
        (r#""observed": {"car_4": null}"#, "`observed.car_4`: unknown name `car_4`"),
        (r#""observd": null"#, "`observd`: unknown field `observd`"),
        (r#""bushings": {"*.air": null}"#, "no item of the list matches"),
        (r#""bodies": null"#, "missing field `bodies`"),
    ] {
        let message = refusal(&with(changes));
        assert!(message.contains(part), "{message}");
    }
}
