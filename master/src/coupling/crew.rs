//! Steps of independent units, one after the other or on several threads.
//!
//! A unit is stepped by one thread at a time, with inputs that are ready before any begins and
//! outputs into a place of its own, so the results are the same bits for any number of threads.
//! FMI 2.0 wants no more: the functions of one instance need not be thread-safe, the caller keeps their
//! sequence, and which thread calls is its choice; instances of one library do not depend on each other.

use rayon::prelude::*;

use super::{Exchange, ITERATION, Inputs, Outputs, Unit};

/// Who steps the units.
pub struct Crew {
    pool: Option<rayon::ThreadPool>,
}

/// One step of some units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) time: f64,
    pub(super) size: f64,
    /// whether the units go back to their saved states before
    pub(super) again: bool,
}

impl Default for Crew {
    fn default() -> Self {
        Self::alone()
    }
}

impl Crew {
    /// The calling thread alone.
    #[must_use]
    pub fn alone() -> Self {
        Self { pool: None }
    }

    /// So many threads, the calling one with them; one only if others cannot be had.
    #[must_use]
    pub fn of(threads: usize) -> Self {
        if threads <= 1 {
            return Self::alone();
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).use_current_thread();
        Self { pool: pool.build().ok() }
    }

    /// Number of threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.as_ref().map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Steps the units of a phase, none of which feeds another one of it during the step, and
    /// reads their outputs, which the exchange has yet to take over.
    pub(super) fn step<U: Unit>(
        &self,
        exchange: &mut Exchange,
        units: &mut [U],
        phase: &Phase,
        task: Task,
    ) -> Result<(), U::Error> {
        for &k in &phase.members {
            exchange.fill(k, task.size);
        }
        let end = task.time + task.size;
        let begin = |unit: &mut U, inputs: &Inputs| {
            if task.again {
                unit.restore(ITERATION)?;
            }
            unit.send(inputs)?;
            unit.begin_step(task.time, task.size)
        };
        let finish = |unit: &mut U, outputs: &mut Outputs| {
            unit.step(task.time, task.size)?;
            unit.receive(end, outputs)
        };
        match &self.pool {
            Some(pool) if phase.members.len() > 1 => pool.install(|| {
                let (inputs, outputs) = (&exchange.inputs, &mut exchange.outputs);
                let mine = &phase.mine;
                let range = phase.first..phase.first + mine.len();
                let (units, inputs) = (&mut units[range.clone()], &inputs[range.clone()]);
                let outputs = &mut outputs[range];
                let begun = units.par_iter_mut().zip(inputs).zip(mine);
                first(begun.filter(|(_, mine)| **mine).map(|((u, i), _)| begin(u, i)))?;
                let ended = units.par_iter_mut().zip(outputs).zip(mine);
                first(ended.filter(|(_, mine)| **mine).map(|((u, o), _)| finish(u, o)))
            }),
            _ => {
                for &k in &phase.members {
                    begin(&mut units[k], &exchange.inputs[k])?;
                }
                for &k in &phase.members {
                    finish(&mut units[k], &mut exchange.outputs[k])?;
                }
                Ok(())
            }
        }
    }
}

/// The failure of the foremost unit that fails, whichever is found first.
fn first<E: Send>(results: impl ParallelIterator<Item = Result<(), E>>) -> Result<(), E> {
    results.find_first(Result::is_err).unwrap_or(Ok(()))
}

/// Units none of which feeds another one during a step.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    pub(super) members: Vec<usize>,
    /// the foremost member
    first: usize,
    /// per unit from there to the last member, whether it is one
    mine: Vec<bool>,
}

impl Phase {
    pub(super) fn new(members: Vec<usize>) -> Self {
        let first = members.iter().copied().min().unwrap_or(0);
        let last = members.iter().copied().max().unwrap_or(0);
        let mut mine = vec![false; last - first + 1];
        members.iter().for_each(|&k| mine[k - first] = true);
        Self { members, first, mine }
    }

    /// Divides a sequence into phases of units that do not feed each other.
    pub(super) fn divide(exchange: &Exchange, order: &[usize]) -> Vec<Self> {
        let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); exchange.len()];
        for &k in order {
            for source in exchange.feeders(k) {
                neighbours[k].push(source);
                neighbours[source].push(k);
            }
        }
        let mut phases: Vec<Vec<usize>> = Vec::new();
        let mut phase_of = vec![usize::MAX; exchange.len()];
        for &k in order {
            let last = phases.len().wrapping_sub(1);
            match phases.last_mut() {
                Some(phase) if neighbours[k].iter().all(|&it| phase_of[it] != last) => {
                    phase.push(k);
                }
                _ => phases.push(vec![k]),
            }
            phase_of[k] = phases.len() - 1;
        }
        phases.into_iter().map(Self::new).collect()
    }
}
