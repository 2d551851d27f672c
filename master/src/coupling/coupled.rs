//! All units over one step: the algorithms one after the other, as the settings have grouped them.
//!
//! A plan first, made of names alone, then the algorithms made by it. Groups relate to each other
//! as the units of a Gauss-Seidel step do: a group's inputs from groups that have stepped are
//! interpolated, those from later ones extrapolated.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use super::{Algorithm, Crew, Exchange, GaussSeidel, Iterated, Jacobi, Newton, Unit};
use results::summary::Iteration;
use scenario::algorithm::{AlgorithmName, IterationSettings};

/// Units that one algorithm steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Algorithm that steps the members.
    pub name: AlgorithmName,
    /// Settings, if it iterates.
    pub iteration: IterationSettings,
    /// The units, in sequence.
    pub members: Vec<usize>,
}

/// Which algorithm steps which units, and in what sequence.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Blueprint {
    /// In sequence.
    pub blocks: Vec<Block>,
    /// of each unit: its block, and its position in that
    places: Vec<Option<(usize, usize)>>,
}

impl Blueprint {
    /// One algorithm for all units.
    #[must_use]
    pub fn whole(name: AlgorithmName, iteration: IterationSettings, order: Vec<usize>) -> Self {
        Self::of(vec![Block { name, iteration, members: order }])
    }

    /// Groups and the rest. The rest is stepped by the `general` algorithm: where that steps one
    /// unit after the other, each in its place in the sequence, else together at the place of the
    /// first. A group is at the place of its first member.
    #[must_use]
    pub fn grouped(general: &Block, groups: &[Block], order: &[usize]) -> Self {
        let mut ranks: HashMap<usize, usize> = HashMap::with_capacity(order.len());
        for (k, &unit) in order.iter().enumerate() {
            ranks.entry(unit).or_insert(k);
        }
        let rank = |unit: usize| ranks.get(&unit).copied();
        let grouped: HashSet<usize> =
            groups.iter().flat_map(|group| group.members.iter().copied()).collect();
        let rest: Vec<usize> =
            order.iter().copied().filter(|unit| !grouped.contains(unit)).collect();
        let block = |of: &Block, mut members: Vec<usize>| {
            members.sort_by_key(|&unit| rank(unit));
            Block { members, ..of.clone() }
        };
        let mut blocks: Vec<Block> =
            groups.iter().map(|group| block(group, group.members.clone())).collect();
        if general.name == AlgorithmName::GaussSeidel {
            blocks.extend(rest.into_iter().map(|unit| block(general, vec![unit])));
        } else {
            blocks.push(block(general, rest));
        }
        blocks.retain(|block| !block.members.is_empty());
        blocks.sort_by_key(|block| block.members.first().and_then(|&unit| rank(unit)));
        // neighbours that step one after the other are one sequence
        let mut joined: Vec<Block> = Vec::new();
        for block in blocks {
            match joined.last_mut() {
                Some(last)
                    if last.name == AlgorithmName::GaussSeidel
                        && block.name == AlgorithmName::GaussSeidel =>
                {
                    last.members.extend(block.members);
                }
                _ => joined.push(block),
            }
        }
        Self::of(joined)
    }

    fn of(blocks: Vec<Block>) -> Self {
        let mut places = Vec::new();
        for (k, block) in blocks.iter().enumerate() {
            for (j, &unit) in block.members.iter().enumerate() {
                if places.len() <= unit {
                    places.resize(unit + 1, None);
                }
                places[unit].get_or_insert((k, j));
            }
        }
        Self { blocks, places }
    }

    /// Position of the block that a unit belongs to.
    #[must_use]
    pub fn home(&self, unit: usize) -> Option<usize> {
        self.place(unit).map(|(block, _)| block)
    }

    /// Block and position in it.
    fn place(&self, unit: usize) -> Option<(usize, usize)> {
        self.places.get(unit).copied().flatten()
    }

