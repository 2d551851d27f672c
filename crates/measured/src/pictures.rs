//! Pictures of record and run.

use figure::{FigureLine, FigurePanel, FigureStyle, draw, draw_styled};

use crate::{SignalComparison, SpectraCompared};

/// Most points of a curve.
const MOST: usize = 4_000;

/// Units that are shown with a prefix: unit, shown unit, factor, and largest magnitude for which it is used.
const PREFIXED: &[(&str, &str, f64, f64)] =
    &[("m", "mm", 1e3, 0.5), ("m/s", "mm/s", 1e3, 0.1), ("N", "kN", 1e-3, f64::INFINITY)];

/// The unit in which values up to a magnitude are shown, and the factor to it.
pub(crate) fn shown(unit: Option<&str>, size: f64) -> (String, f64) {
    let unit = unit.filter(|it| *it != "1").unwrap_or("");
    let fits = |row: &&(&str, &str, f64, f64)| {
        row.0 == unit && size < row.3 && (unit != "N" || size > 5e3)
    };
    match PREFIXED.iter().find(fits) {
        Some((_, name, factor, _)) => ((*name).to_owned(), *factor),
        None => (unit.to_owned(), 1.0),
    }
}

/// A curve with at most as many points as a picture shows, whose peaks remain.
#[must_use]
pub fn thinned(label: &str, times: &[f64], values: &[f64], factor: f64) -> FigureLine {
    let (times, values) = report::series::reduced(times, values, MOST);
    let points = times.into_iter().zip(values.into_iter().map(|it| it * factor)).collect();
    FigureLine { label: label.to_owned(), points }
}

fn label(text: &str, unit: &str) -> String {
    if unit.is_empty() { text.to_owned() } else { format!("{text} ({unit})") }
}

/// Record and run over time, and their difference. None if it cannot be drawn.
pub(crate) fn over_time(it: &SignalComparison) -> Option<String> {
    let unit = it.column.unit.as_deref();
    let size = it.measured.iter().chain(&it.run).fold(0.0, |most: f64, it| most.max(it.abs()));
    let (name, factor) = shown(unit, size);
    let error: Vec<f64> = it.run.iter().zip(&it.measured).map(|(a, b)| a - b).collect();
    let (error_name, error_factor) = shown(unit, it.peak_error.abs());
    let panels = [
        FigurePanel {
            ylabel: label("value", &name),
            lines: vec![
                thinned("measured", &it.times, &it.measured, factor),
                thinned("run", &it.times, &it.run, factor),
            ],
        },
        FigurePanel {
            ylabel: label("difference", &error_name),
            lines: vec![thinned("run - measured", &it.times, &error, error_factor)],
        },
    ];
    draw(&it.column.signal, &panels).ok()
}

/// Densities of record and run, on a logarithmic axis. None if they cannot be drawn.
pub(crate) fn densities(it: &SignalComparison, spectra: &SpectraCompared) -> Option<String> {
    let (unit, factor) = shown(it.column.unit.as_deref(), 0.0);
    let unit = if unit.is_empty() { "1/Hz".to_owned() } else { format!("({unit})²/Hz") };
    let floor =
        spectra.measured.iter().chain(&spectra.run).fold(0.0, |most: f64, it| most.max(*it))
            * 1e-12;
    let curve = |text: &str, values: &[f64]| {
        let factor = factor * factor;
        let points = inner(spectra, values).map(|(x, y)| (x, y.max(floor) * factor));
        FigureLine { label: text.to_owned(), points: points.collect() }
    };
    let panel = FigurePanel {
        ylabel: label("density", &unit),
        lines: vec![curve("measured", &spectra.measured), curve("run", &spectra.run)],
    };
    let style = FigureStyle { log_up: true, ..FigureStyle::default() };
    draw_styled(&it.column.signal, "frequency (Hz)", &[panel], &style).ok()
}

/// Coherence of record and run. None if it cannot be drawn.
pub(crate) fn coherence(it: &SignalComparison, spectra: &SpectraCompared) -> Option<String> {
    let points = inner(spectra, &spectra.coherence).collect();
    let line = FigureLine { label: "coherence of run and record".to_owned(), points };
    let panel = FigurePanel { ylabel: "coherence".to_owned(), lines: vec![line] };
    let style = FigureStyle { up: vec![(None, 0.0..1.05)], ..FigureStyle::default() };
    draw_styled(&it.column.signal, "frequency (Hz)", &[panel], &style).ok()
}

/// Frequencies and values, without the mean, up to where there is nothing to see.
fn inner<'a>(
    spectra: &SpectraCompared,
    values: &'a [f64],
) -> impl Iterator<Item = (f64, f64)> + use<'a> {
    let (top, step) = (spectra.top(), spectra.resolution);
    let all = values.iter().enumerate().skip(1).map(move |(k, value)| (k as f64 * step, *value));
    all.take_while(move |(frequency, _)| *frequency <= top * (1.0 + 1e-9))
}

/// Residuals of a signal over time, and their autocorrelation with the limits of white noise (±1.96/√n). None if they
/// cannot be drawn.
#[must_use]
pub fn residuals(
    name: &str,
    unit: Option<&str>,
    (times, values): (&[f64], &[f64]),
    correlations: &[f64],
) -> Option<String> {
    let size = values.iter().fold(0.0, |most: f64, it| most.max(it.abs()));
    let (unit, factor) = shown(unit, size);
    let step = crate::align::spacing(times);
    let lag = |k: usize| k as f64 * step;
    let bound = 1.96 / (values.len().max(1) as f64).sqrt();
    let last = lag(correlations.len().saturating_sub(1));
    let limits = FigureLine {
        label: "95 % of white noise".to_owned(),
        points: vec![(0.0, bound), (last, bound), (last, -bound), (0.0, -bound)],
    };
    let correlation = FigureLine {
        label: "autocorrelation".to_owned(),
        // that of lag 0 is 1
        points: correlations.iter().enumerate().skip(1).map(|(k, it)| (lag(k), *it)).collect(),
    };
    let over_time = FigurePanel {
        ylabel: label("residual", &unit),
        lines: vec![thinned("fitted run - measured", times, values, factor)],
    };
    let over_lag =
        FigurePanel { ylabel: "autocorrelation".to_owned(), lines: vec![correlation, limits] };
    let first = draw(name, &[over_time]).ok()?;
    let second = figure::draw_over("", "lag (s)", &[over_lag]).ok()?;
    Some(stacked(&first, &second))
}

/// Two pictures one above the other.
fn stacked(first: &str, second: &str) -> String {
    let size = |svg: &str| {
        let number = |key: &str| {
            let rest = svg.split_once(key).map_or("", |it| it.1);
            rest.split('"').next().and_then(|it| it.parse::<f64>().ok()).unwrap_or(0.0)
        };
        (number("width=\""), number("height=\""))
    };
    let ((w1, h1), (w2, h2)) = (size(first), size(second));
    let (width, height) = (w1.max(w2), h1 + h2);
    let moved = second.replacen("<svg ", &format!("<svg x=\"0\" y=\"{h1}\" "), 1);
    format!(
        "<svg width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         xmlns=\"http://www.w3.org/2000/svg\">\n{first}{moved}</svg>\n"
    )
}
