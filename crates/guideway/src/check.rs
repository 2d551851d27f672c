//! Checks of numbers and names that a description gives.

use crate::Error;

/// The value if it is positive and finite.
pub(crate) fn positive(value: f64, path: &str, name: &str, unit: &str) -> Result<f64, Error> {
    if value > 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(
        format!("{path}.{name}"),
        format!("{value} {unit}"),
        "give a positive finite value",
    ))
}

/// The value if it is finite and at least 0.
pub(crate) fn at_least_zero(value: f64, path: &str, name: &str, unit: &str) -> Result<f64, Error> {
    if value >= 0.0 && value.is_finite() {
        return Ok(value);
    }
    Err(Error::invalid(
        format!("{path}.{name}"),
        format!("{value} {unit}"),
        "give a finite value of at least 0",
    ))
}

/// Refuses a place that is not on a girder of this length (m).
pub(crate) fn bounded(x: f64, length: f64, path: &str, name: &str) -> Result<(), Error> {
    if (0.0..=length).contains(&x) {
        return Ok(());
    }
    Err(Error::invalid(
        format!("{path}.{name}"),
        format!("{x} m is not on the girder"),
        format!("give a place from 0 to the girder's length, {length} m"),
    ))
}

/// Refuses a name that a list has twice, and an empty one.
pub(crate) fn unique_names<'a>(
    names: impl Iterator<Item = Option<&'a str>>,
    path: &str,
) -> Result<(), Error> {
    let mut seen: Vec<&str> = Vec::new();
    for (k, name) in names.enumerate() {
        let Some(name) = name else { continue };
        if name.is_empty() || seen.contains(&name) {
            return Err(Error::invalid(
                format!("{path}[{k}].name"),
                if name.is_empty() { "empty".to_owned() } else { format!("`{name}` again") },
                "give every item of the list a name of its own, or none",
            ));
        }
        seen.push(name);
    }
    Ok(())
}
