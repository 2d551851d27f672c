//! A run whose signals stay in memory.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use criteria::Verdict;
use master::simulation::{Pool, to_base};
use master::{Error, Setup, Simulation};
use results::summary::{RideQuality, Status};
use results::{Table, TableRecorder};

use crate::listener::Listener;
use crate::{Signals, metrics, ride};

/// A run that has ended.
#[derive(Debug)]
pub struct Run {
    /// How it ended.
    pub status: Status,
    /// Why it failed.
    pub error: Option<Error>,
    /// Why it ended before its stop time, if it did as a result.
    pub ended_by: Option<String>,
    /// Last time that it reached (s).
    pub reached: f64,
    /// Number of finished steps.
    pub steps: u64,
    /// The recorded signals in SI units, until the end.
    pub table: Table,
    /// Ride quality at the points of the scenario. None of a failed run.
    pub ride: Option<RideQuality>,
    /// The objectives and limits of the scenario. None of a failed run.
    pub verdicts: Vec<Verdict>,
    /// Wall time of loading, initialization and the first outputs.
    pub start_time: Duration,
    /// Wall time of the steps.
    pub step_time: Duration,
}

/// Starts, steps to the end and judges. `watch` is called after each step and can end the run, which is then
/// [`Status::Interrupted`]. A run that fails keeps its signals until then.
pub fn run(
    setup: &Setup,
    pool: &mut Pool,
    watch: &mut dyn FnMut(&Simulation<'_>) -> ControlFlow<()>,
) -> Run {
    let begin = Instant::now();
    let columns = setup.selection().columns(setup.system());
    let mut run = Run {
        status: Status::Failed,
        error: None,
        ended_by: None,
        reached: setup.time_after(0),
        steps: 0,
        table: Table::default(),
        ride: None,
        verdicts: Vec::new(),
        start_time: Duration::ZERO,
        step_time: Duration::ZERO,
    };
    let mut recorder = Recorder::new(setup, TableRecorder::new(&columns));
    match setup.start_from(pool) {
        Err(error) => {
            run.error = Some(error);
            run.start_time = begin.elapsed();
        }
        Ok(mut simulation) => {
            run.start_time = begin.elapsed();
            let stepping = Instant::now();
            let ended = steps(&mut simulation, &mut recorder, watch);
            run.step_time = stepping.elapsed();
            (run.steps, run.reached) = (simulation.done(), simulation.time());
            let ended = ended.and_then(|(status, by)| {
                // instances that are not given back are freed
                let unterminated = pool.take_back(simulation);
                unterminated.map(|()| (status, by))
            });
            match ended {
                Ok((status, by)) => (run.status, run.ended_by) = (status, by),
                Err(error) => run.error = Some(error),
            }
        }
    }
    run.table = recorder.table.finish();
    if run.error.is_none() {
        let signals = Signals::Table(&run.table);
        run.ride = ride::judge(setup, signals);
        // a table in memory can always be read
        run.verdicts = metrics::judge(setup, signals, None, run.ride.as_ref()).unwrap_or_default();
    }
    run
}

/// Steps to the end. Returns how the run ended, and why if that was early.
fn steps(
    simulation: &mut Simulation<'_>,
    recorder: &mut Recorder,
    watch: &mut dyn FnMut(&Simulation<'_>) -> ControlFlow<()>,
) -> Result<(Status, Option<String>), Error> {
    let mut listener = Listener::new(simulation.participants().len());
    recorder.take(simulation);
    let stopped = |it: &Simulation<'_>| it.stopped().map(str::to_owned);
    if let Some(why) = stopped(simulation) {
        return Ok((Status::Stopped, Some(why)));
    }
    while simulation.remaining() > 0 {
        match simulation.step() {
            Ok(()) => {}
            Err(Error::Step { source, .. }) if source.asks_to_end() => {
                return Ok((Status::Terminated, Some(source.to_string())));
            }
            Err(error) => return Err(error),
        }
        recorder.take(simulation);
        let time = simulation.time();
        let heard = listener.listen(simulation.participants_mut());
        heard.map_err(|source| Error::Step { time, source })?;
        if let Some(why) = stopped(simulation) {
            recorder.take_last(simulation);
            return Ok((Status::Stopped, Some(why)));
        }
        if watch(simulation).is_break() {
            return Ok((Status::Interrupted, None));
        }
    }
    simulation.check_loops()?;
    Ok((Status::Finished, None))
}

/// Records signals in SI units.
struct Recorder {
    table: TableRecorder,
    conversions: Vec<(f64, f64)>,
    values: Vec<f64>,
    strides: Vec<u64>,
}

impl Recorder {
    fn new(setup: &Setup, table: TableRecorder) -> Self {
        let recorded = setup.selection().recorded();
        let conversions: Vec<_> = recorded.map(|port| to_base(setup.system(), port)).collect();
        let strides = setup.selection().strides.clone();
        Self { table, values: vec![0.0; conversions.len()], conversions, strides }
    }

    #[inline]
    fn take(&mut self, simulation: &Simulation<'_>) {
        self.row(simulation, simulation.done());
    }

    /// The row of the last communication point of a run that ends early, if none of its signals was due there.
    fn take_last(&mut self, simulation: &Simulation<'_>) {
        let done = simulation.done();
        if !self.strides.iter().any(|stride| done.is_multiple_of(*stride)) {
            // all signals are due in the row of step 0
            self.row(simulation, 0);
        }
    }

    #[inline]
    fn row(&mut self, simulation: &Simulation<'_>, number: u64) {
        if !self.table.is_due(number) {
            return;
        }
        let signals = simulation.values().zip(&self.conversions);
        for (value, (signal, &(factor, offset))) in self.values.iter_mut().zip(signals) {
            *value = factor * signal + offset;
        }
        self.table.take(number, simulation.time(), &self.values);
    }
}
