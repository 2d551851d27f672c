//! Units of measure and declared types.

use std::collections::HashMap;

use roxmltree::Node;

use crate::xml::Plain as _;

use super::{Reader, Result, child, children, type_of};
use crate::description::units::BASE_NAMES;
use crate::description::{BaseUnit, Enumeration, UnitOfMeasure};

/// Elements with the attributes that variables inherit from declared types, by name of the type.
pub(super) type Types<'a> = HashMap<&'a str, Node<'a, 'a>>;

impl<'a> Reader<'a> {
    pub(super) fn units(&mut self, root: Node<'a, 'a>) -> Result<Vec<UnitOfMeasure>> {
        children(root, "UnitDefinitions", "Unit")
            .map(|node| {
                let base = child(node, "BaseUnit").map(|base| self.base_unit(base)).transpose()?;
                let display_units = node
                    .children()
                    .filter(|child| child.is("DisplayUnit"))
                    .map(|display| {
                        let factor = self.number(display, "factor", "a number")?.unwrap_or(1.0);
                        let offset = self.number(display, "offset", "a number")?.unwrap_or(0.0);
                        Ok((self.required(display, "name")?.to_owned(), factor, offset))
                    })
                    .collect::<Result<_>>()?;
                Ok(UnitOfMeasure {
                    name: self.required(node, "name")?.to_owned(),
                    base,
                    display_units,
                })
            })
            .collect()
    }

    fn base_unit(&mut self, node: Node<'a, 'a>) -> Result<BaseUnit> {
        let mut exponents = [0; 8];
        for (name, exponent) in BASE_NAMES.iter().zip(&mut exponents) {
            *exponent = self.number(node, name, "an integer")?.unwrap_or(0);
        }
        let factor: f64 = self.number(node, "factor", "a number")?.unwrap_or(1.0);
        let offset: f64 = self.number(node, "offset", "a number")?.unwrap_or(0.0);
        if factor == 0.0 || !factor.is_finite() || !offset.is_finite() {
            let attribute = if offset.is_finite() { "factor" } else { "offset" };
            return Err(self.invalid(node, attribute, "a finite number other than zero"));
        }
        Ok(BaseUnit { exponents, factor, offset })
    }

    /// The declared types.
    pub(super) fn types(&self, root: Node<'a, 'a>) -> Types<'a> {
        children(root, "TypeDefinitions", "SimpleType")
            .filter_map(|node| {
                let element = node.children().find(|child| type_of(*child).is_some())?;
                Some((node.attr("name")?, element))
            })
            .collect()
    }

    /// The enumerations with their items.
    pub(super) fn enumerations(&mut self, root: Node<'a, 'a>) -> Result<Vec<Enumeration>> {
        children(root, "TypeDefinitions", "SimpleType")
            .filter_map(|node| Some((node, child(node, "Enumeration")?)))
            .map(|(node, element)| {
                let items = element
                    .children()
                    .filter(|item| item.is("Item"))
                    .filter_map(|item| {
                        let value = self.optional(item, "value", "an integer")?;
                        Some((item.attr("name")?.to_owned(), value))
                    })
                    .collect();
                Ok(Enumeration { name: self.required(node, "name")?.to_owned(), items })
            })
            .collect()
    }
}
