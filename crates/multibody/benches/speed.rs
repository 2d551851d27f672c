//! Time of one evaluation of eq. 9, one internal step and one simulated second, for trains of 1 to
//! 32 cars, with nanoseconds per body and the exponent of the growth: `cargo bench -p multibody`.
//!
//! Many short rounds, and the median of them: other work on the machine disturbs a part of the
//! rounds, seldom most of them. The shortest round stands beside it.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use multibody::{
    Error, Holding, LoadCourse, Loads, MagnetIndex, State, VehicleModel, Workspace, train,
};

const CARS: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Rounds for one car; trains get fewer.
const ROUNDS: usize = 4000;
/// Internal step, s.
const STEP: f64 = 1e-3;

/// Seconds that a piece of work takes.
#[derive(Clone, Copy)]
struct Time {
    median: f64,
    shortest: f64,
}

fn measure(
    rounds: usize,
    times: u32,
    mut work: impl FnMut() -> Result<(), Error>,
) -> Result<Time, Error> {
    let mut seconds = Vec::with_capacity(rounds);
    for _ in 0..rounds {
        let begin = Instant::now();
        for _ in 0..times {
            work()?;
        }
        seconds.push(begin.elapsed().as_secs_f64() / f64::from(times));
    }
    seconds.sort_by(f64::total_cmp);
    Ok(Time { median: seconds[rounds / 2], shortest: seconds[0] })
}

/// The vehicle with all magnets held by loads a little off the static ones.
struct Bench {
    model: VehicleModel,
    ws: Workspace,
    state: State,
    static_loads: Vec<f64>,
    vertical: Vec<[f64; 4]>,
    lateral: Vec<[f64; 4]>,
}

impl Bench {
    fn new(cars: usize) -> Result<Self, Error> {
        let model = VehicleModel::new(&train::cars(cars))?;
        let mut ws = model.workspace();
        let magnets = model.counts().magnets;
        let found = model.equilibrium(&vec![0.0; magnets], &Holding::default(), &mut ws)?;
        let vertical = found.loads.iter().map(|l| [*l, 0.0, 0.0, 0.0]).collect();
        Ok(Self {
            model,
            ws,
            state: found.state,
            static_loads: found.loads,
            vertical,
            lateral: vec![[0.0; 4]; magnets],
        })
    }

    /// One evaluation, in another pose each time, so that nothing remembered is used.
    fn evaluation(&mut self, rounds: usize) -> Result<Time, Error> {
        let flat = vec![0.0; self.static_loads.len()];
        let Self { model, ws, state, static_loads, .. } = self;
        let loads = Loads { vertical: static_loads, lateral: &flat };
        measure(rounds, 2, || {
            state.bodies[0].position.z += 1e-12;
            model.accelerations(state, &loads, ws)
        })
    }

    /// One internal step under springs and dampers in place of the magnets.
    fn step(&mut self) -> Result<(), Error> {
        for (k, (load, held)) in self.vertical.iter_mut().zip(&self.static_loads).enumerate() {
            let motion = self.model.magnet(&self.state, MagnetIndex(k));
            let track = 1e-3 * (20.0 * self.state.time + 0.3 * k as f64).sin();
            load[0] = held + 7e5 * (track - motion.displacement.z) - 8e3 * motion.velocity.z;
        }
        let course = LoadCourse { vertical: &self.vertical, lateral: &self.lateral };
        self.model.step(&mut self.state, STEP, STEP, &course, &mut self.ws)
    }
}

/// Slope and height at zero of the least-squares line.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let over: f64 = points.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    let slope = over / points.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>();
    (slope, my - slope * mx)
}

/// A measured train.
#[derive(Clone, Copy)]
struct Train {
    cars: f64,
    bodies: f64,
    seconds: f64,
}

/// Exponent of the growth of the time with what `size` says.
fn exponent(trains: &[Train], size: fn(&Train) -> f64) -> f64 {
    let logs: Vec<_> = trains.iter().map(|t| (size(t).ln(), t.seconds.ln())).collect();
    line(&logs).0
}

/// The growth from 2 to 32 cars. A train of n cars has n − 1 couplers of ten links, so even work
/// that is linear in cars and couplers grows faster than n: the line a n − b says how much.
fn report(what: &str, trains: &[Train]) {
    let times: Vec<_> = trains.iter().map(|t| (t.cars, t.seconds * 1e6)).collect();
    let (slope, height) = line(&times);
    println!(
        "{what}, shortest rounds, 2 to 32 cars: exponent over the bodies {:.3}, over the cars {:.3} \
         (8 to 32 cars {:.3}); line {slope:.2} µs per car {height:+.2} µs",
        exponent(trains, |t| t.bodies),
        exponent(trains, |t| t.cars),
        exponent(&trains[trains.len() - 3..], |t| t.cars),
    );
}

fn main() -> Result<(), Error> {
    println!(
        "cars bodies | evaluation µs  ns/body | step µs  ns/body | simulated second ms  × real time"
    );
    let mut growth: [Vec<Train>; 2] = [Vec::new(), Vec::new()];
    for cars in CARS {
        let mut bench = Bench::new(cars)?;
        let bodies = bench.model.counts().bodies as f64;
        let evaluation = bench.evaluation(ROUNDS / cars)?;
        let step = measure(ROUNDS / cars, 1, || bench.step())?;
        let second = if cars == 2 {
            measure(5, 1, || (0..1000).try_for_each(|_| bench.step()))?
        } else {
            Time { median: step.median / STEP, shortest: step.shortest / STEP }
        };
        println!(
            "{cars:4} {bodies:6} | {:8.2} ({:8.2}) {:5.0} | {:8.1} ({:8.1}) {:5.0} | {:8.1} {:6.1}",
            evaluation.median * 1e6,
            evaluation.shortest * 1e6,
            evaluation.median * 1e9 / bodies,
            step.median * 1e6,
            step.shortest * 1e6,
            step.median * 1e9 / bodies,
            second.median * 1e3,
            1.0 / second.median,
        );
        if cars >= 2 {
            let train = |time: Time| Train { cars: cars as f64, bodies, seconds: time.shortest };
            growth[0].push(train(evaluation));
            growth[1].push(train(step));
        }
    }
    report("evaluation", &growth[0]);
    report("step", &growth[1]);
    Ok(())
}
