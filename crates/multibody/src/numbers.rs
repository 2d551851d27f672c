//! Checks of the numbers in a description.

use std::fmt::Display;

use crate::error::{Error, invalid};

pub(crate) fn finite(values: &[f64], path: &dyn Display) -> Result<(), Error> {
    if values.iter().all(|v| v.is_finite()) {
        Ok(())
    } else {
        Err(invalid(path, "every number must be finite"))
    }
}

pub(crate) fn not_negative(values: &[f64], path: &dyn Display) -> Result<(), Error> {
    finite(values, path)?;
    match values.iter().find(|v| **v < 0.0) {
        Some(v) => Err(invalid(path, format!("must not be negative, but is {v}"))),
        None => Ok(()),
    }
}
