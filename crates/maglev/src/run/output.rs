//! Records the signals of a run: table, statistics, plots.

use std::io;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::checkpoint::CheckpointError;
use crate::error::Error;
use master::Setup;
use master::Simulation;
use master::simulation::to_base;
use master::{Misfit, StateError};
use results::{
    Curve, Gatherer, Position, RecordedColumn, TableWriter, copy_to_parquet, write_whole,
};
use scenario::ResultFormat;

/// Records the signals of a run.
pub(super) struct RunOutput<'a> {
    setup: &'a Setup,
    folder: PathBuf,
    columns: Vec<RecordedColumn>,
    table: TableWriter,
    pub(super) gatherers: Vec<Gatherer>,
    /// curves of the signals that are drawn
    curves: Vec<Option<Curve>>,
    conversions: Vec<(f64, f64)>,
    values: Vec<f64>,
}

/// The part of the output that a checkpoint keeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct OutputState {
    table: Position,
    gatherers: Vec<Gatherer>,
    curves: Vec<Option<Curve>>,
}

/// The files that a run has written besides events.csv and summary.json.
#[derive(Default)]
pub(super) struct Files {
    pub(super) rows: u64,
    pub(super) tables: Vec<String>,
    pub(super) pictures: Vec<String>,
    /// the table as text, if it was not requested
    pub(super) spare: Option<PathBuf>,
}

impl<'a> RunOutput<'a> {
    pub(super) fn create(setup: &'a Setup, folder: &Path) -> io::Result<Self> {
        let columns = setup.selection().columns(setup.system());
        let table = TableWriter::create(folder, &columns)?;
        let gatherers = vec![Gatherer::default(); columns.len()];
        Ok(Self::new(setup, folder, columns, table, gatherers, curves(setup)))
    }

    /// Continues with the files of a run from its checkpoint.
    pub(super) fn resume(
        setup: &'a Setup,
        folder: &Path,
        state: OutputState,
    ) -> Result<Self, CheckpointError> {
        let columns = setup.selection().columns(setup.system());
        let drawn = setup.selection().ports.len();
        if state.gatherers.len() != columns.len() || state.curves.len() != drawn {
            return Err(StateError::Misfit { what: Misfit::Recorded }.into());
        }
        let table = TableWriter::resume(folder, &columns, state.table).map_err(|source| {
            CheckpointError::Results { path: TableWriter::path(folder), source }
        })?;
        Ok(Self::new(setup, folder, columns, table, state.gatherers, state.curves))
    }

    fn new(
        setup: &'a Setup,
        folder: &Path,
        columns: Vec<RecordedColumn>,
        table: TableWriter,
        gatherers: Vec<Gatherer>,
        curves: Vec<Option<Curve>>,
    ) -> Self {
        let ports = &setup.selection().ports;
        Self {
            setup,
            folder: folder.to_owned(),
            columns,
            table,
            gatherers,
            curves,
            conversions: ports.iter().map(|&port| to_base(setup.system(), port)).collect(),
            values: vec![0.0; ports.len()],
        }
    }

    /// Waits until all rows are on the disk, and returns the state from which recording can continue.
    pub(super) fn state(&mut self) -> io::Result<OutputState> {
        Ok(OutputState {
            table: self.table.position()?,
            gatherers: self.gatherers.clone(),
            curves: self.curves.clone(),
        })
    }

    /// Records the signals at the current communication point of the simulation.
    #[inline]
    pub(super) fn take(&mut self, simulation: &Simulation<'_>) -> io::Result<()> {
        let time = simulation.time();
        for ((value, signal), &(factor, offset)) in
            self.values.iter_mut().zip(simulation.values()).zip(&self.conversions)
        {
            *value = factor * signal + offset;
        }
        for ((gatherer, &value), column) in
            self.gatherers.iter_mut().zip(&self.values).zip(&self.columns)
        {
            if !column.is_text {
                gatherer.take(time, value);
            }
        }
        for (curve, &value) in self.curves.iter_mut().zip(&self.values) {
            if let Some(curve) = curve {
                curve.take(time, value);
            }
        }
        let values = &self.values[..self.gatherers.len()];
        self.table.take(simulation.done(), time, values, |signal| simulation.text(signal))
    }

