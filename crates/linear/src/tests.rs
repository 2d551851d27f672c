//! Linear units in place of real ones: a girder alone and with a mass on a spring at midspan.

use std::f64::consts::{PI, TAU};

use coupling::{InputIndex, Links, OutputIndex, RealLink, Schedule, UnitIndex};
use results::modes::CoupledModes;
use scenario::algorithm::{AlgorithmName, IterationSettings};

use super::*;

const FIRST: f64 = 9.0429;
const DAMPING: f64 = 0.01;

/// A unit of one input and one output, without matrices.
fn unit(name: &str, states: usize) -> LinearUnit {
    let quantity = |name: &str| Quantity { name: name.to_owned(), unit: None };
    LinearUnit {
        name: name.to_owned(),
        states: vec!["x".to_owned(); states],
        inputs: vec![quantity("u")],
        outputs: vec![quantity("y")],
        connected_inputs: 1,
        connected_outputs: 1,
        ..LinearUnit::default()
    }
}

/// Six modes of a simply supported girder, qₖ and rates. The even ones have a node at midspan, where force and
/// deflection are.
fn girder(stiffness: f64) -> LinearUnit {
    let (mut a, mut b, mut c) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..6 {
        let n = k as f64 + 1.0;
        let size = TAU * FIRST * n * n * stiffness.sqrt();
        let (q, rate) = (2 * k, 2 * k + 1);
        a.extend([(q, rate, 1.0), (rate, q, -size * size), (rate, rate, -2.0 * DAMPING * size)]);
        if k % 2 == 0 {
            let shape = (n * PI / 2.0).sin();
            b.push((rate, 0, shape / 34_760.0));
            c.push((0, q, shape));
        }
    }
    LinearUnit {
        a: Rows::new(12, &a),
        b: Rows::new(12, &b),
        c: Rows::new(1, &c),
        d: Rows::new(1, &[]),
        ..unit("girder", 12)
    }
}

/// A damped mass on a spring: input is the deflection under it, output the force on the girder.
fn mass() -> LinearUnit {
    let (mass, spring, damping) = (2000.0, 5e6, 1e4);
    LinearUnit {
        a: Rows::new(2, &[(0, 1, 1.0), (1, 0, -spring / mass), (1, 1, -damping / mass)]),
        b: Rows::new(2, &[(1, 0, spring / mass)]),
        c: Rows::new(1, &[(0, 0, spring)]),
        d: Rows::new(1, &[(0, 0, -spring)]),
        ..unit("mass", 2)
    }
}

fn modes_of(mut units: Vec<LinearUnit>, step: f64) -> Result<CoupledModes, LinearError> {
    let count = units.len();
    if let [alone] = units.as_mut_slice() {
        // its input is not connected
        alone.connected_inputs = 0;
    }
    let link = |unit| RealLink {
        input: InputIndex(0),
        unit: UnitIndex(unit),
        output: OutputIndex(0),
        factor: 1.0,
        offset: 0.0,
        limit: 3,
        degree: None,
        held: false,
        kinks: false,
    };
    let links = |unit| Links {
        reals: if count == 2 { vec![link(1 - unit)] } else { Vec::new() },
        offered: vec![1],
        ..Links::default()
    };
    let order = (0..count).map(UnitIndex).collect();
    let settings = IterationSettings::default();
    let stepping = Stepping {
        links: (0..count).map(links).collect(),
        degree: 2,
        schedule: Schedule::whole(AlgorithmName::GaussSeidel, settings, order),
        step,
    };
    let connections = stepping.connections();
    let system = LinearSystem { units, connections, ..LinearSystem::default() };
    modes::of(&Linearised {
        system,
        stepping,
        motions: Vec::new(),
        sources: Vec::new(),
        unreported: Vec::new(),
    })
}

/// A girder alone is stepped without error, so all its modes are found, with steps of 5 ms (three of them
/// above 100 Hz) and others, and no multiplier is left to the coupling.
#[test]
fn analytic_a_girder_alone_has_its_six_modes_at_every_step() {
    for step in [0.0005, 0.001, 0.005, 0.01, 0.5 / FIRST / (1.0 - DAMPING * DAMPING).sqrt()] {
        let found = modes_of(vec![girder(1.0)], step).unwrap();
        assert_eq!(found.modes.len(), 6);
        for mode in &found.modes {
            assert!(mode.relative_error.unwrap() < 1e-9, "{step}: {mode:?}");
        }
        assert_eq!(found.coupling_multiplier, 0.0, "{step}");
    }
}

/// With a mass at midspan at 5 ms, the even modes are still exact, the odd ones nearly so, and what is left
/// for the coupling is smaller than the multiplier of any of them.
#[test]
fn issue_modes_above_the_nyquist_frequency_of_a_coupled_girder_keep_theirs() {
    let found = modes_of(vec![girder(1.0), mass()], 0.005).unwrap();
    for mode in &found.modes {
        assert!(mode.relative_error.unwrap() < 0.02, "{mode:?}");
    }
    let exact = found.modes.iter().filter(|mode| mode.relative_error.unwrap() < 1e-9);
    assert_eq!(exact.count(), 3);
    assert!(found.stable && found.stepped_stable);
    // those of the girder's modes are above 0.9
    assert!(found.coupling_multiplier < 0.8, "{}", found.coupling_multiplier);
}

/// Girders that are so stiff that a step has hundreds of periods: computed in parts, without overflow, to
/// the same accuracy. Far stiffer ones are refused by name.
#[test]
fn issue_fast_units_are_no_algebraic_loop() {
    for stiffness in [1e4, 1e6] {
        let found = modes_of(vec![girder(stiffness)], 0.001).unwrap();
        for mode in found.modes.iter().filter(|mode| mode.stepped.is_some()) {
            assert!(mode.relative_error.unwrap() < 1e-9, "{stiffness}: {mode:?}");
        }
        // a mode that decays within a step has no multiplier
        assert!(found.modes.iter().filter(|mode| mode.stepped.is_some()).count() >= 4);
    }
    let text = modes_of(vec![girder(1e20)], 0.001).unwrap_err().to_string();
    assert!(text.contains("girder has an eigenvalue") && text.contains("too fast"), "{text}");
}
