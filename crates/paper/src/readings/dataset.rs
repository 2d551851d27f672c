//! The dataset of the study: what was measured of each run.

use std::path::PathBuf;

use anyhow::{Context, Result};
use results::Table;
use serde::{Deserialize, Serialize};

use crate::{
    measure::{density, deviation, gaps, hump, largest, largest_rms, response, signal},
    measure::{peak_frequencies, six},
    numbers::{BETWEEN, SECOND, accelerations},
};

/// Magnets near the middle of each bogie's left side.
const BOGIES: [&str; 8] = ["02", "10", "18", "26", "34", "42", "50", "58"];
/// The span under the standing train.
const MIDDLE: &str = "guideway.midspan_displacement_02";
const WHOLE: std::ops::Range<f64> = 0.0..f64::INFINITY;

/// What was measured of a run. Lengths in m, times in s, frequencies in Hz; what a run does not have is empty.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Row {
    /// Name of the study.
    pub study: String,
    /// Name of the run.
    pub case: String,
    /// How it ended, as `maglev study` says.
    pub status: String,
    /// Time that it reached.
    pub reached: f64,
    /// Least damped coupled mode of much of the girder: frequency.
    pub mode_frequency: Option<f64>,
    /// Its damping ratio.
    pub mode_damping: Option<f64>,
    /// Largest deviation of any gap from its start, and when.
    pub gap: Option<f64>,
    /// See above.
    pub gap_time: Option<f64>,
    /// Largest deviation of mid-span from its start, and when.
    pub middle: Option<f64>,
    /// See above.
    pub middle_time: Option<f64>,
    /// Largest deviation of the girder under any bogie from its start, and when.
    pub bogie: Option<f64>,
    /// See above.
    pub bogie_time: Option<f64>,
    /// Largest deviation of any gap from 15 to 20 s.
    pub gap_between: Option<f64>,
    /// The same from 22 to 28 s, and when.
    pub gap_second: Option<f64>,
    /// See above.
    pub gap_second_time: Option<f64>,
    /// Largest deviation of mid-span from 15 to 20 s.
    pub middle_between: Option<f64>,
    /// The same from 22 to 28 s.
    pub middle_second: Option<f64>,
    /// Largest deviation of the girder under any bogie from 15 to 20 s.
    pub bogie_between: Option<f64>,
    /// The same from 22 to 28 s.
    pub bogie_second: Option<f64>,
    /// Peaks of the gaps' spectrum, separated by blanks.
    pub peaks: String,
    /// Largest deflection of any span.
    pub deflection: Option<f64>,
    /// RMS of all gaps.
    pub gap_rms: Option<f64>,
    /// Smallest deflection of any span when it vibrates most, over its largest.
    pub share: Option<f64>,
    /// RMS of the gaps above 4 Hz.
    pub gap_fast: Option<f64>,
    /// How many times higher the gaps' density is around 7.6 Hz than beside it.
    pub gap_hump: Option<f64>,
    /// The same of the spans' accelerations.
    pub girder_hump: Option<f64>,
    /// Mean square of the gaps from 24 to 26 Hz (m²).
    pub gap_at_second: Option<f64>,
    /// The same of the spans' accelerations (m²/s⁴).
    pub girder_at_second: Option<f64>,
}

impl Row {
    /// Measures a run that has its signals. A crossing's spectra are those of this span of time.
    pub fn measure(&mut self, table: &Table, crossing: Option<std::ops::Range<f64>>) -> Result<()> {
        let middle = vec![deviation(table, MIDDLE)?];
        let all = gaps(table)?;
        let some = |(size, time): (f64, f64)| (Some(six(size)), Some(six(time)));
        (self.gap, self.gap_time) = some(largest(table, &all, &WHOLE));
        (self.middle, self.middle_time) = some(largest(table, &middle, &WHOLE));
        match crossing {
            Some(span) => self.measure_crossing(table, &all, &span),
            None => self.measure_standstill(table, &all, &middle),
        }
    }

