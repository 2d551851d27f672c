//! The generator of trains: counts, masses and loads by formulae in the number of cars.

use multibody::{Holding, JointKind, VehicleModel, train};

/// Per car: body, 4 boxes, 10 tables, 8 side frames, 8 motors, 16 beams; 10 links between two cars;
/// one body for the guideway. At two cars these are table 1's 105 bodies, 121 joints and 38,000 kg.
#[test]
fn analytic_counts_of_trains_of_one_to_32_cars() {
    for n in 1..=32 {
        let model = VehicleModel::new(&train::cars(n)).unwrap();
        let counts = model.counts();
        let between = n - 1;
        assert_eq!(counts.bodies, 1 + 47 * n + 10 * between, "{n} cars");
        for (kind, number) in [
            (JointKind::Bracket, 1 + 12 * n),
            (JointKind::Translational, 10 * n),
            (JointKind::Spherical, 32 * n),
            (JointKind::Revolute, 12 * between),
        ] {
            assert_eq!(counts.joints[&kind], number, "{n} cars, {kind}");
        }
        assert_eq!(counts.equations, 6 * (1 + 12 * n) + 5 * (10 * n + 12 * between) + 3 * 32 * n);
        // each bogie 12 (two side frames and four beams: 36 − 24), each car 6 + 10 tables,
        // and each chain of links takes as many as it brings: 6·5 − 5·6
        assert_eq!(counts.degrees_of_freedom, (4 * 12 + 6 + 10) * n, "{n} cars");
        assert_eq!(counts.rank, counts.equations);
        assert_eq!(counts.composites, 35 * n + 10 * between);
        assert_eq!(counts.reduced_equations, 5 * (10 * n + 12 * between) + 3 * 32 * n);
        assert_eq!(counts.components, 4 * n + 1);
        assert_eq!(counts.magnets, 32 * n);
        assert_eq!(counts.force_elements, 64 * n + 10 * n + 12 * between);
        // sums of whole numbers are exact
        assert_eq!(model.total_mass(), 18_800.0 * n as f64 + 400.0 * between as f64, "{n} cars");
    }
}

/// The magnets carry the weight, as much on the left as on the right. A single car also stands as its
/// mirror image from front to rear; couplers, whose hinges change their axes along the chain, do not.
#[test]
fn analytic_loads_of_trains_carry_the_weight() {
    for n in [1, 2, 3, 8, 32] {
        let model = VehicleModel::new(&train::cars(n)).unwrap();
        let mut ws = model.workspace();
        let flat = vec![0.0; model.counts().magnets];
        let found = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap();
        let weight = 9.81 * model.total_mass();
        let sum: f64 = found.loads.iter().sum();
        // accelerations of up to 1e-8 m/s² are accepted as rest
        assert!((sum - weight).abs() <= 1e-8 * model.total_mass(), "{n} cars: {sum} of {weight} N");
        // per magnet 594 kg at that acceleration are 6e-6 N, and places that are accepted when right
        // to 1e-10 m are 1e-5 N of an air spring and 4e-5 N of a traction rod
        let magnet = |car: usize, bogie: usize, side: usize, k: usize| {
            found.loads[((car * 4 + bogie) * 2 + side) * 4 + k]
        };
        for (car, bogie, k) in
            (0..n).flat_map(|c| (0..4).flat_map(move |b| (0..4).map(move |k| (c, b, k))))
        {
            let left = magnet(car, bogie, 0, k);
            let right = magnet(car, bogie, 1, k);
            let mirrored = magnet(car, 3 - bogie, 0, 3 - k);
            let tolerance = 1e-4;
            assert!((left - right).abs() <= tolerance, "{n} cars: {left} and {right} N");
            let mirrored_too = n > 1 || (left - mirrored).abs() <= tolerance;
            assert!(mirrored_too, "one car: {left} and {mirrored} N");
        }
    }
}
