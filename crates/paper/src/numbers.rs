//! The numbers of the page, all out of results. `docs/paper/numbers.json` keeps them.

use std::path::PathBuf;

use analysis::series;
use anyhow::Result;
use serde::{Deserialize, Serialize};

use crate::{
    measure::{
        self, density, deviation, gaps, hump, largest, largest_rms, peak_frequencies, signal, six,
    },
    runs::{self, FREQUENCIES, MEANS, Mode},
};
/// Where the chirp's frequency is that of the girder's second mode, widely; equal to the time in s.
pub const SECOND: std::ops::Range<f64> = 22.0..28.0;
/// Between the girder's first and second mode, where nothing of it answers.
pub const BETWEEN: std::ops::Range<f64> = 15.0..20.0;

/// All of them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Numbers {
    /// Force at mid-span.
    pub standstill: Standstill,
    /// Force at a quarter of the span.
    pub quarter: Standstill,
    /// Figure 14, by stiffness and by mass.
    pub girders: Vec<Girder>,
    /// 5 km/h, irregularity as shipped.
    pub low_speed: Moving,
    /// 5 km/h, irregularity down to waves of 5 cm.
    pub short_waves: Moving,
}

/// The largest response in a span of time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// Size (m).
    pub size: f64,
    /// When (s), which is the chirp's frequency (Hz) at the same time.
    pub time: f64,
}

/// A train at rest under the chirp.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Standstill {
    /// Coupled modes of girder, magnets and vehicle.
    pub modes: Vec<Mode>,
    /// Any gap's deviation, at any time.
    pub gap: Response,
    /// Any gap's deviation while the chirp passes the second mode.
    pub gap_second: Response,
    /// Any gap's deviation between the modes.
    pub gap_between: Response,
    /// Vibration of the middle of the span.
    pub middle: Response,
    /// The same between the modes, and while the chirp passes the second mode.
    pub middle_between: Response,
    /// See above.
    pub middle_second: Response,
    /// Peaks of the gaps' spectrum, 2 to 50 Hz.
    pub gap_peaks: Vec<f64>,
}

/// A girder of figure 14.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Girder {
    /// First frequency, bare (Hz).
    pub frequency: u32,
    /// What was changed.
    pub means: String,
    /// Any gap's deviation.
    pub gap: Response,
    /// Vibration of the middle of the span.
    pub middle: Response,
    /// Static deflection there (m).
    pub static_deflection: f64,
    /// Coupled modes.
    pub modes: Vec<Mode>,
}

/// A train on its way.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Moving {
    /// Largest deflection of each span (m).
    pub deflections: [f64; 3],
    /// RMS of all gaps (m).
    pub gap_rms: f64,
    /// Smallest and largest gap (m).
    pub gap_range: [f64; 2],
    /// Largest RMS of a span's acceleration in 2 s (m/s²), and its deflection then over its largest.
    pub vibration: Vec<[f64; 2]>,
    /// How many times higher the gaps' density is around the girder's first and second frequency than
    /// beside them.
    pub gap_humps: [f64; 2],
    /// The same of the spans' accelerations.
    pub girder_humps: [f64; 2],
    /// RMS of the gaps above 4 Hz (m).
    pub gap_rms_fast: f64,
}

impl Numbers {
    /// Where they are kept.
    pub fn file() -> PathBuf {
        crate::root().join("docs/paper/numbers.json")
    }

    /// Those that are kept.
    #[cfg(test)]
    pub fn committed() -> Result<Self> {
        let file = Self::file();
        Ok(serde_json::from_slice(&std::fs::read(file)?)?)
    }

    /// Those of the results.
    pub fn measured() -> Result<Self> {
        let mut girders = Vec::new();
        for means in MEANS {
            for frequency in FREQUENCIES {
                girders.push(girder(frequency, means)?);
            }
        }
        let numbers = Self {
            standstill: standstill("standstill")?,
            quarter: standstill("standstill-quarter")?,
            girders,
            low_speed: moving("low-speed")?,
            short_waves: moving("low-speed-short-waves")?,
        };
        Ok(rounded(&numbers)?)
    }
}

/// The same with six significant digits.
fn rounded(numbers: &Numbers) -> Result<Numbers, serde_json::Error> {
    fn round(value: &mut serde_json::Value) {
        match value {
            serde_json::Value::Array(items) => items.iter_mut().for_each(round),
            serde_json::Value::Object(members) => members.values_mut().for_each(round),
            serde_json::Value::Number(number) if number.is_f64() => {
                *value = number.as_f64().map_or(serde_json::Value::Null, |x| six(x).into());
            }
            _ => {}
        }
    }
    let mut value = serde_json::to_value(numbers)?;
    round(&mut value);
    serde_json::from_value(value)
}

