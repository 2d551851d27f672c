//! The pictures of the page.

use analysis::{
    series,
    spectrum::{Spectrum, amplitude},
    window::Window,
};
use anyhow::Result;
use figure::{FigureLine, FigurePanel, draw_over};
use results::Table;

use crate::{
    measure::{density, deviation, gaps, response, signal, size},
    numbers::{Numbers, Standstill},
    readings::{self, Dataset},
    runs::{self, FREQUENCIES, MEANS},
};

/// Slices per curve: enough for a page, and few enough for a small file.
const SLICES: usize = 350;
const TIME: &str = "time (s)";
const FREQUENCY: &str = "frequency (Hz)";

/// All pictures: file name and SVG.
pub fn draw(numbers: &Numbers, dataset: &Dataset) -> Result<Vec<(&'static str, String)>> {
    let mut all = of_readings(dataset)?;
    all.extend([
        ("resonance.svg", resonance()?),
        ("impulse.svg", impulse()?),
        ("low-speed.svg", low_speed()?),
        ("standstill.svg", standstill()?),
        ("standstill-spectra.svg", standstill_spectra(numbers)?),
        ("girders.svg", girders()?),
        ("low-speed-spectra.svg", low_speed_spectra(&numbers.standstill)?),
    ]);
    Ok(all)
}

/// Those of the readings, which follow from the dataset alone.
pub fn of_readings(dataset: &Dataset) -> Result<Vec<(&'static str, String)>> {
    let judged = readings::judged(dataset)?;
    Ok(vec![
        ("readings.svg", readings::overview(&judged)),
        ("readings-girders.svg", readings::girders_picture(&judged, dataset)?),
    ])
}

/// Smallest and largest value of each slice in their order: a curve without lost peaks.
fn reduced(time: &[f64], values: &[f64], scale: f64) -> Vec<(f64, f64)> {
    let size = time.len().div_ceil(SLICES).max(1);
    let mut points = Vec::new();
    for (time, values) in time.chunks(size).zip(values.chunks(size)) {
        let by_value = |a: &(usize, &f64), b: &(usize, &f64)| a.1.total_cmp(b.1);
        let low = values.iter().enumerate().min_by(by_value).map_or(0, |it| it.0);
        let high = values.iter().enumerate().max_by(by_value).map_or(0, |it| it.0);
        points.extend([low.min(high), low.max(high)].map(|k| {
            // three decimals more than the eye sees, and short numbers in the file
            (time[k], (values[k] * scale * 1e5).round() / 1e5)
        }));
    }
    points
}

fn line(label: &str, table: &Table, name: &str) -> Result<FigureLine> {
    let points = reduced(&table.time, signal(table, name)?, 1e3);
    Ok(FigureLine { label: label.to_owned(), points })
}

fn panel(ylabel: &str, lines: Vec<FigureLine>) -> FigurePanel {
    FigurePanel { ylabel: ylabel.to_owned(), lines }
}

fn resonance() -> Result<String> {
    let table = runs::table(runs::LIMITED)?;
    let lines = vec![
        line("bogie 4, rear", &table, "vehicle.gap_28")?,
        line("bogie 1, front", &table, "vehicle.gap_01")?,
    ];
    let girder = vec![line("mid-span", &table, "guideway.midspan_displacement_02")?];
    let panels = [panel("gap (mm)", lines), panel("deflection (mm)", girder)];
    Ok(draw_over("Resonance of train and girder, limited by stops and skids", TIME, &panels)?)
}

fn impulse() -> Result<String> {
    let table = runs::table(runs::IMPULSE)?;
    let sensor = signal(&table, "guideway.sensor_acceleration")?;
    let spectrum = amplitude(sensor, series::rate(&table.time)?, Window::Rectangular)?;
    let mut lines = vec![spectrum_line("sensor at 8 m", &spectrum, 40.0, false)];
    for (label, frequency) in [("table 3: 7.1 Hz", 7.1), ("table 3: 24.9 Hz", 24.9)] {
        let mark = mark(label.to_owned(), frequency, &lines[..1]);
        lines.push(mark);
    }
    let panels = [panel("acceleration (mm/s²)", lines)];
    Ok(draw_over(
        "Spectrum of the bare girder's acceleration after an impulse",
        FREQUENCY,
        &panels,
    )?)
}

fn low_speed() -> Result<String> {
    let table = runs::table("low-speed")?;
    let spans = ["01", "02", "03"]
        .map(|k| line(&format!("span {k}"), &table, &format!("guideway.midspan_displacement_{k}")));
    let panels = [
        panel("gap, front bogie (mm)", vec![line("first magnet", &table, "vehicle.gap_01")?]),
        panel("gap, rear bogie (mm)", vec![line("first magnet", &table, "vehicle.gap_57")?]),
        panel("mid-span deflection (mm)", spans.into_iter().collect::<Result<_>>()?),
    ];
    Ok(draw_over("5 km/h over three spans", TIME, &panels)?)
}

