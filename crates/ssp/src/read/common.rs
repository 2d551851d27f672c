//! What the formats share: units of measurement, enumerations, types, transformations.

use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};

use fmi2_import::description::BaseUnit;
use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use crate::SspError;
use crate::xml::{At, SSC, boolean, child, children, listed};

/// Names and values of an enumeration's items.
pub(crate) type Items = Vec<(String, i64)>;

/// Units of measurement and enumerations that a file defines.
#[derive(Debug, Clone, Default)]
pub(crate) struct Definitions {
    /// Units of measurement by name.
    pub(crate) units: HashMap<String, BaseUnit>,
    /// Items of the enumerations by name.
    pub(crate) enumerations: HashMap<String, Items>,
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
    /// The items of an Enumeration.
    pub(crate) items: Option<Items>,
    /// What of it is not supported, if anything. That matters for connections only.
    pub(crate) refused: Option<String>,
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
    /// A local variable, a constant or a calculated parameter: a signal out of the element, but no output.
    Internal,
    /// In both directions, or unspecified.
    Other,
}

impl Kind {
    /// The role by its name in the standard.
    pub(crate) fn named(text: &str) -> Self {
        match text {
            "input" => Self::Input,
            "output" => Self::Output,
            "parameter" | "structuralParameter" => Self::Parameter,
            "local" | "constant" | "calculatedParameter" => Self::Internal,
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
    pub(crate) fn read(node: Node<'_, '_>, definitions: &Definitions) -> Option<Self> {
        let mut found: Option<Self> = None;
        let types =
            node.children().filter(|it| it.is_element() && it.tag_name().namespace() == Some(SSC));
        for it in types {
            let mut signal = Self { unit: None, items: None, refused: None };
            match it.tag_name().name() {
                name if is_real(name) => {
                    signal.unit = it.attr("unit").and_then(|unit| definitions.unit(unit));
                }
                "Enumeration" => {
                    let name = it.attr("name").unwrap_or_default();
                    signal.items = definitions.enumerations.get(name).cloned();
                }
                name if is_integer(name) || ["Boolean", "String"].contains(&name) => {}
                name @ ("Binary" | "Clock") => {
                    signal.refused = Some(format!("the type {name} is not supported"));
                }
                "Dimension" => {
                    let refused = Some("arrays are not supported".to_owned());
                    found = Some(Self { refused, ..found.unwrap_or(signal) });
                    continue;
                }
                _ => continue,
            }
            found = Some(signal);
        }
        found
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

/// A transformation of values on their way. What a table does not list stays as it is.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Transformation {
    /// For Reals.
    Linear(Linear),
    /// Pairs of source and target for Booleans.
    Booleans(Vec<(bool, bool)>),
    /// Pairs of source and target for Integers and Enumerations.
    Integers(Vec<(i64, i64)>),
    /// Pairs of names of items.
    Items(Vec<(String, String)>),
}

impl Transformation {
    /// The transformation of a connection or mapping entry, if it has one.
    pub(crate) fn read(node: Node<'_, '_>, at: At<'_>) -> Result<Option<Self>, SspError> {
        let elements =
            node.children().filter(|it| it.is_element() && it.tag_name().namespace() == Some(SSC));
        for it in elements {
            return Ok(Some(match it.tag_name().name() {
                "LinearTransformation" => {
                    let factor = at.finite(it, "factor", 1.0)?;
                    let offset = at.finite(it, "offset", 0.0)?;
                    Self::Linear(Linear { factor, offset })
                }
                "BooleanMappingTransformation" => Self::Booleans(entries(it, at, boolean)?),
                "IntegerMappingTransformation" => {
                    Self::Integers(entries(it, at, fmi2_import::xml::number)?)
                }
                "EnumerationMappingTransformation" => {
                    Self::Items(entries(it, at, |text| Some(text.to_owned()))?)
                }
                _ => continue,
            }));
        }
        Ok(None)
    }

    /// Whether it leaves all values as they are.
    pub(crate) fn is_identity(&self) -> bool {
        match self {
            Self::Linear(it) => *it == Linear { factor: 1.0, offset: 0.0 },
            Self::Booleans(pairs) => pairs.iter().all(|(a, b)| a == b),
            Self::Integers(pairs) => pairs.iter().all(|(a, b)| a == b),
            Self::Items(pairs) => pairs.iter().all(|(a, b)| a == b),
        }
    }
}

/// The pairs of a table.
fn entries<T: PartialEq>(
    table: Node<'_, '_>,
    at: At<'_>,
    read: impl Fn(&str) -> Option<T>,
) -> Result<Vec<(T, T)>, SspError> {
    let mut pairs: Vec<(T, T)> = Vec::new();
    for it in children(table, (SSC, "MapEntry")) {
        let value = |name| -> Result<T, SspError> {
            let text = at.required(it, name)?;
            let wrong = || at.invalid(format!("\"{text}\" is not valid in a MapEntry"));
            read(&text).ok_or_else(wrong)
        };
        let (source, target) = (value("source")?, value("target")?);
        if pairs.iter().any(|(other, _)| *other == source) {
            let source = it.attr("source").unwrap_or_default();
            return Err(at.invalid(format!("it has two MapEntry elements for {source}")));
        }
        pairs.push((source, target));
    }
    Ok(pairs)
}
