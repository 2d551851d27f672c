//! Signals by names with ranges and stars.

use linear::{LinearSystem, LinearUnit, Quantity};

use crate::error::ResponseError;

/// Which signals are meant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Inputs of a linearisation: inputs of a unit, and outputs to which something can be added inside it.
    Input,
    /// Outputs.
    Output,
    /// Both, outputs before inputs.
    Either,
}

impl Kind {
    fn as_str(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Output => "output",
            Self::Either => "input or output",
        }
    }

    fn lists(self, unit: &LinearUnit) -> impl Iterator<Item = &Quantity> {
        let outputs = if self == Self::Input { &[] } else { unit.outputs.as_slice() };
        let inputs = if self == Self::Output { &[] } else { unit.inputs.as_slice() };
        let added = inputs.iter().filter(move |it| !outputs.contains(it));
        outputs.iter().chain(added)
    }
}

/// Names of all signals that a pattern matches, `instance.variable`, in the order of the units.
///
/// # Errors
/// A name does not exist, a pattern matches nothing or cannot be expanded.
pub fn select(
    system: &LinearSystem,
    kind: Kind,
    pattern: &str,
) -> Result<Vec<String>, ResponseError> {
    let wrong = |message: String| ResponseError::Pattern { pattern: pattern.to_owned(), message };
    let all: Vec<String> = system
        .units
        .iter()
        .flat_map(|unit| kind.lists(unit).map(move |it| format!("{}.{}", unit.name, it.name)))
        .collect();
    let mut found = Vec::new();
    for name in patterns::expand(pattern).map_err(|error| wrong(error.to_string()))? {
        let matching = all.iter().filter(|it| patterns::matches(&name, it));
        let before = found.len();
        found.extend(matching.cloned());
        if found.len() == before {
            let suggestion = patterns::suggest(&name, all.iter().map(String::as_str));
            let suggestion = suggestion.map(|it| format!("; did you mean {it}?"));
            return Err(wrong(format!(
                "no unit has the {} {name} in its linearisation{}",
                kind.as_str(),
                suggestion.unwrap_or_default()
            )));
        }
    }
    Ok(found)
}
