//! The four types of FMI variables, and a struct for what exists once for each of them.

use serde::{Deserialize, Serialize};

/// FMI's four types of variables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum VariableType {
    Real,
    Integer,
    Boolean,
    Text,
}

impl VariableType {
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Real => "Real",
            Self::Integer => "Integer",
            Self::Boolean => "Boolean",
            Self::Text => "String",
        }
    }
}

/// One thing for each type of variable: arrays by value reference, as a rule.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct PerType<R, I = R, B = R, S = R> {
    pub(crate) reals: R,
    pub(crate) integers: I,
    pub(crate) booleans: B,
    pub(crate) strings: S,
}

impl<R: Clone, I: Clone, B: Clone, S: Clone> Clone for PerType<R, I, B, S> {
    fn clone(&self) -> Self {
        Self {
            reals: self.reals.clone(),
            integers: self.integers.clone(),
            booleans: self.booleans.clone(),
            strings: self.strings.clone(),
        }
    }

    /// Reuses the memory: saving and restoring states must not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.reals.clone_from(&source.reals);
        self.integers.clone_from(&source.integers);
        self.booleans.clone_from(&source.booleans);
        self.strings.clone_from(&source.strings);
    }
}

impl<T> PerType<T> {
    pub(crate) fn get(&self, kind: VariableType) -> &T {
        match kind {
            VariableType::Real => &self.reals,
            VariableType::Integer => &self.integers,
            VariableType::Boolean => &self.booleans,
            VariableType::Text => &self.strings,
        }
    }

    pub(crate) fn get_mut(&mut self, kind: VariableType) -> &mut T {
        match kind {
            VariableType::Real => &mut self.reals,
            VariableType::Integer => &mut self.integers,
            VariableType::Boolean => &mut self.booleans,
            VariableType::Text => &mut self.strings,
        }
    }
}
