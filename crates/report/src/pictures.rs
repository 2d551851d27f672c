//! Figures for papers, as SVG or PNG.
//!
//! Each plot of the scenario gives a figure of the signals over time and one of their amplitude spectra, with
//! the curves of several runs in the same panels. A run without plots shows its first signals, one panel
//! per unit of measure.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use analysis::series::rate;
use analysis::spectrum::{Window, amplitude};
use figure::{FigureLine, FigurePanel, FigureStyle};
use results::{PanelAsRun, PlotAsRun, RunResults, ScenarioAsRun, write_whole};
use resvg::{tiny_skia, usvg};

use crate::error::ReportError;
use crate::series::reduced;
use crate::title::RunTitle;

/// The font of PNGs, which therefore look the same on all machines.
const FONT: &[u8] = include_bytes!("../assets/vendor/DejaVuSans.ttf");
const FAMILY: &str = "DejaVu Sans";
/// Pixels of a PNG per pixel of the SVG: the width of 2200 is a column of a paper at 600 dpi. Figures with a size
/// have 600 dpi in that size.
const ZOOM: f32 = 2.0;
const ZOOM_SIZED: f32 = 600.0 / 96.0;
/// Most curves per panel and most panels for a run without plots.
const CURVES: usize = 6;
const PANELS: usize = 4;
/// Spectra end where all curves stay below this fraction of their largest amplitude.
const ENOUGH: f64 = 0.01;

/// A format of figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureFormat {
    /// Vector graphics.
    Svg,
    /// Pixels, 2200 wide.
    Png,
}

/// Titles of figures.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum PictureTitles {
    /// Those of the scenario's plots.
    #[default]
    Plots,
    /// One text instead.
    Text(String),
    /// None.
    Off,
}

/// Limits of vertical axes: of the panels with a label, or of all others.
pub type PanelLimits = Vec<(Option<String>, Range<f64>)>;

/// How figures are drawn.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PictureOptions {
    /// Titles.
    pub titles: PictureTitles,
    /// Width and height (mm).
    pub size: Option<(f64, f64)>,
    /// Limits of the time (s).
    pub time: Option<Range<f64>>,
    /// Limits of the frequency of spectra (Hz).
    pub frequency: Option<Range<f64>>,
    /// Limits of values over time.
    pub values: PanelLimits,
    /// Limits of amplitudes.
    pub amplitudes: PanelLimits,
    /// Whether the frequency is logarithmic.
    pub log_frequency: bool,
    /// Whether amplitudes are logarithmic.
    pub log_amplitude: bool,
}

impl PictureOptions {
    fn over_time(&self) -> FigureStyle {
        let (size, across, up) = (self.size, self.time.clone(), self.values.clone());
        FigureStyle { size, across, up, ..FigureStyle::default() }
    }

    fn of_spectra(&self) -> FigureStyle {
        FigureStyle {
            size: self.size,
            across: self.frequency.clone(),
            up: self.amplitudes.clone(),
            log_across: self.log_frequency,
            log_up: self.log_amplitude,
        }
    }

    /// The title of a figure that is called `own` by itself.
    fn title(&self, own: String) -> String {
        match &self.titles {
            PictureTitles::Plots => own,
            PictureTitles::Text(text) => text.clone(),
            PictureTitles::Off => String::new(),
        }
    }
}

/// Draws the figures of some runs into a folder, which is created, and returns their paths.
///
/// # Errors
/// A figure cannot be drawn or written.
pub fn write(
    runs: &[RunResults],
    folder: &Path,
    formats: &[PictureFormat],
    options: &PictureOptions,
) -> Result<Vec<PathBuf>, ReportError> {
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| ReportError::Write { path, source }
    };
    fs::create_dir_all(folder).map_err(failed(folder))?;
    let mut files = Vec::new();
    let zoom = if options.size.is_some() { ZOOM_SIZED } else { ZOOM };
    for (name, svg) in draw(runs, options)? {
        for format in formats {
            let (ending, content) = match format {
                PictureFormat::Svg => ("svg", svg.clone().into_bytes()),
                PictureFormat::Png => ("png", png(&svg, zoom).map_err(|why| picture(&name, why))?),
            };
            let path = folder.join(format!("{name}.{ending}"));
            write_whole(&path, &content).map_err(failed(&path))?;
            files.push(path);
        }
    }
    Ok(files)
}

