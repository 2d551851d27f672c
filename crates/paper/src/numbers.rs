//! The numbers of the page, all out of results. `docs/paper/numbers.json` keeps them.

use std::path::PathBuf;

use analysis::{series, spectrum::Spectrum};
use anyhow::Result;
use results::Table;
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
    /// The bare girder after an impulse, figure 5.
    pub impulse: Impulse,
    /// The resonance that stops and skids limit, figure 2.
    pub limited: Limited,
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
    /// The same where magnets feel the track at their centres, not the mean over their poles.
    pub at_centres: Moving,
    /// With waves down to 5 cm: density around 25 Hz over that of girders without their second mode, of the gaps and of
    /// the spans' accelerations.
    pub second_mode: [f64; 2],
}

/// What the free vibration of the bare girder gives, first mode first.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Impulse {
    /// Natural frequencies (Hz).
    pub frequencies: [f64; 2],
    /// Damping ratios.
    pub damping: [f64; 2],
}

/// A gap in resonance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limited {
    /// Growth of its amplitude before the first contact (1/s).
    pub growth: f64,
    /// Time of the first contact (s).
    pub contact: f64,
    /// Smallest and largest value of any gap (m).
    pub gap_range: [f64; 2],
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
    /// How many times higher the gaps' density is around the girder's first frequency than beside it.
    pub gap_hump: f64,
    /// The same of the spans' accelerations.
    pub girder_hump: f64,
    /// RMS of the gaps above 4 Hz (m).
    pub gap_rms_fast: f64,
}

impl Numbers {
    /// Where they are kept.
    pub fn file() -> PathBuf {
        crate::root().join("docs/paper/numbers.json")
    }

    /// Those that are kept.
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
            impulse: impulse()?,
            limited: limited()?,
            standstill: standstill("standstill")?,
            quarter: standstill("standstill-quarter")?,
            girders,
            low_speed: moving("low-speed")?,
            short_waves: moving(runs::SHORT_WAVES)?,
            at_centres: moving(runs::AT_CENTRES)?,
            second_mode: second_mode()?,
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

fn impulse() -> Result<Impulse> {
    let table = runs::table(runs::IMPULSE)?;
    let sensor = signal(&table, "guideway.sensor_acceleration")?;
    // windows of so many seconds, in which each mode decays to about a third
    let first = measure::free_mode(&table, sensor, 7.1, 2.0)?;
    let second = measure::free_mode(&table, sensor, 24.9, 0.4)?;
    Ok(Impulse { frequencies: [first.0, second.0], damping: [first.1, second.1] })
}

fn limited() -> Result<Limited> {
    let table = runs::table(runs::LIMITED)?;
    let inner = [deviation(&table, "vehicle.gap_28")?];
    let size = |span| largest(&table, &inner, &span).0;
    let statistic = |k: usize, what: &str| runs::statistic(runs::LIMITED, &gap_name(k), what);
    let all = |what| (1..=64).map(|k| statistic(k, what)).collect::<Result<Vec<_>>>();
    let mut contact = f64::INFINITY;
    for k in 1..=64 {
        let force = signal(&table, &format!("vehicle.contact_force_{k:02}"))?;
        let touches = table.time.iter().zip(force).find(|(_, force)| **force != 0.0);
        contact = contact.min(touches.map_or(f64::INFINITY, |(time, _)| *time));
    }
    Ok(Limited {
        growth: (size(14.0..15.0) / size(10.0..11.0)).ln() / 4.0,
        contact,
        gap_range: [
            all("min")?.into_iter().fold(f64::INFINITY, f64::min),
            all("max")?.into_iter().fold(0.0, f64::max),
        ],
    })
}

fn gap_name(k: usize) -> String {
    format!("vehicle.gap_{k:02}")
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
pub fn responses(table: &Table) -> Result<[Response; 2]> {
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
pub const ON_THE_SPANS: std::ops::Range<f64> = 10.0..65.0;

fn moving(name: &str) -> Result<Moving> {
    let table = runs::table(name)?;
    let statistic = |signal: &str, what: &str| runs::statistic(name, signal, what);
    let spans = ["01", "02", "03"];
    let mut deflections = [0.0; 3];
    let mut vibration = Vec::new();
    for (deflection, span) in deflections.iter_mut().zip(spans) {
        let displacement = format!("guideway.midspan_displacement_{span}");
        *deflection = -statistic(&displacement, "min")?;
        let acceleration = signal(&table, &format!("guideway.midspan_acceleration_{span}"))?;
        let (rms, time) = largest_rms(&table, acceleration, 2.0)?;
        let row = ((time - table.time[0]) * series::rate(&table.time)?).round() as usize;
        vibration.push([rms, -signal(&table, &displacement)?[row] / *deflection]);
    }
    let names: Vec<String> = (1..=64).map(|k| format!("vehicle.gap_{k:02}")).collect();
    let all = |what| names.iter().map(|it| statistic(it, what)).collect::<Result<Vec<_>>>();
    let mean_square = all("rms")?.iter().map(|rms| rms * rms).sum::<f64>() / names.len() as f64;
    let [of_gaps, of_girders] = densities(&table)?;
    // Twice 2 Hz wide: at 5 km/h the magnets' pitch of 0.7 m makes a comb of 2 Hz, and what their poles
    // of 0.65 m do not feel one of 2.1 Hz.
    let around_first = |density| hump(density, 7.6, 2.0);
    Ok(Moving {
        deflections,
        gap_rms: mean_square.sqrt(),
        gap_range: [
            all("min")?.into_iter().fold(f64::INFINITY, f64::min),
            all("max")?.into_iter().fold(0.0, f64::max),
        ],
        vibration,
        gap_hump: around_first(&of_gaps),
        girder_hump: around_first(&of_girders),
        gap_rms_fast: of_gaps.mean_square(4.0, f64::INFINITY).sqrt(),
    })
}

/// Mean densities of all gaps and of the spans' accelerations, while the train is on the spans.
fn densities(table: &Table) -> Result<[Spectrum; 2]> {
    let of = |signals: &[Vec<f64>]| density(table, signals, 0.25, &ON_THE_SPANS);
    Ok([of(&gaps(table)?)?, of(&accelerations(table)?)?])
}

/// The spans' accelerations.
pub fn accelerations(table: &Table) -> Result<Vec<Vec<f64>>> {
    let of = |k| deviation(table, &format!("guideway.midspan_acceleration_{k}"));
    ["01", "02", "03"].map(of).into_iter().collect()
}

/// What the second mode adds around its frequency. A comparison with the bands beside it would show the
/// combs of pitch and poles, and the end of the waves at 28 Hz.
fn second_mode() -> Result<[f64; 2]> {
    let around = |name| -> Result<[f64; 2]> {
        Ok(densities(&runs::table(name)?)?.map(|it| it.mean_square(24.0, 26.0)))
    };
    let (with, without) = (around(runs::SHORT_WAVES)?, around(runs::ONE_MODE)?);
    Ok([with[0] / without[0], with[1] / without[1]])
}
