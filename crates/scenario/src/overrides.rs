//! Values that replace those of the file, as `--set instance.variable=value` gives them.

use std::fmt;
use std::str::FromStr;

use fmi2_import::description::{Type, Variable};

use crate::Setting;

/// A value from outside the file: `instance.variable=value`, patterns allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Override {
    /// `instance.variable`, or a pattern for several.
    pub target: String,
    /// The value as text.
    pub value: String,
}

impl Override {
    /// The value for a variable: text for a String, whatever it looks like.
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