fn picture(name: &str, message: impl ToString) -> ReportError {
    ReportError::Picture { name: name.to_owned(), message: message.to_string() }
}

/// Names and SVG texts of the figures.
fn draw(
    runs: &[RunResults],
    options: &PictureOptions,
) -> Result<Vec<(String, String)>, ReportError> {
    let Some(first) = runs.first() else { return Ok(Vec::new()) };
    let mut figures = Vec::new();
    let called = RunTitle::of(first);
    let mut plots = plots(first);
    called.remove_stale_titles(&mut plots);
    for (k, plot) in plots.iter().enumerate() {
        let name = match Path::new(&plot.file).file_stem() {
            Some(stem) => stem.to_string_lossy().into_owned(),
            None => format!("signals-{}", k + 1),
        };
        let own = if plot.title.is_empty() { called.text.clone() } else { plot.title.clone() };
        let curves = plot.panels.iter().map(|panel| panel.signals.len()).sum::<usize>();
        let most = figure::slices(curves * runs.len());
        let most = 2 * usize::try_from(most).unwrap_or(usize::MAX);
        let histories = panels(runs, plot, |times, values| {
            let (times, values) = within(times, values, options.time.as_ref());
            Some(reduced(times, values, most))
        });
        let title = options.title(own.clone());
        let svg = figure::draw_styled(&title, "time (s)", &histories, &options.over_time())
            .map_err(|e| picture(&name, e))?;
        figures.push((name.clone(), svg));
        let mut spectra = panels(runs, plot, spectrum);
        if spectra.iter().any(|panel| !panel.lines.is_empty()) {
            if options.frequency.is_none() {
                cut(&mut spectra);
            }
            let name = format!("{name}-spectra");
            let title = options.title(format!("{own}: amplitude spectra"));
            let style = options.of_spectra();
            let svg = figure::draw_styled(&title, "frequency (Hz)", &spectra, &style);
            figures.push((name.clone(), svg.map_err(|e| picture(&name, e))?));
        }
    }
    Ok(figures)
}

/// The scenario's plots, or one of the first signals.
fn plots(run: &RunResults) -> Vec<PlotAsRun> {
    let names = &run.table.names;
    let plots = run.scenario.as_ref().map(|it: &ScenarioAsRun| it.plots(names)).unwrap_or_default();
    if !plots.is_empty() || names.is_empty() {
        return plots;
    }
    let mut panels: Vec<PanelAsRun> = Vec::new();
    for name in names {
        let ylabel = run.unit_of(name).unwrap_or("1");
        match panels.iter().position(|panel| panel.ylabel == ylabel) {
            Some(k) if panels[k].signals.len() < CURVES => panels[k].signals.push(name.clone()),
            None if panels.len() < PANELS => panels.push(PanelAsRun {
                ylabel: ylabel.to_owned(),
                signals: vec![name.clone()],
                ..PanelAsRun::default()
            }),
            Some(_) | None => {}
        }
    }
    vec![PlotAsRun { panels, ..PlotAsRun::default() }]
}

/// The panels of a plot, with the curve that `curve` computes from times and values of each recorded signal.
fn panels(
    runs: &[RunResults],
    plot: &PlotAsRun,
    curve: impl Fn(&[f64], &[f64]) -> Option<(Vec<f64>, Vec<f64>)>,
) -> Vec<FigurePanel> {
    let line = |run: &RunResults, panel: &PanelAsRun, k: usize, signal: &String| {
        let index = run.table.names.iter().position(|name| name == signal)?;
        let (times, values) = run.table.points(index);
        let (across, up) = curve(&times, &values)?;
        let label = panel.labels.get(k).unwrap_or(signal);
        let label = if runs.len() > 1 { format!("{}: {label}", run.name()) } else { label.clone() };
        let points = across.into_iter().zip(up).map(|(x, y)| (x, panel.scale * y));
        Some(FigureLine { label, points: points.collect() })
    };
    let panel = |panel: &PanelAsRun| {
        let lines = runs.iter().flat_map(|run| {
            let signals = panel.signals.iter().enumerate();
            signals.filter_map(move |(k, signal)| line(run, panel, k, signal))
        });
        FigurePanel { ylabel: panel.ylabel.clone(), lines: lines.collect() }
    };
    plot.panels.iter().map(panel).collect()
}

