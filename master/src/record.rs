//! Results: rows of results.csv, statistics over every communication point, curves for pictures.

use std::fs::{self, File};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use serde::Serialize;

/// Extremes and means of one signal over all communication points.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Smallest value.
    pub min: f64,
    /// Time of the smallest value (s).
    pub time_of_min: f64,
    /// Largest value.
    pub max: f64,
    /// Time of the largest value (s).
    pub time_of_max: f64,
    /// Mean over the points.
    pub mean: f64,
    /// Root of the mean square over the points.
    pub rms: f64,
    /// Last value.
    #[serde(rename = "final")]
    pub last: f64,
    /// Number of points.
    pub points: u64,
}

/// Gathers [`Statistics`]. Sums are compensated (Neumaier), so that millions of points keep full
/// precision.
#[derive(Debug, Clone, Copy, Default)]
pub struct Gatherer {
    min: (f64, f64),
    max: (f64, f64),
    sum: Sum,
    squares: Sum,
    last: f64,
    points: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    total: f64,
    lost: f64,
}

impl Sum {
    #[inline]
    fn add(&mut self, x: f64) {
        let next = self.total + x;
        self.lost += if self.total.abs() >= x.abs() {
            (self.total - next) + x
        } else {
            (x - next) + self.total
        };
        self.total = next;
    }

    fn value(self) -> f64 {
        self.total + self.lost
    }
}

impl Gatherer {
    /// Takes one point.
    #[inline]
    pub fn take(&mut self, time: f64, value: f64) {
        if self.points == 0 || value < self.min.0 {
            self.min = (value, time);
        }
        if self.points == 0 || value > self.max.0 {
            self.max = (value, time);
        }
        self.sum.add(value);
        self.squares.add(value * value);
        self.last = value;
        self.points += 1;
    }

    /// The statistics so far; nothing before the first point.
    #[must_use]
    pub fn statistics(&self) -> Option<Statistics> {
        #[expect(clippy::cast_precision_loss, reason = "2^53 points are out of reach")]
        let n = self.points as f64;
        (self.points > 0).then(|| Statistics {
            min: self.min.0,
            time_of_min: self.min.1,
            max: self.max.0,
            time_of_max: self.max.1,
            mean: self.sum.value() / n,
            rms: (self.squares.value() / n).sqrt(),
            last: self.last,
            points: self.points,
        })
    }
}

/// A curve reduced while it is recorded: per slice of time its smallest and largest value, so that
/// no peak is lost and memory stays bounded.
#[derive(Debug, Clone)]
pub struct Curve {
    points_per_slice: u64,
    slice: Option<Slice>,
    points: Vec<(f64, f64)>,
    taken: u64,
}

#[derive(Debug, Clone, Copy)]
struct Slice {
    min: (f64, f64),
    max: (f64, f64),
}

impl Curve {
    /// A curve for a known number of points, drawn with at most two points per slice.
    #[must_use]
    pub fn new(points: u64, slices: u64) -> Self {
        let points_per_slice = if points <= 2 * slices { 1 } else { points.div_ceil(slices) };
        Self { points_per_slice, slice: None, points: Vec::new(), taken: 0 }
    }

    /// Whether the other curve keeps more of its points.
    #[must_use]
    pub fn is_coarser_than(&self, other: &Self) -> bool {
        self.points_per_slice > other.points_per_slice
    }

    /// Takes one point.
    #[inline]
    pub fn take(&mut self, time: f64, value: f64) {
        let point = (time, value);
        match &mut self.slice {
            Some(slice) => {
                if value < slice.min.1 {
                    slice.min = point;
                }
                if value > slice.max.1 {
                    slice.max = point;
                }
            }
            None => self.slice = Some(Slice { min: point, max: point }),
        }
        self.taken += 1;
        if self.taken.is_multiple_of(self.points_per_slice) {
            self.flush();
        }
    }

    fn flush(&mut self) {
        if let Some(Slice { min, max }) = self.slice.take() {
            let (first, second) = if min.0 <= max.0 { (min, max) } else { (max, min) };
            self.points.push(first);
            if first != second {
                self.points.push(second);
            }
        }
    }

    /// The reduced curve: time and value.
    #[must_use]
    pub fn finish(mut self) -> Vec<(f64, f64)> {
        self.flush();
        self.points
    }
}

/// results.csv, written under another name until it is complete.
pub struct Table {
    writer: csv::Writer<BufWriter<File>>,
    partial: PathBuf,
    path: PathBuf,
    number: ryu::Buffer,
    rows: u64,
}

