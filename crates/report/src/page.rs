//! The page: its data, put into the template with styles and scripts.

use serde::Serialize;
use serde_json::Value;

use crate::embed::{Arrays, html as escape, script_json};
use crate::error::ReportError;
use crate::run::Run;
use crate::scenario::{Plot, Scenario};
use crate::scene::{self, Scene};
use crate::series::{Clock, Clocks, Series};

const TEMPLATE: &str = include_str!("../assets/report.html");
const STYLES: [&str; 3] = [
    include_str!("../assets/vendor/uPlot.min.css"),
    include_str!("../assets/report.css"),
    include_str!("../assets/scene/scene.css"),
];
const UPLOT: &str = include_str!("../assets/vendor/uPlot.iife.min.js");
/// Run in this order, in one scope.
const SCRIPTS: [&str; 11] = [
    include_str!("../assets/base.js"),
    include_str!("../assets/chart.js"),
    include_str!("../assets/history.js"),
    include_str!("../assets/tables.js"),
    include_str!("../assets/scene/model.js"),
    include_str!("../assets/scene/track.js"),
    include_str!("../assets/scene/train.js"),
    include_str!("../assets/scene/stage.js"),
    include_str!("../assets/scene/side.js"),
    include_str!("../assets/scene/view.js"),
    include_str!("../assets/report.js"),
];

/// Values of all signals over time that a page has room for, at 4 bytes each.
const ROOM: usize = 900_000;
/// Values of one signal in the scenario's pictures.
const ROOM_DRAWN: usize = 80_000;
/// No signal gets fewer values than that: two per pixel of a wide screen.
const LEAST: usize = 2_000;

/// Data of the page.
#[derive(Serialize)]
struct Data<'a> {
    version: &'static str,
    three: Option<scene::Library>,
    runs: Vec<RunData<'a>>,
}

/// Data of one run.
#[derive(Serialize)]
struct RunData<'a> {
    name: String,
    title: String,
    summary: &'a Value,
    /// its text
    scenario: Option<&'a str>,
    modes: Option<&'a Value>,
    clocks: Vec<Clock>,
    signals: Vec<SignalData<'a>>,
    plots: Vec<Plot>,
    scene: Option<Scene>,
    /// why there is no scene where one was to be expected
    scene_error: Option<String>,
}

/// One recorded signal.
#[derive(Serialize)]
struct SignalData<'a> {
    name: &'a str,
    unit: Option<&'a str>,
    series: Series,
}

/// Makes the page.
///
/// # Errors
/// A unit's file is not as it should be.
pub fn html(runs: &[Run]) -> Result<String, ReportError> {
    let mut arrays = Arrays::default();
    let share = ROOM / runs.len().max(1);
    let runs_data: Vec<_> = runs.iter().map(|run| run_data(run, share, &mut arrays)).collect();
    let three = runs_data.iter().any(|run| run.scene.is_some());
    let data = Data {
        version: env!("CARGO_PKG_VERSION"),
        three: three.then(|| scene::Library::new(&mut arrays)),
        runs: runs_data,
    };
    // plain data, which always prints
    let data = script_json(&data).unwrap_or_default();
    let title = runs.first().map(|run| escape(&run.title())).unwrap_or_default();
    let scripts = format!("(async () => {{\n\"use strict\";\n{}}})();", SCRIPTS.concat());
    Ok(fill(&[
        ("title", &title),
        ("styles", &STYLES.concat()),
        ("data", &data),
        ("arrays", &arrays.pack()),
        ("uplot", UPLOT),
        ("scripts", &scripts),
    ]))
}

/// Puts texts into the template's places, which stand in this order; what is put in is not looked at.
fn fill(places: &[(&str, &str)]) -> String {
    let mut page = String::new();
    let mut rest = TEMPLATE;
    for (name, text) in places {
        let place = format!("{{{{{name}}}}}");
        if let Some((before, after)) = rest.split_once(place.as_str()) {
            page.push_str(before);
            page.push_str(text);
            rest = after;
        }
    }
    page.push_str(rest);
    page
}

fn run_data<'a>(run: &'a Run, room: usize, arrays: &mut Arrays) -> RunData<'a> {
    let table = &run.table;
    let plots = run.scenario.as_ref().map(|it| it.plots(&table.names)).unwrap_or_default();
    let most = (room / table.names.len().max(1)).max(LEAST);
    let mut clocks = Clocks::default();
    let signals = table.names.iter().enumerate().map(|(k, name)| {
        let (times, values) = table.points(k);
        let most = if is_drawn(&plots, name) { ROOM_DRAWN.max(most) } else { most };
        let series = clocks.embed(&times, &values, most, arrays);
        SignalData { name, unit: run.unit_of(name), series }
    });
    let signals = signals.collect();
    // a unit that has been moved away since the run costs the view, not the report
    let (scene, scene_error) = match scene::build(run, arrays) {
        Ok(scene) => (scene, None),
        Err(error) => (None, Some(error.to_string())),
    };
    RunData {
        name: run.name(),
        title: run.title(),
        summary: &run.raw_summary,
        scenario: run.scenario.as_ref().map(Scenario::text),
        modes: run.modes.as_ref(),
        clocks: clocks.into_list(),
        signals,
        plots,
        scene,
        scene_error,
    }
}

fn is_drawn(plots: &[Plot], signal: &str) -> bool {
    let mut panels = plots.iter().flat_map(|plot| &plot.panels);
    panels.any(|panel| panel.signals.iter().any(|name| name == signal))
}
