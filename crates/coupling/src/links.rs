//! What one unit exchanges in a step, and where its inputs come from.

use std::ffi::CString;
use std::sync::Arc;

use super::index::{InputIndex, OutputIndex, UnitIndex};
use super::taylor::Taylor;
use fmi2_import::per_type::PerType;

/// The inputs or the outputs of one unit in one step, in the order of its [`Links`]. Real inputs are
/// polynomials over the step, Real outputs have the derivatives that the unit provides. A Boolean is
/// 0 or 1.
pub type UnitValues = PerType<Vec<Taylor>, Vec<i32>, Vec<i32>, Vec<CString>>;

/// Copies all values that are not Real.
pub(super) fn copy_held(to: &mut UnitValues, from: &UnitValues) {
    to.integers.clone_from(&from.integers);
    to.booleans.clone_from(&from.booleans);
    to.strings.clone_from(&from.strings);
}

/// A connection from a Real output to a Real input. An input with several takes their sum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RealLink {
    /// Real input of the unit.
    pub input: InputIndex,
    /// Unit that the output belongs to.
    pub unit: UnitIndex,
    /// Real output of that unit.
    pub output: OutputIndex,
    /// Input = factor · output + offset.
    pub factor: f64,
    /// Input = factor · output + offset.
    pub offset: f64,
    /// Highest derivative that the input takes; 0: values only.
    pub limit: usize,
    /// Degree of the extrapolation, if it differs from the general one.
    pub degree: Option<usize>,
    /// Whether output or input changes at communication points only (`variability="discrete"`).
    pub held: bool,
    /// Whether the output's slope jumps at communication points.
    pub kinks: bool,
}

/// Type of a whole number in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Whole {
    /// Integer or Enumeration.
    Integer,
    /// Boolean: false is 0, true is 1.
    Boolean,
}

/// An Integer, Enumeration or Boolean output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WholeOutput {
    /// Unit that the output belongs to.
    pub unit: UnitIndex,
    /// Position among its outputs of this type.
    pub output: OutputIndex,
    /// Its type.
    pub kind: Whole,
}

impl WholeOutput {
    /// Its value among the outputs of all units; true is 1.
    pub(super) fn value(self, outputs: &[UnitValues]) -> i32 {
        let unit = &outputs[self.unit];
        match self.kind {
            Whole::Integer => unit.integers[self.output],
            Whole::Boolean => i32::from(unit.booleans[self.output] != 0),
        }
    }
}

/// A connection from an Integer or Boolean output to a Real input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WholeLink {
    /// Real input of the unit.
    pub input: InputIndex,
    /// Source of the value.
    pub from: WholeOutput,
    /// Input = factor · output + offset.
    pub factor: f64,
    /// Input = factor · output + offset.
    pub offset: f64,
}

/// The source of an Integer or Enumeration input.
#[derive(Debug, Clone, PartialEq)]
pub struct IntegerLink {
    /// Source of the value.
    pub from: WholeOutput,
    /// Pairs of values, from source to target, sorted. Without it, values are not changed.
    pub items: Option<Arc<[(i32, i32)]>>,
}

impl IntegerLink {
    /// The value for the input. A value without a pair is not changed. Where it is not allowed, the unit that returns it
    /// is checked when it is read.
    pub(super) fn convert(&self, value: i32) -> i32 {
        let Some(items) = &self.items else { return value };
        items.binary_search_by_key(&value, |item| item.0).map_or(value, |k| items[k].1)
    }
}

/// The source of a Boolean input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BooleanLink {
    /// Source of the value.
    pub from: HeldLink,
    /// What false and true become. Without it, values are not changed.
    pub map: Option<[i32; 2]>,
}

impl BooleanLink {
    /// The value for the input.
    pub(super) fn value(&self, outputs: &[UnitValues]) -> i32 {
        let value = outputs[self.from.unit].booleans[self.from.output];
        self.map.map_or(value, |map| map[usize::from(value != 0)])
    }
}

/// The source of a Boolean or String input.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeldLink {
    /// Unit that the output belongs to.
    pub unit: UnitIndex,
    /// Position among its outputs of this type.
    pub output: OutputIndex,
}

