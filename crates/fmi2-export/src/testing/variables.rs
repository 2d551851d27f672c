//! Reading and setting variables by name.

use core::ffi::CStr;
use std::ffi::CString;

use fmi2_sys::fmi2String;

use super::instance::TestInstance;
use super::log::CallFailure;
use crate::per_type::VariableType;
use crate::{Error, ffi};

impl TestInstance {
    /// Value of a real variable.
    ///
    /// # Errors
    /// There is no such variable, or it cannot be read in this mode.
    pub fn real(&mut self, name: &str) -> Result<f64, CallFailure> {
        let mut value = [0.0];
        self.reals(&[self.reference(name)?], &mut value)?;
        Ok(value[0])
    }

    /// Values of real variables by value reference.
    ///
    /// # Errors
    /// There is no such variable, or it cannot be read in this mode.
    pub fn reals(&mut self, references: &[u32], out: &mut [f64]) -> Result<(), CallFailure> {
        let count = references.len().min(out.len());
        // SAFETY: both arrays have at least `count` elements.
        let status =
            unsafe { ffi::get_real(self.component, references.as_ptr(), count, out.as_mut_ptr()) };
        self.check("fmi2GetReal", status)
    }

    /// Sets a real variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set in this mode or to this value.
    pub fn set_real(&mut self, name: &str, value: f64) -> Result<(), CallFailure> {
        self.set_reals(&[self.reference(name)?], &[value])
    }

    /// Sets real variables by value reference.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set in this mode or to this value.
    pub fn set_reals(&mut self, references: &[u32], values: &[f64]) -> Result<(), CallFailure> {
        let count = references.len().min(values.len());
        // SAFETY: both arrays have at least `count` elements.
        let status =
            unsafe { ffi::set_real(self.component, references.as_ptr(), count, values.as_ptr()) };
        self.check("fmi2SetReal", status)
    }

    /// Value of an integer variable.
    ///
    /// # Errors
    /// There is no such variable, or it cannot be read in this mode.
    pub fn integer(&mut self, name: &str) -> Result<i32, CallFailure> {
        let (reference, mut value) = (self.lookup(name, VariableType::Integer)?, 0);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_integer(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetInteger", status).map(|()| value)
    }

    /// Sets an integer variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set in this mode or to this value.
    pub fn set_integer(&mut self, name: &str, value: i32) -> Result<(), CallFailure> {
        let reference = self.lookup(name, VariableType::Integer)?;
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_integer(self.component, &raw const reference, 1, &raw const value) };
        self.check("fmi2SetInteger", status)
    }

    /// Value of a boolean variable.
    ///
    /// # Errors
    /// There is no such variable, or it cannot be read in this mode.
    pub fn boolean(&mut self, name: &str) -> Result<bool, CallFailure> {
        let (reference, mut value) = (self.lookup(name, VariableType::Boolean)?, 0);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_boolean(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetBoolean", status).map(|()| value != 0)
    }

    /// Sets a boolean variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set in this mode or to this value.
    pub fn set_boolean(&mut self, name: &str, value: bool) -> Result<(), CallFailure> {
        let (reference, value) = (self.lookup(name, VariableType::Boolean)?, i32::from(value));
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_boolean(self.component, &raw const reference, 1, &raw const value) };
        self.check("fmi2SetBoolean", status)
    }

    /// Value of a string variable.
    ///
    /// # Errors
    /// There is no such variable, or it cannot be read in this mode.
    pub fn string(&mut self, name: &str) -> Result<String, CallFailure> {
        let reference = self.lookup(name, VariableType::Text)?;
        let mut value: fmi2String = std::ptr::null();
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_string(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetString", status)?;
        // SAFETY: a C string that lives until the next call.
        Ok(unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())
    }

    /// Sets a string variable.
    ///
    /// # Errors
    /// There is no such variable, it may not be set in this mode, or the text contains a NUL.
    pub fn set_string(&mut self, name: &str, value: &str) -> Result<(), CallFailure> {
        let call = "fmi2SetString";
        let reference = self.lookup(name, VariableType::Text)?;
        let value =
            CString::new(value).map_err(|error| CallFailure::new(call, &Error::invalid(error)))?;
        let pointer = value.as_ptr();
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_string(self.component, &raw const reference, 1, &raw const pointer) };
        self.check(call, status)
    }
}
