//! Work-precision of the internal step on the two-car vehicle: error of the magnets' motion against
//! the time that a simulated second takes. Prints CSV:
//! `cargo run --release -p multibody --example work_precision`.
//!
//! The magnets are held by springs and dampers of 7e5 N/m and 8e3 N·s/m (fastest pair −209 ± 308i
//! 1/s) to an irregular track that passes at 5 km/h. Springs and dampers are bushings to the ground,
//! so that they act within the stages; the track comes in as forces, cubic polynomials of 12 ms
//! whatever the step, so that all steps solve the same problem. The error is the RMS, over all
//! magnets and every 12 ms, of the difference to the reference, relative to the RMS of the gap
//! deviations (track minus magnet).

use std::io::Write;
use std::time::Instant;

use multibody::{
    Bushing, Error, GROUND, Holding, LoadCourse, MagnetIndex, Scheme, State, VehicleModel, train,
};

const STIFFNESS: f64 = 7e5;
const DAMPING: f64 = 8e3;
const SPEED: f64 = 5.0 / 3.6;
/// Simulated time, s: 4.2 m of track.
const DURATION: f64 = 3.0;
/// All steps are whole parts or multiples of this; the loads' pieces have this length, s.
const PIECE: f64 = 12e-3;

/// Irregularity of PSD A/Ω² between 0.5 and 50 m: a sum of harmonics with fixed phases.
struct Track {
    waves: Vec<(f64, f64, f64)>,
}

impl Track {
    fn new() -> Self {
        let (first, last) = (std::f64::consts::TAU / 50.0, std::f64::consts::TAU / 0.5);
        let count = 200;
        let ratio = (last / first).powf(1.0 / f64::from(count));
        let waves = (0..count)
            .map(|k| {
                let low = first * ratio.powi(k);
                let width = low * (ratio - 1.0);
                let number = low + 0.5 * width;
                // a low-discrepancy sequence serves as random phases
                let phase = std::f64::consts::TAU * (f64::from(k) * 0.618_033_988_749_895).fract();
                ((2.0 * 4e-7 / (number * number) * width).sqrt(), number, phase)
            })
            .collect();
        Self { waves }
    }

    /// Height and its first two derivatives in time at the place x.
    fn at(&self, x: f64) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (amplitude, number, phase) in &self.waves {
            let (sin, cos) = (number * x + phase).sin_cos();
            let w = number * SPEED;
            for (sum, term) in sums.iter_mut().zip([sin, w * cos, -w * w * sin]) {
                *sum += amplitude * term;
            }
        }
        sums
    }
}

/// Smooth step from 0 to 1 over the first half second with its first two derivatives.
fn fade(t: f64) -> [f64; 3] {
    let s = (t / 0.5).min(1.0);
    let left = 1.0 - s;
    [
        s.powi(3) * (10.0 + s * (-15.0 + s * 6.0)),
        2.0 * 30.0 * s * s * left * left,
        4.0 * 60.0 * s * left * (1.0 - 2.0 * s),
    ]
}

/// Loads of one piece: derivatives at its beginning.
type Piece = Vec<[f64; 4]>;

struct Run {
    model: VehicleModel,
    start: State,
    pieces: Vec<Piece>,
    /// Track heights at the ends of the pieces.
    heights: Vec<Vec<f64>>,
}

