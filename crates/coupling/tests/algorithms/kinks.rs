//! Signals whose slope jumps at every communication point.

use std::sync::Arc;

use super::*;

/// Gives the parabola n + τ + (τ − τ²)·(n + 1) on [n, n + 1]: its slope jumps at every whole n, where
/// the derivative is that from the left. Keeps what it is sent.
#[derive(Default)]
struct Pieces {
    time: f64,
    sent: Vec<Taylor>,
}

fn piece(n: f64, tau: f64) -> f64 {
    n + tau + (tau - tau * tau) * (n + 1.0)
}

impl Unit for Pieces {
    type Error = ();

    fn capabilities(&self) -> Capabilities {
        ABLE
    }

    fn send(&mut self, inputs: &UnitValues) -> Result<(), ()> {
        self.sent.extend(inputs.reals.first());
        Ok(())
    }

    fn step(&mut self, time: f64, size: f64) -> Result<(), ()> {
        self.time = time + size;
        Ok(())
    }

    fn receive(&mut self, _: f64, outputs: &mut UnitValues) -> Result<(), ()> {
        if let Some(output) = outputs.reals.first_mut() {
            // at the end of piece n − 1: value n, slope 1 − n
            *output = Taylor::cubic([self.time, 1.0 - self.time, 0.0, 0.0]);
        }
        Ok(())
    }
}

/// The greatest error of the input in the middle of three steps, interpolated.
fn error(kinks: bool) -> f64 {
    let link = RealLink { kinks, ..LINK };
    let links = vec![
        Links { offered: vec![1], ..Links::default() },
        Links { reals: vec![link], ..Links::default() },
    ];
    let mut units = [Pieces::default(), Pieces::default()];
    let mut exchange = Exchange::new(links, 2);
    exchange.start(0.0, &mut units).unwrap();
    let schedule = whole(SEIDEL, [0, 1]);
    let mut coupling = Coupling::new(&schedule, &exchange, &Arc::default());
    for n in 0..4 {
        coupling.step(&mut exchange, &mut units, f64::from(n), 1.0).unwrap();
    }
    let errors = units[1].sent.iter().zip(0_i32..).map(|(p, n)| {
        let n = f64::from(n);
        (p.value(0.5) - piece(n, 0.5)).abs().max((p.value(1.0) - piece(n, 1.0)).abs())
    });
    errors.fold(0.0, f64::max)
}

/// Announced, the pieces are exact: value at the beginning, value and slope at the end. Not announced,
/// the slope from before the kink enters.
#[test]
fn analytic_announced_kinks_leave_parabolas_exact() {
    assert!(error(true) < 1e-14, "{}", error(true));
    assert!(error(false) > 0.1, "{}", error(false));
}
