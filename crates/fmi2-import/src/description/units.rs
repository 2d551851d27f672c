//! Units of measure: exponents of the SI base units, factor and offset.

use serde::Serialize;
use thiserror::Error;

/// Exponents of the SI base units and the radian, with factor and offset:
/// value in base units = factor · value + offset.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BaseUnit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i32; 8],
    /// Factor to the base unit.
    pub factor: f64,
    /// Offset to the base unit.
    pub offset: f64,
}

/// Names of the base units in the order of [`BaseUnit::exponents`].
pub(super) const BASE_NAMES: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];

impl BaseUnit {
    /// Name of the base unit, such as `kg.m.s-2`; `1` if it has no dimension.
    #[must_use]
    pub fn expression(&self) -> String {
        let parts: Vec<String> = BASE_NAMES
            .iter()
            .zip(self.exponents)
            .filter(|(_, exponent)| *exponent != 0)
            .map(|(name, exponent)| match exponent {
                1 => (*name).to_owned(),
                _ => format!("{name}{exponent}"),
            })
            .collect();
        if parts.is_empty() { "1".to_owned() } else { parts.join(".") }
    }
}

/// A unit of measure as the description defines it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct UnitOfMeasure {
    /// Name of the unit of measure, unique in the description.
    pub name: String,
    /// Definition by base units. Without it, it can be connected only to units of the same name.
    pub base: Option<BaseUnit>,
    /// Display units: name, factor, offset; display value = factor · value + offset.
    pub display_units: Vec<(String, f64, f64)>,
}

/// Conversion between two units: target = factor · source + offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conversion {
    /// Multiplies values and derivatives.
    pub factor: f64,
    /// Added to values only.
    pub offset: f64,
}

/// Two units cannot be converted.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum UnitMismatch {
    /// Their base dimensions differ.
    #[error("{from} is {from_base} in base units, {to} is {to_base}")]
    Dimension {
        /// Unit of the source.
        from: String,
        /// Its base units.
        from_base: String,
        /// Unit of the target.
        to: String,
        /// Its base units.
        to_base: String,
    },
    /// Names differ, and at least one has no definition.
    #[error("{from} and {to} have different names, and {missing} is not defined by base units")]
    Undefined {
        /// Unit of the source.
        from: String,
        /// Unit of the target.
        to: String,
        /// The one that lacks a definition.
        missing: String,
    },
}

impl Conversion {
    /// No conversion.
    pub const IDENTITY: Self = Self { factor: 1.0, offset: 0.0 };

    /// The conversion from one unit to another: (a₁·x + b₁ − b₂)/a₂.
    ///
    /// # Errors
    /// Dimensions differ, or a definition is missing.
    pub fn between(
        (from, from_base): (&str, Option<&BaseUnit>),
        (to, to_base): (&str, Option<&BaseUnit>),
    ) -> Result<Self, UnitMismatch> {
        let (a, b) = match (from_base, to_base) {
            (Some(a), Some(b)) => (a, b),
            _ if from == to => return Ok(Self::IDENTITY),
            (None, _) | (_, None) => {
                let missing = if from_base.is_none() { from } else { to };
                return Err(UnitMismatch::Undefined {
                    from: from.to_owned(),
                    to: to.to_owned(),
                    missing: missing.to_owned(),
                });
            }
        };
        if a.exponents != b.exponents {
            return Err(UnitMismatch::Dimension {
                from: from.to_owned(),
                from_base: a.expression(),
                to: to.to_owned(),
                to_base: b.expression(),
            });
        }
        // exactly 1 and 0 if the units are the same, without rounding
        let factor = if a.factor == b.factor { 1.0 } else { a.factor / b.factor };
        let offset = if a.offset == b.offset { 0.0 } else { (a.offset - b.offset) / b.factor };
        Ok(Self { factor, offset })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit(exponents: [i32; 8], factor: f64, offset: f64) -> BaseUnit {
        BaseUnit { exponents, factor, offset }
    }

    #[test]
    fn analytic_millimetres_to_metres() {
        let (mm, m) =
            (unit([0, 1, 0, 0, 0, 0, 0, 0], 1e-3, 0.0), unit([0, 1, 0, 0, 0, 0, 0, 0], 1.0, 0.0));
        let map = Conversion::between(("mm", Some(&mm)), ("m", Some(&m))).unwrap();
        assert_eq!(map.factor * 8.0 + map.offset, 8e-3);
        let back = Conversion::between(("m", Some(&m)), ("mm", Some(&mm))).unwrap();
        assert_eq!(back.factor * 8e-3 + back.offset, 8.0);
    }

    #[test]
    fn analytic_fahrenheit_to_celsius() {
        let k = [0, 0, 0, 0, 1, 0, 0, 0];
        let (f, c) = (unit(k, 5.0 / 9.0, 273.15 - 32.0 * 5.0 / 9.0), unit(k, 1.0, 273.15));
        let map = Conversion::between(("degF", Some(&f)), ("degC", Some(&c))).unwrap();
        // 273.15 carries an error of half an ulp of 512: 2^-45
        assert!((map.factor * 212.0 + map.offset - 100.0).abs() < 1e-12);
    }

    #[test]
    fn issue_conversion_between_units_of_different_dimension_is_refused() {
        let (m, s) =
            (unit([0, 1, 0, 0, 0, 0, 0, 0], 1.0, 0.0), unit([0, 0, 1, 0, 0, 0, 0, 0], 1.0, 0.0));
        let error = Conversion::between(("m", Some(&m)), ("s", Some(&s))).unwrap_err();
        assert!(matches!(error, UnitMismatch::Dimension { .. }));
        assert!(Conversion::between(("m", None), ("m", Some(&m))).is_ok());
        assert!(Conversion::between(("m", None), ("mm", Some(&m))).is_err());
    }
}
