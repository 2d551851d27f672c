//! A record beside a run as a section of a report.

use report::section::{Cell, Note, Section, SectionFigure, SectionTable};

use crate::{Comparison, SignalComparison, pictures};

/// The section of a report about measured data, one comparison for each run.
#[must_use]
pub fn section(comparisons: &[Comparison]) -> Section {
    let mut notes = Vec::new();
    if let Some(first) = comparisons.first() {
        notes.push(Note::plain(format!(
            "Record: {}. The difference is run minus record, at the times of the record; between two recorded values of the \
             run a cubic polynomial.",
            first.file
        )));
        units(first, &mut notes);
    }
    for comparison in comparisons {
        alignment(comparison, comparisons.len() > 1, &mut notes);
        for it in &comparison.signals {
            remarks(it, &mut notes);
        }
    }
    let tables = vec![over_time(comparisons), over_frequency(comparisons)];
    // the first run is the one that others are compared with
    let signals = comparisons.first().into_iter().flat_map(|it| &it.signals);
    let figures = signals.flat_map(|it| {
        let name = &it.column.signal;
        let spectra = it.spectra.as_ref();
        [
            (pictures::over_time(it), format!("{name}: run and record, and their difference")),
            (
                spectra.and_then(|spectra| pictures::densities(it, spectra)),
                format!("{name}: power spectral densities of run and record"),
            ),
            (
                spectra.and_then(|spectra| pictures::coherence(it, spectra)),
                format!("{name}: coherence of run and record"),
            ),
        ]
    });
    let figures = figures.filter_map(|(svg, caption)| Some(SectionFigure { svg: svg?, caption }));
    Section {
        id: "measured",
        title: "Measured data".to_owned(),
        short: "Measured",
        notes,
        tables: tables.into_iter().filter(|it| !it.rows.is_empty()).collect(),
        figures: figures.collect(),
    }
}

fn units(comparison: &Comparison, notes: &mut Vec<Note>) {
    for it in &comparison.signals {
        let (column, signal) = (&it.column.column, &it.column.signal);
        let to = it.column.unit.as_deref().unwrap_or("1");
        notes.push(match &it.column.file_unit {
            None => Note::warning(format!(
                "Column \"{column}\" has no unit; its values are taken as those of {signal} in {to}."
            )),
            Some(from) => Note::plain(format!("Column \"{column}\" in {from} is {signal} in {to}.")),
        });
    }
}

fn alignment(comparison: &Comparison, named: bool, notes: &mut Vec<Note>) {
    let run = if named { format!("{}: ", comparison.run) } else { String::new() };
    let offset = comparison.alignment.offset;
    let Some(found) = comparison.alignment.found else {
        notes.push(Note::plain(match offset {
            0.0 => format!("{run}the times of the record are taken as those of the run."),
            _ => format!("{run}{offset} s were added to the times of the record, as given."),
        }));
        return;
    };
    notes.push(Note::plain(format!(
        "{run}{offset:.6} s were added to the times of the record: found by cross-correlation, with a coefficient of \
         {:.4} and an interval of {:.4e} s.",
        found.correlation, found.interval
    )));
    if let Some((other, coefficient)) = found.ambiguous {
        notes.push(Note::warning(format!(
            "{run}the offset is ambiguous: at {other:.6} s the coefficient is {coefficient:.4}. Give the offset if you know \
             it."
        )));
    }
}

fn remarks(it: &SignalComparison, notes: &mut Vec<Note>) {
    let signal = &it.column.signal;
    if it.outside > 0 {
        notes.push(Note::plain(format!(
            "{signal}: {} of {} values of the record are before or after the run and not compared.",
            it.outside,
            it.outside + it.samples
        )));
    }
    if let Some(error) = &it.spectra_error {
        notes.push(Note::plain(format!("{signal} has no spectra here: {error}.")));
    }
    if it.spectra.as_ref().is_some_and(|it| it.resampled) {
        notes.push(Note::plain(format!(
            "{signal}: the times of the record are uneven; for spectra both signals were interpolated at its median interval."
        )));
    }
}

fn over_time(comparisons: &[Comparison]) -> SectionTable {
    let columns = [
        ("signal", false),
        ("run", false),
        ("samples", true),
        ("from (s)", true),
        ("to (s)", true),
        ("mean difference", true),
        ("RMS difference", true),
        ("relative (%)", true),
        ("peak difference", true),
        ("at (s)", true),
        ("peak measured", true),
        ("peak run", true),
        ("correlation", true),
    ];
    let row = |run: &str, it: &SignalComparison| {
        let unit = it.column.unit.clone().unwrap_or_default();
        let quantity = |value: f64| Cell::Quantity { value, unit: unit.clone() };
        vec![
            Cell::Text(it.column.signal.clone()),
            Cell::Text(run.to_owned()),
            Cell::Number(it.samples as f64),
            Cell::Number(it.from),
            Cell::Number(it.to),
            quantity(it.mean_error),
            quantity(it.rms_error),
            it.relative_rms_error.map_or(Cell::None, |it| Cell::Number(100.0 * it)),
            quantity(it.peak_error),
            Cell::Number(it.time_of_peak_error),
            quantity(it.peak_measured),
            quantity(it.peak_run),
            it.correlation.map_or(Cell::None, Cell::Number),
        ]
    };
    SectionTable::new(
        "Differences over time. Relative: RMS difference over the standard deviation of the record. Peaks of record and run \
         are distances from their means",
        &columns,
        rows(comparisons, |run, it| Some(row(run, it))),
    )
}

fn over_frequency(comparisons: &[Comparison]) -> SectionTable {
    let columns = [
        ("signal", false),
        ("run", false),
        ("peak measured (Hz)", true),
        ("peak run (Hz)", true),
        ("mean coherence", true),
        ("pieces", true),
        ("resolution (Hz)", true),
    ];
    let row = |run: &str, it: &SignalComparison| {
        let spectra = it.spectra.as_ref()?;
        Some(vec![
            Cell::Text(it.column.signal.clone()),
            Cell::Text(run.to_owned()),
            spectra.peak_measured.map_or(Cell::None, Cell::Number),
            spectra.peak_run.map_or(Cell::None, Cell::Number),
            Cell::Number(spectra.mean_coherence),
            Cell::Number(spectra.pieces as f64),
            Cell::Number(spectra.resolution),
        ])
    };
    SectionTable::new(
        "Spectra beside each other. The coherence is weighted by the density of the record; of unrelated signals it is about \
         one over the number of pieces",
        &columns,
        rows(comparisons, row),
    )
}

fn rows(
    comparisons: &[Comparison],
    row: impl Fn(&str, &SignalComparison) -> Option<Vec<Cell>>,
) -> Vec<Vec<Cell>> {
    let all =
        comparisons.iter().flat_map(|it| it.signals.iter().map(|signal| (it.run.as_str(), signal)));
    all.filter_map(|(run, signal)| row(run, signal)).collect()
}
