//! The data of one run in the page.

use criteria::Verdict;
use rayon::prelude::*;
use results::modes::{CoupledMode, CoupledModes, Eigenvalue};
use results::{PlotAsRun, RunResults, ScenarioAsRun};
use serde::Serialize;
use serde_json::Value;

use crate::embed::Arrays;
use crate::irregularity::RecordedIrregularity;
use crate::knowledge::{GuidewayFacts, KeyFigure, SignalRole, figures, role};
use crate::layout_fmu::{InstanceParameters, all_parameters};
use crate::modes::{least_damped, of_girders};
use crate::scene::{self, Scene};
use crate::series::{EmbeddedSeries, SignalClock, SignalClocks};
use crate::spectra::{self, Frequencies, Spectra};
use crate::spectrogram::{self, EmbeddedSpectrogram};

/// Most values of time histories in a page, at 4 bytes each.
const ROOM: usize = 900_000;
/// Most values of a signal that the scenario plots.
const ROOM_DRAWN: usize = 80_000;
/// Least limit on the values of a signal: two per pixel of a wide screen.
const LEAST: usize = 2_000;
/// Most bytes of all spectrograms.
const ROOM_SPECTROGRAMS: usize = 2_800_000;
/// Most signals with spectra, besides those that the scenario plots.
const MOST_SPECTRA: usize = 400;
/// Spectrograms end at this multiple of the girder's highest frequency.
const ABOVE: f64 = 3.0;
/// The search for resonances starts at this fraction of the girder's lowest frequency.
const BELOW: f64 = 0.7;

/// Data of one run.
#[derive(Serialize)]
pub(crate) struct RunData<'a> {
    name: String,
    title: String,
    folder: String,
    description: &'a str,
    summary: &'a Value,
    /// text of scenario-as-run.json
    scenario: Option<&'a str>,
    parameters: Vec<InstanceParameters>,
    figures: Vec<KeyFigure>,
    guideway: Option<GuidewayFacts>,
    modes: Option<&'a CoupledModes>,
    /// modes that spectra mark
    coupled: Vec<Eigenvalue>,
    least_damped: Option<&'a CoupledMode>,
    clocks: Vec<SignalClock>,
    frequencies: Frequencies,
    signals: Vec<SignalData<'a>>,
    plots: Vec<PlotAsRun>,
    /// verdicts by limits or criteria
    verdicts: &'a [Verdict],
    irregularity: Option<RecordedIrregularity>,
    scene: Option<Scene>,
    /// why the scene is missing, if the run has a vehicle
    scene_error: Option<String>,
}

/// One recorded signal.
#[derive(Serialize)]
struct SignalData<'a> {
    name: &'a str,
    unit: Option<&'a str>,
    role: Option<SignalRole>,
    series: EmbeddedSeries,
    spectra: Option<Spectra>,
    /// why there is no spectrum
    spectra_error: Option<String>,
    spectrogram: Option<EmbeddedSpectrogram>,
}

/// A recorded signal with its spectra, before it is embedded.
struct ComputedSignal {
    times: Vec<f64>,
    values: Vec<f64>,
    spectra: Option<Result<spectra::ComputedSpectra, analysis::Error>>,
    spectrogram: Option<spectrogram::ComputedSpectrogram>,
}

