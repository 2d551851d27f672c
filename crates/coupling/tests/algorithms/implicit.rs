//! Algorithms that iterate: order, stability, what they do with units that cannot save their state.

use super::*;
use results::summary::Iteration;
use scenario::algorithm::{Acceleration, JacobianSource};

const ITERATED: AlgorithmName = AlgorithmName::Iterated;
const NEWTON: AlgorithmName = AlgorithmName::Newton;

/// All inputs are interpolated: by the cubic Hermite polynomial where derivatives are on offer, so
/// order 4 whatever the extrapolation; else by a polynomial of degree m = max(N, 1) through values,
/// so order m + 1. Steps of 4 and 2 ms, since at order 4 rounding and the masses' own error come
/// close at 1 ms; ω h is 0.13 at most, so the slack stays.
#[test]
fn order_iterated_is_that_of_interpolation() {
    let truth = pushed_truth();
    for name in [ITERATED, NEWTON] {
        for (offered, degree, expected) in
            [(1, 0, 4.0), (1, 2, 4.0), (0, 0, 2.0), (0, 1, 2.0), (0, 2, 3.0), (0, 3, 4.0)]
        {
            let error =
                |h| distance(positions(&whole(name, [0, 1]), pushed(offered), degree, h), truth);
            let observed = (error(4e-3) / error(2e-3)).log2();
            let message = format!("{name:?} d={offered} N={degree}: {observed:.3}");
            assert!((observed - expected).abs() < SLACK, "{message}");
        }
    }
}

/// A start with motion costs no order: interpolation needs no history.
#[test]
fn order_iterated_is_not_limited_by_the_start() {
    for name in [ITERATED, NEWTON] {
        let error = |h| distance(positions(&whole(name, [0, 1]), thrown(1), 2, h), exact(1.0));
        let observed = (error(4e-3) / error(2e-3)).log2();
        assert!((observed - 4.0).abs() < SLACK, "{name:?}: {observed:.3}");
    }
}

/// A unit that cannot save its state steps once, on extrapolated inputs: the order of the extrapolation.
#[test]
fn order_of_iterations_with_a_unit_without_saved_states_is_that_of_extrapolation() {
    let truth = pushed_truth();
    for name in [ITERATED, NEWTON] {
        let mut units = pushed(1);
        units[0].able.restore = false;
        let observed = order(&whole(name, [0, 1]), &units, 1, truth);
        assert!((observed - 2.0).abs() < SLACK, "{name:?}: {observed:.3}");
    }
}

/// A tank that passes on what comes in at once, and more: y = g u + c. Two of them are a loop of
/// feed-through with the gain g₁ g₂.
struct Tank {
    gain: f64,
    offset: f64,
    input: f64,
    output: f64,
    able: Capabilities,
}

impl Unit for Tank {
    type Error = ();

    fn capabilities(&self) -> Capabilities {
        self.able
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
        self.input = inputs.reals[0][0] + inputs.reals[0][1] * 1e-2;
        Ok(())
    }

    fn step(&mut self, _time: f64, _size: f64) -> Result<(), ()> {
        self.output = self.gain * self.input + self.offset;
        Ok(())
    }

    fn receive(&mut self, _time: f64, outputs: &mut UnitValues) -> Result<(), ()> {
        outputs.reals[0][0] = self.output;
        Ok(())
    }

    fn directional(&mut self, _input: InputIndex, column: &mut [f64]) -> Result<(), ()> {
        column[0] = self.gain;
        Ok(())
    }
}

/// Output of the first tank after a step, and how the iteration went. Exact: (c₁ + g₁c₂)/(1 − g₁g₂).
fn loop_of_tanks(
    settings: IterationSettings,
    name: AlgorithmName,
    directional: bool,
) -> (f64, Iteration) {
    let able = Capabilities { directional, ..ABLE };
    let tank = |gain, offset| Tank { gain, offset, input: 0.0, output: 0.0, able };
    let mut units = [tank(-3.0, 1.0), tank(1.5, 2.0)];
    let mut exchange = Exchange::new(links(0), 1);
    exchange.start(0.0, &mut units).unwrap();
    let schedule = Schedule::whole(name, settings, vec![UnitIndex(0), UnitIndex(1)]);
    let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
    coupling.step(&mut exchange, &mut units, 0.0, 1e-2).unwrap();
    let iteration = *coupling.iterations().next().unwrap();
    (units[0].output, iteration)
}

