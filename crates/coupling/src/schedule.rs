//! Which algorithm steps which units, and in what order.
//!
//! Groups relate to each other like the units of a Gauss-Seidel step: inputs from groups that have
//! stepped are interpolated, inputs from later groups are extrapolated.

use std::collections::{HashMap, HashSet};

use super::index::UnitIndex;
use scenario::algorithm::{AlgorithmName, IterationSettings};

/// Units that one algorithm steps.
#[derive(Debug, Clone, PartialEq)]
pub struct StepGroup {
    /// Algorithm that steps the members.
    pub name: AlgorithmName,
    /// Settings of its iteration, if it iterates.
    pub iteration: IterationSettings,
    /// The units, in the order of their steps.
    pub members: Vec<UnitIndex>,
}

impl StepGroup {
    /// Whether the members' steps are repeated until they converge.
    #[must_use]
    pub fn iterates(&self) -> bool {
        matches!(self.name, AlgorithmName::Iterated | AlgorithmName::Newton)
    }
}

/// Which algorithm steps which units, and in what order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Schedule {
    /// In the order of their steps.
    pub groups: Vec<StepGroup>,
    /// of each unit: its group, and its position in the group
    places: Vec<Option<(usize, usize)>>,
}

impl Schedule {
    /// One algorithm for all units.
    #[must_use]
    pub fn whole(name: AlgorithmName, iteration: IterationSettings, order: Vec<UnitIndex>) -> Self {
        Self::of(vec![StepGroup { name, iteration, members: order }])
    }

    /// Several groups; the `general` algorithm steps all other units. If that is Gauss-Seidel, each of
    /// them has its own place in the order, else they step together at the place of the first.
    /// A group is at the place of its first member.
    #[must_use]
    pub fn grouped(general: &StepGroup, groups: &[StepGroup], order: &[UnitIndex]) -> Self {
        let mut ranks: HashMap<UnitIndex, usize> = HashMap::with_capacity(order.len());
        for (k, &unit) in order.iter().enumerate() {
            ranks.entry(unit).or_insert(k);
        }
        let rank = |unit: UnitIndex| ranks.get(&unit).copied();
        let grouped: HashSet<UnitIndex> =
            groups.iter().flat_map(|group| group.members.iter().copied()).collect();
        let rest: Vec<UnitIndex> =
            order.iter().copied().filter(|unit| !grouped.contains(unit)).collect();
        let group = |of: &StepGroup, mut members: Vec<UnitIndex>| {
            members.sort_by_key(|&unit| rank(unit));
            StepGroup { members, ..of.clone() }
        };
        let mut all: Vec<StepGroup> =
            groups.iter().map(|it| group(it, it.members.clone())).collect();
        if general.name == AlgorithmName::GaussSeidel {
            all.extend(rest.into_iter().map(|unit| group(general, vec![unit])));
        } else {
            all.push(group(general, rest));
        }
        all.retain(|group| !group.members.is_empty());
        all.sort_by_key(|group| group.members.first().and_then(|&unit| rank(unit)));
        // neighbours that step one after the other are one group
        let mut joined: Vec<StepGroup> = Vec::new();
        for group in all {
            match joined.last_mut() {
                Some(last)
                    if last.name == AlgorithmName::GaussSeidel
                        && group.name == AlgorithmName::GaussSeidel =>
                {
                    last.members.extend(group.members);
                }
                _ => joined.push(group),
            }
        }
        Self::of(joined)
    }

    fn of(groups: Vec<StepGroup>) -> Self {
        let mut places = Vec::new();
        for (k, group) in groups.iter().enumerate() {
            for (j, &unit) in group.members.iter().enumerate() {
                if places.len() <= unit.0 {
                    places.resize(unit.0 + 1, None);
                }
                places[unit].get_or_insert((k, j));
            }
        }
        Self { groups, places }
    }

    /// The group that a unit belongs to, by its position.
    #[must_use]
    pub fn group_of(&self, unit: UnitIndex) -> Option<usize> {
        self.place(unit).map(|(group, _)| group)
    }

    /// StepGroup and position in it.
    fn place(&self, unit: UnitIndex) -> Option<(usize, usize)> {
        self.places.get(unit.0).copied().flatten()
    }

    /// Whether an input is interpolated when the step is finished.
    #[must_use]
    pub fn interpolates(&self, source: UnitIndex, target: UnitIndex) -> bool {
        let (Some(a), Some(b)) = (self.place(source), self.place(target)) else { return false };
        a.0 < b.0
            || a.0 == b.0
                && match self.groups[a.0].name {
                    AlgorithmName::Jacobi => false,
                    AlgorithmName::GaussSeidel => a.1 < b.1,
                    AlgorithmName::Iterated | AlgorithmName::Newton => true,
                }
    }

    /// Whether an input is extrapolated when its unit steps for the first time.
    #[must_use]
    pub fn extrapolates(&self, source: UnitIndex, target: UnitIndex) -> bool {
        let (Some(a), Some(b)) = (self.place(source), self.place(target)) else { return true };
        a.0 > b.0 || a.0 == b.0 && (self.groups[a.0].name == AlgorithmName::Jacobi || a.1 >= b.1)
    }

    /// All units, in the order of their steps.
    pub fn order(&self) -> impl Iterator<Item = UnitIndex> + '_ {
        self.groups.iter().flat_map(|group| group.members.iter().copied())
    }
}