    /// Whether an input is interpolated when the step is done.
    #[must_use]
    pub fn interpolates(&self, source: usize, target: usize) -> bool {
        let (Some(a), Some(b)) = (self.place(source), self.place(target)) else { return false };
        a.0 < b.0
            || a.0 == b.0
                && match self.blocks[a.0].name {
                    AlgorithmName::Jacobi => false,
                    AlgorithmName::GaussSeidel => a.1 < b.1,
                    AlgorithmName::Iterated | AlgorithmName::Newton => true,
                }
    }

    /// Whether an input is extrapolated when its unit steps for the first time.
    #[must_use]
    pub fn extrapolates(&self, source: usize, target: usize) -> bool {
        let (Some(a), Some(b)) = (self.place(source), self.place(target)) else { return true };
        a.0 > b.0 || a.0 == b.0 && (self.blocks[a.0].name == AlgorithmName::Jacobi || a.1 >= b.1)
    }

    /// The units in the sequence of their steps.
    pub fn order(&self) -> impl Iterator<Item = usize> + '_ {
        self.blocks.iter().flat_map(|block| block.members.iter().copied())
    }

    /// Whether a step of some units is made again.
    pub fn repeats(&self) -> impl Iterator<Item = usize> + '_ {
        let iterates =
            |block: &&Block| matches!(block.name, AlgorithmName::Iterated | AlgorithmName::Newton);
        self.blocks.iter().filter(iterates).flat_map(|block| block.members.iter().copied())
    }
}

/// The algorithms that together step all units.
pub struct Coupling<U> {
    parts: Vec<Box<dyn Algorithm<U>>>,
}

impl<U: Unit> Coupling<U> {
    /// Makes the algorithms.
    #[must_use]
    pub fn new(blueprint: &Blueprint, exchange: &Exchange, crew: &Arc<Crew>) -> Self {
        let make = |block: &Block| -> Box<dyn Algorithm<U>> {
            let (members, crew) = (block.members.clone(), Arc::clone(crew));
            match block.name {
                AlgorithmName::Jacobi => Box::new(Jacobi::new(exchange, members, crew)),
                AlgorithmName::GaussSeidel => Box::new(GaussSeidel::new(exchange, members, crew)),
                AlgorithmName::Iterated => {
                    Box::new(Iterated::new(exchange, members, block.iteration, crew))
                }
                AlgorithmName::Newton => {
                    Box::new(Newton::new(exchange, members, block.iteration, crew))
                }
            }
        };
        Self { parts: blueprint.blocks.iter().map(make).collect() }
    }

    /// Steps all units from `time` over `size`, and the exchange with them.
    ///
    /// # Errors
    /// The first unit's that fails.
    pub fn step(
        &mut self,
        exchange: &mut Exchange,
        units: &mut [U],
        time: f64,
        size: f64,
    ) -> Result<(), U::Error> {
        exchange.extrapolate(size);
        let last = self.parts.len().saturating_sub(1);
        for (n, part) in self.parts.iter_mut().enumerate() {
            part.step(exchange, units, time, size)?;
            for &k in part.members().iter().filter(|_| n < last) {
                exchange.interpolate(k, size);
            }
        }
        Ok(())
    }

    /// How the algorithms that iterate fared, one after the other.
    pub fn iterations(&self) -> impl Iterator<Item = &Iteration> {
        self.parts.iter().filter_map(|part| part.iteration())
    }

    /// Whether all iterations of the last step settled.
    #[must_use]
    pub fn settled(&self) -> bool {
        self.iterations().all(|iteration| iteration.settled)
    }

    /// What the algorithms remember from step to step, for a checkpoint.
    #[must_use]
    pub fn state(&self) -> Vec<Vec<u8>> {
        self.parts.iter().map(|part| part.state()).collect()
    }

    /// Goes back to such a state; false if it is not one of these algorithms'.
    #[must_use]
    pub fn restore(&mut self, state: &[Vec<u8>]) -> bool {
        self.parts.len() == state.len()
            && self.parts.iter_mut().zip(state).all(|(part, state)| part.restore(state))
    }
}
