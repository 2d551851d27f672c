//! What the report knows about maglev trains by the names of variables: which signals are gaps and
//! deflections, and the parameters of the guideway. Reports of other systems lack these parts.

use results::{RunResults, Statistics};
use serde::Serialize;

use crate::layout_fmu::LayoutFmu;
use crate::names;

/// The meaning of a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SignalRole {
    /// The air gap of a magnet.
    Gap,
    /// The deflection of a girder in the middle of its span.
    Midspan,
    /// The deflection of a girder at a quarter of its span.
    Quarter,
}

/// The meaning of the signal `instance.variable`, if it is known.
#[must_use]
pub fn role(signal: &str) -> Option<SignalRole> {
    let (_, variable) = signal.split_once('.')?;
    match names::row(variable)? {
        names::GAP => Some(SignalRole::Gap),
        names::MIDSPAN => Some(SignalRole::Midspan),
        names::QUARTER => Some(SignalRole::Quarter),
        _ => None,
    }
}

/// A number at the top of the report.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KeyFigure {
    /// Label of the number.
    pub label: &'static str,
    /// The number, in SI units.
    pub value: f64,
    /// Unit of measure; empty for a ratio.
    pub unit: &'static str,
    /// Signal and time of the number, or the number of signals.
    pub note: String,
}

/// Key figures of a run: deflections and gaps.
#[must_use]
pub fn figures(run: &RunResults) -> Vec<KeyFigure> {
    let of = |wanted: SignalRole| {
        let all = run.signals.iter().filter(move |(name, _)| role(name) == Some(wanted));
        let measured = all.filter_map(|(name, it)| Some((name, it.statistics.as_ref()?)));
        measured.collect::<Vec<(&String, &Statistics)>>()
    };
    let mut figures = Vec::new();
    figures.extend(deflections(&of(SignalRole::Midspan), &of(SignalRole::Quarter)));
    let gaps = of(SignalRole::Gap);
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
            KeyFigure { label: "RMS of the gaps", value: mean.sqrt(), unit: "m", note: several },
            KeyFigure {
                label: "Smallest gap",
                value: low.1.min,
                unit: "m",
                note: moment(low.0, low.1.time_of_min),
            },
            KeyFigure {
                label: "Largest gap",
                value: high.1.max,
                unit: "m",
                note: moment(high.0, high.1.time_of_max),
            },
        ]);
    }
    figures
}

/// The largest deflection at mid-span, and that at quarter span if it is larger or if there is no other.
fn deflections(
    middle: &[(&String, &Statistics)],
    quarter: &[(&String, &Statistics)],
) -> Vec<KeyFigure> {
    let deepest = |of: &[(&String, &Statistics)]| {
        let it = of.iter().min_by(|a, b| a.1.min.total_cmp(&b.1.min))?;
        Some((-it.1.min, moment(it.0, it.1.time_of_min)))
    };
    let mut figures = Vec::new();
    let in_the_middle = deepest(middle);
    if let Some((value, note)) = in_the_middle.clone() {
        figures.push(KeyFigure { label: "Largest deflection at mid-span", value, unit: "m", note });
    }
    if let Some((value, mut note)) = deepest(quarter)
        && in_the_middle.as_ref().is_none_or(|(middle, _)| value > *middle)
    {
        if in_the_middle.is_none() {
            note += &format!("; {} is not recorded", names::MIDSPAN);
        }
        figures.push(KeyFigure {
            label: "Largest deflection at quarter span",
            value,
            unit: "m",
            note,
        });
    }
    figures
}

/// A signal and a time, which is rounded to hide the binary error of n·h.
fn moment(signal: &str, time: f64) -> String {
    format!("{signal} at {} s", (time * 1e9).round() / 1e9)
}

/// What the parameters of a guideway define.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GuidewayFacts {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// Modes of an empty girder: frequency f·√(stiffness/mass) (Hz) and damping ratio.
    pub modes: Vec<GirderModeFacts>,
    /// The chirp A sin(π (t − t₀)²), if it is on. Its frequency in Hz is t − t₀ in s.
    pub chirp: Option<ChirpFacts>,
    /// The random profile, if it is on.
    pub irregularity: Option<TargetDensity>,
}

/// A mode of an empty girder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GirderModeFacts {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Damping ratio.
    pub damping: Option<f64>,
}

/// A force with rising frequency.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ChirpFacts {
    /// Start time (s).
    pub start: f64,
    /// Frequency at which it ends (Hz).
    pub end_frequency: f64,
}

/// The one-sided PSD of a random profile as a magnet feels it: A/Ω², and of each wave what the mean over
/// the pole leaves, sin(Ωℓ/2)/(Ωℓ/2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TargetDensity {
    /// A (m·rad).
    pub amplitude: f64,
    /// Shortest wavelength (m).
    pub shortest: f64,
    /// Longest wavelength (m).
    pub longest: f64,
    /// Length ℓ of the pole (m); 0 if magnets feel the profile at their centres.
    pub pole: f64,
}