fn standstill() -> Result<String> {
    let mut panels = Vec::new();
    for (name, place) in [("standstill", "mid-span"), ("standstill-quarter", "a quarter")] {
        let table = runs::table(name)?;
        let front = line("bogie 1, front", &table, "vehicle.gap_01")?;
        let inner = line("bogie 4, rear", &table, "vehicle.gap_28")?;
        panels.push(panel(&format!("gap, force at {place} (mm)"), vec![inner, front]));
        let middle = line("mid-span", &table, "guideway.midspan_displacement_02")?;
        let quarter = line("quarter", &table, "guideway.quarter_displacement_02")?;
        panels.push(panel(&format!("deflection, force at {place} (mm)"), vec![middle, quarter]));
    }
    Ok(draw_over(
        "Standstill: chirp of 10 kN, its frequency in Hz is the time in s",
        TIME,
        &panels,
    )?)
}

/// Amplitudes in mm, or roots of a density in mm/√Hz, up to a frequency; with `log` their common logarithm.
fn spectrum_line(label: &str, spectrum: &Spectrum, to: f64, log: bool) -> FigureLine {
    let bins = spectrum.bins(spectrum.resolution, to);
    let every = (bins.len() / SLICES).max(1);
    let points = bins.step_by(every).map(|k| {
        let value = size(spectrum, k) * 1e3;
        (spectrum.frequency(k), if log { value.max(1e-12).log10() } else { value })
    });
    FigureLine { label: label.to_owned(), points: points.collect() }
}

/// The coupled modes as vertical lines.
fn marks(run: &Standstill, lines: &[FigureLine]) -> Vec<FigureLine> {
    let label = |frequency| format!("coupled mode {frequency:.2} Hz");
    run.modes.iter().map(|it| mark(label(it.frequency), it.frequency, lines)).collect()
}

/// A vertical line from the lowest to the highest of the curves.
fn mark(label: String, frequency: f64, lines: &[FigureLine]) -> FigureLine {
    let values = || lines.iter().flat_map(|line| line.points.iter().map(|point| point.1));
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    FigureLine { label, points: vec![(frequency, low), (frequency, high)] }
}

fn standstill_spectra(numbers: &Numbers) -> Result<String> {
    let mut panels = Vec::new();
    for (name, place, run) in [
        ("standstill", "mid-span", &numbers.standstill),
        ("standstill-quarter", "a quarter", &numbers.quarter),
    ] {
        let table = runs::table(name)?;
        let gaps = response(&table, &gaps(&table)?)?;
        let mut lines = vec![spectrum_line("gaps, mean of all", &gaps, 50.0, false)];
        lines.extend(marks(run, &lines));
        panels.push(panel(&format!("force at {place} (mm)"), lines));
    }
    Ok(draw_over("Standstill: spectra of the gaps' deviations", FREQUENCY, &panels)?)
}

fn girders() -> Result<String> {
    let mut panels = Vec::new();
    for means in MEANS {
        let (mut gap_lines, mut middle_lines) = (Vec::new(), Vec::new());
        for frequency in FREQUENCIES {
            let table = runs::table(&runs::girder(frequency, means))?;
            let label = format!("{frequency} Hz");
            let gap = deviation(&table, "vehicle.gap_28")?;
            let middle = deviation(&table, "guideway.midspan_displacement_02")?;
            for (lines, values) in [(&mut gap_lines, gap), (&mut middle_lines, middle)] {
                let points = reduced(&table.time, &values, 1e3);
                lines.push(FigureLine { label: label.clone(), points });
            }
        }
        panels.push(panel(&format!("gap deviation, by {means} (mm)"), gap_lines));
        panels.push(panel(&format!("mid-span, by {means} (mm)"), middle_lines));
    }
    let title = "Girders of 5 to 8 Hz under the chirp, its frequency in Hz is the time in s";
    Ok(draw_over(title, TIME, &panels)?)
}

fn low_speed_spectra(rest: &Standstill) -> Result<String> {
    let (mut gap_lines, mut girder_lines) = (Vec::new(), Vec::new());
    for (name, label) in [
        ("low-speed", "waves from 0.5 m"),
        (runs::SHORT_WAVES, "waves from 0.05 m"),
        (runs::AT_CENTRES, "the same, felt at the magnets' centres"),
    ] {
        let table = runs::table(name)?;
        let span = 10.0..65.0;
        let of_gaps = density(&table, &gaps(&table)?, 0.25, &span)?;
        gap_lines.push(spectrum_line(label, &of_gaps, 40.0, true));
        let accelerations = ["01", "02", "03"].map(|k| {
            signal(&table, &format!("guideway.midspan_acceleration_{k}")).map(<[f64]>::to_vec)
        });
        let accelerations = accelerations.into_iter().collect::<Result<Vec<_>>>()?;
        let of_girders = density(&table, &accelerations, 0.25, &span)?;
        girder_lines.push(spectrum_line(label, &of_girders, 40.0, true));
    }
    for lines in [&mut gap_lines, &mut girder_lines] {
        lines.extend(marks(rest, lines));
    }
    let panels = [
        panel("gaps, log10 of mm/√Hz", gap_lines),
        panel("girders' acceleration, log10 of mm/s²/√Hz", girder_lines),
    ];
    Ok(draw_over("5 km/h: spectra of gaps and girders", FREQUENCY, &panels)?)
}
