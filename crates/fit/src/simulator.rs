//! Runs of the scenario in threads, each with its own units.

use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;

use master::simulation::Pool;
use measured::Interpolated;
use results::Table;
use results::summary::Status;
use scenario::{Override, Scenario};

use crate::least_squares::Model;
use crate::varied::Varied;

/// Where the values of a run are wanted.
#[derive(Debug, Clone)]
pub(crate) struct Wanted {
    /// Signal and times of the record, without any offset.
    pub(crate) columns: Vec<(String, Vec<f64>)>,
    /// Seconds that are added to these times.
    pub(crate) offset: f64,
}

struct Job {
    number: usize,
    values: Vec<f64>,
}

type Answer = (usize, Result<Vec<f64>, String>);

/// Computes the values of the record's signals for sets of parameters.
pub(crate) struct Simulator {
    jobs: Option<Sender<Job>>,
    answers: Receiver<Answer>,
    threads: Vec<JoinHandle<()>>,
}

/// What all threads share.
struct Shared {
    scenario: Scenario,
    varied: Vec<Varied>,
    wanted: Wanted,
}

impl Simulator {
    /// Starts so many threads, which open the units.
    pub(crate) fn new(
        scenario: Scenario,
        varied: Vec<Varied>,
        wanted: Wanted,
        threads: usize,
    ) -> std::io::Result<Self> {
        let shared = Arc::new(Shared { scenario, varied, wanted });
        let (jobs, queue) = channel::<Job>();
        let queue = Arc::new(Mutex::new(queue));
        let (answer, answers) = channel();
        let start = |k: usize| {
            let (shared, queue, answer) = (Arc::clone(&shared), Arc::clone(&queue), answer.clone());
            std::thread::Builder::new()
                .name(format!("fit {k}"))
                .spawn(move || work(&shared, &queue, &answer))
        };
        let threads = (0..threads.max(1)).map(start).collect::<Result<_, _>>()?;
        Ok(Self { jobs: Some(jobs), answers, threads })
    }
}

impl Model for Simulator {
    fn evaluate(&mut self, sets: &[Vec<f64>]) -> Vec<Result<Vec<f64>, String>> {
        let ended = || Err("a thread of the fit ended".to_owned());
        let mut found: Vec<Result<Vec<f64>, String>> = sets.iter().map(|_| ended()).collect();
        let Some(jobs) = &self.jobs else { return found };
        for (number, values) in sets.iter().enumerate() {
            if jobs.send(Job { number, values: values.clone() }).is_err() {
                return found;
            }
        }
        for _ in sets {
            // an error if all threads have ended
            let Ok((number, answer)) = self.answers.recv() else { break };
            found[number] = answer;
        }
        found
    }
}

impl Drop for Simulator {
    fn drop(&mut self) {
        // the end of the queue ends the threads
        self.jobs = None;
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

fn work(shared: &Shared, queue: &Mutex<Receiver<Job>>, answer: &Sender<Answer>) {
    let mut pool = Pool::default();
    loop {
        let job = queue.lock().map(|queue| queue.recv());
        let Ok(Ok(Job { number, values })) = job else { return };
        let found = shared.values(&mut pool, &values);
        if answer.send((number, found)).is_err() {
            return;
        }
    }
}

impl Shared {
    fn values(&self, pool: &mut Pool, set: &[f64]) -> Result<Vec<f64>, String> {
        let table = table(pool, &with_values(&self.scenario, &self.varied, set))?;
        let own = self.varied.iter().zip(set).find(|(it, _)| it.is_offset());
        let offset = own.map_or(self.wanted.offset, |(_, value)| *value);
        let mut values = Vec::new();
        for (signal, times) in &self.wanted.columns {
            let k = table.names.iter().position(|it| it == signal);
            let (run_times, run) = k.map(|k| table.points(k)).unwrap_or_default();
            let run = Interpolated::new(run_times, run).map_err(|error| error.to_string())?;
            let end = times.last().map_or(0.0, |it| it + offset);
            if !run.covers(end) {
                return Err(format!("the run ended at {} s, before the record", run.stop));
            }
            values.extend(times.iter().map(|time| run.at(time + offset)));
        }
        Ok(values)
    }
}

/// A scenario with values of the varied parameters.
pub(crate) fn with_values(scenario: &Scenario, varied: &[Varied], set: &[f64]) -> Scenario {
    let mut scenario = scenario.clone();
    for (it, value) in varied.iter().zip(set).filter(|(it, _)| !it.is_offset()) {
        let change = Override { target: it.target.clone(), value: value.to_string() };
        scenario.overrides.push(change);
    }
    scenario
}

/// The recorded signals of a run.
pub(crate) fn table(pool: &mut Pool, scenario: &Scenario) -> Result<Table, String> {
    let setup = pool.setup(scenario).map_err(|error| results::causes(&error).join(": "))?;
    let run = in_memory::run(&setup, pool, &mut |_| ControlFlow::Continue(()));
    match (&run.error, run.status) {
        (Some(error), _) => Err(results::causes(error).join(": ")),
        (None, Status::Finished) => Ok(run.table),
        (None, _) => {
            Err(run.ended_by.unwrap_or_else(|| format!("the run ended at {} s", run.reached)))
        }
    }
}
