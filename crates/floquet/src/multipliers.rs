//! Floquet multipliers, and the growth and frequency of their motions.

use std::f64::consts::{PI, TAU};

use faer::Mat;
use faer::prelude::c64;
use serde::{Deserialize, Serialize};

use crate::{FloquetError, Monodromy};

/// Sizes of multipliers below this share of the monodromy matrix are rounding errors.
const NOISE: f64 = 1e-12;
/// Motions whose watched signals have less than this share of the energy of the largest are not seen.
const UNSEEN: f64 = 1e-16;
/// Most multipliers that are listed.
const MOST: usize = 250;

/// One Floquet multiplier, or a conjugate pair.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Multiplier {
    /// μ, with Im μ ≥ 0.
    #[serde(with = "pair")]
    pub value: c64,
    /// ln|μ|/T (1/s): positive if the motion grows.
    pub growth: f64,
    /// Frequency of the motion (Hz), by the turns of the watched signals. μ alone shows it only up to multiples of 1/T.
    pub frequency: f64,
}

impl Multiplier {
    /// Damping ratio of a mode with this growth and frequency.
    #[must_use]
    pub fn damping_ratio(&self) -> f64 {
        let omega = TAU * self.frequency;
        let size = self.growth.hypot(omega);
        if size > 0.0 { -self.growth / size } else { 0.0 }
    }
}

/// Complex numbers in files: real and imaginary part.
mod pair {
    use faer::prelude::c64;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(value: &c64, to: S) -> Result<S::Ok, S::Error> {
        [value.re, value.im].serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<c64, D::Error> {
        let [re, im] = Deserialize::deserialize(from)?;
        Ok(c64::new(re, im))
    }
}

/// The largest multipliers, as far as they can be told from rounding errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Multipliers {
    /// The fastest growing first.
    pub all: Vec<Multiplier>,
    /// Motions with a smaller growth rate than this (1/s) are rounding errors, and are not among them.
    pub floor: f64,
}

impl Multipliers {
    /// The fastest growing one with at least this frequency (Hz).
    #[must_use]
    pub fn critical(&self, above: f64) -> Option<&Multiplier> {
        self.all.iter().find(|it| it.frequency >= above)
    }
}

/// The multipliers of a monodromy matrix.
///
/// # Errors
/// The eigenvalues cannot be found.
pub fn multipliers(monodromy: &Monodromy) -> Result<Multipliers, FloquetError> {
    let Monodromy { period, matrix, watched, .. } = monodromy;
    let eigen = matrix.eigen().map_err(|_| FloquetError::Eigenvalues("Floquet multipliers"))?;
    let size = matrix.norm_l2();
    let floor = (NOISE * size).ln() / period;
    let mut found: Vec<usize> = (0..matrix.nrows())
        .filter(|&k| eigen.S()[k].im >= 0.0 && eigen.S()[k].norm() > NOISE * size)
        .collect();
    found.sort_by(|&a, &b| eigen.S()[b].norm().total_cmp(&eigen.S()[a].norm()));
    found.truncate(MOST);
    let shapes = Mat::from_fn(matrix.nrows(), 2 * found.len(), |i, j| {
        let value = eigen.U()[(i, found[j / 2])];
        if j % 2 == 0 { value.re } else { value.im }
    });
    let all = found.iter().zip(turns(watched, &shapes)).map(|(&k, turns)| {
        let value = eigen.S()[k];
        let whole = ((turns - value.arg()) / TAU).round();
        let frequency = ((value.arg() + TAU * whole) / period / TAU).abs();
        Multiplier { value, growth: value.norm().ln() / period, frequency }
    });
    Ok(Multipliers { all: all.collect(), floor })
}

/// Angles (rad) by which the watched signals turn in the complex plane over a period, for motions with these initial states,
/// whose real and imaginary parts are neighbouring columns.
fn turns(watched: &[Mat<f64>], shapes: &Mat<f64>) -> Vec<f64> {
    let mut angles = vec![0.0; shapes.ncols() / 2];
    let mut sizes = angles.clone();
    let mut last: Option<Mat<f64>> = None;
    for map in watched {
        let now = map * shapes;
        for (k, angle) in angles.iter_mut().enumerate() {
            let Some(last) = &last else { break };
            let mut sum = c64::new(0.0, 0.0);
            for i in 0..now.nrows() {
                let value = |it: &Mat<f64>| c64::new(it[(i, 2 * k)], it[(i, 2 * k + 1)]);
                sum += value(last).conj() * value(&now);
                sizes[k] += value(&now).norm_sqr();
            }
            // a real motion that changes its sign has made half a turn
            *angle += if sum.im == 0.0 && sum.re < 0.0 { PI } else { sum.arg() };
        }
        last = Some(now);
    }
    // from the middle of the first step to that of the last
    let steps = watched.len() as f64;
    let whole = if steps > 1.0 { steps / (steps - 1.0) } else { 0.0 };
    // what is hardly seen only turns by rounding errors
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let seen = |size: f64| size > UNSEEN * largest;
    angles
        .into_iter()
        .zip(sizes)
        .map(|(it, size)| if seen(size) { it * whole } else { 0.0 })
        .collect()
}
