//! Coupled modes from modes.json, as `maglev modes` writes it.

use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

/// Marks in spectra are of modes below this damping ratio: others leave no peak.
const PEAKED: f64 = 0.25;
/// Share of the guideway from which on a mode is one of the girder's.
const SHARE: f64 = 0.1;
/// Share from which on nothing but the girder moves.
const ALONE: f64 = 0.99;
/// Marks in a plot.
const MARKS: usize = 8;

/// The content of modes.json.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub(crate) struct File {
    pub(crate) modes: Modes,
}

/// The modes of a coupled system.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Modes {
    /// Whether all modes die away as the equations have them.
    pub stable: bool,
    /// The same as stepped.
    pub stepped_stable: bool,
    /// Communication step (s).
    pub step: f64,
    /// Where the system is linearised.
    pub operating_point: OperatingPoint,
    /// Units with states that are in no mode together with another unit's there.
    pub apart: Vec<Apart>,
    /// The modes, least damped first.
    pub modes: Vec<Mode>,
}

/// The point of linearisation.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct OperatingPoint {
    /// Time (s).
    pub time: f64,
}

/// A unit with states that are coupled with no other unit.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Apart {
    /// The instance, by its name in the scenario.
    pub instance: String,
    /// Number of its states.
    pub of: usize,
    /// Names of those states.
    pub states: Vec<String>,
}

/// One mode.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Mode {
    /// As the equations have it.
    pub continuous: Eigenvalue,
    /// As stepped.
    pub stepped: Option<Eigenvalue>,
    /// Shares of the instances.
    pub participation: IndexMap<String, f64>,
}

/// Frequency and damping.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Eigenvalue {
    /// Frequency |λ|/2π (Hz).
    pub frequency_hz: f64,
    /// Damping ratio −Re λ/|λ|.
    pub damping_ratio: f64,
    /// Im λ (rad/s); 0 of a motion that only creeps.
    pub imaginary: f64,
}

impl Modes {
    /// The least damped mode that oscillates and is not that of a girder alone, which nothing on it
    /// can change.
    #[must_use]
    pub fn least_damped(&self, guideway: Option<&str>) -> Option<&Mode> {
        let swinging = self.modes.iter().filter(|it| {
            let girder = guideway.and_then(|name| it.participation.get(name));
            it.continuous.imaginary > 0.0 && girder.is_none_or(|share| *share < ALONE)
        });
        swinging.min_by(|a, b| a.continuous.damping_ratio.total_cmp(&b.continuous.damping_ratio))
    }

    /// Modes with the guideway in them that show as peaks, each frequency once.
    #[must_use]
    pub fn of_girders(&self, guideway: &str) -> Vec<Eigenvalue> {
        let mut found: Vec<Eigenvalue> = Vec::new();
        for mode in &self.modes {
            let it = mode.continuous;
            let share = mode.participation.get(guideway).copied().unwrap_or(0.0);
            let new = found
                .iter()
                .all(|other| (other.frequency_hz - it.frequency_hz).abs() > 1e-3 * it.frequency_hz);
            let shows = it.imaginary > 0.0 && it.damping_ratio < PEAKED && share >= SHARE;
            if shows && new && found.len() < MARKS {
                found.push(it);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_marks_are_of_girder_modes_that_peak() {
        let mode = |frequency: f64, damping: f64, share: f64| {
            format!(
                r#"{{"continuous": {{"frequency_hz": {frequency}, "damping_ratio": {damping},
                "imaginary": 1.0, "real": -1.0}}, "participation": {{"g": {share}}}}}"#
            )
        };
        let list = [
            mode(7.1, 0.01, 1.0),
            mode(7.1, 0.01, 0.9),
            mode(6.4, 0.1, 0.4),
            mode(3.0, 0.01, 0.05),
            mode(9.0, 0.7, 0.9),
        ];
        let text = format!(r#"{{"stable": true, "modes": [{}]}}"#, list.join(","));
        let modes: Modes = serde_json::from_str(&text).unwrap();
        let marks: Vec<f64> = modes.of_girders("g").iter().map(|it| it.frequency_hz).collect();
        assert_eq!(marks, [7.1, 6.4]);
        let least = |name| modes.least_damped(name).unwrap().continuous.frequency_hz;
        // the empty girder at 7.1 Hz is as little damped, and first
        assert_eq!((least(None), least(Some("g"))), (7.1, 7.1));
        assert_eq!(modes.least_damped(Some("g")).unwrap().participation["g"], 0.9);
    }
}
