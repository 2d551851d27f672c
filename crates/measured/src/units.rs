//! Units of measure: those that the units of a run define, and SI units with prefixes.

use std::collections::HashMap;
use std::f64::consts::PI;

use fmi2_import::description::{BaseUnit, Conversion, ModelDescription, UnitMismatch};

/// Symbols with their exponents of kg, m, s, A, K, mol, cd, rad, factor and offset, and whether prefixes are usual.
const SYMBOLS: &[(&str, [i32; 8], f64, f64, bool)] = &[
    ("m", [0, 1, 0, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("g", [1, 0, 0, 0, 0, 0, 0, 0], 1e-3, 0.0, true),
    ("s", [0, 0, 1, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("A", [0, 0, 0, 1, 0, 0, 0, 0], 1.0, 0.0, true),
    ("K", [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 0.0, true),
    ("mol", [0, 0, 0, 0, 0, 1, 0, 0], 1.0, 0.0, true),
    ("cd", [0, 0, 0, 0, 0, 0, 1, 0], 1.0, 0.0, false),
    ("rad", [0, 0, 0, 0, 0, 0, 0, 1], 1.0, 0.0, true),
    ("N", [1, 1, -2, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("Pa", [1, -1, -2, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("J", [1, 2, -2, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("W", [1, 2, -3, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("V", [1, 2, -3, -1, 0, 0, 0, 0], 1.0, 0.0, true),
    ("Ohm", [1, 2, -3, -2, 0, 0, 0, 0], 1.0, 0.0, true),
    ("T", [1, 0, -2, -1, 0, 0, 0, 0], 1.0, 0.0, true),
    ("H", [1, 2, -2, -2, 0, 0, 0, 0], 1.0, 0.0, true),
    ("Wb", [1, 2, -2, -1, 0, 0, 0, 0], 1.0, 0.0, true),
    ("Hz", [0, 0, -1, 0, 0, 0, 0, 0], 1.0, 0.0, true),
    ("deg", [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, 0.0, false),
    ("°", [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, 0.0, false),
    ("degC", [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15, false),
    ("°C", [0, 0, 0, 0, 1, 0, 0, 0], 1.0, 273.15, false),
    ("t", [1, 0, 0, 0, 0, 0, 0, 0], 1e3, 0.0, false),
    ("min", [0, 0, 1, 0, 0, 0, 0, 0], 60.0, 0.0, false),
    ("h", [0, 0, 1, 0, 0, 0, 0, 0], 3600.0, 0.0, false),
    ("bar", [1, -1, -2, 0, 0, 0, 0, 0], 1e5, 0.0, true),
    ("1", [0; 8], 1.0, 0.0, false),
    ("%", [0; 8], 1e-2, 0.0, false),
];

const PREFIXES: &[(&str, f64)] = &[
    ("n", 1e-9),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("μ", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("h", 1e2),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];

/// The units of measure that are known.
#[derive(Debug, Clone, Default)]
pub struct Units {
    defined: HashMap<String, BaseUnit>,
}

impl Units {
    /// Those that descriptions define, with their display units. The first definition of a name counts.
    pub fn defined_by<'a>(descriptions: impl IntoIterator<Item = &'a ModelDescription>) -> Self {
        let mut defined = HashMap::new();
        let mut shown = Vec::new();
        for unit in descriptions.into_iter().flat_map(|it| &it.units) {
            let Some(base) = &unit.base else { continue };
            defined.entry(unit.name.clone()).or_insert_with(|| base.clone());
            for (name, factor, offset) in &unit.display_units {
                // shown = factor * value + offset
                let factor = base.factor / factor;
                let offset = base.offset - factor * offset;
                shown.push((name.clone(), BaseUnit { factor, offset, ..base.clone() }));
            }
        }
        for (name, base) in shown {
            defined.entry(name).or_insert(base);
        }
        Self { defined }
    }

    /// A unit by its name: as defined, or made of SI units, such as `mm/s`, `kN.m`, `m/s2`, `kg.m.s-2`, `deg`.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<BaseUnit> {
        self.defined.get(name).cloned().or_else(|| composed(name))
    }

    /// The conversion of values from one unit to another.
    ///
    /// # Errors
    /// The dimensions differ, or a name is not known.
    pub fn conversion(&self, from: &str, to: &str) -> Result<Conversion, UnitMismatch> {
        let (a, b) = (self.find(from), self.find(to));
        Conversion::between((from, a.as_ref()), (to, b.as_ref()))
    }
}

/// A product of SI units with exponents; what follows a slash is below the line.
fn composed(name: &str) -> Option<BaseUnit> {
    let name = name.trim();
    let mut product = BaseUnit { exponents: [0; 8], factor: 1.0, offset: 0.0 };
    let mut count = 0;
    for (k, part) in name.split('/').enumerate() {
        for text in part.trim_matches(['(', ')']).split(['.', '*', '·', ' ']) {
            let (unit, exponent) = factor(text)?;
            let exponent = if k > 0 { -exponent } else { exponent };
            for (to, it) in product.exponents.iter_mut().zip(unit.exponents) {
                *to += exponent * it;
            }
            product.factor *= unit.factor.powi(exponent);
            count += 1;
            // a shifted scale has no products
            if unit.offset != 0.0 {
                if exponent != 1 || name != text {
                    return None;
                }
                product.offset = unit.offset;
            }
        }
    }
    (count > 0).then_some(product)
}

/// A symbol with prefix and exponent: `mm`, `s2`, `s^-2`, `m²`.
fn factor(text: &str) -> Option<(BaseUnit, i32)> {
    let plain = text.replace('²', "2").replace('³', "3").replace('⁻', "-").replace('¹', "1");
    if let Some(unit) = symbol(&plain) {
        return Some((unit, 1));
    }
    let at = plain.find(|it: char| it.is_ascii_digit() || matches!(it, '-' | '^' | '+'))?;
    let exponent = plain[at..].trim_start_matches('^').parse().ok()?;
    Some((symbol(&plain[..at])?, exponent))
}

fn symbol(text: &str) -> Option<BaseUnit> {
    let exact = |name: &str, factor: f64, prefixed: bool| {
        let mut rows = SYMBOLS.iter().filter(|it| !prefixed || it.4);
        let &(_, exponents, own, offset, _) = rows.find(|it| it.0 == name)?;
        Some(BaseUnit { exponents, factor: own * factor, offset })
    };
    exact(text, 1.0, false).or_else(|| {
        PREFIXES
            .iter()
            .find_map(|(prefix, factor)| exact(text.strip_prefix(prefix)?, *factor, true))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_units_convert() {
        let units = Units::default();
        for (from, to, value, expected) in [
            ("mm", "m", 8.0, 8e-3),
            ("kg", "g", 1.5, 1500.0),
            ("km/h", "m/s", 36.0, 10.0),
            ("kN", "kg.m.s-2", 2.0, 2000.0),
            ("mm/s2", "m.s-2", 1.0, 1e-3),
            ("mm/s^2", "m/s²", 1.0, 1e-3),
            ("degC", "K", 20.0, 293.15),
            ("deg", "rad", 180.0, PI),
            ("ms", "s", 250.0, 0.25),
            ("%", "1", 5.0, 0.05),
            ("µm", "mm", 3.0, 3e-3),
            ("min", "s", 2.0, 120.0),
            ("N/mm", "N/m", 3.0, 3000.0),
        ] {
            let it = units.conversion(from, to).unwrap();
            let found = it.factor * value + it.offset;
            assert!((found - expected).abs() < 1e-12 * expected.abs(), "{from} {to}: {found}");
        }
        let error = units.conversion("mm", "kN").unwrap_err().to_string();
        assert_eq!(error, "mm is m in base units, kN is kg.m.s-2");
        for wrong in ["", "furlong", "m/", "degC/s", "mmin", "m//s"] {
            assert!(units.find(wrong).is_none(), "{wrong}");
        }
    }

    #[test]
    fn analytic_definitions_and_their_display_units_come_first() {
        let text = r#"<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g">
            <CoSimulation modelIdentifier="m"/>
            <UnitDefinitions><Unit name="K"><BaseUnit K="1"/>
            <DisplayUnit name="degF" factor="1.8" offset="-459.67"/></Unit>
            <Unit name="volt5"><BaseUnit m="1" factor="0.002"/></Unit></UnitDefinitions>
            <ModelVariables/><ModelStructure/></fmiModelDescription>"#;
        let units = Units::defined_by([&ModelDescription::parse(text).unwrap()]);
        let it = units.conversion("degF", "degC").unwrap();
        assert!((it.factor * 212.0 + it.offset - 100.0).abs() < 1e-10);
        let it = units.conversion("volt5", "mm").unwrap();
        assert!((it.factor * 4.0 - 8.0).abs() < 1e-12);
    }
}
