//! Parameter sets (SSV).

use fmi2_import::description::BaseUnit;
use fmi2_import::xml::{Plain as _, number, words};
use roxmltree::Node;

use super::common::{Definitions, is_integer, is_real};
use crate::SspError;
use crate::xml::{At, SSC, SSV, boolean, child, children, double, listed};

/// A parameter set.
#[derive(Debug, Clone)]
pub(crate) struct ParameterSet {
    /// Its parameters in their order.
    pub(crate) parameters: Vec<Parameter>,
}

/// A value by its name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Parameter {
    /// Name as in the file.
    pub(crate) name: String,
    /// Its value.
    pub(crate) value: ParameterValue,
}

/// A number with its unit of measurement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Number {
    /// The value.
    pub(crate) value: f64,
    /// Its unit of measurement: name, and definition if the file has one.
    pub(crate) unit: Option<(String, BaseUnit)>,
}

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ParameterValue {
    /// A real number.
    Real(Number),
    /// An integer of any size.
    Integer(i64),
    /// A Boolean.
    Boolean(bool),
    /// A text.
    String(String),
    /// An item by its name, and its value if the file defines the enumeration.
    Item(String, Option<i64>),
}

impl ParameterSet {
    /// Reads a `ParameterSet`. Units and enumerations that it does not define are those of the description.
    pub(crate) fn read(
        node: Node<'_, '_>,
        file: &str,
        outer: &Definitions,
    ) -> Result<Self, SspError> {
        let own = Definitions::read(node, SSV, file)?;
        let parameters = listed(node, (SSV, "Parameters"), (SSV, "Parameter"));
        let parameters = parameters.map(|it| parameter(it, file, [&own, outer]));
        Ok(Self { parameters: parameters.collect::<Result<_, _>>()? })
    }
}

fn parameter(
    node: Node<'_, '_>,
    file: &str,
    [own, outer]: [&Definitions; 2],
) -> Result<Parameter, SspError> {
    let name = node.attr("name").unwrap_or_default().to_owned();
    let place = format!("Parameter \"{name}\"");
    let at = At { file, place: &place };
    if name.is_empty() {
        return Err(at.invalid("it has no name"));
    }
    let value = node
        .children()
        .find(|it| it.is_element() && it.tag_name().namespace() == Some(SSV))
        .ok_or_else(|| at.invalid("it has no value"))?;
    let kind = value.tag_name().name();
    let is_array = child(node, (SSC, "Dimension")).is_some()
        || children(value, (SSV, "Value")).nth(1).is_some()
        || (is_real(kind) || is_integer(kind) || kind == "Boolean")
            && value.attr("value").is_some_and(|text| words(text).nth(1).is_some());
    if is_array {
        return Err(at.unsupported("arrays are not supported"));
    }
    let text = match value.attr("value") {
        Some(text) => text.to_owned(),
        None => match child(value, (SSV, "Value")) {
            Some(only) => at.required(only, "value")?,
            None => return Err(at.invalid("it has no value")),
        },
    };
    let wrong = || at.invalid(format!("\"{text}\" is not a valid {kind}"));
    // one that neither file defines is remembered with the description
    let unit = |name: Option<&str>| match own.units.get(name?) {
        Some(base) => Some((name?.to_owned(), base.clone())),
        None => outer.unit(name?),
    };
    let value = match kind {
        _ if is_real(kind) => ParameterValue::Real(Number {
            value: double(&text).ok_or_else(wrong)?,
            unit: unit(value.attr("unit")),
        }),
        _ if is_integer(kind) => ParameterValue::Integer(number(&text).ok_or_else(wrong)?),
        "Boolean" => ParameterValue::Boolean(boolean(&text).ok_or_else(wrong)?),
        "String" => ParameterValue::String(text),
        "Enumeration" => {
            let of = |it: &&Definitions| it.enumerations.get(value.attr("name")?).cloned();
            let items = [own, outer].iter().find_map(of).unwrap_or_default();
            let number = items.into_iter().find(|(item, _)| *item == text).map(|(_, it)| it);
            ParameterValue::Item(text, number)
        }
        _ => return Err(at.unsupported(format!("the type {kind} is not supported"))),
    };
    Ok(Parameter { name, value })
}
