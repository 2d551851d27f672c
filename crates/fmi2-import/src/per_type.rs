//! Something for each of the four C types that FMI 2.0 gets and sets: Real, Integer, Boolean, String.

use std::ops::{Index, IndexMut};

use serde::{Deserialize, Serialize};

/// The types of the C interface. An Enumeration is an Integer here.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum CType {
    /// `fmi2Real`
    Real,
    /// `fmi2Integer`
    Integer,
    /// `fmi2Boolean`
    Boolean,
    /// `fmi2String`
    String,
}

/// One value for each C type. `()` stands for a type that does not occur.
///
/// ```
/// use fmi2_import::per_type::{CType, PerType};
///
/// let references: PerType<Vec<u32>> = PerType { reals: vec![3, 4], strings: vec![7], ..PerType::default() };
/// assert_eq!(references[CType::Real], [3, 4]);
/// assert_eq!(references.lengths().map(|n| 8 * n), PerType { reals: 16, strings: 8, ..PerType::default() });
///
/// let values: PerType<Vec<f64>, Vec<i32>, Vec<i32>, Vec<String>> = PerType::filled(&references.lengths());
/// assert_eq!((values.reals.len(), values.strings.len()), (2, 1));
/// ```
#[derive(Debug, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PerType<R, I = R, B = R, S = R> {
    /// For Reals.
    pub reals: R,
    /// For Integers and Enumerations.
    pub integers: I,
    /// For Booleans.
    pub booleans: B,
    /// For Strings.
    pub strings: S,
}

/// One value for each C type but String. Strings are not part of a step's exchange.
pub type PerNumeric<R, I = R, B = R> = PerType<R, I, B, ()>;

impl<R: Clone, I: Clone, B: Clone, S: Clone> Clone for PerType<R, I, B, S> {
    fn clone(&self) -> Self {
        Self {
            reals: self.reals.clone(),
            integers: self.integers.clone(),
            booleans: self.booleans.clone(),
            strings: self.strings.clone(),
        }
    }

    // The derived method would allocate again; steps must not.
    fn clone_from(&mut self, source: &Self) {
        self.reals.clone_from(&source.reals);
        self.integers.clone_from(&source.integers);
        self.booleans.clone_from(&source.booleans);
        self.strings.clone_from(&source.strings);
    }
}

impl<T> PerType<T> {
    /// Makes the value of each type with the same function.
    pub fn of(mut make: impl FnMut(CType) -> T) -> Self {
        Self {
            reals: make(CType::Real),
            integers: make(CType::Integer),
            booleans: make(CType::Boolean),
            strings: make(CType::String),
        }
    }

    /// Maps the values of all types with the same function.
    pub fn map<U>(self, mut map: impl FnMut(T) -> U) -> PerType<U> {
        PerType {
            reals: map(self.reals),
            integers: map(self.integers),
            booleans: map(self.booleans),
            strings: map(self.strings),
        }
    }

    /// The values in the order Real, Integer, Boolean, String.
    pub fn iter(&self) -> impl Iterator<Item = (CType, &T)> {
        [
            (CType::Real, &self.reals),
            (CType::Integer, &self.integers),
            (CType::Boolean, &self.booleans),
            (CType::String, &self.strings),
        ]
        .into_iter()
    }
}

impl<R, I, B, S> PerType<R, I, B, S> {
    /// References to the values.
    pub fn as_ref(&self) -> PerType<&R, &I, &B, &S> {
        PerType {
            reals: &self.reals,
            integers: &self.integers,
            booleans: &self.booleans,
            strings: &self.strings,
        }
    }

    /// Mutable references to the values.
    pub fn as_mut(&mut self) -> PerType<&mut R, &mut I, &mut B, &mut S> {
        PerType {
            reals: &mut self.reals,
            integers: &mut self.integers,
            booleans: &mut self.booleans,
            strings: &mut self.strings,
        }
    }
}

impl<R, I, B, S> PerType<Vec<R>, Vec<I>, Vec<B>, Vec<S>> {
    /// Lists of these lengths, filled with default values.
    #[must_use]
    pub fn filled(lengths: &PerType<usize>) -> Self
    where
        R: Default + Clone,
        I: Default + Clone,
        B: Default + Clone,
        S: Default + Clone,
    {
        Self {
            reals: vec![R::default(); lengths.reals],
            integers: vec![I::default(); lengths.integers],
            booleans: vec![B::default(); lengths.booleans],
            strings: vec![S::default(); lengths.strings],
        }
    }

    /// Length of each list.
    #[must_use]
    pub fn lengths(&self) -> PerType<usize> {
        PerType {
            reals: self.reals.len(),
            integers: self.integers.len(),
            booleans: self.booleans.len(),
            strings: self.strings.len(),
        }
    }

    /// Whether all lists are empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lengths() == PerType::default()
    }
}

impl<T> Index<CType> for PerType<T> {
    type Output = T;

    fn index(&self, index: CType) -> &T {
        match index {
            CType::Real => &self.reals,
            CType::Integer => &self.integers,
            CType::Boolean => &self.booleans,
            CType::String => &self.strings,
        }
    }
}

impl<T> IndexMut<CType> for PerType<T> {
    fn index_mut(&mut self, index: CType) -> &mut T {
        match index {
            CType::Real => &mut self.reals,
            CType::Integer => &mut self.integers,
            CType::Boolean => &mut self.booleans,
            CType::String => &mut self.strings,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_clone_from_keeps_the_memory() {
        let source = PerType::of(|_| vec![1, 2]);
        let mut target = PerType::of(|_| Vec::with_capacity(9));
        let before = target.as_ref().map(|it| it.as_ptr());
        target.clone_from(&source);
        assert_eq!(target, source);
        assert_eq!(target.as_ref().map(|it| it.as_ptr()), before);
    }

    #[test]
    fn invariant_indexing_and_iteration_agree_with_the_fields() {
        let mut names = PerType::of(|it| format!("{it:?}"));
        assert_eq!(names.strings, "String");
        for (it, name) in names.iter() {
            assert_eq!((&names[it], name), (name, &format!("{it:?}")));
        }
        names[CType::Boolean].push('s');
        assert_eq!(names.booleans, "Booleans");
    }
}
