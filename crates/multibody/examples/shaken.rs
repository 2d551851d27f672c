//! A vehicle on springs below its magnets, shaken by a waving track: trajectories for a comparison
//! with another program. The case is read from standard input, the run is written to standard
//! output, both as JSON:
//! `cargo run --release -p multibody --example shaken -- VEHICLE.json < case.json > run.json`.
//! `tests/python/exudyn_vehicle.py` is the other side.

use std::error::Error;
use std::io::{Read, Write};
use std::time::Instant;

use multibody::{
    BodyState, Bushing, GROUND, Holding, LoadCourse, State, VehicleDescription, VehicleModel,
    Workspace,
};
use serde::{Deserialize, Serialize};

/// What is done with the vehicle.
#[derive(Deserialize)]
struct Case {
    /// Simulated time, s.
    duration: f64,
    /// Internal steps tried, s; a divisor of `interval`.
    step: f64,
    /// Time between two rows of the result, s.
    interval: f64,
    /// Of the vertical spring below each magnet, N/m and N·s/m.
    stiffness: f64,
    damping: f64,
    /// The track's waves come up as t²/(t² + fade²), s.
    fade: f64,
    waves: Vec<Wave>,
}

/// amplitude·sin(2π·frequency·t − along·x − across·y).
#[derive(Deserialize)]
struct Wave {
    amplitude: f64,
    frequency: f64,
    along: f64,
    across: f64,
}

/// What came out.
#[derive(Serialize)]
struct Run {
    /// Upward force on each magnet in equilibrium, N.
    loads: Vec<f64>,
    /// Names of the bodies (brackets merged), in the order of `start` and of each row.
    bodies: Vec<String>,
    /// Poses in the file, and in equilibrium, where the run begins.
    start: Vec<BodyState>,
    equilibrium: Vec<BodyState>,
    times: Vec<f64>,
    rows: Vec<Vec<BodyState>>,
    /// What stepping took of the processor, s.
    seconds: f64,
}

impl Case {
    /// Height of the track's surface at a magnet and its rate.
    fn track(&self, at: [f64; 3], t: f64) -> (f64, f64) {
        let (mut wave, mut rate) = (0.0, 0.0);
        for w in &self.waves {
            let omega = 2.0 * std::f64::consts::PI * w.frequency;
            let (s, c) = (omega * t - w.along * at[0] - w.across * at[1]).sin_cos();
            wave += w.amplitude * s;
            rate += w.amplitude * omega * c;
        }
        let below = t * t + self.fade * self.fade;
        let fade = t * t / below;
        let fading = 2.0 * t * self.fade * self.fade / (below * below);
        (fade * wave, fading * wave + fade * rate)
    }

    /// What the waves add to the force of a spring at rest.
    fn force(&self, at: [f64; 3], t: f64) -> f64 {
        let (height, rate) = self.track(at, t);
        self.stiffness * height + self.damping * rate
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("give a vehicle file")?;
    let mut description = VehicleDescription::from_json(&std::fs::read_to_string(path)?)?;
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    let case: Case = serde_json::from_str(&text)?;
    let springs: Vec<_> =
        description.magnets.iter().enumerate().map(|(k, m)| spring(&case, k, m)).collect();
    description.bushings.extend(springs);
    let model = VehicleModel::new(&description)?;
    let run = run(&description, &model, &case)?;
    serde_json::to_writer(std::io::stdout().lock(), &run)?;
    std::io::stdout().flush()?;
    Ok(())
}

/// The spring between a magnet and the unmoved track; what the track moves is a load.
fn spring(case: &Case, k: usize, magnet: &multibody::MagnetPoint) -> Bushing {
    Bushing {
        name: format!("track_spring_{k}"),
        body_a: GROUND.to_owned(),
        body_b: magnet.body.clone(),
        position: magnet.position,
        orientation: None,
        translational_stiffness: [0.0, 0.0, case.stiffness],
        translational_damping: [0.0, 0.0, case.damping],
        rotational_stiffness: [0.0; 3],
        rotational_damping: [0.0; 3],
        preload: [0.0; 3],
    }
}

fn run(
    description: &VehicleDescription,
    model: &VehicleModel,
    case: &Case,
) -> Result<Run, Box<dyn Error>> {
    let mut ws = model.workspace();
    let magnets = description.magnets.len();
    let found = model.equilibrium(&vec![0.0; magnets], &Holding::default(), &mut ws)?;
    let mut state = found.state.clone();
    let (mut times, mut rows) = (vec![0.0], vec![state.bodies.clone()]);
    let per_row = (case.interval / case.step).round().max(1.0) as usize;
    let count = (case.duration / case.interval).round() as usize;
    let mut loads = Loads { vertical: vec![[0.0; 4]; magnets], lateral: vec![[0.0; 4]; magnets] };
    let clock = Clock(Instant::now());
    let mut seconds = 0.0;
    for row in 1..=count {
        let begin = clock.now();
        for n in (row - 1) * per_row..row * per_row {
            loads.set(description, case, &found.loads, n as f64 * case.step);
            loads.step(model, &mut state, case.step, &mut ws)?;
        }
        seconds += clock.now() - begin;
        times.push(row as f64 * case.interval);
        rows.push(state.bodies.clone());
    }
    Ok(Run {
        loads: found.loads,
        bodies: model.body_names().map(String::from).collect(),
        start: model.initial_state().bodies,
        equilibrium: found.state.bodies,
        times,
        rows,
        seconds,
    })
}

/// The processor's time where the system counts it (Linux), since other work on the machine does not
/// count then; else the wall clock's.
struct Clock(Instant);

impl Clock {
    fn now(&self) -> f64 {
        std::fs::read_to_string("/proc/thread-self/schedstat")
            .ok()
            .and_then(|line| line.split(' ').next()?.parse::<f64>().ok())
            .map_or_else(|| self.0.elapsed().as_secs_f64(), |nanoseconds| nanoseconds * 1e-9)
    }
}

struct Loads {
    vertical: Vec<[f64; 4]>,
    lateral: Vec<[f64; 4]>,
}

impl Loads {
    /// The cubics through the forces at four times of a step: off by a hundred-millionth of the
    /// track's share where waves of 10 Hz meet steps of 1 ms.
    fn set(&mut self, description: &VehicleDescription, case: &Case, rest: &[f64], t: f64) {
        let h = case.step;
        for ((course, magnet), rest) in self.vertical.iter_mut().zip(&description.magnets).zip(rest)
        {
            let f = [0.0, 1.0, 2.0, 3.0].map(|k| case.force(magnet.position, t + k * h / 3.0));
            let (d1, d2) = (f[1] - f[0], f[2] - 2.0 * f[1] + f[0]);
            let d3 = f[3] - 3.0 * f[2] + 3.0 * f[1] - f[0];
            let third = 3.0 / h;
            *course = [
                rest + f[0],
                (d1 - d2 / 2.0 + d3 / 3.0) * third,
                (d2 - d3) * third * third,
                d3 * third * third * third,
            ];
        }
    }

    fn step(
        &self,
        model: &VehicleModel,
        state: &mut State,
        size: f64,
        ws: &mut Workspace,
    ) -> Result<(), multibody::Error> {
        let course = LoadCourse { vertical: &self.vertical, lateral: &self.lateral };
        model.step(state, size, size, &course, ws)
    }
}
