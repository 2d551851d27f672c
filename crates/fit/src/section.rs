//! A fit as a section of a report.

use report::section::{Cell, Note, Section, SectionFigure, SectionTable};

use crate::{Fit, FittedParameter};

/// The section of a report about a fit.
#[must_use]
pub fn section(fit: &Fit) -> Section {
    let mut notes = vec![Note::plain(format!(
        "{} parameters fitted to {} by least squares (Levenberg-Marquardt within bounds), with {} runs of the scenario and {} \
         iterations.",
        fit.parameters.len(),
        fit.file,
        fit.runs,
        fit.iterations
    ))];
    notes.push(Note::plain(match fit.is_white() {
        true => "The residuals pass as white noise, so the intervals are those of independent errors (Student's t).".to_owned(),
        false => "The residuals are not white, so the intervals are those of errors that are correlated in time, as an \
                  autoregressive process that fits the residuals."
            .to_owned(),
    }));
    notes.extend(fit.warnings.iter().map(|it| Note::warning(format!("{it}."))));
    let figures = fit.signals.iter().filter_map(|it| {
        let values = (it.times.as_slice(), it.residuals.as_slice());
        let svg = measured::residuals(&it.signal, it.unit.as_deref(), values, &it.autocorrelation)?;
        let caption = format!("{}: residuals of the fit, and their autocorrelation", it.signal);
        Some(SectionFigure { svg, caption })
    });
    let mut tables = vec![parameters(fit), signals(fit)];
    if fit.parameters.len() > 1 {
        tables.push(correlations(fit));
    }
    Section {
        id: "fit",
        title: "Fitted parameters".to_owned(),
        short: "Fit",
        notes,
        tables,
        figures: figures.collect(),
    }
}

fn parameters(fit: &Fit) -> SectionTable {
    let columns = [
        ("parameter", false),
        ("unit", false),
        ("before", true),
        ("fitted", true),
        ("± 95 %", true),
        ("relative (%)", true),
        ("lower bound", true),
        ("upper bound", true),
        ("remark", false),
    ];
    let number = |it: Option<f64>| it.map_or(Cell::None, Cell::Number);
    let white = fit.is_white();
    let row = |it: &FittedParameter| {
        let half = it.interval(white).filter(|_| it.determined);
        let remark = match it {
            it if it.at_bound => "at its bound",
            it if !it.determined => "not determined by the record",
            _ => "",
        };
        vec![
            Cell::Text(it.target.clone()),
            Cell::Text(it.unit.clone().unwrap_or_default()),
            number(it.before),
            Cell::Number(it.value),
            number(half),
            number(half.map(|half| 100.0 * half / it.value.abs()).filter(|it| it.is_finite())),
            Cell::Number(it.low),
            Cell::Number(it.high),
            Cell::Text(remark.to_owned()),
        ]
    };
    SectionTable::new("Parameters", &columns, fit.parameters.iter().map(row).collect())
}

fn signals(fit: &Fit) -> SectionTable {
    let columns = [
        ("signal", false),
        ("column", false),
        ("values", true),
        ("RMS difference before", true),
        ("RMS residual", true),
        ("correlation of neighbours", true),
        ("Ljung-Box probability", true),
        ("white", false),
    ];
    let rows = fit.signals.iter().map(|it| {
        let unit = it.unit.clone().unwrap_or_default();
        let quantity = |value: f64| Cell::Quantity { value, unit: unit.clone() };
        vec![
            Cell::Text(it.signal.clone()),
            Cell::Text(it.column.clone()),
            Cell::Number(it.samples as f64),
            it.rms_before.map_or(Cell::None, quantity),
            quantity(it.rms_after),
            Cell::Number(it.whiteness.first_lag),
            Cell::Number(it.whiteness.probability),
            Cell::Text(if it.whiteness.white { "yes" } else { "no" }.to_owned()),
        ]
    });
    SectionTable::new("Residuals", &columns, rows.collect())
}

fn correlations(fit: &Fit) -> SectionTable {
    let mut columns = vec![("", false)];
    columns.extend(fit.parameters.iter().map(|it| (it.target.as_str(), true)));
    let rows = fit.parameters.iter().zip(&fit.correlations).map(|(it, row)| {
        let cells = row.iter().map(|it| it.map_or(Cell::None, Cell::Number));
        std::iter::once(Cell::Text(it.target.clone())).chain(cells).collect()
    });
    SectionTable::new("Correlation of the estimates", &columns, rows.collect())
}