impl<'a> RunData<'a> {
    /// Collects the data of one of `runs` runs that share the page.
    pub(crate) fn new(run: &'a RunResults, runs: usize, arrays: &mut Arrays) -> Self {
        let table = &run.table;
        let scenario = run.scenario.as_ref();
        let plots = scenario.map(|it| it.plots(&table.names)).unwrap_or_default();
        let guideway = GuidewayFacts::of(run);
        let (mut clocks, mut frequencies) = (SignalClocks::default(), Frequencies::default());
        let signals =
            signals(run, &plots, guideway.as_ref(), runs, (&mut clocks, &mut frequencies), arrays);
        // the report is complete except for the view if a unit was removed after the run
        let (scene, scene_error) = match scene::build(run, arrays) {
            Ok(scene) => (scene, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let modes = run.modes.as_ref();
        let girders = guideway.as_ref().map(|it| it.instance.as_str());
        Self {
            name: run.name(),
            title: run.title(),
            folder: run.folder.display().to_string(),
            description: scenario.map(ScenarioAsRun::description).unwrap_or_default(),
            summary: &run.summary,
            scenario: scenario.map(ScenarioAsRun::text),
            parameters: scenario.map(all_parameters).unwrap_or_default(),
            figures: figures(run),
            coupled: modes.zip(girders).map(|(it, name)| of_girders(it, name)).unwrap_or_default(),
            least_damped: modes.and_then(|it| least_damped(it, girders)),
            modes,
            clocks: clocks.into_list(),
            frequencies,
            signals,
            plots,
            verdicts: &run.verdicts,
            irregularity: RecordedIrregularity::of(run, guideway.as_ref(), arrays),
            guideway,
            scene,
            scene_error,
        }
    }

    /// Whether the page needs the 3D library.
    pub(crate) fn has_scene(&self) -> bool {
        self.scene.is_some()
    }
}

fn signals<'a>(
    run: &'a RunResults,
    plots: &[PlotAsRun],
    guideway: Option<&GuidewayFacts>,
    runs: usize,
    (clocks, frequencies): (&mut SignalClocks, &mut Frequencies),
    arrays: &mut Arrays,
) -> Vec<SignalData<'a>> {
    let names = &run.table.names;
    let most = (ROOM / runs / names.len().max(1)).max(LEAST);
    let top = top_frequency(guideway);
    let modes = guideway.iter().flat_map(|it| &it.modes);
    let resonances = modes.map(|mode| BELOW * mode.frequency).reduce(f64::min);
    let compute = |k: usize| {
        let (times, values) = run.table.points(k);
        let wanted = k < MOST_SPECTRA || is_drawn(plots, &names[k]);
        ComputedSignal {
            spectra: wanted.then(|| spectra::ComputedSpectra::new(&times, &values, resonances)),
            spectrogram: if wanted {
                spectrogram::ComputedSpectrogram::new(&times, &values, top).ok()
            } else {
                None
            },
            times,
            values,
        }
    };
    let computed: Vec<ComputedSignal> = (0..names.len()).into_par_iter().map(compute).collect();
    let mut room = ROOM_SPECTROGRAMS / runs;
    let signal = |(name, it): (&'a String, ComputedSignal)| {
        let most = if is_drawn(plots, name) { (ROOM_DRAWN / runs).max(most) } else { most };
        let size = it.spectrogram.as_ref().map_or(0, spectrogram::ComputedSpectrogram::size);
        let fits = size <= room;
        room -= if fits { size } else { 0 };
        let (spectra, spectra_error) = match it.spectra {
            Some(Ok(spectra)) => (Some(frequencies.embed(&spectra, arrays)), None),
            Some(Err(error)) => (None, Some(error.to_string())),
            None => (None, Some(format!("only the first {MOST_SPECTRA} signals have spectra"))),
        };
        SignalData {
            name,
            unit: run.unit_of(name),
            role: role(name),
            series: clocks.embed(&it.times, &it.values, most, arrays),
            spectra,
            spectra_error,
            spectrogram: it.spectrogram.filter(|_| fits).map(|it| it.embed(arrays)),
        }
    };
    names.iter().zip(computed).map(signal).collect()
}

/// Frequency (Hz) at which spectrograms end; infinite if no frequency is known.
fn top_frequency(guideway: Option<&GuidewayFacts>) -> f64 {
    let Some(it) = guideway else { return f64::INFINITY };
    let modes = it.modes.iter().map(|mode| ABOVE * mode.frequency);
    let chirp = it.chirp.map(|it| 1.1 * it.end_frequency);
    modes.chain(chirp).reduce(f64::max).unwrap_or(f64::INFINITY)
}

fn is_drawn(plots: &[PlotAsRun], signal: &str) -> bool {
    let mut panels = plots.iter().flat_map(|plot| &plot.panels);
    panels.any(|panel| panel.signals.iter().any(|name| name == signal))
}
