//! Computes points in this process.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use in_memory::{Reset, Run, needed, prove_resets, run};
use master::Simulation;
use master::simulation::Pool;
use results::Table;
use results::summary::Status as RunStatus;
use scenario::{Recorded, Scenario};

use crate::{Column, Limits, Point, Row, Status, Study, StudyError, plan};

/// Computes points of a study, one after the other, with units that are opened and libraries that are loaded once.
pub struct Runner<'a> {
    study: &'a Study,
    pool: Pool,
    /// what a point records
    record: Vec<Recorded>,
    /// units of measure of the figures
    units: Vec<Option<String>>,
    resets: Vec<Reset>,
}

/// A point that has been computed.
#[derive(Debug)]
pub struct Computed {
    /// Its row.
    pub row: Row,
    /// Its signals, without those that `keep.signals` does not name.
    pub signals: Table,
    /// Wall time of the whole point.
    pub time: Duration,
    /// Wall time of its steps alone.
    pub step_time: Duration,
}

impl<'a> Runner<'a> {
    /// Chooses the step if the scenario asks for an accuracy, opens the units, and checks the first point whole.
    ///
    /// # Errors
    /// The scenario of the first point does not fit its units.
    pub fn new(study: &'a Study) -> Result<Self, StudyError> {
        Self::starting_with(study, 1)
    }

    /// As [`Runner::new`], but checks the point of that number.
    ///
    /// # Errors
    /// There is no such point, or its scenario does not fit its units.
    pub fn starting_with(study: &'a Study, number: u64) -> Result<Self, StudyError> {
        study.choose(&mut |_| (), &mut || false)?;
        let mut pool = Pool::default();
        let first = plan::apply(study, &study.point(number)?)?;
        let setup = pool.setup(&first).map_err(|source| StudyError::Setup { number, source })?;
        let record = needed(&setup, &study.file.keep.signals);
        let signals = setup.selection().columns(setup.system());
        let names: Vec<String> = signals.iter().map(|it| it.name.clone()).collect();
        let unit = |column: &Column| {
            let pattern = column.metric.signal.as_deref().unwrap_or_default();
            let first = criteria::selected(pattern, &names).into_iter().next();
            criteria::unit_of(&column.metric, first.and_then(|k| signals[k].unit.clone()))
        };
        let units = study.columns().iter().map(unit).collect();
        Ok(Self { study, pool, record, units, resets: Vec::new() })
    }

    /// Units of measure of the figures, in the order of [`Study::columns`].
    #[must_use]
    pub fn units(&self) -> &[Option<String>] {
        &self.units
    }

    /// Finds out which instances can be reset and used again. Without it all instances are made anew.
    ///
    /// # Errors
    /// There are no points.
    pub fn prove_resets(&mut self) -> Result<&[Reset], StudyError> {
        let (first, last) = (self.study.point(1)?, self.study.point(self.study.count())?);
        let mut setup = |point: &Point| {
            let scenario = plan::apply(self.study, point).ok()?;
            self.pool.setup(&recording(&self.record, scenario)).ok()
        };
        if let (Some(before), Some(after)) = (setup(&last), setup(&first)) {
            // a point that fails proves nothing, and then all instances are made anew
            self.resets = prove_resets(&before, &after, &mut self.pool).unwrap_or_default();
        }
        Ok(&self.resets)
    }

    /// Whether this process should end soon and another one continue.
    #[must_use]
    pub fn is_worn(&self) -> bool {
        self.pool.is_worn()
    }

    /// The scenario of a point, as it can be run by itself: with everything that the base scenario records.
    ///
    /// # Errors
    /// There is no such point, or a target cannot have its value.
    pub fn scenario(&self, number: u64) -> Result<Scenario, StudyError> {
        plan::apply(self.study, &self.study.point(number)?)
    }

    /// Computes a point. A point that fails is a row with that status.
    ///
    /// # Errors
    /// There is no such point.
    pub fn run(&mut self, number: u64) -> Result<Row, StudyError> {
        self.compute(number, &mut |_| ControlFlow::Continue(())).map(|it| it.row)
    }

    /// Computes a point, with its signals. `watch` is called after each step and can end the point, which is then
    /// [`Status::TimedOut`].
    ///
    /// # Errors
    /// There is no such point.
    pub fn compute(
        &mut self,
        number: u64,
        watch: &mut dyn FnMut(&Simulation<'_>) -> ControlFlow<()>,
    ) -> Result<Computed, StudyError> {
        let begin = Instant::now();
        let point = self.study.point(number)?;
        let failed = |text: String| Computed {
            row: Row::without_figures(point.name.clone(), Status::Failed, text),
            signals: Table::default(),
            time: begin.elapsed(),
            step_time: Duration::ZERO,
        };
        let scenario = match plan::apply(self.study, &point) {
            Ok(scenario) => recording(&self.record, scenario),
            Err(error) => return Ok(failed(error.chain().join(": "))),
        };
        let setup = match self.pool.setup(&scenario) {
            Ok(setup) => setup,
            Err(error) => return Ok(failed(results::causes(&error).join(": "))),
        };
        let run = run(&setup, &mut self.pool, watch);
        let row = row(&point, &run);
        let signals = self.kept(run.table);
        Ok(Computed { row, signals, time: begin.elapsed(), step_time: run.step_time })
    }

    /// The signals that are kept.
    fn kept(&self, mut table: Table) -> Table {
        let keep = &self.study.file.keep.signals;
        let chosen: Vec<usize> =
            keep.iter().flat_map(|it| criteria::selected(it, &table.names)).collect();
        let is_kept = |k: &usize| chosen.contains(k);
        let mut k = 0..;
        table.names.retain(|_| k.next().is_some_and(|k| is_kept(&k)));
        let mut k = 0..;
        table.columns.retain(|_| k.next().is_some_and(|k| is_kept(&k)));
        table
    }
}

/// A scenario that records what a point needs.
fn recording(record: &[Recorded], mut scenario: Scenario) -> Scenario {
    scenario.record.signals = record.to_vec();
    scenario
}

fn row(point: &Point, run: &Run) -> Row {
    let status = match run.status {
        RunStatus::Finished => Status::Finished,
        RunStatus::Stopped => Status::Stopped,
        RunStatus::Terminated => Status::Terminated,
        RunStatus::Interrupted => Status::TimedOut,
        RunStatus::Failed => Status::Failed,
    };
    let message = match (&run.error, &run.ended_by) {
        (Some(error), _) => results::causes(error).join(": "),
        (None, Some(text)) => text.clone(),
        (None, None) => {
            let missing = run.verdicts.iter().filter(|it| it.value.is_none());
            let texts: Vec<String> =
                missing.map(|it| format!("{}: {}", it.name, it.reason)).collect();
            texts.join("; ")
        }
    };
    let regular = status.is_regular();
    Row {
        run: point.name.clone(),
        status,
        limits: Limits::of(&run.verdicts).filter(|_| regular),
        reached: Some(run.reached),
        metrics: if regular {
            run.verdicts.iter().map(|it| it.value.filter(|it| it.is_finite())).collect()
        } else {
            Vec::new()
        },
        message,
    }
}