impl Run {
    fn new() -> Result<Self, Error> {
        let plain = train::two_car();
        let free = VehicleModel::new(&plain)?;
        let magnets = free.counts().magnets;
        let mut ws = free.workspace();
        let found = free.equilibrium(&vec![0.0; magnets], &Holding::default(), &mut ws)?;
        let mut description = plain;
        for (k, magnet) in description.magnets.iter().enumerate() {
            description.bushings.push(Bushing {
                name: format!("magnet_{}", k + 1),
                body_a: GROUND.to_owned(),
                body_b: magnet.body.clone(),
                position: magnet.position,
                orientation: None,
                translational_stiffness: [0.0, 1e5, STIFFNESS],
                translational_damping: [0.0, 1e3, DAMPING],
                rotational_stiffness: [0.0; 3],
                rotational_damping: [0.0; 3],
                preload: [0.0; 3],
            });
        }
        let places: Vec<f64> = description.magnets.iter().map(|m| m.position[0]).collect();
        let model = VehicleModel::new(&description)?;
        let track = Track::new();
        let count = (DURATION / PIECE).round() as usize;
        let product = |k: usize, t: f64| {
            let (z, f) = (track.at(places[k] + SPEED * t), fade(t));
            [z[0] * f[0], z[1] * f[0] + z[0] * f[1], z[2] * f[0] + 2.0 * z[1] * f[1] + z[0] * f[2]]
        };
        let mut pieces = Vec::with_capacity(count);
        let mut heights = Vec::with_capacity(count);
        for n in 0..count {
            let (t, end) = (n as f64 * PIECE, (n + 1) as f64 * PIECE);
            let piece = (0..magnets).map(|k| {
                // cubic through force and rate of force at both ends
                let force = |z: [f64; 3]| {
                    (STIFFNESS * z[0] + DAMPING * z[1], STIFFNESS * z[1] + DAMPING * z[2])
                };
                let ((f0, r0), (f1, r1)) = (force(product(k, t)), force(product(k, end)));
                let h = PIECE;
                let second = (6.0 * (f1 - f0) / h - 4.0 * r0 - 2.0 * r1) / h;
                let third = (6.0 * (r0 + r1) - 12.0 * (f1 - f0) / h) / (h * h);
                [found.loads[k] + f0, r0, second, third]
            });
            pieces.push(piece.collect());
            heights.push((0..magnets).map(|k| product(k, end)[0]).collect());
        }
        Ok(Self { model, start: found.state, pieces, heights })
    }

    /// Heights of all magnets at the ends of the pieces, and the seconds it took.
    fn go(&self, scheme: Scheme, internal: f64) -> Result<(Vec<f64>, f64), Error> {
        let model = self.model.clone().with_scheme(scheme);
        let mut ws = model.workspace();
        let mut state = self.start.clone();
        let magnets = model.counts().magnets;
        let lateral = vec![[0.0; 4]; magnets];
        let mut heights = Vec::with_capacity(magnets * self.pieces.len());
        let mut seconds = 0.0;
        for vertical in &self.pieces {
            let course = LoadCourse { vertical, lateral: &lateral };
            let begin = Instant::now();
            model.step(&mut state, PIECE, internal, &course, &mut ws)?;
            seconds += begin.elapsed().as_secs_f64();
            for k in 0..magnets {
                heights.push(model.magnet(&state, MagnetIndex(k)).displacement.z);
            }
        }
        Ok((heights, seconds))
    }
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
    (sum / count).sqrt()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let run = Run::new()?;
    let (reference, _) = run.go(Scheme::Classical, PIECE / 96.0)?;
    let gaps =
        rms(run.heights.iter().flatten().zip(&reference).map(|(track, magnet)| track - magnet));
    let mut out = std::io::stdout();
    writeln!(out, "# gap deviation RMS {gaps:e} m, reference step {} ms", PIECE / 96.0 * 1e3)?;
    writeln!(out, "scheme,step_ms,error_of_gap_rms,ms_per_simulated_second,times_real_time")?;
    for scheme in [Scheme::Midpoint, Scheme::Heun, Scheme::Classical] {
        for parts in [24, 12, 8, 6, 5, 4, 3, 2, 1] {
            let step = PIECE / f64::from(parts);
            match run.go(scheme, step) {
                Ok((heights, seconds)) => {
                    let error = rms(heights.iter().zip(&reference).map(|(a, b)| a - b)) / gaps;
                    writeln!(
                        out,
                        "{scheme:?},{:.3},{error:.3e},{:.2},{:.1}",
                        step * 1e3,
                        seconds / DURATION * 1e3,
                        DURATION / seconds
                    )?;
                }
                Err(error) => writeln!(out, "{scheme:?},{:.3},unstable: {error},,", step * 1e3)?,
            }
        }
    }
    Ok(())
}
