//! Handles of variables, and the flat arrays that hold an instance's values.

use serde::{Deserialize, Serialize};

use crate::per_type::PerType;

/// FMI's type `Real`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Real;
/// FMI's type `Integer`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Integer;
/// FMI's type `Boolean`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Boolean;
/// FMI's type `String`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Text;

/// Means "not an input" in [`Var::slot`].
pub(crate) const NO_SLOT: u32 = u32::MAX;

/// A declared variable of type `T`: its place in the array of that type, which is also its FMI
/// value reference. A real input also has a place among the inputs' Taylor coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Var<T> {
    pub(crate) index: u32,
    pub(crate) slot: u32,
    pub(crate) of: T,
}

/// A declared row of variables of type `T`, contiguous in the array of that type.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Vars<T> {
    pub(crate) first: u32,
    pub(crate) count: u32,
    pub(crate) slot: u32,
    pub(crate) of: T,
}

/// Handle on one real variable.
pub type RealVar = Var<Real>;
/// Handle on a row of real variables.
pub type RealVars = Vars<Real>;
/// Handle on one integer variable.
pub type IntegerVar = Var<Integer>;
/// Handle on a row of integer variables.
pub type IntegerVars = Vars<Integer>;
/// Handle on one boolean variable.
pub type BooleanVar = Var<Boolean>;
/// Handle on a row of boolean variables.
pub type BooleanVars = Vars<Boolean>;
/// Handle on one string variable.
pub type StringVar = Var<Text>;
/// Handle on a row of string variables.
pub type StringVars = Vars<Text>;

impl<T> Var<T> {
    /// The FMI value reference, unique within the type.
    #[must_use]
    pub fn value_reference(&self) -> u32 {
        self.index
    }

    pub(crate) fn at(&self) -> usize {
        self.index as usize
    }
}

impl<T: Copy> Vars<T> {
    /// The `k`-th variable, counted from zero; `None` beyond the end.
    #[must_use]
    pub fn checked_get(&self, k: usize) -> Option<Var<T>> {
        let offset = u32::try_from(k).ok().filter(|&k| k < self.count)?;
        let slot = if self.slot == NO_SLOT { NO_SLOT } else { self.slot + offset };
        Some(Var { index: self.first + offset, slot, of: self.of })
    }

    /// The `k`-th variable, counted from zero (`gap_01` is number 0).
    ///
    /// # Panics
    /// When `k` is not below [`Vars::len`], as with a slice.
    #[must_use]
    pub fn get(&self, k: usize) -> Var<T> {
        assert!(k < self.len(), "variable {k} of a row of {}", self.count);
        let slot = if self.slot == NO_SLOT { NO_SLOT } else { self.slot + k as u32 };
        Var { index: self.first + k as u32, slot, of: self.of }
    }

    /// How many variables the row has.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Whether the row has no variable.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The variables in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Var<T>> + use<T> {
        let row = *self;
        (0..row.len()).map(move |k| row.get(k))
    }

    fn range(&self) -> std::ops::Range<usize> {
        let first = self.first as usize;
        first..first + self.len()
    }

    fn slots(&self) -> std::ops::Range<usize> {
        if self.count == 0 {
            return 0..0;
        }
        let first = self.slot as usize;
        first..first + self.len()
    }
}

impl<T: Copy> From<Var<T>> for Vars<T> {
    fn from(one: Var<T>) -> Self {
        Self { first: one.index, count: 1, slot: one.slot, of: one.of }
    }
}

/// UTF-8 text that C can read in place: always ends with a NUL and has no other.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CText(String);

impl Clone for CText {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }

    fn clone_from(&mut self, source: &Self) {
        self.0.clone_from(&source.0);
    }
}

impl CText {
    /// `None` if the text contains a NUL.
    pub(crate) fn new(text: &str) -> Option<Self> {
        (!text.contains('\0')).then(|| Self(format!("{text}\0")))
    }

    pub(crate) fn empty() -> Self {
        Self("\0".to_owned())
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0[..self.0.len() - 1]
    }

    pub(crate) fn as_ptr(&self) -> *const core::ffi::c_char {
        self.0.as_ptr().cast()
    }

    /// Whether the text ends with its only NUL, which deserialized bytes need not.
    pub(crate) fn is_well_formed(&self) -> bool {
        self.0.find('\0') == Some(self.0.len().wrapping_sub(1))
    }
}

/// The values of all variables of one instance: one flat array per type, indexed by value
/// reference, and the Taylor coefficients of the real inputs.
///
/// A model reads inputs and parameters here and writes outputs, calculated parameters and locals. A
/// model must not write inputs.
#[derive(Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Values {
    pub(crate) arrays: PerType<Vec<f64>, Vec<i32>, Vec<bool>, Vec<CText>>,
    /// Per real input `[u, u̇, ü, u⃛]` at the communication point; the first entry always equals
    /// the value in the array of reals.
    pub(crate) taylor: Vec<[f64; 4]>,
    /// The fourth and fifth derivatives of each real input.
    pub(crate) further: Vec<[f64; 2]>,
    /// Whether some of them are set.
    pub(crate) has_further: bool,
}

