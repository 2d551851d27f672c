//! Equal instances of a unit in one process share their interface table, and begin as copies of one model.

use std::any::{Any, TypeId};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::resources::Reads;
use crate::table::VariableTable;
use crate::{Error, Model, Resources};

/// Number of units with different resources that are kept.
const MOST: usize = 4;

/// What an instantiation has made, for the next ones with the same resources.
struct Prototype {
    model_type: TypeId,
    folder: PathBuf,
    reads: Reads,
    model: Box<dyn Any + Send>,
    table: Arc<VariableTable>,
}

/// The latest one is the last.
static PROTOTYPES: Mutex<Vec<Prototype>> = Mutex::new(Vec::new());

/// The model and its table: copies, if the unit has been instantiated before with resources of the same content.
pub(crate) fn declare<M: Model>(resources: &Resources) -> Result<(M, Arc<VariableTable>), Error> {
    if let Some(found) = copied(resources) {
        return Ok(found);
    }
    let (model, table) = VariableTable::declare::<M>(resources)?;
    let table = Arc::new(table);
    if let Some(copy) = model.copied(resources) {
        let prototype = Prototype {
            model_type: TypeId::of::<M>(),
            folder: resources.path().to_path_buf(),
            reads: resources.reads(),
            model: Box::new(copy),
            table: table.clone(),
        };
        let mut all = all();
        all.retain(|old| !is_for::<M>(old, resources));
        if all.len() == MOST {
            all.remove(0);
        }
        all.push(prototype);
    }
    Ok((model, table))
}

fn copied<M: Model>(resources: &Resources) -> Option<(M, Arc<VariableTable>)> {
    let all = all();
    let prototype = all.iter().find(|it| is_for::<M>(it, resources))?;
    if !resources.have(&prototype.reads) {
        return None;
    }
    let model = prototype.model.downcast_ref::<M>()?;
    Some((model.copied(resources)?, prototype.table.clone()))
}

fn is_for<M: Model>(prototype: &Prototype, resources: &Resources) -> bool {
    prototype.model_type == TypeId::of::<M>() && prototype.folder == resources.path()
}

fn all() -> MutexGuard<'static, Vec<Prototype>> {
    PROTOTYPES.lock().unwrap_or_else(PoisonError::into_inner)
}
