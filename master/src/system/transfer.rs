//! The conversion of values by a connection, according to the types of its ends.
//!
//! | from \ to | Real | Integer | Enumeration | Boolean | String |
//! |---|---|---|---|---|---|
//! | Real | linear | | | | |
//! | Integer | linear | unchanged | must be the value of an item | | |
//! | Enumeration | linear | unchanged | by the names of the items | | |
//! | Boolean | linear, of 0 or 1 | 0 or 1 | | unchanged | |
//! | String | | | | | unchanged |
//!
//! Other pairs are errors. They would need rounding or a threshold, which a connection cannot guess
//! and a unit in between can compute.

use std::sync::Arc;

use super::{Port, Result, System, SystemError};
use fmi2_import::description::{Conversion, Enumeration, Type};

/// The conversion of a value by a connection.
#[derive(Debug, Clone, PartialEq)]
pub enum Transfer {
    /// To a Real: factor · value + offset; false is 0, true is 1.
    Linear(Conversion),
    /// To an Integer, unchanged; false is 0, true is 1.
    Whole,
    /// To an Enumeration: pairs of values of its items, from source to target, sorted.
    Items(Arc<[(i32, i32)]>),
    /// To a Boolean or a String, unchanged.
    Same,
}

impl System {
    /// The conversion between these two; `linear` is the one between Reals.
    pub(super) fn transfer(
        &mut self,
        place: &str,
        from: Port,
        to: Port,
        linear: Conversion,
    ) -> Result<Transfer> {
        let kinds = (self.variable(from).kind, self.variable(to).kind);
        let transfer = match kinds {
            (Type::Real | Type::Integer | Type::Enumeration | Type::Boolean, Type::Real) => {
                return Ok(Transfer::Linear(linear));
            }
            (Type::Integer | Type::Enumeration | Type::Boolean, Type::Integer) => Transfer::Whole,
            (Type::Integer | Type::Enumeration, Type::Enumeration) => {
                self.items(place, from, to)?
            }
            (a, b) if a == b => Transfer::Same,
            (from_type, to_type) => {
                return Err(SystemError::Type {
                    place: place.to_owned(),
                    from: self.port_name(from),
                    from_type,
                    to: self.port_name(to),
                    to_type,
                });
            }
        };
        if linear != Conversion::IDENTITY {
            return Err(SystemError::NotLinear {
                place: place.to_owned(),
                to: self.port_name(to),
                kind: kinds.1,
            });
        }
        Ok(transfer)
    }

    fn enumeration(&self, port: Port) -> Option<&Enumeration> {
        self.instances[port.instance].description().enumeration_of(port.variable.0)
    }

    /// The items of both ends. If the target defines none, values are not changed.
    fn items(&mut self, place: &str, from: Port, to: Port) -> Result<Transfer> {
        let Some(target) = self.enumeration(to) else { return Ok(Transfer::Whole) };
        let Some(source) = self.enumeration(from) else {
            let mut items: Vec<_> = target.items.iter().map(|&(_, value)| (value, value)).collect();
            items.sort_unstable();
            return Ok(Transfer::Items(items.into()));
        };
        let known = |name: &str| target.items.iter().find(|(it, _)| it == name).map(|it| it.1);
        let mut items = Vec::with_capacity(source.items.len());
        let mut unknown = Vec::new();
        for (name, value) in &source.items {
            match known(name) {
                Some(other) => items.push((*value, other)),
                None => unknown.push(format!("\"{name}\" ({value})")),
            }
        }
        let names = (self.port_name(from), self.port_name(to));
        if items.is_empty() {
            let listed = |it: &Enumeration| {
                it.items.iter().map(|(name, value)| format!("\"{name}\" ({value})")).collect()
            };
            return Err(SystemError::NoCommonItem {
                place: place.to_owned(),
                from: names.0,
                from_items: listed(source),
                to: names.1,
                to_items: listed(target),
            });
        }
        if !unknown.is_empty() {
            self.notes.push(format!(
                "{} has no item {} of {}: the run fails if the connection has to pass one of these",
                names.1,
                unknown.join(", "),
                names.0
            ));
        }
        items.sort_unstable();
        Ok(Transfer::Items(items.into()))
    }
}
