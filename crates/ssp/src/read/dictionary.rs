//! Signal dictionaries (SSB).

use std::collections::HashMap;

use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use super::common::{Definitions, SignalType};
use crate::SspError;
use crate::xml::{At, SSB, children};

/// A signal dictionary: signals that elements share.
#[derive(Debug, Clone)]
pub(crate) struct SignalDictionary {
    /// Its signals by name.
    pub(crate) entries: HashMap<String, Option<SignalType>>,
}

impl SignalDictionary {
    /// Reads a `SignalDictionary`.
    pub(crate) fn read(node: Node<'_, '_>, file: &str) -> Result<Self, SspError> {
        let definitions = Definitions::read(node, SSB, file)?;
        let mut entries = HashMap::new();
        for it in children(node, (SSB, "DictionaryEntry")) {
            let name = it.attr("name").unwrap_or_default().to_owned();
            let place = format!("DictionaryEntry \"{name}\"");
            let signal = SignalType::read(it, &definitions);
            if name.is_empty() || entries.insert(name, signal).is_some() {
                return Err(At { file, place: &place }.invalid("its name is missing or not unique"));
            }
        }
        Ok(Self { entries })
    }
}
