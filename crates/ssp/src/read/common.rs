//! What the formats share: units of measurement, enumerations, types, transformations.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use fmi2_import::description::BaseUnit;
use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use crate::SspError;
use crate::xml::{At, SSC, boolean, child, children, is, listed};

/// Units of measurement and enumerations that a file defines.
#[derive(Debug, Clone, Default)]
pub(crate) struct Definitions {
    /// Units of measurement by name.
    pub(crate) units: HashMap<String, BaseUnit>,
    /// Items of the enumerations by name.
    pub(crate) enumerations: HashMap<String, Vec<(String, i32)>>,
    /// Names of units of measurement that are used but not defined.
    pub(crate) undefined: RefCell<BTreeSet<String>>,
}

impl Definitions {
    /// Reads `Units` and `Enumerations`, which are elements of the file's own namespace.
    pub(crate) fn read(
        node: Node<'_, '_>,
        namespace: &'static str,
        file: &str,
    ) -> Result<Self, SspError> {
        let mut found = Self::default();
        for unit in listed(node, (namespace, "Units"), (SSC, "Unit")) {
            let name = unit.attr("name").unwrap_or_default().to_owned();
            let at = At { file, place: &format!("Unit \"{name}\"") };
            let Some(base) = child(unit, (SSC, "BaseUnit")) else {
                return Err(at.invalid("it has no BaseUnit"));
            };
            let mut exponents = [0; 8];
            for (exponent, base_name) in
                exponents.iter_mut().zip(["kg", "m", "s", "A", "K", "mol", "cd", "rad"])
            {
                *exponent = at.integer(base, base_name)?.unwrap_or(0);
            }
            let factor = at.finite(base, "factor", 1.0)?;
            if factor == 0.0 {
                return Err(at.invalid("its factor is 0"));
            }
            let offset = at.finite(base, "offset", 0.0)?;
            found.units.insert(name, BaseUnit { exponents, factor, offset });
        }
        for enumeration in listed(node, (namespace, "Enumerations"), (SSC, "Enumeration")) {
            let name = enumeration.attr("name").unwrap_or_default().to_owned();
            let place = format!("Enumeration \"{name}\"");
            let at = At { file, place: &place };
            let items = children(enumeration, (SSC, "Item")).map(|item| {
                let value = at.integer(item, "value")?;
                let value = value.ok_or_else(|| at.invalid("an item has no value"))?;
                Ok((at.required(item, "name")?, value))
            });
            let items = items.collect::<Result<_, SspError>>()?;
            found.enumerations.insert(name, items);
        }
        Ok(found)
    }

    /// The unit of measurement of this name. One that is not defined counts as none, and is remembered for a note.
    pub(crate) fn unit(&self, name: &str) -> Option<(String, BaseUnit)> {
        let base = self.units.get(name).cloned();
        if base.is_none() && !name.is_empty() {
            self.undefined.borrow_mut().insert(name.to_owned());
        }
        Some((name.to_owned(), base?))
    }
}

/// The type of a signal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SignalType {
    /// Unit of measurement of a Real: its name and definition.
    pub(crate) unit: Option<(String, BaseUnit)>,
}

/// The role of a connector.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// A signal into the element.
    Input,
    /// A signal out of it.
    Output,
    /// A parameter, which is set before the run.
    Parameter,
    /// Any other, or unspecified.
    Other,
}

impl Kind {
    /// The role by its name in the standard.
    pub(crate) fn named(text: &str) -> Self {
        match text {
            "input" => Self::Input,
            "output" => Self::Output,
            "parameter" | "structuralParameter" => Self::Parameter,
            _ => Self::Other,
        }
    }
}

const INTEGERS: [&str; 9] =
    ["Integer", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"];

/// Whether a name is that of an integer type of 1.0 or 2.0.
pub(crate) fn is_integer(name: &str) -> bool {
    INTEGERS.contains(&name)
}

/// Whether a name is that of a real type of 1.0 or 2.0.
pub(crate) fn is_real(name: &str) -> bool {
    ["Real", "Float64", "Float32"].contains(&name)
}

impl SignalType {
    /// The type of a connector or dictionary entry, if it is given.
    pub(crate) fn read(
        node: Node<'_, '_>,
        definitions: &Definitions,
        at: At<'_>,
    ) -> Result<Option<Self>, SspError> {
        let types =
            node.children().filter(|it| it.is_element() && it.tag_name().namespace() == Some(SSC));
        let mut found = None;
        for it in types {
            match it.tag_name().name() {
                name if is_real(name) => {
                    found = Some(Self {
                        unit: it.attr("unit").and_then(|unit| definitions.unit(unit)),
                    });
                }
                name if is_integer(name)
                    || ["Boolean", "String", "Enumeration"].contains(&name) =>
                {
                    found = Some(Self { unit: None });
                }
                "Dimension" => return Err(at.unsupported("arrays are not supported")),
                name @ ("Binary" | "Clock") => {
                    return Err(at.unsupported(format!("the type {name} is not supported")));
                }
                _ => {}
            }
        }
        Ok(found)
    }
}

/// target = factor · source + offset, after units of measurement have been converted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Linear {
    /// Multiplies the value.
    pub(crate) factor: f64,
    /// Is added, in the unit of the target.
    pub(crate) offset: f64,
}

/// A transformation of values on their way.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Transformation {
    /// For Reals.
    Linear(Linear),
    /// Pairs of source and target: Booleans (0, 1) or integers.
    Numbers(Vec<(i64, i64)>),
    /// Pairs of names of items.
    Items(Vec<(String, String)>),
}

impl Transformation {
    /// The transformation of a connection or mapping entry, if it has one.
    pub(crate) fn read(node: Node<'_, '_>, at: At<'_>) -> Result<Option<Self>, SspError> {
        if let Some(linear) = child(node, (SSC, "LinearTransformation")) {
            let factor = at.finite(linear, "factor", 1.0)?;
            let offset = at.finite(linear, "offset", 0.0)?;
            return Ok(Some(Self::Linear(Linear { factor, offset })));
        }
        let entries = |list: Node<'_, '_>| -> Result<Vec<(String, String)>, SspError> {
            children(list, (SSC, "MapEntry"))
                .map(|it| Ok((at.required(it, "source")?, at.required(it, "target")?)))
                .collect()
        };
        for list in node.children() {
            let number = |text: &str| -> Result<i64, SspError> {
                let number = match is(list, (SSC, "BooleanMappingTransformation")) {
                    true => boolean(text).map(i64::from),
                    false => fmi2_import::xml::number(text),
                };
                number.ok_or_else(|| at.invalid(format!("\"{text}\" is not valid in a MapEntry")))
            };
            if is(list, (SSC, "EnumerationMappingTransformation")) {
                return Ok(Some(Self::Items(entries(list)?)));
            }
            if is(list, (SSC, "BooleanMappingTransformation"))
                || is(list, (SSC, "IntegerMappingTransformation"))
            {
                let pairs = entries(list)?;
                let pairs = pairs.iter().map(|(a, b)| Ok((number(a)?, number(b)?)));
                return Ok(Some(Self::Numbers(pairs.collect::<Result<_, SspError>>()?)));
            }
        }
        Ok(None)
    }

    /// Whether it leaves all values that it names as they are.
    pub(crate) fn is_identity(&self) -> bool {
        match self {
            Self::Linear(it) => *it == Linear { factor: 1.0, offset: 0.0 },
            Self::Numbers(pairs) => pairs.iter().all(|(a, b)| a == b),
            Self::Items(pairs) => pairs.iter().all(|(a, b)| a == b),
        }
    }
}
