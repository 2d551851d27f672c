//! Integration schemes: observed order, and one limit for all.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

use multibody::{BodyState, Holding, LoadCourse, Scheme, VehicleDescription, VehicleModel, train};

/// Largest difference of the bogie's places and velocities after 96 ms in steps of h from those of
/// the classical scheme in steps of 0.25 ms, whose own error is some 1e-4 of theirs or less.
fn errors(scheme: Scheme, steps: &[f64]) -> Vec<f64> {
    let model = VehicleModel::new(&train::by_name("one-bogie").unwrap()).unwrap();
    let mut ws = model.workspace();
    let found = model.equilibrium(&[0.0; 8], &Holding::default(), &mut ws).unwrap();
    let vertical: Vec<[f64; 4]> = found
        .loads
        .iter()
        .enumerate()
        .map(|(k, l)| [l + 300.0 * (k as f64 + 1.0), 1e4, -1e6, 2e7])
        .collect();
    let lateral: Vec<[f64; 4]> = (0..8).map(|k| [400.0 * f64::from(k), -3e3, 1e5, 0.0]).collect();
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    let mut end = |scheme: Scheme, h: f64| {
        let model = model.clone().with_scheme(scheme);
        let mut state = found.state.clone();
        model.step(&mut state, 0.096, h, &course, &mut ws).unwrap();
        state
    };
    let exact = end(Scheme::Classical, 0.25e-3);
    let apart = |(a, b): (&BodyState, &BodyState)| {
        (a.position - b.position).amax().max((a.velocity - b.velocity).amax())
    };
    steps
        .iter()
        .map(|h| end(scheme, *h).bodies.iter().zip(&exact.bodies).map(apart).fold(0.0, f64::max))
        .collect()
}

/// Halving the step divides the error by 2 to the power of the order. The next term of the error is
/// a tenth at these steps, hence the margin of 0.4.
#[test]
fn order_of_each_scheme() {
    for (scheme, expected) in [(Scheme::Midpoint, 2.0), (Scheme::Heun, 3.0)] {
        let errors = errors(scheme, &[3e-3, 1.5e-3, 0.75e-3]);
        for pair in errors.windows(2) {
            let order = (pair[0] / pair[1]).log2();
            assert!((order - expected).abs() < 0.4, "{scheme:?} {errors:?} {order}");
        }
    }
}

/// The largest difference of all places and velocities after 0.2 s from those of a vehicle that factors every stage,
/// and from those in steps of a quarter.
fn kept(start: &VehicleDescription, push: f64) -> [f64; 2] {
    let model = VehicleModel::new(start).unwrap();
    let mut ws = model.workspace();
    let flat = vec![0.0; model.counts().magnets];
    let found = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap();
    let pushed =
        |(k, load): (usize, &f64)| [load + push * (k as f64 + 1.0), push * 100.0, 0.0, 0.0];
    let vertical: Vec<[f64; 4]> = found.loads.iter().enumerate().map(pushed).collect();
    let lateral = vec![[push, 0.0, 0.0, 0.0]; flat.len()];
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    let mut end = |above: f64, h: f64| {
        let model = model.clone().with_factors_kept_above(above);
        let mut state = found.state.clone();
        model.step(&mut state, 0.2, h, &course, &mut ws).unwrap();
        state.bodies
    };
    let every = end(f64::INFINITY, 4e-3);
    let largest = |others: Vec<BodyState>| {
        let apart = every
            .iter()
            .zip(&others)
            .map(|(a, b)| (a.position - b.position).amax().max((a.velocity - b.velocity).amax()));
        apart.fold(0.0, f64::max)
    };
    [largest(end(1.5e-3, 4e-3)), largest(end(f64::INFINITY, 1e-3))]
}

/// Kept factors change much less than the step does, but something: they are in use.
#[test]
fn invariant_kept_factors_change_less_than_the_step() {
    for name in ["one-bogie", "two-car"] {
        let [change, step] = kept(&train::by_name(name).unwrap(), 1.0);
        assert!(change > 0.0 && change < 0.1 * step, "{name} {change} {step}");
    }
}

/// Stages far from the last factors are factored: loads that move the bogie by 10 m/s² turn nothing into an error.
#[test]
fn invariant_far_stages_are_factored() {
    let [change, step] = kept(&train::by_name("one-bogie").unwrap(), 1e4);
    assert!(change < 0.1 * step, "{change} {step}");
}
