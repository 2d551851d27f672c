//! What the report knows of this system by name: which signals are gaps and deflections, and what the
//! guideway's parameters say. A run without these names gets a report without these parts.

use serde::Serialize;

use crate::run::{Run, Signal};
use crate::unit::Unit;

/// Names of the variables, `#` stands for a number.
const GAP: &str = "gap_#";
const DEFLECTIONS: [&str; 2] = ["midspan_displacement_#", "quarter_displacement_#"];
/// File in the unit that is the guideway.
const GUIDEWAY: &str = "guideway.json";

/// What a signal is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// The air gap of a magnet.
    Gap,
    /// The deflection of a girder.
    Deflection,
}

/// What a signal `instance.variable` is, if it is known.
#[must_use]
pub fn role(signal: &str) -> Option<Role> {
    let (_, variable) = signal.split_once('.')?;
    let stem = variable.trim_end_matches(|letter: char| letter.is_ascii_digit());
    if stem.len() == variable.len() {
        return None;
    }
    let pattern = format!("{stem}#");
    if pattern == GAP {
        Some(Role::Gap)
    } else {
        DEFLECTIONS.contains(&pattern.as_str()).then_some(Role::Deflection)
    }
}

/// A number at the top of the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it is.
    pub label: &'static str,
    /// In the unit's SI base.
    pub value: f64,
    /// Unit of measurement; empty for a ratio.
    pub unit: &'static str,
    /// Which signal, when, or of how many.
    pub note: String,
}

/// The numbers that are asked for first.
#[must_use]
pub fn figures(run: &Run) -> Vec<Figure> {
    let of = |wanted: Role| {
        let all = run.summary.signals.iter();
        let chosen = all.filter(move |(name, it)| role(name) == Some(wanted) && it.points > 0);
        chosen.collect::<Vec<(&String, &Signal)>>()
    };
    let mut figures = Vec::new();
    let deepest = of(Role::Deflection).into_iter().min_by(|a, b| a.1.min.total_cmp(&b.1.min));
    if let Some((name, it)) = deepest {
        let note = moment(name, it.time_of_min);
        figures.push(Figure { label: "Largest deflection", value: -it.min, unit: "m", note });
    }
    let gaps = of(Role::Gap);
    if let (Some(low), Some(high)) = (
        gaps.iter().min_by(|a, b| a.1.min.total_cmp(&b.1.min)),
        gaps.iter().max_by(|a, b| a.1.max.total_cmp(&b.1.max)),
    ) {
        #[expect(clippy::cast_precision_loss, reason = "a number of magnets")]
        let mean = gaps.iter().map(|(_, it)| it.rms * it.rms).sum::<f64>() / gaps.len() as f64;
        let several = match gaps.len() {
            1 => gaps[0].0.clone(),
            count => format!("over {count} gaps"),
        };
        figures.extend([
            Figure { label: "RMS of the gaps", value: mean.sqrt(), unit: "m", note: several },
            Figure {
                label: "Smallest gap",
                value: low.1.min,
                unit: "m",
                note: moment(low.0, low.1.time_of_min),
            },
            Figure {
                label: "Largest gap",
                value: high.1.max,
                unit: "m",
                note: moment(high.0, high.1.time_of_max),
            },
        ]);
    }
    figures
}

/// A signal and when; a time n·h with what a decimal fraction lacks in binary left off.
fn moment(signal: &str, time: f64) -> String {
    format!("{signal} at {} s", (time * 1e9).round() / 1e9)
}

/// What the guideway's parameters say.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Guideway {
    /// Name of the instance.
    pub instance: String,
    /// Modes of an empty girder: frequency f·√(stiffness/mass) (Hz) and damping ratio.
    pub modes: Vec<GirderMode>,
    /// The chirp A sin(π (t − t₀)²), if it is on: its frequency is t − t₀ (Hz for s).
    pub chirp: Option<Chirp>,
    /// The random profile, if it is on.
    pub irregularity: Option<Target>,
}

/// A mode of an empty girder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GirderMode {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Damping ratio.
    pub damping: Option<f64>,
}

/// A force with rising frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Chirp {
    /// When it begins (s).
    pub start: f64,
    /// Frequency at which it ends (Hz).
    pub end_frequency: f64,
}

/// The one-sided PSD A/Ω² that a random profile is made to have.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Target {
    /// A (m·rad).
    pub amplitude: f64,
    /// Shortest wavelength (m).
    pub shortest: f64,
    /// Longest wavelength (m).
    pub longest: f64,
}

impl Guideway {
    /// Of the first unit that is a guideway; `None` if there is none or its file has gone.
    #[must_use]
    pub fn of(run: &Run) -> Option<Self> {
        let unit = Unit::find(run.scenario.as_ref()?, GUIDEWAY).ok()??;
        let number = |name: &str| unit.parameter(name).filter(|value| value.is_finite());
        let on = |name: &str| number(name).is_some_and(|value| value != 0.0);
        let stiffness = number("stiffness_factor").unwrap_or(1.0);
        let factor = (stiffness / number("mass_factor").unwrap_or(1.0)).sqrt();
        let count = number("modes").unwrap_or(0.0);
        let modes = (1..=99).take_while(|&k| f64::from(k) <= count).map_while(|k| {
            let frequency = factor * number(&format!("frequency_{k:02}"))?;
            Some(GirderMode { frequency, damping: number(&format!("damping_{k:02}")) })
        });
        let chirp = || {
            let start = number("chirp_start")?;
            Some(Chirp { start, end_frequency: number("chirp_end_frequency")? })
        };
        let target = || {
            Some(Target {
                amplitude: number("irregularity_amplitude")?,
                shortest: number("irregularity_shortest_wave")?,
                longest: number("irregularity_longest_wave")?,
            })
        };
        let file = unit.value("irregularity_file");
        let from_file = file.is_some_and(|it| it.as_str().is_some_and(|name| !name.is_empty()));
        Some(Self {
            instance: unit.name().to_owned(),
            modes: modes.collect(),
            chirp: if on("chirp_on") { chirp() } else { None },
            irregularity: if on("irregularity_on") && !from_file { target() } else { None },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_roles_are_known_by_their_names() {
        assert_eq!(role("vehicle.gap_07"), Some(Role::Gap));
        assert_eq!(role("guideway.midspan_displacement_12"), Some(Role::Deflection));
        for other in ["vehicle.gap_rate_07", "ems_01.gap", "gap_01", "a.b_1", "a."] {
            assert_eq!(role(other), None, "{other}");
        }
    }

    #[test]
    fn analytic_figures_are_the_extremes_over_all_signals() {
        let text = r#"{"signals": {
            "v.gap_1": {"points": 2, "min": 0.007, "time_of_min": 1.5, "max": 0.009, "rms": 0.003},
            "v.gap_2": {"points": 2, "min": 0.006, "time_of_min": 2.5, "max": 0.008, "rms": 0.004},
            "g.midspan_displacement_1": {"points": 2, "min": -0.0035, "time_of_min": 3.5, "max": 0}
        }}"#;
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("summary.json"), text).unwrap();
        let figures = figures(&Run::read(folder.path()).unwrap());
        let values: Vec<f64> = figures.iter().map(|it| it.value).collect();
        // √((9 + 16)/2) mm
        assert_eq!(values[0], 0.0035);
        assert!((values[1] - 12.5_f64.sqrt() * 1e-3).abs() < 1e-15);
        assert_eq!(values[2..], [0.006, 0.009]);
        assert_eq!(figures[2].note, "v.gap_2 at 2.5 s");
    }
}
