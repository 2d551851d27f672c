//! Which modes of the coupled system the report shows.

use results::modes::{CoupledMode, CoupledModes, Eigenvalue};

/// Spectra mark modes below this damping ratio. Others cause no peak.
const PEAKED: f64 = 0.25;
/// Participation of the guideway from which a mode is called one of the girders.
const SHARE: f64 = 0.1;
/// Participation of the guideway from which hardly anything but a girder moves.
const ALONE: f64 = 0.99;
/// A mode has the frequency of an empty girder if it is this close, relatively. A train on the girder shifts the
/// frequency by far more, and the eigenvalues are more exact.
const SAME: f64 = 1e-6;
/// Most marks in a plot.
const MARKS: usize = 8;

/// The guideway of a run, as far as modes are told apart by it.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct GuidewayModes {
    /// The instance, by its name in the scenario.
    pub(crate) instance: String,
    /// Natural frequencies of the empty girders (Hz).
    pub(crate) frequencies: Vec<f64>,
}

impl GuidewayModes {
    /// Whether a mode is that of a girder without train: only a girder moves, with its own frequency.
    pub(crate) fn is_empty_girder(&self, mode: &CoupledMode) -> bool {
        let share = mode.participation.get(&self.instance);
        let frequency = mode.continuous.frequency_hz;
        let own = |it: &f64| (it - frequency).abs() <= SAME * frequency;
        share.is_some_and(|share| *share >= ALONE) && self.frequencies.iter().any(own)
    }
}

/// The least damped mode that oscillates, without those of empty girders: the vehicle does not influence them.
pub(crate) fn least_damped<'a>(
    modes: &'a CoupledModes,
    guideway: Option<&GuidewayModes>,
) -> Option<&'a CoupledMode> {
    let oscillating = modes.modes.iter().filter(|it| {
        it.continuous.imaginary > 0.0
            && !guideway.is_some_and(|girders| girders.is_empty_girder(it))
    });
    oscillating.min_by(|a, b| a.continuous.damping_ratio.total_cmp(&b.continuous.damping_ratio))
}

/// Modes of the girders that cause peaks, each frequency once.
pub(crate) fn of_girders(modes: &CoupledModes, guideway: &str) -> Vec<Eigenvalue> {
    let mut found: Vec<Eigenvalue> = Vec::new();
    for mode in &modes.modes {
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
        let modes: CoupledModes = serde_json::from_str(&text).unwrap();
        let marks: Vec<f64> = of_girders(&modes, "g").iter().map(|it| it.frequency_hz).collect();
        assert_eq!(marks, [7.1, 6.4]);
        let least = |girders: Option<&GuidewayModes>| {
            let it = least_damped(&modes, girders).unwrap();
            (it.continuous.frequency_hz, it.participation["g"])
        };
        let girders = GuidewayModes { instance: "g".to_owned(), frequencies: vec![7.1, 28.4] };
        // the empty girder at 7.1 Hz is as little damped, and first
        assert_eq!((least(None), least(Some(&girders))), ((7.1, 1.0), (7.1, 0.9)));
    }

    /// A girder under a train moves alone in its higher modes, but with a shifted frequency.
    #[test]
    fn issue_the_mode_of_a_loaded_span_is_not_that_of_an_empty_girder() {
        let girders = GuidewayModes { instance: "g".to_owned(), frequencies: vec![7.1, 28.4] };
        let mode = |frequency_hz: f64, share: f64| CoupledMode {
            continuous: Eigenvalue { frequency_hz, ..Eigenvalue::default() },
            participation: [("g".to_owned(), share)].into_iter().collect(),
            ..CoupledMode::default()
        };
        assert!(girders.is_empty_girder(&mode(28.4 * (1.0 + 1e-9), 1.0)));
        assert!(!girders.is_empty_girder(&mode(28.4 * 1.001, 0.999)));
        assert!(!girders.is_empty_girder(&mode(28.4, 0.5)));
    }
}
