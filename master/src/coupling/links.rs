//! What one unit exchanges in a step, and where its inputs come from.

use std::ffi::CString;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::signal::Taylor;

/// Inputs of one unit for one step, in the order of its [`Links`].
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Inputs {
    /// Real inputs as polynomials over the step.
    pub reals: Vec<Taylor>,
    /// Integer and Enumeration inputs, held.
    pub integers: Vec<i32>,
    /// Boolean inputs, held.
    pub booleans: Vec<i32>,
    /// String inputs, held.
    pub strings: Vec<CString>,
}

impl Clone for Inputs {
    fn clone(&self) -> Self {
        Self {
            reals: self.reals.clone(),
            integers: self.integers.clone(),
            booleans: self.booleans.clone(),
            strings: self.strings.clone(),
        }
    }

    // keeps the memory, unlike the derived one: steps do not allocate
    fn clone_from(&mut self, other: &Self) {
        self.reals.clone_from(&other.reals);
        self.integers.clone_from(&other.integers);
        self.booleans.clone_from(&other.booleans);
        self.strings.clone_from(&other.strings);
    }
}

/// Outputs of one unit that feed inputs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outputs {
    /// Real outputs with the derivatives that the unit offers.
    pub reals: Vec<Taylor>,
    /// Integer and Enumeration outputs.
    pub integers: Vec<i32>,
    /// Boolean outputs.
    pub booleans: Vec<i32>,
    /// String outputs.
    pub strings: Vec<CString>,
}

impl Clone for Outputs {
    fn clone(&self) -> Self {
        Self {
            reals: self.reals.clone(),
            integers: self.integers.clone(),
            booleans: self.booleans.clone(),
            strings: self.strings.clone(),
        }
    }

    // keeps the memory, unlike the derived one: steps do not allocate
    fn clone_from(&mut self, other: &Self) {
        self.reals.clone_from(&other.reals);
        self.integers.clone_from(&other.integers);
        self.booleans.clone_from(&other.booleans);
        self.strings.clone_from(&other.strings);
    }
}

impl Outputs {
    pub(super) fn of(links: &Links) -> Self {
        Self {
            reals: vec![[0.0; 4]; links.offered.len()],
            integers: vec![0; links.integer_outputs],
            booleans: vec![0; links.boolean_outputs],
            strings: vec![CString::default(); links.string_outputs],
        }
    }

    pub(super) fn is_like(&self, other: &Self) -> bool {
        let size =
            |it: &Self| (it.reals.len(), it.integers.len(), it.booleans.len(), it.strings.len());
        size(self) == size(other)
    }

    /// Takes over what is not Real.
    pub(super) fn keep_held(&mut self, other: &Self) {
        self.integers.copy_from_slice(&other.integers);
        self.booleans.copy_from_slice(&other.booleans);
        self.strings.clone_from(&other.strings);
    }

    pub(super) fn whole(&self, (_, output, kind): WholeOutput) -> i32 {
        match kind {
            Whole::Integer => self.integers[output],
            Whole::Boolean => i32::from(self.booleans[output] != 0),
        }
    }
}

/// A Real output that a Real input takes. An input with several takes their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealLink {
    /// Which of the unit's Real inputs.
    pub input: usize,
    /// Which unit the output is of.
    pub unit: usize,
    /// Which of its Real outputs.
    pub output: usize,
    /// Input = factor · output + offset.
    pub factor: f64,
    /// Input = factor · output + offset.
    pub offset: f64,
    /// Highest derivative that the input takes; 0: values only.
    pub limit: usize,
    /// Degree of the extrapolation, if not that of all.
    pub degree: Option<usize>,
    /// Whether output or input changes at communication points only (`variability="discrete"`).
    pub held: bool,
}

/// What a whole number is in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// Integer or Enumeration
    Integer,
    /// false is 0, true is 1
    Boolean,
}

/// Unit, output and its type.
pub type WholeOutput = (usize, usize, Whole);

