//! From fresh instances to the start of stepping.
//!
//! After instantiation, units get the experiment and their parameters; in initialization mode, their
//! inputs, in the order of their dependencies (InitialUnknowns). Signals are grouped in levels
//! (`levels.rs`), so that many outputs of a unit are read in one call. Loops are solved by sweeps over
//! their levels, by Newton's method where sweeps converge slowly or not at all, and by Anderson
//! acceleration (`loops.rs`).

mod error;
pub mod late;
mod levels;
mod loops;
mod solver;

use std::collections::HashMap;

pub use self::error::InitializeError;
use self::levels::{Stage, stages};
use self::loops::Loop;
use self::solver::Solver;
use crate::system::{Port, SignalGraph, System};
use fmi2_import::instance::Instance;
use results::summary::SolvedLoop;
use scenario::{Experiment, Initialization};

/// Results of the initialization.
#[derive(Debug, Clone, Default)]
pub struct Initialized {
    /// The loops that were solved.
    pub loops: Vec<SolvedLoop>,
    /// Values of the connected outputs in initialization mode, without Strings; true is 1.
    pub outputs: HashMap<Port, f64>,
}

/// Initializes all instances. They are then ready to step.
///
/// # Errors
/// A unit fails, or a loop does not converge.
pub fn initialize(
    system: &System,
    instances: &mut [Instance],
    experiment: Experiment,
    settings: Initialization,
) -> Result<Initialized, InitializeError> {
    for (setup, instance) in system.instances.iter().zip(instances.iter_mut()) {
        instance.setup_experiment(setup.tolerance, experiment.start, experiment.stop)?;
        for (variable, value) in &setup.parameters {
            instance.set(variable.0, value)?;
        }
        instance.enter_initialization_mode()?;
        for (variable, value) in &setup.inputs {
            instance.set(variable.0, value)?;
        }
    }
    let initialized = solve(Solver::new(system, instances, experiment.start), settings)?;
    for instance in instances.iter_mut() {
        instance.exit_initialization_mode()?;
    }
    Ok(initialized)
}

/// Passes values from outputs to inputs, stage by stage, and solves the loops.
fn solve(mut solver: Solver<'_>, settings: Initialization) -> Result<Initialized, InitializeError> {
    let signals = SignalGraph::initial(solver.system);
    let mut loops = Vec::new();
    for stage in stages(&signals) {
        match stage {
            Stage::Once(level) => {
                solver.transport(&level, 1.0)?;
            }
            Stage::Loop { nodes, levels } => {
                let names = signals.names(solver.system, &nodes);
                let it = Loop::new(names, &signals, &nodes, &levels);
                loops.push(solver.solve_loop(&it, settings)?);
            }
        }
    }
    Ok(Initialized { loops, outputs: solver.numbers() })
}
