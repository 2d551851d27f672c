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
            let at = At { file, place: &place };
            entries.insert(name, SignalType::read(it, &definitions, at)?);
        }
        Ok(Self { entries })
    }
}
