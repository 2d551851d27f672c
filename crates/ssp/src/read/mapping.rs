//! Parameter mappings (SSM).

use roxmltree::Node;

use super::common::Transformation;
use crate::SspError;
use crate::xml::{At, SSM, children};

/// A parameter mapping.
#[derive(Debug, Clone)]
pub(crate) struct ParameterMapping {
    /// Its entries in their order.
    pub(crate) entries: Vec<Entry>,
}

/// Which parameter of the source sets which of the element, and how.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    /// Name in the parameter set, with the prefix of the binding.
    pub(crate) source: String,
    /// Name in the element.
    pub(crate) target: String,
    /// Transformation of the value, after its unit of measurement has been converted.
    pub(crate) transformation: Option<Transformation>,
    /// Do not convert units of measurement.
    pub(crate) keeps_unit: bool,
}

impl ParameterMapping {
    /// Reads a `ParameterMapping`.
    pub(crate) fn read(node: Node<'_, '_>, file: &str) -> Result<Self, SspError> {
        let entries = children(node, (SSM, "MappingEntry")).enumerate().map(|(k, it)| {
            let place = format!("MappingEntry {}", k + 1);
            let at = At { file, place: &place };
            Ok(Entry {
                source: at.required(it, "source")?,
                target: at.required(it, "target")?,
                transformation: Transformation::read(it, at)?,
                keeps_unit: at.flag(it, "suppressUnitConversion")?,
            })
        });
        Ok(Self { entries: entries.collect::<Result<_, SspError>>()? })
    }
}
