//! Steps of independent units, one after the other or on several threads.
//!
//! One thread at a time steps a unit. Its inputs are ready before any unit begins, and it writes its
//! outputs to memory of its own. The results are therefore the same bits for any number of threads.
//! FMI 2.0 allows this: the functions of one instance need not be thread-safe, but any thread may call
//! them in the right order, and instances of one library do not depend on each other.

use std::thread::{Builder, JoinHandle};

use rayon::prelude::*;

use super::exchange::Exchange;
use super::index::UnitIndex;
use super::links::UnitValues;
use super::unit::{ITERATION, Unit};

/// The threads that step the units. They have ended when this is dropped, so a library with this code can be unloaded.
pub struct Workers {
    pool: Option<rayon::ThreadPool>,
    /// all but the calling one
    others: Vec<JoinHandle<()>>,
}

/// One step of some units.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task {
    pub(super) time: f64,
    pub(super) size: f64,
    /// whether the units first return to their saved states
    pub(super) again: bool,
}

impl Default for Workers {
    fn default() -> Self {
        Self::alone()
    }
}

impl Workers {
    /// Only the calling thread.
    #[must_use]
    pub fn alone() -> Self {
        Self { pool: None, others: Vec::new() }
    }

    /// So many threads, including the calling one; only that one if no others can be started.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        if threads <= 1 {
            return Self::alone();
        }
        // rayon lets a thread belong to one pool in its life: a later simulation in it waits for others
        Self::start(threads, true).or_else(|| Self::start(threads, false)).unwrap_or_default()
    }

    fn start(threads: usize, with_this: bool) -> Option<Self> {
        let mut others = Vec::new();
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let builder = if with_this { builder.use_current_thread() } else { builder };
        let pool = builder.spawn_handler(|thread| {
            others.push(Builder::new().spawn(|| thread.run())?);
            Ok(())
        });
        let pool = pool.build().ok();
        // joins what was started, also if not all could be
        Some(Self { pool, others }).filter(|it| it.pool.is_some())
    }

    /// Number of threads.
    #[must_use]
    pub fn threads(&self) -> usize {
        self.pool.as_ref().map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Steps the units of a phase and reads their outputs, which the exchange has still to
    /// [accept](Exchange::accept).
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
        let begin = |unit: &mut U, inputs: &UnitValues| {
            if task.again {
                unit.restore(ITERATION)?;
            }
            unit.send(inputs)?;
            unit.begin_step(task.time, task.size)
        };
        let finish = |unit: &mut U, outputs: &mut UnitValues| {
            unit.step(task.time, task.size)?;
            unit.receive(end, outputs)
        };
        match &self.pool {
            Some(pool) if phase.members.len() > 1 => pool.install(|| {
                let (inputs, outputs) = (&exchange.inputs, &mut exchange.now.outputs);
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
                    finish(&mut units[k], &mut exchange.now.outputs[k])?;
                }
                Ok(())
            }
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        // asks the threads to end
        drop(self.pool.take());
        for thread in self.others.drain(..) {
            // a panic in a step has been passed on to the caller of the step
            let _ = thread.join();
        }
    }
}

/// The first failure in the order of the units.
fn first<E: Send>(results: impl ParallelIterator<Item = Result<(), E>>) -> Result<(), E> {
    results.find_first(Result::is_err).unwrap_or(Ok(()))
}

/// Units that do not feed each other.
#[derive(Debug, Clone)]
pub(super) struct Phase {
    pub(super) members: Vec<UnitIndex>,
    /// the member with the smallest index
    first: usize,
    /// per unit from there to the member with the largest, whether it is a member
    mine: Vec<bool>,
}

impl Phase {
    pub(super) fn new(members: Vec<UnitIndex>) -> Self {
        let first = members.iter().min().map_or(0, |unit| unit.0);
        let last = members.iter().max().map_or(0, |unit| unit.0);
        let mut mine = vec![false; last - first + 1];
        members.iter().for_each(|unit| mine[unit.0 - first] = true);
        Self { members, first, mine }
    }

    /// Divides an order of units into phases.
    pub(super) fn divide(exchange: &Exchange, order: &[UnitIndex]) -> Vec<Self> {
        let mut neighbours: Vec<Vec<UnitIndex>> = vec![Vec::new(); exchange.len()];
        for &k in order {
            for source in exchange.feeders(k) {
                neighbours[k].push(source);
                neighbours[source].push(k);
            }
        }
        let mut phases: Vec<Vec<UnitIndex>> = Vec::new();
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

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::sync::Arc;

    use super::*;

    thread_local! {
        static MINE: RefCell<Option<Arc<()>>> = const { RefCell::new(None) };
    }

    #[test]
    fn issue_21_threads_have_ended_when_workers_are_dropped() {
        let workers = Workers::new(4);
        assert_eq!(workers.threads(), 4);
        let shared = Arc::new(());
        // each thread holds a share until it ends
        workers.pool.as_ref().unwrap().broadcast(|_| MINE.set(Some(Arc::clone(&shared))));
        assert_eq!(Arc::strong_count(&shared), 5);
        drop(workers);
        // that of this thread
        assert_eq!(Arc::strong_count(&shared), 2);
    }

    /// A second simulation in the same thread, beside the first and after it.
    #[test]
    fn issue_21_all_simulations_of_a_thread_have_their_threads() {
        let ids = |workers: &Workers| {
            let pool = workers.pool.as_ref().unwrap();
            let all = pool.broadcast(|_| std::thread::current().id());
            all.into_iter().collect::<std::collections::HashSet<_>>().len()
        };
        let first = Workers::new(3);
        let second = Workers::new(3);
        assert_eq!([first.threads(), second.threads()], [3, 3]);
        assert_eq!([ids(&first), ids(&second)], [3, 3]);
        drop(first);
        let third = Workers::new(2);
        assert_eq!([ids(&second), ids(&third)], [3, 2]);
        let pool = third.pool.as_ref().unwrap();
        let sum: u64 = pool.install(|| (0..1000_u64).into_par_iter().sum());
        assert_eq!(sum, 499_500);
    }
}
