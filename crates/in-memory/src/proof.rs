//! Whether a reset instance behaves as a new one.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use master::simulation::Pool;
use master::{Error, Setup, Simulation};

/// Most steps that are compared.
const STEPS: u64 = 200;

/// What a comparison of reset instances with new ones found for one .fmu file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reset {
    /// Path of the file.
    pub fmu: PathBuf,
    /// Whether its instances are used again.
    pub renewed: bool,
}

/// Compares reset instances with new ones, and lets the pool reuse those of units for which all bits are equal.
///
/// The instances step through `before` first and are then reset for `after`: the two should differ in all that changes
/// from run to run, so that a value that survives the reset shows. Compared are the recorded signals after each of the
/// first 200 steps and, where all units can serialize their states, the states at the end of these steps.
///
/// # Errors
/// A simulation cannot start or fails within these steps. The pool then makes all instances anew.
pub fn prove_resets(before: &Setup, after: &Setup, pool: &mut Pool) -> Result<Vec<Reset>, Error> {
    let fmus: BTreeSet<PathBuf> =
        after.system().instances.iter().map(|it| it.package.path().to_owned()).collect();
    for fmu in &fmus {
        pool.make_instances_anew_of(fmu);
    }
    let new = trace(after, pool)?;
    let equal = |fmus: &mut dyn Iterator<Item = &PathBuf>, pool: &mut Pool| {
        let chosen: Vec<&Path> = fmus.map(PathBuf::as_path).collect();
        chosen.iter().for_each(|fmu| pool.renew_instances_of(fmu));
        let traced = trace(before, pool).and_then(|_| trace(after, pool));
        let same = traced.as_ref().is_ok_and(|reset| *reset == new);
        if !same {
            chosen.iter().for_each(|fmu| pool.make_instances_anew_of(fmu));
        }
        same
    };
    // usually all of them are equal; otherwise one after the other
    if equal(&mut fmus.iter(), pool) {
        return Ok(fmus.into_iter().map(|fmu| Reset { fmu, renewed: true }).collect());
    }
    let mut found = Vec::new();
    for fmu in &fmus {
        let renewed = equal(&mut std::iter::once(fmu), pool);
        pool.make_instances_anew_of(fmu);
        found.push(Reset { fmu: fmu.clone(), renewed });
    }
    for reset in found.iter().filter(|it| it.renewed) {
        pool.renew_instances_of(&reset.fmu);
    }
    Ok(found)
}

/// The bits of a simulation's beginning.
#[derive(PartialEq)]
struct Trace {
    values: Vec<u64>,
    state: Option<Vec<u8>>,
}

fn trace(setup: &Setup, pool: &mut Pool) -> Result<Trace, Error> {
    let mut simulation = setup.start_from(pool)?;
    let mut values = bits(&simulation);
    while simulation.remaining() > 0 && simulation.done() < STEPS {
        match simulation.step() {
            Ok(()) => values.extend(bits(&simulation)),
            // a regular end
            Err(Error::Step { source, .. }) if source.asks_to_end() => break,
            Err(error) => return Err(error),
        }
    }
    let instances = &setup.system().instances;
    let serializes = instances.iter().all(|it| {
        it.description().co_simulation.can_serialize_fmu_state && it.isolate != Some(true)
    });
    let state = match serializes {
        true => serde_json::to_vec(&simulation.state()?).ok(),
        false => None,
    };
    pool.take_back(simulation)?;
    Ok(Trace { values, state })
}

fn bits(simulation: &Simulation<'_>) -> Vec<u64> {
    simulation.values().map(f64::to_bits).collect()
}