/// A loop with a gain of −4.5, for which plain iteration diverges: accelerated iteration and Newton
/// solve it, a linear loop of one unknown within a few sweeps.
#[test]
fn analytic_loops_of_feed_through_are_solved() {
    let truth = (1.0 - 3.0 * 2.0) / (1.0 + 4.5);
    let base = IterationSettings { tolerance: 1e-10, ..IterationSettings::default() };
    for directional in [true, false] {
        for (name, acceleration, jacobian) in [
            (ITERATED, Acceleration::Anderson, JacobianSource::Steps),
            (ITERATED, Acceleration::Aitken, JacobianSource::Steps),
            (NEWTON, Acceleration::None, JacobianSource::Steps),
            (NEWTON, Acceleration::None, JacobianSource::Directional),
        ] {
            let settings = IterationSettings { acceleration, jacobian, ..base };
            let (output, iteration) = loop_of_tanks(settings, name, directional);
            assert!(iteration.settled && iteration.most <= 6, "{settings:?} {iteration:?}");
            assert!((output - truth).abs() < 1e-8, "{settings:?}: {output} {truth}");
        }
    }
    let plain = IterationSettings { acceleration: Acceleration::None, ..base };
    let (_, iteration) = loop_of_tanks(plain, ITERATED, true);
    assert!(!iteration.settled && iteration.unsettled == 1 && iteration.worst > 1.0);
}

/// Steps of 0.1 s, three radians of the fast mode: what is extrapolated to degree 2 grows
/// beyond what the energy allows, 100/ω or 10 m, within 100 steps; what iterates does not.
#[test]
fn invariant_iterations_are_stable_where_explicit_coupling_is_not() {
    let run = |name| {
        let mut units = thrown(1);
        let mut exchange = Exchange::new(links(1), 2);
        exchange.start(0.0, &mut units).unwrap();
        let mut coupling = Coupling::new(&whole(name, [0, 1]), &exchange, &Arc::default());
        let mut largest = 0.0;
        for n in 0..100 {
            coupling.step(&mut exchange, &mut units, f64::from(n) * 0.1, 0.1).unwrap();
            largest = f64::max(largest, units[0].x.abs().max(units[1].x.abs()));
        }
        largest
    };
    for name in [JACOBI, SEIDEL] {
        assert!(run(name) > 20.0, "{name:?} {}", run(name));
    }
    for name in [ITERATED, NEWTON] {
        assert!(run(name) < 10.0, "{name:?} {}", run(name));
    }
}

/// Iterating a group only: the rest keeps the order of its extrapolation, the whole its accuracy.
#[test]
fn order_of_groups_is_that_of_the_weaker_coupling() {
    let truth = pushed_truth();
    let units =
        |list: &[usize]| -> Vec<UnitIndex> { list.iter().copied().map(UnitIndex).collect() };
    let group = |name, members: &[usize]| StepGroup {
        name,
        iteration: IterationSettings::default(),
        members: units(members),
    };
    // each alone in a group: what the first takes from the second is extrapolated
    let apart = Schedule::grouped(
        &group(SEIDEL, &[]),
        &[group(ITERATED, &[0]), group(NEWTON, &[1])],
        &units(&[0, 1]),
    );
    let observed = order(&apart, &pushed(1), 1, truth);
    assert!((observed - 2.0).abs() < SLACK, "{observed:.3}");
    let (first, second) = (UnitIndex(0), UnitIndex(1));
    assert!(
        apart.interpolates(first, second)
            && apart.extrapolates(second, first)
            && !apart.extrapolates(first, second)
    );
    // together they are as the algorithm for all
    let together =
        Schedule::grouped(&group(SEIDEL, &[]), &[group(ITERATED, &[1, 0])], &units(&[0, 1]));
    assert_eq!(together.groups, [group(ITERATED, &[0, 1])]);
    // a sequence stays one sequence around a group
    let mixed = Schedule::grouped(
        &group(SEIDEL, &[]),
        &[group(ITERATED, &[3, 2])],
        &units(&[0, 1, 2, 3, 4]),
    );
    let members: Vec<Vec<UnitIndex>> = mixed.groups.into_iter().map(|it| it.members).collect();
    assert_eq!(members, [units(&[0, 1]), units(&[2, 3]), units(&[4])]);
}
