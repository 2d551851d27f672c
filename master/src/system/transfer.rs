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
//! A table of the connection (`map`) replaces values between Booleans, and between Integers and Enumerations.
//! Other pairs of types are errors. They would need rounding or a threshold, which a connection cannot guess
//! and a unit in between can compute.

use std::sync::Arc;

use super::{Port, Result, System, SystemError};
use fmi2_import::description::{Conversion, Enumeration, Type};
use scenario::table::{self, Table};

/// The conversion of a value by a connection.
#[derive(Debug, Clone, PartialEq)]
pub enum Transfer {
    /// To a Real: factor · value + offset; false is 0, true is 1.
    Linear(Conversion),
    /// To an Integer, unchanged; false is 0, true is 1.
    Whole,
    /// To an Enumeration: pairs of values of its items, from source to target, sorted.
    Items(Arc<[(i32, i32)]>),
    /// To an Integer or Boolean: pairs of values, from source to target, sorted. Others are unchanged.
    Table(Arc<[(i32, i32)]>),
    /// To a Boolean or a String, unchanged.
    Same,
}

impl Transfer {
    /// The value that becomes of another by a table; all others stay.
    pub(crate) fn replace(&self, value: i32) -> i32 {
        let Self::Table(pairs) = self else { return value };
        pairs.iter().find(|pair| pair.0 == value).map_or(value, |pair| pair.1)
    }
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
                self.items(place, from, to, None)?
            }
            (a, b) if a == b => Transfer::Same,
            (from_type, to_type) => {
                let (place, from, to) = (place.into(), self.port_name(from), self.port_name(to));
                return Err(SystemError::Type { place, from, from_type, to, to_type });
            }
        };
        if linear != Conversion::IDENTITY {
            let (place, to) = (place.to_owned(), self.port_name(to));
            return Err(SystemError::NotLinear { place, to, kind: kinds.1 });
        }
        Ok(transfer)
    }

    fn enumeration(&self, port: Port) -> Option<&Enumeration> {
        self.instances[port.instance].description().enumeration_of(port.variable.0)
    }

    /// The values of an Enumeration, or those of a table. If the target defines no items, others are not changed.
    pub(super) fn items(
        &mut self,
        place: &str,
        from: Port,
        to: Port,
        table: Option<&Table>,
    ) -> Result<Transfer> {
        let end = |port| (self.variable(port).kind, self.enumeration(port));
        let (found, is_complete) = (table::pairs(table, end(from), end(to)), end(to).1.is_some());
        let (from, to) = (self.port_name(from), self.port_name(to));
        let (pairs, unknown) = match found {
            Ok(found) => found,
            Err(source) => return Err(SystemError::Map { place: place.into(), from, to, source }),
        };
        if !unknown.is_empty() {
            self.notes.push(format!(
                "{to} has no item {} of {from}: the run fails if the connection has to pass one of these",
                unknown.join(", "),
            ));
        }
        Ok(if is_complete { Transfer::Items(pairs.into()) } else { Transfer::Table(pairs.into()) })
    }
}
