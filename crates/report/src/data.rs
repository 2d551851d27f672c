//! The data of one run in the page.

use criteria::Verdict;
use rayon::prelude::*;
use results::modes::{CoupledMode, CoupledModes, Eigenvalue};
use results::{PlotAsRun, RunResults, ScenarioAsRun};
use serde::Serialize;
use serde_json::Value;

use crate::detail::Detail;
use crate::embed::Arrays;
use crate::evidence::RunEvidence;
use crate::irregularity::RecordedIrregularity;
use crate::knowledge::{GuidewayFacts, KeyFigure, SignalRole, figures, role};
use crate::layout_fmu::{InstanceParameters, all_parameters};
use crate::modes::{least_damped, of_girders};
use crate::response_section::ResponseSection;
use crate::scene::{self, Scene};
use crate::series::{EmbeddedSeries, SignalClock, SignalClocks};
use crate::spectra::{self, Frequencies, Spectra, Thinning};
use crate::spectrogram::{self, EmbeddedSpectrogram};
use crate::title::RunTitle;

/// Spectrograms end no lower than at this multiple of the girder's highest frequency.
const ABOVE: f64 = 1.15;
/// The search for resonances starts at this fraction of the girder's lowest frequency.
const BELOW: f64 = 0.7;

/// Data of one run.
#[derive(Serialize)]
pub(crate) struct RunData<'a> {
    name: String,
    title: String,
    /// the scenario's title, if `title` is another one
    scenario_title: Option<String>,
    /// settings of the command line
    changes: Vec<String>,
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
    /// for each of the modes, whether it is that of a girder without train, if the girders are known
    empty_girders: Option<Vec<bool>>,
    response: Option<ResponseSection<'a>>,
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
    /// Collects the data of a run.
    pub(crate) fn new(
        run: &'a RunResults,
        name: String,
        detail: Detail,
        arrays: &mut Arrays,
    ) -> Self {
        let table = &run.table;
        let scenario = run.scenario.as_ref();
        let title = RunTitle::of(run);
        let mut plots = scenario.map(|it| it.plots(&table.names)).unwrap_or_default();
        let guideway = GuidewayFacts::of(run);
        let (mut clocks, mut frequencies) = (SignalClocks::default(), Frequencies::default());
        let signals = signals(
            run,
            &plots,
            guideway.as_ref(),
            detail,
            (&mut clocks, &mut frequencies),
            arrays,
        );
        // the report is complete except for the view if a unit was removed after the run
        let (scene, scene_error) = match scene::build(run, detail.frames, arrays) {
            Ok(scene) => (scene, None),
            Err(error) => (None, Some(error.to_string())),
        };
        let modes = run.modes.as_ref();
        title.remove_stale_titles(&mut plots);
        let girders = guideway.as_ref().map(|it| it.instance.as_str());
        let own = modes.and_then(|_| RunEvidence::of(run).guideway_modes());
        Self {
            name,
            title: title.text,
            scenario_title: title.of_scenario,
            changes: title.changes,
            empty_girders: modes.zip(own.as_ref()).map(|(modes, own)| {
                modes.modes.iter().map(|mode| own.is_empty_girder(mode)).collect()
            }),
            folder: run.folder.display().to_string(),
            description: scenario.map(ScenarioAsRun::description).unwrap_or_default(),
            summary: &run.summary,
            scenario: scenario.map(ScenarioAsRun::text),
            parameters: scenario.map(all_parameters).unwrap_or_default(),
            figures: figures(run),
            coupled: modes.zip(girders).map(|(it, name)| of_girders(it, name)).unwrap_or_default(),
            least_damped: modes.and_then(|it| least_damped(it, own.as_ref())),
            modes,
            response: run.response.as_ref().map(ResponseSection::new),
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

    /// What the run is called.
    pub(crate) fn title(&self) -> &str {
        &self.title
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
    detail: Detail,
    (clocks, frequencies): (&mut SignalClocks, &mut Frequencies),
    arrays: &mut Arrays,
) -> Vec<SignalData<'a>> {
    let names = &run.table.names;
    let most = (detail.room / names.len().max(1)).max(detail.least);
    let top = top_frequency(guideway);
    let modes = guideway.iter().flat_map(|it| &it.modes);
    let resonances = modes.map(|mode| BELOW * mode.frequency).reduce(f64::min);
    let compute = |k: usize| {
        let (times, values) = run.table.points(k);
        let wanted = k < detail.spectra || is_drawn(plots, &names[k]);
        ComputedSignal {
            spectra: wanted.then(|| {
                spectra::ComputedSpectra::new(&times, &values, run.unit_of(&names[k]), resonances)
            }),
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
    let drawn = names.iter().zip(&computed).filter(|(name, _)| is_drawn(plots, name));
    let content = drawn.filter_map(|(_, it)| Some(it.spectra.as_ref()?.as_ref().ok()?.content()));
    // the page shows the marks and a fifth more than the content
    let shown = content.map(|it| 1.2 * it).fold(top, f64::max);
    let thinning = Thinning {
        top: if shown > 0.0 { shown } else { f64::INFINITY },
        below: detail.bins,
        slices: detail.slices,
    };
    let mut room = detail.spectrograms;
    let signal = |(name, it): (&'a String, ComputedSignal)| {
        let most = if is_drawn(plots, name) { detail.drawn.max(most) } else { most };
        let size = it.spectrogram.as_ref().map_or(0, spectrogram::ComputedSpectrogram::size);
        let fits = size <= room;
        room -= if fits { size } else { 0 };
        let (spectra, spectra_error) = match it.spectra {
            Some(Ok(spectra)) => (Some(frequencies.embed(&spectra, thinning, arrays)), None),
            Some(Err(error)) => (None, Some(error.to_string())),
            None => (
                None,
                Some(format!("only the first {} signals of a run have spectra", detail.spectra)),
            ),
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

/// Frequency (Hz) that spectrograms reach: that of the girders and of the chirp; 0 if none is known.
fn top_frequency(guideway: Option<&GuidewayFacts>) -> f64 {
    let Some(it) = guideway else { return 0.0 };
    let modes = it.modes.iter().map(|mode| ABOVE * mode.frequency);
    let chirp = it.chirp.map(|it| 1.1 * it.end_frequency);
    modes.chain(chirp).reduce(f64::max).unwrap_or(0.0)
}

fn is_drawn(plots: &[PlotAsRun], signal: &str) -> bool {
    let mut panels = plots.iter().flat_map(|plot| &plot.panels);
    panels.any(|panel| panel.signals.iter().any(|name| name == signal))
}
