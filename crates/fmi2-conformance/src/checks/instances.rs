//! Several instances in one process (FMI 2.0.5, sections 2.1.5 and 4.3.1).

use std::sync::Barrier;

use crate::harness::bench::{Bench, STEPS};
use crate::harness::drive::same;
use crate::harness::{CheckResult, Stop, fault, skip, table};

table! {
    "many-instances", "2.1.5", Error, "instances that step in turn do not disturb each other", many;
    "threads", "2.1.5", Error, "instances in separate threads have the same values as a single instance, bit for bit", threads;
}

fn supported(bench: &Bench) -> CheckResult {
    if bench.description().co_simulation.can_be_instantiated_only_once_per_process {
        return skip("canBeInstantiatedOnlyOncePerProcess is true");
    }
    Ok(())
}

fn many(bench: &Bench) -> CheckResult {
    const COUNT: usize = 12;
    supported(bench)?;
    let wanted = bench.initialized("alone")?.record(0, STEPS)?;
    let units = (0..COUNT).map(|n| bench.initialized(&format!("unit {n}")));
    let units: Vec<_> = units.collect::<Result<_, Stop>>()?;
    // each instance is one step behind the one before, so that their states differ
    for round in 0..STEPS + COUNT {
        for (lag, unit) in units.iter().enumerate() {
            let Some(step) = round.checked_sub(lag).filter(|step| *step < STEPS) else { continue };
            let record = unit.record(step, step + 1)?;
            same(bench, &record, &wanted[step..=step], &format!("instance {lag} of {COUNT}"))?;
        }
    }
    Ok(())
}

fn threads(bench: &Bench) -> CheckResult {
    const THREADS: usize = 4;
    const ROUNDS: usize = 6;
    supported(bench)?;
    let wanted = bench.initialized("alone")?.record(0, STEPS)?;
    let start = Barrier::new(THREADS);
    let work = |thread: usize| -> CheckResult {
        start.wait();
        for _ in 0..ROUNDS {
            let unit = bench.initialized(&format!("thread {thread}"))?;
            same(bench, &unit.record(0, STEPS)?, &wanted, &format!("thread {thread}"))?;
        }
        Ok(())
    };
    bench.trace().quietly(&format!("{THREADS} threads with {ROUNDS} runs each"), || {
        std::thread::scope(|scope| {
            let work = &work;
            let threads: Vec<_> =
                (0..THREADS).map(|thread| scope.spawn(move || work(thread))).collect();
            threads
                .into_iter()
                .try_for_each(|thread| thread.join().unwrap_or_else(|_| fault("a thread panicked")))
        })
    })
}
