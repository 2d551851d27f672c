//! What a report calls a run: the title of its scenario, or what ran if that title no longer fits.

use results::{PlotAsRun, RunResults};
use serde_json::Value;

use crate::evidence::RunEvidence;
use crate::layout_fmu::LayoutFmu;
use crate::names;

/// A number in a title fits if it is this close, relatively: titles round.
const ROUNDED: f64 = 0.02;

/// The title of a run, with what distinguishes the run from its scenario.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RunTitle {
    pub(crate) text: String,
    /// Settings of the command line that changed the scenario: `gain=6`.
    pub(crate) changes: Vec<String>,
    /// The title of the scenario, if `text` says something else.
    pub(crate) of_scenario: Option<String>,
    ran: Option<WhatRan>,
}

impl RunTitle {
    pub(crate) fn of(run: &RunResults) -> Self {
        let given = run.title();
        let list = run.summary.get("overrides").and_then(Value::as_array);
        let texts = list.into_iter().flatten().filter_map(Value::as_str);
        let changes: Vec<String> = texts.map(str::to_owned).collect();
        let ran = WhatRan::of(run);
        if changes.is_empty() && ran.as_ref().is_none_or(|it| it.fits(&given)) {
            return Self { text: given, changes, of_scenario: None, ran };
        }
        let text = ran.as_ref().map_or_else(|| format!("{given}, changed"), WhatRan::sentence);
        Self { text, changes, of_scenario: Some(given), ran }
    }

    /// Removes titles of plots that name speeds or spans that are not those of the run.
    pub(crate) fn remove_stale_titles(&self, plots: &mut [PlotAsRun]) {
        let Some(ran) = &self.ran else { return };
        plots.iter_mut().filter(|plot| !ran.fits(&plot.title)).for_each(|plot| plot.title.clear());
    }
}

/// The train and the track of a run.
#[derive(Debug, Clone, PartialEq)]
struct WhatRan {
    vehicle: String,
    /// Largest speed (m/s).
    speed: f64,
    /// Numbers of consecutive spans of one length, with that length (m).
    spans: Vec<(usize, f64)>,
}

impl WhatRan {
    /// `None` if the run has no vehicle of this project, or if its files cannot be read any more.
    fn of(run: &RunResults) -> Option<Self> {
        let unit = LayoutFmu::find(run.scenario.as_ref()?, names::VEHICLE_FILE).ok()??;
        let layout = unit.layout(multibody::VehicleDescription::from_json).ok()?;
        let evidence = RunEvidence::of(run);
        let speed = criteria::Evidence::speed(&evidence).ok()?;
        let lengths = evidence.girders().map(|it| it.lengths()).unwrap_or_default();
        let mut spans: Vec<(usize, f64)> = Vec::new();
        for length in lengths {
            match spans.last_mut() {
                Some((count, last)) if (*last - length).abs() < 1e-6 * length => *count += 1,
                _ => spans.push((1, length)),
            }
        }
        Some(Self { vehicle: layout.name, speed, spans })
    }

    fn sentence(&self) -> String {
        let spans = self.spans.iter().map(|(count, length)| match count {
            1 => format!("1 span of {} m", rounded(*length)),
            _ => format!("{count} spans of {} m", rounded(*length)),
        });
        let spans = spans.collect::<Vec<_>>().join(", ");
        let speed = format!("{} km/h", rounded(3.6 * self.speed));
        let Self { vehicle, .. } = self;
        match (self.speed > 0.0, spans.is_empty()) {
            (true, true) => format!("Vehicle {vehicle} at {speed} on a rigid track"),
            (true, false) => format!("Vehicle {vehicle} at {speed} over {spans}"),
            (false, true) => format!("Vehicle {vehicle} at standstill on a rigid track"),
            (false, false) => format!("Vehicle {vehicle} at standstill on {spans}"),
        }
    }

