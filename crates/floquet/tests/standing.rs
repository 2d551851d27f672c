//! The standing train: the same modes as `maglev modes` finds by joining the units' linearisations.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::path::Path;

use floquet::{Accuracy, MovingTrain};
use linear::{Linearised, eigenvalues};
use master::Setup;
use scenario::{Override, Scenario};

/// One bogie in the middle of its span. Left out of the moving system is only the slope of the bent girder under a
/// magnet that shifts along it, 1e-6 of an eigenvalue here.
#[test]
fn analytic_at_standstill_the_modes_are_those_of_the_joined_units() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let mut scenario = Scenario::load(&root.join("scenarios/one-bogie.json")).unwrap();
    for (target, value) in [("vehicle.initial_position", "12.5"), ("vehicle.travel_speed", "0")] {
        scenario.overrides.push(Override { target: target.into(), value: value.into() });
    }
    let setup = Setup::new(&scenario).unwrap();
    let joined =
        eigenvalues(&Linearised::at_start(&setup).unwrap().system.matrix().unwrap()).unwrap();
    let train = MovingTrain::read(&scenario, Accuracy::default()).unwrap();
    // the magnets are symmetric about the middle of the span
    let place = 12.5 + 0.5 * train.train.length() + train.row.reach;
    let moving = eigenvalues(&train.standing(place)).unwrap();
    let mut compared = 0;
    for value in moving.iter().filter(|it| it.im > 0.0) {
        let nearest = joined.iter().map(|it| (it - value).norm()).fold(f64::INFINITY, f64::min)
            / value.norm();
        // the span behind the bogie has no magnet, and its modes are those of an empty span: 7.1 and 24.9 Hz
        let hz = value.norm() / std::f64::consts::TAU;
        let empty = (hz - 7.1).abs() < 1e-6 || (hz - 24.9).abs() < 1e-6;
        assert!(nearest < 1e-5 || empty, "{value}: {nearest:.1e}");
        compared += usize::from(!empty);
    }
    assert!(compared > 20, "{compared}");
}