/// Frequencies (Hz) and amplitudes of a signal without its mean; none if its times are uneven or too few.
fn spectrum(times: &[f64], values: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
    let (times, values) = analysis::series::without_early_end(times, values);
    let spectrum = amplitude(values, rate(times).ok()?, Window::Hann).ok()?;
    let frequencies = (1..spectrum.values.len()).map(|k| spectrum.frequency(k)).collect();
    Some((frequencies, spectrum.values[1..].to_vec()))
}

/// The part of a signal within limits, with the points next to them, so that a reduced curve keeps what it shows.
fn within<'a>(
    times: &'a [f64],
    values: &'a [f64],
    limits: Option<&Range<f64>>,
) -> (&'a [f64], &'a [f64]) {
    let Some(limits) = limits else { return (times, values) };
    let first = times.partition_point(|time| *time < limits.start).saturating_sub(1);
    let end = times.partition_point(|time| *time <= limits.end) + 1;
    let part = first..end.clamp(first, times.len());
    (&times[part.clone()], &values[part])
}

/// Removes the end of spectra in which nothing is visible.
fn cut(panels: &mut [FigurePanel]) {
    let matters = |line: &FigureLine| {
        let largest = line.points.iter().map(|point| point.1.abs()).fold(0.0, f64::max);
        line.points.iter().rfind(|point| point.1.abs() > ENOUGH * largest).map_or(0.0, |it| it.0)
    };
    let lines = panels.iter().flat_map(|panel| &panel.lines);
    let end = 1.1 * lines.map(matters).fold(0.0, f64::max);
    for line in panels.iter_mut().flat_map(|panel| &mut panel.lines) {
        line.points.retain(|point| point.0 <= end);
    }
}