/// An Integer or Boolean output that a Real input takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WholeLink {
    /// Which of the unit's Real inputs.
    pub input: usize,
    /// Source of the value, an output of another FMU.
    pub from: WholeOutput,
    /// Input = factor · output + offset.
    pub factor: f64,
    /// Input = factor · output + offset.
    pub offset: f64,
}

/// The source of an Integer or Enumeration input.
#[derive(Debug, Clone, PartialEq)]
pub struct IntegerLink {
    /// Source of the value, an output of another FMU.
    pub from: WholeOutput,
    /// Values of an Enumeration's items, from source to target, sorted; without it as they are.
    pub items: Option<Arc<[(i32, i32)]>>,
}

impl IntegerLink {
    /// The value for the input. What is not among the items stays as it is: who gives it is checked
    /// where it is read.
    pub(super) fn convert(&self, value: i32) -> i32 {
        let Some(items) = &self.items else { return value };
        items.binary_search_by_key(&value, |item| item.0).map_or(value, |k| items[k].1)
    }
}

/// The source of an input that is held over the step: unit and output.
pub type HeldLink = (usize, usize);

/// One input of a unit, by type and position in its [`Links`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// Real
    Real(usize),
    /// Integer or Enumeration
    Integer(usize),
    /// Boolean
    Boolean(usize),
    /// String
    String(usize),
}

/// What change of a Real output counts as large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// A tolerance is relative to the value or to this, whichever is larger.
    pub nominal: f64,
    /// What a tolerance is relative to instead.
    pub fixed: Option<f64>,
}

impl Default for Size {
    fn default() -> Self {
        Self { nominal: 1.0, fixed: None }
    }
}

/// Where one unit's inputs come from and which outputs it has.
#[derive(Debug, Clone, Default)]
pub struct Links {
    /// Real sources of Real inputs.
    pub reals: Vec<RealLink>,
    /// Integer and Boolean sources of Real inputs.
    pub wholes: Vec<WholeLink>,
    /// One source per Integer input.
    pub integers: Vec<IntegerLink>,
    /// One source per Boolean input.
    pub booleans: Vec<HeldLink>,
    /// One source per String input.
    pub strings: Vec<HeldLink>,
    /// Highest derivative on offer, per Real output.
    pub offered: Vec<usize>,
    /// Sizes of the Real outputs; of those left out the default.
    pub sizes: Vec<Size>,
    /// The inputs that each Real output depends on directly; of those left out all.
    pub direct: Vec<Vec<Input>>,
    /// Number of Integer outputs.
    pub integer_outputs: usize,
    /// Number of Boolean outputs.
    pub boolean_outputs: usize,
    /// Number of String outputs.
    pub string_outputs: usize,
}

impl Links {
    /// Number of Real inputs.
    #[must_use]
    pub fn real_inputs(&self) -> usize {
        let reals = self.reals.iter().map(|link| link.input);
        reals.chain(self.wholes.iter().map(|link| link.input)).max().map_or(0, |last| last + 1)
    }

    /// The units that feed inputs.
    pub(super) fn units(&self) -> impl Iterator<Item = usize> + '_ {
        let held = self.booleans.iter().chain(&self.strings).map(|link| link.0);
        self.reals.iter().map(|link| link.unit).chain(self.held_wholes()).chain(held)
    }

    fn held_wholes(&self) -> impl Iterator<Item = usize> + '_ {
        let wholes = self.wholes.iter().map(|link| link.from.0);
        wholes.chain(self.integers.iter().map(|link| link.from.0))
    }

    /// Whether some input is held.
    pub(super) fn holds(&self) -> bool {
        self.reals.iter().any(|link| link.held)
            || !(self.wholes.is_empty()
                && self.integers.is_empty()
                && self.booleans.is_empty()
                && self.strings.is_empty())
    }

    /// Whether a Real output depends directly on an input.
    pub(super) fn is_direct(&self, output: usize, input: Input) -> bool {
        self.direct.get(output).is_none_or(|direct| direct.contains(&input))
    }

    pub(super) fn has_held_outputs(&self) -> bool {
        self.integer_outputs + self.boolean_outputs + self.string_outputs > 0
    }
}
