//! Where a run's signals go: table, statistics, curves, pictures.

use std::fs;
use std::path::{Path, PathBuf};

use super::selection::{Selection, to_base};
use crate::error::Error;
use crate::participant::{Participant, Slot};
use crate::plot;
use crate::record::{Curve, Gatherer, Table};
use crate::scenario::Scenario;
use crate::system::System;

/// Where the run's signals go.
pub(super) struct Output {
    pub(super) folder: PathBuf,
    pub(super) table: Table,
    pub(super) gatherers: Vec<Gatherer>,
    /// of the signals that are drawn
    pub(super) curves: Vec<Option<Curve>>,
    conversions: Vec<(f64, f64)>,
    values: Vec<f64>,
    stride: u64,
    points: u64,
}

impl Output {
    pub(super) fn create(
        folder: &Path,
        scenario: &Scenario,
        system: &System,
        selection: &Selection,
    ) -> Result<Self, Error> {
        let failed = |source| Error::Output { path: folder.to_owned(), running: false, source };
        fs::create_dir_all(folder).map_err(failed)?;
        let names: Vec<String> = selection.ports[..selection.recorded]
            .iter()
            .map(|&port| system.port_name(port))
            .collect();
        let table = Table::create(folder, names.iter().map(String::as_str)).map_err(failed)?;
        let mut curves = vec![None; selection.ports.len()];
        let points = scenario.experiment.steps()? + 1;
        for panels in &selection.plots {
            let count = panels.iter().map(Vec::len).sum();
            for &k in panels.iter().flatten() {
                // a signal in two pictures is reduced for the finer one
                let slices = plot::slices(count);
                let curve = Curve::new(points, slices);
                if curves[k].as_ref().is_none_or(|other: &Curve| other.is_coarser_than(&curve)) {
                    curves[k] = Some(curve);
                }
            }
        }
        Ok(Self {
            folder: folder.to_owned(),
            table,
            gatherers: vec![Gatherer::default(); selection.recorded],
            curves,
            conversions: selection.ports.iter().map(|&port| to_base(system, port)).collect(),
            values: vec![0.0; selection.ports.len()],
            stride: scenario.stride()?,
            points: 0,
        })
    }

    pub(super) fn take(
        &mut self,
        time: f64,
        participants: &[Participant],
        slots: &[(usize, Slot)],
    ) -> Result<(), Error> {
        for ((value, &(unit, slot)), &(factor, offset)) in
            self.values.iter_mut().zip(slots).zip(&self.conversions)
        {
            *value = factor * participants[unit].value(slot) + offset;
        }
        for (gatherer, &value) in self.gatherers.iter_mut().zip(&self.values) {
            gatherer.take(time, value);
        }
        for (curve, &value) in self.curves.iter_mut().zip(&self.values) {
            if let Some(curve) = curve {
                curve.take(time, value);
            }
        }
        if self.points.is_multiple_of(self.stride) {
            let recorded = self.gatherers.len();
            self.table.row(time, self.values[..recorded].iter().copied()).map_err(|source| {
                Error::Output { path: self.folder.clone(), running: true, source }
            })?;
        }
        self.points += 1;
        Ok(())
    }
}

/// Draws the scenario's pictures into the folder and returns their names.
pub(super) fn draw(
    scenario: &Scenario,
    system: &System,
    selection: &Selection,
    folder: &Path,
    curves: Vec<Option<Curve>>,
) -> Result<Vec<String>, Error> {
    let points: Vec<Vec<(f64, f64)>> =
        curves.into_iter().map(|curve| curve.map(Curve::finish).unwrap_or_default()).collect();
    let mut pictures = Vec::new();
    for (plot, panels) in scenario.plots.iter().zip(&selection.plots) {
        let panels: Vec<plot::Panel> = plot
            .panels
            .iter()
            .zip(panels)
            .map(|(panel, indices)| plot::Panel {
                ylabel: panel.ylabel.clone(),
                lines: indices
                    .iter()
                    .enumerate()
                    .map(|(k, &index)| plot::Line {
                        label: panel
                            .labels
                            .get(k)
                            .cloned()
                            .unwrap_or_else(|| system.port_name(selection.ports[index])),
                        points: points[index].iter().map(|&(t, y)| (t, panel.scale * y)).collect(),
                    })
                    .collect(),
            })
            .collect();
        let title = if plot.title.is_empty() { &scenario.title } else { &plot.title };
        let svg = plot::draw(title, &panels)
            .map_err(|source| Error::Plot { file: plot.file.clone(), source })?;
        let path = folder.join(&plot.file);
        fs::write(&path, svg).map_err(|source| Error::Output { path, running: true, source })?;
        pictures.push(plot.file.clone());
    }
    Ok(pictures)
}