/// Renders SVG as PNG, with the report's font.
///
/// # Errors
/// The text is not a picture, or it is too large.
pub fn png(svg: &str, zoom: f32) -> Result<Vec<u8>, String> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(FONT.to_vec());
    fonts.set_sans_serif_family(FAMILY);
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let size = tree.size().to_int_size().scale_by(zoom).ok_or("it has no size")?;
    let mut pixels =
        tiny_skia::Pixmap::new(size.width(), size.height()).ok_or("it is too large")?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(zoom, zoom), &mut pixels.as_mut());
    pixels.encode_png().map_err(|error| error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(folder: &Path, scenario: bool) -> RunResults {
        let mut csv = "time,v.gap_1,v.u\n".to_owned();
        for k in 0..2000 {
            let t = f64::from(k) * 0.01;
            let gap = 0.008 + 0.0005 * (std::f64::consts::TAU * 5.0 * t).sin();
            csv += &format!("{t},{gap},{}\n", t.floor());
        }
        fs::write(folder.join("results.csv"), csv).unwrap();
        let summary =
            r#"{"title": "a run", "signals": {"v.gap_1": {"unit": "m"}, "v.u": {"unit": "V"}}}"#;
        fs::write(folder.join("summary.json"), summary).unwrap();
        let mut run = RunResults::read(folder).unwrap();
        let text = r#"{"plots": [{"file": "gaps.svg", "panels": [
            {"ylabel": "gap (mm)", "scale": 1e3, "signals": ["v.gap_[1..1]"], "labels": ["the gap"]}]}]}"#;
        if scenario {
            run.scenario = Some(ScenarioAsRun::parse(text.to_owned()).unwrap());
        }
        run
    }

    #[test]
    fn analytic_figures_show_the_signals_and_their_spectra() {
        let folder = tempfile::tempdir().unwrap();
        let plot = &plots(&run(folder.path(), true))[0];
        let runs = [run(folder.path(), true)];
        let drawn = panels(&runs, plot, spectrum);
        let points = &drawn[0].lines[0].points;
        let top = points.iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        // 0.5 mm at 5 Hz, a bin of the 20 s
        assert!((top.0 - 5.0).abs() < 1e-9 && (top.1 - 0.5).abs() < 1e-9, "{top:?}");
        let figures = draw(&runs, &PictureOptions::default()).unwrap();
        let names: Vec<&str> = figures.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["gaps", "gaps-spectra"]);
        assert!(figures[0].1.contains("the gap") && figures[0].1.contains("time (s)"));
        assert!(
            figures[1].1.contains("frequency (Hz)") && figures[1].1.contains("a run: amplitude")
        );
    }

    #[test]
    fn analytic_runs_without_pictures_and_several_runs_are_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let runs = [run(folder.path(), false), run(folder.path(), false)];
        let plots = plots(&runs[0]);
        let labels: Vec<&str> = plots[0].panels.iter().map(|it| it.ylabel.as_str()).collect();
        assert_eq!(labels, ["m", "V"]);
        let figures = draw(&runs, &PictureOptions::default()).unwrap();
        assert_eq!(figures[0].0, "signals-1");
        assert!(figures[0].1.contains(&format!("{}: v.gap_1", runs[0].name())));
    }

    /// A column of a paper at 600 dpi, from 2 s to 4 s, with a logarithmic spectrum and no titles.
    #[test]
    fn issue_figures_have_the_size_and_limits_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let runs = [run(folder.path(), true)];
        let options = PictureOptions {
            titles: PictureTitles::Off,
            size: Some((90.0, 60.0)),
            time: Some(2.0..4.0),
            frequency: Some(1.0..20.0),
            log_frequency: true,
            log_amplitude: true,
            ..PictureOptions::default()
        };
        let figures = draw(&runs, &options).unwrap();
        assert!(figures.iter().all(|it| it.1.contains("width=\"340\"") && !it.1.contains("a run")));
        assert!(
            figures[0].1.contains("2.0")
                && figures[0].1.contains("4.0")
                && !figures[0].1.contains("10.0")
        );
        assert!(figures[1].1.contains(">\n10\n<"), "{}", figures[1].1);
        let pixels =
            tiny_skia::Pixmap::decode_png(&png(&figures[0].1, ZOOM_SIZED).unwrap()).unwrap();
        // 90 mm at 600 dpi are 2126 pixels, within a pixel of the SVG
        assert!(pixels.width().abs_diff(2126) <= 6, "{}", pixels.width());
    }

    /// The PNG has twice the size and dark pixels where the title is.
    #[test]
    fn invariant_pngs_have_size_curves_and_letters() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("figures");
        let runs = [run(folder.path(), true)];
        let files = write(
            &runs,
            &out,
            &[PictureFormat::Svg, PictureFormat::Png],
            &PictureOptions::default(),
        )
        .unwrap();
        let names: Vec<_> = files.iter().map(|it| it.file_name().unwrap().to_owned()).collect();
        assert_eq!(names, ["gaps.svg", "gaps.png", "gaps-spectra.svg", "gaps-spectra.png"]);
        let bytes = fs::read(&files[1]).unwrap();
        let pixels = tiny_skia::Pixmap::decode_png(&bytes).unwrap();
        assert_eq!(pixels.width(), 2200);
        // the title, with white left of it
        let dark = |x: Range<u32>, y: Range<u32>| {
            let places = y.flat_map(|y| x.clone().map(move |x| (x, y)));
            let all = places.filter_map(|(x, y)| pixels.pixel(x, y));
            all.filter(|pixel| pixel.red() < 100).count()
        };
        assert!(dark(900..1300, 10..80) > 200, "no title");
        assert_eq!(dark(0..300, 0..60), 0);
    }
}