const MIDDLE: &str = "guideway.midspan_displacement_02";

fn standstill(name: &str) -> Result<Standstill> {
    let table = runs::table(name)?;
    let (gaps, middle) = (gaps(&table)?, vec![deviation(&table, MIDDLE)?]);
    let response = |signals: &[Vec<f64>], span| {
        let (size, time) = largest(&table, signals, &span);
        Response { size, time }
    };
    let whole = 0.0..f64::INFINITY;
    let spectrum = measure::response(&table, &gaps)?;
    Ok(Standstill {
        modes: runs::modes(name)?,
        gap: response(&gaps, whole.clone()),
        gap_second: response(&gaps, SECOND),
        gap_between: response(&gaps, BETWEEN),
        middle: response(&middle, whole),
        middle_between: response(&middle, BETWEEN),
        middle_second: response(&middle, SECOND),
        gap_peaks: peak_frequencies(&spectrum, &(2.0..50.0)),
    })
}

/// Any gap's deviation and the vibration of the middle of the span, over the whole run.
pub fn responses(table: &results::Table) -> Result<[Response; 2]> {
    let of = |signals: &[Vec<f64>]| {
        let (size, time) = largest(table, signals, &(0.0..f64::INFINITY));
        Response { size, time }
    };
    Ok([of(&gaps(table)?), of(&[deviation(table, MIDDLE)?])])
}

fn girder(frequency: u32, means: &str) -> Result<Girder> {
    let name = runs::girder(frequency, means);
    let table = runs::table(&name)?;
    let [gap, middle] = responses(&table)?;
    let static_deflection = -signal(&table, MIDDLE)?[0];
    let modes = runs::modes(&name)?;
    Ok(Girder { frequency, means: means.to_owned(), gap, middle, static_deflection, modes })
}

/// While the train is on the spans, and clear of the run-in, whose irregularity fades in over 10 m.
const ON_THE_SPANS: std::ops::Range<f64> = 10.0..65.0;

fn moving(name: &str) -> Result<Moving> {
    let table = runs::table(name)?;
    let statistic = |signal: &str, what: &str| runs::statistic(name, signal, what);
    let spans = ["01", "02", "03"];
    let mut deflections = [0.0; 3];
    let mut vibration = Vec::new();
    let mut accelerations = Vec::new();
    for (deflection, span) in deflections.iter_mut().zip(spans) {
        let displacement = format!("guideway.midspan_displacement_{span}");
        *deflection = -statistic(&displacement, "min")?;
        let acceleration = signal(&table, &format!("guideway.midspan_acceleration_{span}"))?;
        let (rms, time) = largest_rms(&table, acceleration, 2.0)?;
        let row = ((time - table.time[0]) * series::rate(&table.time)?).round() as usize;
        vibration.push([rms, -signal(&table, &displacement)?[row] / *deflection]);
        accelerations.push(acceleration.to_vec());
    }
    let names: Vec<String> = (1..=64).map(|k| format!("vehicle.gap_{k:02}")).collect();
    let all = |what| names.iter().map(|it| statistic(it, what)).collect::<Result<Vec<_>>>();
    let mean_square = all("rms")?.iter().map(|rms| rms * rms).sum::<f64>() / names.len() as f64;
    let spectrum = density(&table, &gaps(&table)?, 0.25, &ON_THE_SPANS)?;
    let of_girders = density(&table, &accelerations, 0.25, &ON_THE_SPANS)?;
    // twice and once 2 Hz wide: the magnets' pitch of 0.7 m makes a comb of 2 Hz at 5 km/h
    let humps = |spectrum| [hump(spectrum, 7.6, 2.0), hump(spectrum, 25.0, 1.0)];
    Ok(Moving {
        deflections,
        gap_rms: mean_square.sqrt(),
        gap_range: [
            all("min")?.into_iter().fold(f64::INFINITY, f64::min),
            all("max")?.into_iter().fold(0.0, f64::max),
        ],
        vibration,
        gap_humps: humps(&spectrum),
        girder_humps: humps(&of_girders),
        gap_rms_fast: spectrum.mean_square(4.0, f64::INFINITY).sqrt(),
    })
}
