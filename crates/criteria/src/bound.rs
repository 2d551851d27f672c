//! Bounds, also written as fractions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A bound: a number, or a fraction such as `"1/3800"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Written", into = "Written")]
pub struct Bound {
    /// Its value.
    pub value: f64,
    /// Numerator and denominator of one that is written as a fraction.
    fraction: Option<(f64, f64)>,
}

/// A number, or a text with a fraction such as "1/3800".
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or a fraction such as \"1/3800\"")]
enum Written {
    Number(f64),
    Fraction(String),
}

impl From<f64> for Bound {
    fn from(value: f64) -> Self {
        Self { value, fraction: None }
    }
}

impl TryFrom<Written> for Bound {
    type Error = String;

    fn try_from(written: Written) -> Result<Self, String> {
        let text = match written {
            Written::Number(value) => return Ok(value.into()),
            Written::Fraction(text) => text,
        };
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|it| it.is_finite());
        text.split_once('/')
            .and_then(|(above, below)| Some((number(above)?, number(below)?)))
            .filter(|(_, below)| *below != 0.0)
            .map(|(above, below)| Self { value: above / below, fraction: Some((above, below)) })
            .ok_or_else(|| {
                format!("\"{text}\" is neither a number nor a fraction such as \"1/3800\"")
            })
    }
}

impl From<Bound> for Written {
    fn from(bound: Bound) -> Self {
        match bound.fraction {
            Some((above, below)) => Self::Fraction(format!("{above}/{below}")),
            None => Self::Number(bound.value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_bounds_are_numbers_or_fractions() {
        let read = |text: &str| serde_json::from_str::<Bound>(text);
        assert_eq!(read("0.004").unwrap().value, 0.004);
        let bound = read("\"1/3800\"").unwrap();
        assert_eq!(bound.value, 1.0 / 3800.0);
        assert_eq!(serde_json::to_string(&bound).unwrap(), "\"1/3800\"");
        for wrong in ["\"1/0\"", "\"L/3800\"", "\"3800\"", "\"1/inf\"", "true", "[1]"] {
            let error = read(wrong).unwrap_err().to_string();
            assert!(error.contains("a fraction such as \"1/3800\""), "{wrong}: {error}");
        }
    }
}
