//! What the algorithms of a run need of units beyond plain steps.

use std::collections::HashSet;

use crate::coupling::Blueprint;
use scenario::{AlgorithmName, JacobianSource, Scenario};

/// Which instances are asked for more than plain steps.
pub(super) struct Needs {
    /// Their states are saved.
    pub(super) states: HashSet<usize>,
    /// Newton's method takes their directional derivatives.
    pub(super) directional: HashSet<usize>,
}

impl Needs {
    pub(super) fn of(scenario: &Scenario, blueprint: &Blueprint) -> Self {
        let directional = blueprint
            .blocks
            .iter()
            .filter(|block| block.name == AlgorithmName::Newton)
            .filter(|block| block.iteration.jacobian == JacobianSource::Directional)
            .flat_map(|block| block.members.iter().copied());
        let all = blueprint.blocks.iter().flat_map(|block| block.members.iter().copied());
        let states = match scenario.algorithm.variable {
            Some(_) => all.collect(),
            None => blueprint.repeats().collect(),
        };
        Self { states, directional: directional.collect() }
    }
}