    fn measure_standstill(
        &mut self,
        table: &Table,
        gaps: &[Vec<f64>],
        middle: &[Vec<f64>],
    ) -> Result<()> {
        let bogies = BOGIES.map(|k| deviation(table, &format!("guideway.deflection_{k}")));
        let bogies = bogies.into_iter().collect::<Result<Vec<_>>>()?;
        let some = |(size, time): (f64, f64)| (Some(six(size)), Some(six(time)));
        (self.bogie, self.bogie_time) = some(largest(table, &bogies, &WHOLE));
        if table.time.last().is_none_or(|end| *end < SECOND.end) {
            return Ok(());
        }
        let size = |signals, span| some(largest(table, signals, span)).0;
        self.gap_between = size(gaps, &BETWEEN);
        (self.gap_second, self.gap_second_time) = some(largest(table, gaps, &SECOND));
        self.middle_between = size(middle, &BETWEEN);
        self.middle_second = size(middle, &SECOND);
        self.bogie_between = size(&bogies, &BETWEEN);
        self.bogie_second = size(&bogies, &SECOND);
        // up to the frequency that the chirp has reached
        let peaks = peak_frequencies(&response(table, gaps)?, &(2.0..SECOND.end));
        let peaks: Vec<_> = peaks.iter().map(|it| six(*it).to_string()).collect();
        self.peaks = peaks.join(" ");
        Ok(())
    }

    fn measure_crossing(
        &mut self,
        table: &Table,
        gaps: &[Vec<f64>],
        span: &std::ops::Range<f64>,
    ) -> Result<()> {
        let (mut deflection, mut share) = (0.0_f64, f64::INFINITY);
        for k in ["01", "02", "03"] {
            let displacement = signal(table, &format!("guideway.midspan_displacement_{k}"))?;
            let own = displacement.iter().fold(0.0, |most: f64, it| most.max(-it));
            deflection = deflection.max(own);
            let acceleration = signal(table, &format!("guideway.midspan_acceleration_{k}"))?;
            let (_, time) = largest_rms(table, acceleration, 2.0)?;
            let row = table.time.partition_point(|it| *it < time).min(displacement.len() - 1);
            share = share.min(-displacement[row] / own);
        }
        (self.deflection, self.share) = (Some(six(deflection)), Some(six(share)));
        let mut squares = 0.0;
        for k in 1..=gaps.len() {
            let gap = signal(table, &format!("vehicle.gap_{k:02}"))?;
            squares += gap.iter().map(|c| c * c).sum::<f64>() / gap.len() as f64;
        }
        self.gap_rms = Some(six((squares / gaps.len() as f64).sqrt()));
        if table.time.last().is_none_or(|end| *end < span.end) {
            return Ok(());
        }
        let of_gaps = density(table, gaps, 0.25, span)?;
        let of_girders = density(table, &accelerations(table)?, 0.25, span)?;
        self.gap_fast = Some(six(of_gaps.mean_square(4.0, f64::INFINITY).sqrt()));
        self.gap_hump = Some(six(hump(&of_gaps, 7.6, 2.0)));
        self.girder_hump = Some(six(hump(&of_girders, 7.6, 2.0)));
        self.gap_at_second = Some(six(of_gaps.mean_square(24.0, 26.0)));
        self.girder_at_second = Some(six(of_girders.mean_square(24.0, 26.0)));
        Ok(())
    }

    /// Whether the run reached its end.
    pub fn finished(&self) -> bool {
        self.status == "finished"
    }
}

/// All rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Dataset {
    /// In the order of the studies.
    pub rows: Vec<Row>,
}

impl Dataset {
    /// Where it is kept.
    pub fn file() -> PathBuf {
        crate::root().join("docs/paper/readings.csv")
    }

    /// The dataset that is kept.
    pub fn committed() -> Result<Self> {
        let file = Self::file();
        let failed = || format!("reading {}; make it with `cargo xtask readings`", file.display());
        let mut reader = csv::Reader::from_path(&file).with_context(failed)?;
        let rows = reader.deserialize().collect::<Result<_, _>>().with_context(failed)?;
        Ok(Self { rows })
    }

    /// As CSV.
    pub fn text(&self) -> Result<String> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in &self.rows {
            writer.serialize(row)?;
        }
        Ok(String::from_utf8(writer.into_inner()?)?)
    }

    /// The row of a run.
    pub fn row(&self, study: &str, case: &str) -> Result<&Row> {
        let found = self.rows.iter().find(|it| it.study == study && it.case == case);
        found.with_context(|| {
            format!("the dataset has no run \"{case}\" of {study}; run `cargo xtask readings`")
        })
    }
}
