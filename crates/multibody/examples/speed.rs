//! Times one evaluation of eq. 9, the rates of its accelerations, one internal step and the search
//! for the equilibrium:
//! `cargo run --release -p multibody --example speed -- [vehicle …]`.

use std::io::Write;
use std::time::{Duration, Instant};

use multibody::{Error, Holding, LoadCourse, Loads, VehicleModel, train};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.is_empty() {
        names = ["one-bogie", "one-car", "two-car", "4-cars", "8-cars"].map(String::from).to_vec();
    }
    let mut out = std::io::stdout();
    for name in names {
        let description = train::by_name(&name).ok_or_else(|| format!("no vehicle `{name}`"))?;
        let model = VehicleModel::new(&description)?;
        let [equilibrium, evaluation, jerks, step] = times(&model)?;
        writeln!(
            out,
            "{name:>10}: equilibrium {:8.3} ms, evaluation {:8.2} µs, jerks {:6.2} µs, \
             step {:8.2} µs \
             ({:.1} times real time at 1 ms), {:.0} ns per body and evaluation",
            equilibrium.as_secs_f64() * 1e3,
            evaluation.as_secs_f64() * 1e6,
            jerks.as_secs_f64() * 1e6,
            step.as_secs_f64() * 1e6,
            1e-3 / step.as_secs_f64(),
            evaluation.as_secs_f64() * 1e9 / model.counts().bodies as f64,
        )?;
    }
    Ok(())
}

/// Shortest of several rounds, so that other work on the machine counts least.
fn best(rounds: u32, mut work: impl FnMut() -> Result<(), Error>) -> Result<Duration, Error> {
    let mut shortest = Duration::MAX;
    for _ in 0..rounds {
        let begin = Instant::now();
        work()?;
        shortest = shortest.min(begin.elapsed());
    }
    Ok(shortest)
}

fn times(model: &VehicleModel) -> Result<[Duration; 4], Error> {
    let mut ws = model.workspace();
    let magnets = model.counts().magnets;
    let flat = vec![0.0; magnets];
    let found = model.equilibrium(&flat, &Holding::default(), &mut ws)?;
    let equilibrium =
        best(5, || model.equilibrium(&flat, &Holding::default(), &mut ws).map(|_| ()))?;
    let mut state = found.state.clone();
    let loads = Loads { vertical: &found.loads, lateral: &flat };
    let evaluation = best(20, || {
        for _ in 0..50 {
            // another pose each time, so that nothing remembered is used
            state.bodies[0].position.z += 1e-12;
            model.accelerations(&state, &loads, &mut ws)?;
        }
        Ok(())
    })? / 50;
    let mut probe = model.workspace();
    let rates = Loads { vertical: &flat, lateral: &flat };
    let jerks = best(20, || {
        for _ in 0..50 {
            model.jerks(&state, &loads, &rates, &mut ws, &mut probe)?;
        }
        Ok(())
    })? / 50;
    let vertical: Vec<[f64; 4]> = found.loads.iter().map(|l| [l + 1.0, 0.0, 0.0, 0.0]).collect();
    let lateral = vec![[0.0; 4]; magnets];
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    let step = best(20, || {
        for _ in 0..10 {
            model.step(&mut state, 1e-3, 1e-3, &course, &mut ws)?;
        }
        Ok(())
    })? / 10;
    Ok([equilibrium, evaluation, jerks, step])
}
