//! Which modes of the coupled system the report shows.

use results::modes::{CoupledMode, CoupledModes, Eigenvalue};

/// Spectra mark modes below this damping ratio. Others cause no peak.
const PEAKED: f64 = 0.25;
/// Participation of the guideway from which a mode is called one of the girders.
const SHARE: f64 = 0.1;
/// Participation of the guideway from which only a girder moves.
pub(crate) const ALONE: f64 = 0.99;
/// Most marks in a plot.
const MARKS: usize = 8;

/// The least damped mode that oscillates, without those in which only a girder moves: the vehicle does
/// not influence them.
pub(crate) fn least_damped<'a>(
    modes: &'a CoupledModes,
    guideway: Option<&str>,
) -> Option<&'a CoupledMode> {
    let oscillating = modes.modes.iter().filter(|it| {
        let girder = guideway.and_then(|name| it.participation.get(name));
        it.continuous.imaginary > 0.0 && girder.is_none_or(|share| *share < ALONE)
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
        let least = |name| least_damped(&modes, name).unwrap().continuous.frequency_hz;
        // the empty girder at 7.1 Hz is as little damped, and first
        assert_eq!((least(None), least(Some("g"))), (7.1, 7.1));
        assert_eq!(least_damped(&modes, Some("g")).unwrap().participation["g"], 0.9);
    }
}