/// One input of a unit, by type and position in its [`Links`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Input {
    /// Real
    Real(InputIndex),
    /// Integer or Enumeration
    Integer(InputIndex),
    /// Boolean
    Boolean(InputIndex),
    /// String
    String(InputIndex),
}

/// What a tolerance for a Real output is relative to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// The larger of this and the value, unless `fixed` is set.
    pub nominal: f64,
    /// This, whatever the value is.
    pub fixed: Option<f64>,
}

impl Default for Size {
    fn default() -> Self {
        Self { nominal: 1.0, fixed: None }
    }
}

/// Where one unit's inputs come from, and which outputs it has.
#[derive(Debug, Clone, Default)]
pub struct Links {
    /// Real sources of Real inputs.
    pub reals: Vec<RealLink>,
    /// Integer and Boolean sources of Real inputs.
    pub wholes: Vec<WholeLink>,
    /// One source per Integer input.
    pub integers: Vec<IntegerLink>,
    /// One source per Boolean input.
    pub booleans: Vec<BooleanLink>,
    /// One source per String input.
    pub strings: Vec<HeldLink>,
    /// Real inputs that follow functions of time instead of outputs.
    pub given: Vec<InputIndex>,
    /// Highest derivative that the unit provides, per Real output.
    pub offered: Vec<usize>,
    /// Whether Real outputs that have second derivatives are interpolated with them: order 6.
    pub bends: bool,
    /// Sizes of the Real outputs. Missing ones have the default.
    pub sizes: Vec<Size>,
    /// The inputs that each Real output depends on directly. Missing ones depend on all.
    pub direct: Vec<Vec<Input>>,
    /// Number of Integer outputs.
    pub integer_outputs: usize,
    /// Number of Boolean outputs.
    pub boolean_outputs: usize,
    /// Number of String outputs.
    pub string_outputs: usize,
}

impl Links {
    /// Inputs that are all zero.
    pub(super) fn new_inputs(&self) -> UnitValues {
        let (integers, booleans) = (self.integers.len(), self.booleans.len());
        let (reals, strings) = (self.real_inputs(), self.strings.len());
        UnitValues::filled(&PerType { reals, integers, booleans, strings })
    }

    /// Outputs that are all zero.
    pub(super) fn new_outputs(&self) -> UnitValues {
        let Self { integer_outputs: integers, boolean_outputs: booleans, .. } = *self;
        let (reals, strings) = (self.offered.len(), self.string_outputs);
        UnitValues::filled(&PerType { reals, integers, booleans, strings })
    }

    /// Number of Real inputs.
    #[must_use]
    pub fn real_inputs(&self) -> usize {
        let reals = self.reals.iter().map(|link| link.input);
        let all = reals
            .chain(self.wholes.iter().map(|link| link.input))
            .chain(self.given.iter().copied());
        all.max().map_or(0, |last| last.0 + 1)
    }

    /// The units that feed inputs.
    pub(super) fn units(&self) -> impl Iterator<Item = UnitIndex> + '_ {
        let wholes = self.wholes.iter().map(|link| link.from.unit);
        let integers = self.integers.iter().map(|link| link.from.unit);
        let booleans = self.booleans.iter().map(|link| &link.from);
        let held = booleans.chain(&self.strings).map(|link| link.unit);
        self.reals.iter().map(|link| link.unit).chain(wholes).chain(integers).chain(held)
    }

    /// Whether some input is held over a step.
    pub(super) fn holds(&self) -> bool {
        self.reals.iter().any(|link| link.held)
            || !(self.wholes.is_empty()
                && self.integers.is_empty()
                && self.booleans.is_empty()
                && self.strings.is_empty())
    }

    /// Whether a Real output depends directly on an input.
    pub(super) fn is_direct(&self, output: OutputIndex, input: Input) -> bool {
        self.direct.get(output.0).is_none_or(|direct| direct.contains(&input))
    }

    pub(super) fn has_held_outputs(&self) -> bool {
        self.integer_outputs + self.boolean_outputs + self.string_outputs > 0
    }
}