impl Table {
    /// Begins the table in the folder.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn create<'a>(folder: &Path, names: impl IntoIterator<Item = &'a str>) -> io::Result<Self> {
        let path = folder.join("results.csv");
        let partial = folder.join("results.csv.partial");
        let file = BufWriter::with_capacity(1 << 16, File::create(&partial)?);
        let mut writer = csv::WriterBuilder::new().from_writer(file);
        writer.write_field("time")?;
        for name in names {
            writer.write_field(name)?;
        }
        writer.write_record(None::<&[u8]>)?;
        Ok(Self { writer, partial, path, number: ryu::Buffer::new(), rows: 0 })
    }

    /// Writes one row: shortest decimals that read back to the same floats.
    ///
    /// # Errors
    /// The file cannot be written, for instance because the disk is full.
    pub fn row(&mut self, time: f64, values: impl IntoIterator<Item = f64>) -> io::Result<()> {
        self.writer.write_field(self.number.format(time))?;
        for value in values {
            self.writer.write_field(self.number.format(value))?;
        }
        self.writer.write_record(None::<&[u8]>)?;
        self.rows += 1;
        Ok(())
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Completes the table and gives it its name.
    ///
    /// # Errors
    /// The file cannot be written or renamed.
    pub fn finish(self) -> io::Result<PathBuf> {
        let Self { writer, partial, path, .. } = self;
        let buffer = writer.into_inner().map_err(|error| error.into_error())?;
        let file = buffer.into_inner().map_err(io::IntoInnerError::into_error)?;
        file.sync_all()?;
        drop(file);
        fs::rename(&partial, &path)?;
        Ok(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn analytic_statistics_of_a_ramp() {
        let mut gatherer = Gatherer::default();
        assert!(gatherer.statistics().is_none());
        for k in 0..=4 {
            gatherer.take(f64::from(k) * 0.5, f64::from(k) - 1.0);
        }
        let s = gatherer.statistics().unwrap();
        assert_eq!((s.min, s.time_of_min, s.max, s.time_of_max), (-1.0, 0.0, 3.0, 2.0));
        assert_eq!((s.mean, s.rms, s.last, s.points), (1.0, 3.0_f64.sqrt(), 3.0, 5));
    }

    /// A plain sum of 1e16 and ten ones loses them all.
    #[test]
    fn analytic_sums_are_compensated() {
        let mut sum = Sum::default();
        sum.add(1e16);
        (0..10).for_each(|_| sum.add(1.0));
        sum.add(-1e16);
        assert_eq!(sum.value(), 10.0);
    }

    #[test]
    fn invariant_rows_read_back_to_the_same_bits() {
        let folder = tempfile::tempdir().unwrap();
        let mut table = Table::create(folder.path(), ["a.x", "b,y"]).unwrap();
        let values = [0.1 + 0.2, 1e-300, -0.0, 8e-3, f64::MAX];
        for x in values {
            table.row(x, [x, -x]).unwrap();
        }
        assert!(!folder.path().join("results.csv").exists());
        let path = table.finish().unwrap();
        let text = fs::read_to_string(path).unwrap();
        assert!(text.starts_with("time,a.x,\"b,y\"\n0.30000000000000004,"), "{text}");
        for (line, x) in text.lines().skip(1).zip(values) {
            let read: f64 = line.split(',').next().unwrap().parse().unwrap();
            assert_eq!(read.to_bits(), x.to_bits());
        }
        assert!(!folder.path().join("results.csv.partial").exists());
    }

    proptest! {
        #[test]
        fn invariant_reduction_keeps_every_peak(
            values in proptest::collection::vec(-1e3..1e3_f64, 1..2000), slices in 1_u64..100
        ) {
            let mut curve = Curve::new(values.len() as u64, slices);
            for (k, &value) in values.iter().enumerate() {
                curve.take(k as f64, value);
            }
            let points = curve.finish();
            prop_assert!(points.len() as u64 <= 2 * slices + 2);
            let extreme = |pick: fn(f64, f64) -> f64, list: &mut dyn Iterator<Item = f64>| {
                list.fold(f64::NAN, pick)
            };
            for pick in [f64::min as fn(f64, f64) -> f64, f64::max] {
                let all = extreme(pick, &mut values.iter().copied());
                let kept = extreme(pick, &mut points.iter().map(|p| p.1));
                prop_assert_eq!(all, kept);
            }
            prop_assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
        }
    }
}