impl Clone for Values {
    fn clone(&self) -> Self {
        Self {
            arrays: self.arrays.clone(),
            taylor: self.taylor.clone(),
            further: self.further.clone(),
            has_further: self.has_further,
        }
    }

    /// Reuses the memory: saving and restoring states must not allocate.
    fn clone_from(&mut self, source: &Self) {
        self.arrays.clone_from(&source.arrays);
        self.taylor.clone_from(&source.taylor);
        self.further.clone_from(&source.further);
        self.has_further = source.has_further;
    }
}

impl Values {
    /// Value of a real variable.
    #[inline]
    #[must_use]
    pub fn real(&self, variable: RealVar) -> f64 {
        self.arrays.reals[variable.at()]
    }

    /// Values of a row of real variables.
    #[inline]
    #[must_use]
    pub fn reals(&self, row: RealVars) -> &[f64] {
        &self.arrays.reals[row.range()]
    }

    /// Values of a row of real variables, to be written.
    #[inline]
    pub fn reals_mut(&mut self, row: RealVars) -> &mut [f64] {
        debug_assert!(row.slot == NO_SLOT, "a model must not write inputs");
        &mut self.arrays.reals[row.range()]
    }

    /// Writes a real output, calculated parameter or local.
    #[inline]
    pub fn set_real(&mut self, variable: RealVar, value: f64) {
        debug_assert!(variable.slot == NO_SLOT, "a model must not write inputs");
        self.arrays.reals[variable.at()] = value;
    }

    /// `[u, u̇, ü, u⃛]` of a real input at the current communication point: the value and its time
    /// derivatives (not divided by factorials), so that during the step u(t + τ) = u + u̇·τ +
    /// ü·τ²/2 + u⃛·τ³/6. Derivatives that the importer has not set are 0.
    ///
    /// # Panics
    /// When the variable was not declared as an input.
    #[inline]
    #[must_use]
    pub fn taylor(&self, input: RealVar) -> &[f64; 4] {
        &self.taylor[input.slot as usize]
    }

    /// The fourth and fifth derivatives of a real input, of which u(t + τ) has the further terms
    /// u⁗·τ⁴/24 + u⁗′·τ⁵/120. They are 0 unless the input is declared to take
    /// [more derivatives](crate::Declaration::takes) and the importer has set them.
    ///
    /// # Panics
    /// When the variable was not declared as an input.
    #[inline]
    #[must_use]
    pub fn further(&self, input: RealVar) -> &[f64; 2] {
        &self.further[input.slot as usize]
    }

    /// [`Values::further`] of a row of real inputs; empty if no input of the unit has any.
    ///
    /// # Panics
    /// When the row was not declared as inputs.
    #[inline]
    #[must_use]
    pub fn furthers(&self, inputs: RealVars) -> &[[f64; 2]] {
        if self.has_further { &self.further[inputs.slots()] } else { &[] }
    }

    /// [`Values::taylor`] of a row of real inputs.
    ///
    /// # Panics
    /// When the row was not declared as inputs.
    #[inline]
    #[must_use]
    pub fn taylors(&self, inputs: RealVars) -> &[[f64; 4]] {
        &self.taylor[inputs.slots()]
    }

    /// Value of an integer variable.
    #[inline]
    #[must_use]
    pub fn integer(&self, variable: IntegerVar) -> i32 {
        self.arrays.integers[variable.at()]
    }

    /// Writes an integer variable.
    #[inline]
    pub fn set_integer(&mut self, variable: IntegerVar, value: i32) {
        self.arrays.integers[variable.at()] = value;
    }

    /// Value of a boolean variable.
    #[inline]
    #[must_use]
    pub fn boolean(&self, variable: BooleanVar) -> bool {
        self.arrays.booleans[variable.at()]
    }

    /// Writes a boolean variable.
    #[inline]
    pub fn set_boolean(&mut self, variable: BooleanVar, value: bool) {
        self.arrays.booleans[variable.at()] = value;
    }

    /// Value of a string variable.
    #[inline]
    #[must_use]
    pub fn string(&self, variable: StringVar) -> &str {
        self.arrays.strings[variable.at()].as_str()
    }

    /// Writes a string variable. C ends a string at its first NUL, so the text is truncated there.
    pub fn set_string(&mut self, variable: StringVar, value: &str) {
        let text = value.split('\0').next().unwrap_or_default();
        if let Some(text) = CText::new(text) {
            self.arrays.strings[variable.at()] = text;
        }
    }

    /// Sets a real variable on behalf of the importer; an input's Taylor coefficients follow.
    #[inline]
    pub(crate) fn put_real(&mut self, index: usize, slot: u32, value: f64) {
        self.arrays.reals[index] = value;
        if slot != NO_SLOT {
            self.taylor[slot as usize][0] = value;
        }
    }
}