    /// Writes the row of the last communication point of a run that ends early, if none of its signals was due there.
    pub(super) fn take_last(&mut self, simulation: &Simulation<'_>) -> io::Result<()> {
        let done = simulation.done();
        if self.columns.iter().any(|column| done.is_multiple_of(column.stride)) {
            return Ok(());
        }
        let values = &self.values[..self.gatherers.len()];
        // all signals are due in the row of step 0
        self.table.take(0, simulation.time(), values, |signal| simulation.text(signal))
    }

    /// Completes the table, copies it and draws the plots. Continues after an error, and returns the first one
    /// together with the files that were written.
    pub(super) fn finish(self, draw: bool) -> (Files, Result<(), Error>) {
        let Self { setup, folder, columns, table, curves, .. } = self;
        let formats = &setup.scenario().record.format;
        let mut files = Files { rows: table.rows(), ..Files::default() };
        let failed = |source| Error::Output { path: folder.clone(), running: true, source };
        let mut result = table.finish().map_err(failed).map(|csv| {
            if formats.contains(&ResultFormat::Csv) {
                files.tables.push(results::TABLE.to_owned());
            } else {
                files.spare = Some(csv);
            }
        });
        if result.is_ok() && formats.contains(&ResultFormat::Parquet) {
            let copied = copy_to_parquet(&folder, &columns)
                .map_err(|source| Error::Parquet { folder: folder.clone(), source });
            result = copied.map(|_| files.tables.push(results::PARQUET.to_owned()));
            if result.is_err() {
                // it is the only table
                files.spare = None;
            }
        }
        if draw {
            let drawn = pictures(setup, &folder, curves, &mut files.pictures);
            result = result.and(drawn);
        }
        (files, result)
    }
}

/// Empty curves for the signals that are drawn.
fn curves(setup: &Setup) -> Vec<Option<Curve>> {
    let mut curves = vec![None; setup.selection().ports.len()];
    let points = setup.steps() + 1;
    for panels in &setup.selection().plots {
        let count = panels.iter().map(Vec::len).sum();
        for &k in panels.iter().flatten() {
            // a signal in two plots is reduced for the finer one
            let curve = Curve::new(points, figure::slices(count));
            if curves[k].as_ref().is_none_or(|other: &Curve| other.is_coarser_than(&curve)) {
                curves[k] = Some(curve);
            }
        }
    }
    curves
}

/// Draws the scenario's plots into the folder and adds their file names.
fn pictures(
    setup: &Setup,
    folder: &Path,
    curves: Vec<Option<Curve>>,
    names: &mut Vec<String>,
) -> Result<(), Error> {
    let (scenario, system, selection) = (setup.scenario(), setup.system(), setup.selection());
    let points: Vec<Vec<(f64, f64)>> =
        curves.into_iter().map(|curve| curve.map(Curve::finish).unwrap_or_default()).collect();
    let line = |scale: f64, label: Option<&String>, index: usize| figure::FigureLine {
        label: label.cloned().unwrap_or_else(|| system.port_name(selection.ports[index])),
        points: points[index].iter().map(|&(t, y)| (t, scale * y)).collect(),
    };
    for (plot, panels) in scenario.plots.iter().zip(&selection.plots) {
        let panels: Vec<figure::FigurePanel> = plot
            .panels
            .iter()
            .zip(panels)
            .map(|(panel, indices)| figure::FigurePanel {
                ylabel: panel.ylabel.clone(),
                lines: (0_usize..)
                    .zip(indices)
                    .map(|(k, &index)| line(panel.scale, panel.labels.get(k), index))
                    .collect(),
            })
            .collect();
        let title = if plot.title.is_empty() { &scenario.title } else { &plot.title };
        let svg = figure::draw(title, &panels)
            .map_err(|source| Error::Plot { file: plot.file.clone(), source })?;
        let path = folder.join(&plot.file);
        write_whole(&path, svg.as_bytes()).map_err(|source| Error::Output {
            path,
            running: true,
            source,
        })?;
        names.push(plot.file.clone());
    }
    Ok(())
}
