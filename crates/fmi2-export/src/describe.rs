//! The description of a model, printed from its declarations.

use crate::description::print;
use crate::table::VariableTable;
use crate::{Error, Model, Resources};

/// The description of `M` with these resources, as UTF-8 XML.
///
/// # Errors
/// The resources or the declarations are invalid.
pub fn describe<M: Model>(resources: &Resources) -> Result<String, Error> {
    let (_, table) = VariableTable::declare::<M>(resources)?;
    Ok(print(&table.interface, Some(&table.guid)))
}
