//! The variables of one instance that a run exchanges, and where their values are.

use std::collections::{HashMap, HashSet};
use std::ffi::CString;
use std::sync::Arc;

use crate::system::VariableIndex;
use fmi2_import::description::{Type, Variable};
use fmi2_import::per_type::{CType, PerType};

/// Variables of each type. A Real comes with the highest derivative to exchange.
pub type VariableLists = PerType<
    Vec<(VariableIndex, usize)>,
    Vec<VariableIndex>,
    Vec<VariableIndex>,
    Vec<VariableIndex>,
>;

/// The variables that one instance exchanges.
#[derive(Debug, Clone, Default)]
pub struct ExchangedVariables {
    /// Connected inputs.
    pub inputs: VariableLists,
    /// Outputs that feed inputs.
    pub outputs: VariableLists,
    /// Other variables to read, for recording.
    pub watched: Vec<VariableIndex>,
    /// Whether derivatives of all orders are sent in one call.
    pub one_call: bool,
    /// Highest derivative that the signals of its Real inputs provide where an input does not take it.
    pub wanted_order: usize,
    /// Outputs without second derivatives in a coupling of order 6.
    pub cubic: Vec<VariableIndex>,
    /// Values that Integer outputs may have, for the Enumerations that they feed.
    pub items: Vec<ItemCheck>,
}

/// The values that an Enumeration accepts from an Integer output.
#[derive(Debug, Clone)]
pub struct ItemCheck {
    /// Position among the Integer outputs.
    pub output: usize,
    /// The output.
    pub variable: VariableIndex,
    /// Pairs of values of the items, from output to input, sorted.
    pub items: Arc<[(i32, i32)]>,
    /// `instance.variable` of the input.
    pub target: String,
}

impl ExchangedVariables {
    /// All variables to read: outputs that feed inputs first, then those that are only watched.
    pub(super) fn read(&self, variables: &[Variable]) -> PerType<Vec<VariableIndex>> {
        let with_watched = |mut list: Vec<VariableIndex>, kinds: &[Type]| {
            let mut known: HashSet<VariableIndex> = list.iter().copied().collect();
            let watched = self.watched.iter().copied();
            let of_kind = watched.filter(|&it| kinds.contains(&variables[it].kind));
            list.extend(of_kind.filter(|&it| known.insert(it)));
            list
        };
        let outputs = &self.outputs;
        let reals = outputs.reals.iter().map(|&(variable, _)| variable).collect();
        PerType {
            reals: with_watched(reals, &[Type::Real]),
            integers: with_watched(outputs.integers.clone(), &[Type::Integer, Type::Enumeration]),
            booleans: with_watched(outputs.booleans.clone(), &[Type::Boolean]),
            strings: with_watched(outputs.strings.clone(), &[Type::String]),
        }
    }
}

/// Values in one direction.
#[derive(Debug, Default)]
pub(super) struct Buffers {
    pub(super) values: PerType<Vec<f64>, Vec<i32>, Vec<i32>, Vec<CString>>,
    pub(super) derivatives: Vec<f64>,
}

impl Buffers {
    pub(super) fn new(lengths: &PerType<usize>) -> Self {
        Self { values: PerType::filled(lengths), derivatives: Vec::new() }
    }
}

/// The place of a value that a participant reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// Position among the Reals.
    Real(usize),
    /// Position among the Integers.
    Integer(usize),
    /// Position among the Booleans.
    Boolean(usize),
    /// Position among the Strings.
    String(usize),
}

/// The place of each variable that is read.
pub(super) fn slots(read: &PerType<Vec<VariableIndex>>) -> HashMap<VariableIndex, Slot> {
    let slot = |kind, place| match kind {
        CType::Real => Slot::Real(place),
        CType::Integer => Slot::Integer(place),
        CType::Boolean => Slot::Boolean(place),
        CType::String => Slot::String(place),
    };
    let places = |(kind, list): (CType, &Vec<VariableIndex>)| {
        let list = list.iter().enumerate();
        list.map(|(place, &variable)| (variable, slot(kind, place))).collect::<Vec<_>>()
    };
    read.iter().flat_map(places).collect()
}
