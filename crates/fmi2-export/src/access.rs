//! Reading and setting the values of an instance.

use crate::Error;
use crate::instance::{ExportedInstance, unknown};
use crate::interface::VariableRole;
use crate::per_type::VariableType;
use crate::values::CText;

impl ExportedInstance {
    /// Brings values up to date before they are read, unless all are set by the importer: those are
    /// read back as they were set, also while the other values do not fit them yet.
    #[inline]
    pub(crate) fn refresh_for(
        &mut self,
        kind: VariableType,
        references: &[u32],
    ) -> Result<(), Error> {
        let rules = &self.table.rules;
        let others = self.table.other_rules(kind);
        let computed = |&it: &u32| match kind {
            VariableType::Real => rules.reals.get(it as usize).map(|it| it.settable),
            _ => others.get(it as usize).map(|it| it.settable),
        };
        if references.iter().any(|it| computed(it).is_none_or(|settable| settable == 0)) {
            self.refresh()?;
        }
        Ok(())
    }

    /// Copies real values out. `out` is C's memory, which need not be initialised.
    pub(crate) fn get_reals(
        &mut self,
        references: &[u32],
        out: &mut [std::mem::MaybeUninit<f64>],
    ) -> Result<(), Error> {
        self.refresh_for(VariableType::Real, references)?;
        for (&reference, out) in references.iter().zip(out) {
            let Some(&value) = self.values.arrays.reals.get(reference as usize) else {
                return Err(unknown(VariableType::Real, reference));
            };
            out.write(value);
        }
        Ok(())
    }

    /// Sets real values, all or none.
    pub(crate) fn set_reals(&mut self, references: &[u32], new: &[f64]) -> Result<(), Error> {
        let mode = self.progress.mode.bit();
        for (&reference, &value) in references.iter().zip(new) {
            let allowed = self.table.rules.reals.get(reference as usize).is_some_and(|rule| {
                rule.settable & mode != 0 && value >= rule.low && value <= rule.high
            });
            if !allowed {
                return Err(self.refuse_real(reference, value));
            }
        }
        let mut tunable = false;
        for (&reference, &value) in references.iter().zip(new) {
            let rule = &self.table.rules.reals[reference as usize];
            tunable |= rule.tunable;
            self.values.put_real(reference as usize, rule.slot, value);
        }
        if !references.is_empty() {
            self.touched(tunable);
        }
        Ok(())
    }

    #[cold]
    fn refuse_real(&self, reference: u32, value: f64) -> Error {
        let Some(rule) = self.table.rules.reals.get(reference as usize) else {
            return unknown(VariableType::Real, reference);
        };
        let name = self.table.name(VariableType::Real, reference as usize);
        if rule.settable & self.progress.mode.bit() == 0 {
            return self.not_settable(VariableType::Real, reference);
        }
        if !value.is_finite() {
            return Error::invalid(format!("{name} cannot be set to {value}: it is not finite"));
        }
        let (low, high) = (rule.low, rule.high);
        Error::invalid(format!("{name} cannot be set to {value}: {}", range(low, high)))
    }

    #[cold]
    fn not_settable(&self, kind: VariableType, reference: u32) -> Error {
        let name = self.table.name(kind, reference as usize);
        let why = match self.table.role(kind, reference as usize) {
            Some(VariableRole::Parameter) => "is fixed once initialization is over",
            Some(VariableRole::Constant) => "is a constant",
            Some(VariableRole::Output) => "is an output",
            _ => "is calculated by the model",
        };
        Error::invalid(format!("{name} cannot be set: it {why}"))
    }

    /// Checks that a non-real variable may be set now, and to this number.
    fn check(&self, kind: VariableType, reference: u32, value: Option<i32>) -> Result<(), Error> {
        let rules = self.table.other_rules(kind);
        let rule = rules.get(reference as usize).ok_or_else(|| unknown(kind, reference))?;
        if rule.settable & self.progress.mode.bit() == 0 {
            return Err(self.not_settable(kind, reference));
        }
        if let Some(value) = value
            && !(rule.low..=rule.high).contains(&value)
        {
            let name = self.table.name(kind, reference as usize);
            let range = range(rule.low, rule.high);
            return Err(Error::invalid(format!("{name} cannot be set to {value}: {range}")));
        }
        Ok(())
    }

    fn touched_others(&mut self, kind: VariableType, references: &[u32]) {
        let rules = self.table.other_rules(kind);
        let tunable = references.iter().any(|&reference| rules[reference as usize].tunable);
        if !references.is_empty() {
            self.touched(tunable);
        }
    }

    pub(crate) fn set_integers(&mut self, references: &[u32], new: &[i32]) -> Result<(), Error> {
        for (&reference, &value) in references.iter().zip(new) {
            self.check(VariableType::Integer, reference, Some(value))?;
        }
        for (&reference, &value) in references.iter().zip(new) {
            self.values.arrays.integers[reference as usize] = value;
        }
        self.touched_others(VariableType::Integer, references);
        Ok(())
    }

    /// Any number but 0 counts as true, as in C.
    pub(crate) fn set_booleans(&mut self, references: &[u32], new: &[i32]) -> Result<(), Error> {
        for &reference in references {
            self.check(VariableType::Boolean, reference, None)?;
        }
        for (&reference, &value) in references.iter().zip(new) {
            self.values.arrays.booleans[reference as usize] = value != 0;
        }
        self.touched_others(VariableType::Boolean, references);
        Ok(())
    }

    /// The caller passes copies, because the pointers may refer to this instance's own strings.
    pub(crate) fn set_strings(&mut self, references: &[u32], new: Vec<CText>) -> Result<(), Error> {
        for &reference in references {
            self.check(VariableType::Text, reference, None)?;
        }
        for (&reference, value) in references.iter().zip(new) {
            self.values.arrays.strings[reference as usize] = value;
        }
        self.touched_others(VariableType::Text, references);
        Ok(())
    }
}

fn range(low: impl std::fmt::Debug, high: impl std::fmt::Debug) -> String {
    format!("its range is {low:?} to {high:?}")
}
