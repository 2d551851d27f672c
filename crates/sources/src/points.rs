//! Signals by their values at given times.

use scenario::Interpolation;

use crate::{Break, MAX_BREAKS, SourceError};

/// Points in the order of time, with what the signal is in between. Before the first and after the last point the signal
/// is constant.
#[derive(Debug, Clone)]
pub struct Points {
    times: Vec<f64>,
    values: Vec<f64>,
    /// at the points, for cubic interpolation
    slopes: Vec<f64>,
    pub(crate) interpolation: Interpolation,
}

impl Points {
    /// There is at least one point, and times increase.
    pub(crate) fn new(times: Vec<f64>, values: Vec<f64>, interpolation: Interpolation) -> Self {
        let slopes = match interpolation {
            Interpolation::Cubic => slopes(&times, &values),
            Interpolation::Linear | Interpolation::Hold => Vec::new(),
        };
        Self { times, values, slopes, interpolation }
    }

    /// Times and values of the points.
    pub(crate) fn into_parts(self) -> (Vec<f64>, Vec<f64>) {
        (self.times, self.values)
    }

    /// Number of points up to the time.
    pub(crate) fn index(&self, time: f64) -> i64 {
        let count = self.times.partition_point(|&it| it <= time);
        i64::try_from(count).unwrap_or(i64::MAX)
    }

    pub(crate) fn piece(&self, index: i64, time: f64) -> [f64; 4] {
        let index = usize::try_from(index).unwrap_or(0);
        let value = |k: usize| self.values.get(k).or(self.values.last()).copied().unwrap_or(0.0);
        let Some(k) = index.checked_sub(1) else { return [value(0), 0.0, 0.0, 0.0] };
        if index >= self.times.len() || self.interpolation == Interpolation::Hold {
            return [value(k), 0.0, 0.0, 0.0];
        }
        let (width, tau) = (self.times[index] - self.times[k], time - self.times[k]);
        let slope = (self.values[index] - self.values[k]) / width;
        if self.interpolation == Interpolation::Linear {
            return [self.values[k] + slope * tau, slope, 0.0, 0.0];
        }
        let (a, b) = (self.slopes[k], self.slopes[index]);
        let second = (6.0 * slope - 4.0 * a - 2.0 * b) / width;
        let third = (6.0 * (a + b) - 12.0 * slope) / (width * width);
        [
            self.values[k] + tau * (a + tau / 2.0 * (second + tau / 3.0 * third)),
            a + tau * (second + tau / 2.0 * third),
            second + tau * third,
            third,
        ]
    }

    /// Held values jump where they change. The others have no breaks: see the crate's documentation.
    pub(crate) fn breaks(&self, start: f64, stop: f64) -> Result<Vec<Break>, SourceError> {
        if self.interpolation != Interpolation::Hold {
            return Ok(Vec::new());
        }
        let changes = self.times.iter().skip(1).zip(self.values.windows(2));
        let within = |time: f64| (start..stop).contains(&time);
        let jumps = changes.filter(|(time, pair)| within(**time) && pair[0] != pair[1]);
        let breaks: Vec<Break> =
            jumps.take(MAX_BREAKS + 1).map(|(&time, _)| Break { time, jump: true }).collect();
        if breaks.len() > MAX_BREAKS { Err(SourceError::TooMany) } else { Ok(breaks) }
    }

    pub(crate) fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for number in self.times.iter().chain(&self.values) {
            hasher.update(&number.to_le_bytes());
        }
        hasher.finalize()
    }
}

/// Slopes at the points: of the parabola through a point and its neighbours, at both ends of the parabola through the
/// first or last three points. Exact for parabolas.
fn slopes(times: &[f64], values: &[f64]) -> Vec<f64> {
    let secant = |k: usize| (values[k + 1] - values[k]) / (times[k + 1] - times[k]);
    match times.len() {
        0 | 1 => vec![0.0; times.len()],
        2 => vec![secant(0); 2],
        count => (0..count)
            .map(|k| {
                let middle = k.clamp(1, count - 2);
                let (before, after) = (secant(middle - 1), secant(middle));
                let bend = (after - before) / (times[middle + 1] - times[middle - 1]);
                // Newton's form about the first two of the three points
                before + bend * (2.0 * times[k] - times[middle - 1] - times[middle])
            })
            .collect(),
    }
}