impl GuidewayFacts {
    /// Reads the first FMU that is a guideway. `None` if there is none, or if it cannot be read.
    #[must_use]
    pub fn of(run: &RunResults) -> Option<Self> {
        let unit = LayoutFmu::find(run.scenario.as_ref()?, names::GUIDEWAY_FILE).ok()??;
        let number = |name: &str| unit.parameter(name).filter(|value| value.is_finite());
        let on = |name: &str| number(name).is_some_and(|value| value != 0.0);
        let stiffness = number(names::STIFFNESS_FACTOR).unwrap_or(1.0);
        let factor = (stiffness / number(names::MASS_FACTOR).unwrap_or(1.0)).sqrt();
        let count = number(names::MODES).unwrap_or(0.0);
        let modes = (1..=99_usize).take_while(|&k| k as f64 <= count).map_while(|k| {
            let frequency = factor * number(&names::numbered(names::FREQUENCY, k, 99))?;
            Some(GirderModeFacts {
                frequency,
                damping: number(&names::numbered(names::DAMPING, k, 99)),
            })
        });
        let chirp = || {
            let start = number(names::CHIRP_START)?;
            Some(ChirpFacts { start, end_frequency: number(names::CHIRP_END_FREQUENCY)? })
        };
        let target = || {
            Some(TargetDensity {
                amplitude: number(names::IRREGULARITY_AMPLITUDE)?,
                shortest: number(names::IRREGULARITY_SHORTEST_WAVE)?,
                longest: number(names::IRREGULARITY_LONGEST_WAVE)?,
                pole: if on(names::IRREGULARITY_AVERAGED) {
                    number(names::POLE_LENGTH)?
                } else {
                    0.0
                },
            })
        };
        let file = unit.value(names::IRREGULARITY_FILE);
        let from_file = file.is_some_and(|it| it.as_str().is_some_and(|name| !name.is_empty()));
        Some(Self {
            instance: unit.name().to_owned(),
            modes: modes.collect(),
            chirp: if on(names::CHIRP_ON) { chirp() } else { None },
            irregularity: if on(names::IRREGULARITY_ON) && !from_file { target() } else { None },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_roles_are_known_by_their_names() {
        assert_eq!(role("vehicle.gap_07"), Some(SignalRole::Gap));
        assert_eq!(role("guideway.midspan_displacement_12"), Some(SignalRole::Midspan));
        assert_eq!(role("guideway.quarter_displacement_12"), Some(SignalRole::Quarter));
        for other in ["vehicle.gap_rate_07", "ems_01.gap", "gap_01", "a.b_1", "a."] {
            assert_eq!(role(other), None, "{other}");
        }
    }

    /// If only the quarter point is recorded, the figure names it and says that mid-span is missing. If both
    /// are recorded, the quarter point is shown if its deflection is larger.
    #[test]
    fn issue_a_deflection_names_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let shown = |middle: Option<f64>, quarter: Option<f64>| {
            let signal = |row: &str, min: f64| {
                format!(
                    r#""g.{row}_displacement_1": {{"points": 2, "min": {min}, "time_of_min": 1.5}}"#
                )
            };
            let all: Vec<String> = [("midspan", middle), ("quarter", quarter)]
                .into_iter()
                .filter_map(|(row, min)| Some(signal(row, min?)))
                .collect();
            let text = format!(r#"{{"signals": {{{}}}}}"#, all.join(","));
            std::fs::write(folder.path().join("summary.json"), text).unwrap();
            let figures = figures(&RunResults::read(folder.path()).unwrap());
            figures.into_iter().map(|it| (it.label, it.value, it.note)).collect::<Vec<_>>()
        };
        let middle = "Largest deflection at mid-span";
        let quarter = "Largest deflection at quarter span";
        let note = |row: &str| format!("g.{row}_displacement_1 at 1.5 s");
        let both = shown(Some(-3.538e-3), Some(-2.501e-3));
        assert_eq!(both, [(middle, 3.538e-3, note("midspan"))]);
        let alone = format!("{}; midspan_displacement is not recorded", note("quarter"));
        assert_eq!(shown(None, Some(-2.501e-3)), [(quarter, 2.501e-3, alone)]);
        let chirp = shown(Some(-1e-4), Some(-2e-4));
        assert_eq!(chirp, [(middle, 1e-4, note("midspan")), (quarter, 2e-4, note("quarter"))]);
        assert_eq!(shown(None, None), []);
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
        let figures = figures(&RunResults::read(folder.path()).unwrap());
        let values: Vec<f64> = figures.iter().map(|it| it.value).collect();
        // √((9 + 16)/2) mm
        assert_eq!(values[0], 0.0035);
        assert!((values[1] - 12.5_f64.sqrt() * 1e-3).abs() < 1e-15);
        assert_eq!(values[2..], [0.006, 0.009]);
        assert_eq!(figures[2].note, "v.gap_2 at 2.5 s");
    }
}