    /// Whether speeds and span lengths that a title names are those of the run.
    fn fits(&self, title: &str) -> bool {
        let near = |a: f64, b: f64| (a - b).abs() <= ROUNDED * a.abs().max(b.abs());
        let speeds = before(title, " km/h");
        let speed = speeds.is_empty() || speeds.iter().any(|it| near(*it, 3.6 * self.speed));
        let mut lengths = before(title, " m span");
        lengths.extend(before(title, " m girder"));
        let known = |it: &f64| self.spans.iter().any(|(_, length)| near(*it, *length));
        speed && lengths.iter().all(known)
    }
}

/// The numbers before a unit in a text.
fn before(text: &str, unit: &str) -> Vec<f64> {
    let number = |(at, _): (usize, &str)| {
        let head = &text[..at];
        let words = head.trim_end_matches(|letter: char| letter.is_ascii_digit() || letter == '.');
        head[words.len()..].parse().ok()
    };
    text.match_indices(unit).filter_map(number).collect()
}

/// A number with at most three decimals.
fn rounded(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// Names of runs by their folders, with as many parents as distinguish them.
pub(crate) fn distinct_names(runs: &[RunResults]) -> Vec<String> {
    let last = |run: &RunResults, parts: usize| {
        let path = std::path::absolute(&run.folder).unwrap_or_else(|_| run.folder.clone());
        let all: Vec<String> =
            path.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        all[all.len().saturating_sub(parts)..].join("/")
    };
    let mut names: Vec<String> = runs.iter().map(RunResults::name).collect();
    for parts in 2..6 {
        let now = names.clone();
        for (k, name) in names.iter_mut().enumerate() {
            if now.iter().filter(|it| **it == now[k]).count() > 1 {
                *name = last(&runs[k], parts);
            }
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ran(speed: f64, spans: &[(usize, f64)]) -> WhatRan {
        WhatRan { vehicle: "two-car".to_owned(), speed, spans: spans.to_vec() }
    }

    #[test]
    fn analytic_a_title_fits_if_its_numbers_are_those_of_the_run() {
        let slow = ran(5.0 / 3.6, &[(3, 25.0)]);
        assert!(slow.fits("5 km/h over three 25 m spans with irregularity"));
        assert!(slow.fits("My bridge, variant 3") && slow.fits("Waves of 5 cm, ü1.2.3 km/h"));
        let fast = ran(10.0 / 3.6, &[(3, 30.0)]);
        for stale in ["5 km/h over a girder", "over three 25 m spans", "a 25 m girder"] {
            assert!(!fast.fits(stale), "{stale}");
        }
        assert_eq!(fast.sentence(), "Vehicle two-car at 10 km/h over 3 spans of 30 m");
        let standing = ran(0.0, &[(1, 25.0), (2, 30.5)]);
        assert_eq!(
            standing.sentence(),
            "Vehicle two-car at standstill on 1 span of 25 m, 2 spans of 30.5 m"
        );
    }

    #[test]
    fn issue_a_changed_run_does_not_claim_to_be_its_scenario() {
        let folder = tempfile::tempdir().unwrap();
        let title = |overrides: &str| {
            let text = format!(r#"{{"title": "Two masses", "overrides": [{overrides}]}}"#);
            std::fs::write(folder.path().join("summary.json"), text).unwrap();
            RunTitle::of(&RunResults::read(folder.path()).unwrap())
        };
        assert_eq!(title("").text, "Two masses");
        let changed = title("\"a.gain=6\"");
        assert_eq!(
            (changed.text.as_str(), &*changed.changes),
            ("Two masses, changed", &["a.gain=6".to_owned()][..])
        );
        assert_eq!(changed.of_scenario.as_deref(), Some("Two masses"));
    }

    #[test]
    fn issue_folders_with_one_name_are_distinguished() {
        let folder = tempfile::tempdir().unwrap();
        let runs: Vec<RunResults> = ["a/out", "b/out", "b/other"]
            .iter()
            .map(|name| {
                let path = folder.path().join(name);
                std::fs::create_dir_all(&path).unwrap();
                std::fs::write(path.join("summary.json"), "{}").unwrap();
                RunResults::read(&path).unwrap()
            })
            .collect();
        assert_eq!(distinct_names(&runs), ["a/out", "b/out", "other"]);
    }
}
