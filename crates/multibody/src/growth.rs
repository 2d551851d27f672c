//! How the work of an evaluation grows with the train: counted, and timed pass by pass.

use std::time::Instant;

use crate::block::{Factorisation, Pivot};
use crate::{Holding, Loads, VehicleModel, train};

/// Multiplications with additions of a factorisation and of a solution.
fn operations(solver: &Factorisation) -> [usize; 2] {
    let (mut factor, mut solve) = (0, 0);
    for column in &solver.columns {
        let p = column.size.get();
        let sizes: Vec<usize> = solver.below
            [column.below.start as usize..column.below.end as usize]
            .iter()
            .map(|block| block.size.get())
            .collect();
        let rows: usize = sizes.iter().sum();
        // a leaf's L has three entries
        let triangle = if let Pivot::Leaf(_) = column.pivot { 3 } else { p * (p - 1) / 2 };
        if !matches!(column.pivot, Pivot::Leaf(_)) {
            factor += (0..p).map(|c| (p - c - 1) * (p - c + 2) / 2).sum::<usize>();
        }
        factor += rows * triangle + rows * p;
        for (k, m) in sizes.iter().enumerate() {
            // of a diagonal block, the lower triangle by pairs of rows
            factor += (0..*m).map(|c| m - c / 2 * 2).sum::<usize>() * p;
            factor += sizes[k + 1..].iter().map(|n| n * m * p).sum::<usize>();
        }
        solve += 2 * (triangle + p + rows * p);
    }
    [factor, solve]
}

/// From two cars on, every further car with its coupler brings the same work and the same memory, to
/// the last multiplication: the elimination makes no fill that grows with the train.
#[test]
fn invariant_work_grows_by_the_same_for_every_car() {
    let work = |cars: usize| {
        let model = VehicleModel::new(&train::cars(cars)).unwrap();
        let [factor, solve] = operations(&model.solver);
        let values = model.solver.storage;
        println!("{cars} cars: factorisation {factor}, solution {solve}, {values} values");
        [factor, solve, values]
    };
    let (two, four) = (work(2), work(4));
    for cars in [8, 16, 32] {
        let expected: [usize; 3] =
            std::array::from_fn(|k| two[k] + (cars - 2) * (four[k] - two[k]) / 2);
        assert_eq!(work(cars), expected, "{cars}");
    }
}

/// Microseconds per car of each pass of an evaluation, shortest of many rounds.
#[test]
#[ignore = "prints times: cargo test --release -p multibody --lib passes -- --ignored --nocapture"]
fn passes_of_an_evaluation() {
    println!(
        "cars  poses  forces  right-hand side  matrix, factors and solution  together  [µs per car]"
    );
    for cars in [1_u32, 2, 4, 8, 16, 32] {
        let model = VehicleModel::new(&train::cars(cars as usize)).unwrap();
        let mut ws = model.workspace();
        let flat = vec![0.0; model.counts().magnets];
        let state = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap().state;
        model.accelerations(&state, &Loads { vertical: &flat, lateral: &flat }, &mut ws).unwrap();
        let mut best = [f64::INFINITY; 4];
        for _ in 0..6000 / cars {
            let mut last = Instant::now();
            let mut lap = |k: usize| {
                let now = Instant::now();
                best[k] = best[k].min((now - last).as_secs_f64() * 1e6 / f64::from(cars));
                last = now;
            };
            model.set_kinematics(&state.bodies, &mut ws);
            lap(0);
            model.apply_forces(&mut ws);
            lap(1);
            model.applied(&mut ws);
            lap(2);
            model.factor_and_solve(0.0, &mut ws).unwrap();
            lap(3);
        }
        let [a, b, c, d] = best;
        println!("{cars:4} {a:6.2} {b:7.2} {c:16.2} {d:29.2} {:9.2}", a + b + c + d);
    }
}
