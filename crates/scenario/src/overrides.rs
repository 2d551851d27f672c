//! Values of `--set instance.variable=value`, which replace those of the file.

use std::fmt;
use std::str::FromStr;

use fmi2_import::description::{Type, Variable};

use crate::Setting;

/// A value that replaces one of the file, written as `instance.variable=value`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    /// `instance.variable`, patterns allowed.
    pub target: String,
    /// The value as text.
    pub value: String,
}

impl Override {
    /// The value for a variable. For a String it is a text, even if it looks like a number.
    #[must_use]
    pub fn setting(&self, variable: &Variable) -> Setting {
        match variable.kind {
            Type::String => Setting::Text(self.value.clone()),
            _ => Setting::from_text(&self.value),
        }
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.target, self.value)
    }
}

impl FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (target, value) = text
            .split_once('=')
            .ok_or_else(|| format!("\"{text}\" is not of the form instance.variable=value"))?;
        Ok(Self { target: target.trim().to_owned(), value: value.trim().to_owned() })
    }
}
