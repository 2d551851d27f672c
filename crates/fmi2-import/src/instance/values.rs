//! Reading and setting variables.

use std::ffi::{CStr, CString};
use std::sync::Arc;

use super::{Backend, Instance};
use crate::component::{Boolean, Integer, Numeric, Real};
use crate::description::Value;
use crate::fault::{FmuError, fail};
use crate::per_type::CType;
use crate::request::{Data, Request, Values};

impl Instance {
    /// Reads Reals.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), FmuError> {
        self.get::<Real>(references, values)
    }

    /// Reads Integers and Enumerations.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), FmuError> {
        self.get::<Integer>(references, values)
    }

    /// Reads Booleans: 0 or 1.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), FmuError> {
        self.get::<Boolean>(references, values)
    }

    /// Reads one String; null reads as empty.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_string(&mut self, reference: u32) -> Result<CString, FmuError> {
        self.alive()?;
        let (answer, text) = match &mut self.backend {
            Backend::Here { component, .. } => component.get_string(reference),
            Backend::Elsewhere(worker) => {
                let reply = worker.perform(&Request::Get(CType::String, vec![reference]));
                let text = match reply.data {
                    Data::Values(Values::String(mut texts)) => texts.pop(),
                    _ => None,
                };
                (reply.answer, text.unwrap_or_default())
            }
        };
        self.check(answer, &[reference])?;
        Ok(text)
    }

    /// Sets Reals.
    ///
    /// # Errors
    /// The call fails.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), FmuError> {
        self.set_numbers::<Real>(references, values)
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// The call fails.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), FmuError> {
        self.set_numbers::<Integer>(references, values)
    }

    /// Sets Booleans: 0 or 1.
    ///
    /// # Errors
    /// The call fails.
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Result<(), FmuError> {
        self.set_numbers::<Boolean>(references, values)
    }

    /// Sets one String.
    ///
    /// # Errors
    /// The call fails.
    pub fn set_string(&mut self, reference: u32, value: &CStr) -> Result<(), FmuError> {
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.set_string(reference, value),
            Backend::Elsewhere(worker) => {
                let values = Values::String(vec![value.to_owned()]);
                worker.perform(&Request::Set(vec![reference], values)).answer
            }
        };
        self.check(answer, &[reference])
    }

    /// Sets one variable of any type.
    ///
    /// # Errors
    /// The call fails, or the text contains a zero byte.
    pub fn set(&mut self, variable: usize, value: &Value) -> Result<(), FmuError> {
        let package = Arc::clone(&self.package);
        let variable = &package.description().variables[variable];
        let reference = variable.value_reference;
        match value {
            Value::Real(value) => self.set_real(&[reference], &[*value]),
            Value::Integer(value) => self.set_integer(&[reference], &[*value]),
            Value::Boolean(value) => self.set_boolean(&[reference], &[i32::from(*value)]),
            Value::String(value) => match CString::new(value.as_str()) {
                Ok(text) => self.set_string(reference, &text),
                Err(_) => fail(self.zero_byte(&variable.name)),
            },
        }
    }

    fn get<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &mut [K::Value],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.get::<K>(references, values),
            Backend::Elsewhere(worker) => {
                let reply = worker.perform(&Request::Get(K::TYPE, references.to_vec()));
                if let Data::Values(read) = &reply.data
                    && let Some(read) = K::unwrap(read)
                {
                    values.iter_mut().zip(read).for_each(|(value, read)| *value = *read);
                }
                reply.answer
            }
        };
        self.check(answer, references)
    }

    fn set_numbers<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &[K::Value],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.set::<K>(references, values),
            Backend::Elsewhere(worker) => {
                let values = K::wrap(values.to_vec());
                worker.perform(&Request::Set(references.to_vec(), values)).answer
            }
        };
        self.check(answer, references)
    }
}
