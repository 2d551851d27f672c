//! Steps of variable size.

use super::*;
use results::summary::ControlReport;
use scenario::algorithm::{Estimate, VariableStep};

/// Error of the positions at 1 s, and what the control reports, with spans of 20 ms.
fn controlled(
    estimate: Estimate,
    tolerance: f64,
    name: AlgorithmName,
    able: Capabilities,
) -> (f64, ControlReport) {
    let mut units = thrown(1);
    units.iter_mut().for_each(|unit| unit.able = able);
    let degree = 2;
    let mut exchange = Exchange::new(links(1), degree);
    exchange.start(0.0, &mut units).unwrap();
    let schedule = whole(name, [0, 1]);
    let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
    let all = estimate == Estimate::Doubling;
    let signals = exchange.signals_between(|a, b| all || schedule.extrapolates(a, b));
    let settings = VariableStep { tolerance, estimate, min_step: None };
    let mut control = Control::new(settings, degree, signals);
    let (span, mut seen) = (0.02, 0.0);
    for n in 0..50 {
        let begin = f64::from(n) * span;
        let mut after = |_: &Exchange, end: f64, size: f64| {
            assert!(size > 0.0 && end > seen);
            seen = end;
        };
        control
            .advance(&mut coupling, &mut exchange, &mut units, (begin, span), &mut after)
            .unwrap();
        // the steps end at the end of the span, except for the rounding of one sum
        assert!((seen - (begin + span)).abs() < 1e-15 + 4e-16 * seen);
    }
    (distance([units[0].x, units[1].x], exact(1.0)), *control.report())
}

/// The estimate falls with the third power of the step for the predictor, and up to the sixth for
/// doubling (positions are integrated twice within a step); the error after 1 s with the third at
/// least. So a tolerance of a thousandth gains at least 1000^(3/6) = 30, and costs no more than
/// 1000^(1/3) = 10 times as many steps; each within a factor of two for safety and limits.
#[test]
fn invariant_errors_follow_the_tolerance() {
    for (estimate, tolerance) in [(Estimate::Predictor, 1e-4), (Estimate::Doubling, 1e-8)] {
        for name in [JACOBI, SEIDEL, AlgorithmName::Iterated] {
            let (coarse, few) = controlled(estimate, tolerance, name, ABLE);
            let (fine, many) = controlled(estimate, tolerance / 1e3, name, ABLE);
            let message = format!("{estimate:?} {name:?}: {coarse:e} {few:?}, {fine:e} {many:?}");
            assert!(fine < coarse / 15.0, "{message}");
            assert!(many.accepted < 20 * few.accepted, "{message}");
            assert!(few.forced == 0 && many.forced == 0, "{message}");
            assert!(many.smallest < many.largest && many.largest < few.largest * 1.5, "{message}");
        }
    }
}

/// Units that cannot restore their state: every step is accepted, the control only changes the next
/// one, and nothing fails.
#[test]
fn invariant_control_without_saved_states_changes_only_the_next_step() {
    let able = Capabilities { restore: false, ..ABLE };
    let (error, report) = controlled(Estimate::Doubling, 1e-5, SEIDEL, able);
    let (best, _) = controlled(Estimate::Predictor, 1e-5, SEIDEL, ABLE);
    assert_eq!(report.rejected, 0);
    assert!(error < 10.0 * best, "{error:e} {best:e} {report:?}");
}

/// The residual of force times velocity of two masses that exchange position and velocity falls as
/// the extrapolation's error does: order 3 in the step for degree 2, so 8 for half the step.
#[test]
fn order_of_the_residual_energy_is_that_of_the_extrapolation() {
    let residual = |h: f64| {
        let mut units = thrown(1);
        let mut exchange = Exchange::new(links(1), 2);
        exchange.start(0.0, &mut units).unwrap();
        let schedule = whole(JACOBI, [0, 1]);
        let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
        let signals = exchange.signals_between(|a, b| schedule.extrapolates(a, b));
        let mut meter = PowerMeter::new(&[(signals[0], signals[1])], &signals);
        for n in 0..(1.0 / h).round() as u32 {
            let time = f64::from(n) * h;
            coupling.step(&mut exchange, &mut units, time, h).unwrap();
            meter.add(&exchange, time + h, h);
        }
        meter.report().unwrap()
    };
    let (coarse, fine) = (residual(2e-3), residual(1e-3));
    let order = (coarse.residual / fine.residual).log2();
    assert!((order - 3.0).abs() < SLACK, "{order} {coarse:?}");
    assert!(fine.net.abs() <= fine.residual && fine.residual < 1e-3 * fine.transmitted);
}
