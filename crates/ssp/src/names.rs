//! The names of the standard. A misspelt one would otherwise be ignored, and a connection or a factor with it.

use patterns::suggest;
use roxmltree::Node;

use crate::SspError;
use crate::xml::PREFIXES;

/// Elements of all five formats, versions 1.0 and 2.0.
#[rustfmt::skip]
const ELEMENTS: [&str; 61] = [
    "Annotation", "Annotations", "BaseUnit", "Binary", "Boolean", "BooleanMappingTransformation", "Clock",
    "Component", "Connection", "ConnectionGeometry", "Connections", "Connector", "ConnectorGeometry", "Connectors",
    "Content", "DefaultExperiment", "DictionaryEntry", "Dimension", "ElementGeometry", "Elements", "Enumeration",
    "EnumerationMappingTransformation", "Enumerations", "Float32", "Float64", "GraphicalElements", "Int16", "Int32",
    "Int64", "Int8", "Integer", "IntegerMappingTransformation", "Item", "LinearTransformation", "MapEntry",
    "MappingEntry", "MetaData", "Note", "Parameter", "ParameterBinding", "ParameterBindings", "ParameterMapping",
    "ParameterSet", "ParameterValues", "Parameters", "Real", "SignalDictionaries", "SignalDictionary",
    "SignalDictionaryReference", "Signature", "String", "System", "SystemGeometry", "SystemStructureDescription",
    "UInt16", "UInt32", "UInt64", "UInt8", "Unit", "Units", "Value",
];

/// Their attributes.
#[rustfmt::skip]
const ATTRIBUTES: [&str; 67] = [
    "A", "K", "author", "cd", "copyright", "description", "dictionary", "endConnector", "endElement", "endIndices",
    "factor", "fileversion", "generationDateAndTime", "generationTool", "iconFixedAspectRatio", "iconFlip",
    "iconRotation", "iconSource", "id", "implementation", "intervalCounter", "intervalDecimal",
    "intervalVariability", "kg", "kind", "license", "m", "mime-type", "mol", "name", "offset", "pointsX", "pointsY",
    "prefix", "priority", "rad", "resolution", "role", "rotation", "s", "shiftCounter", "shiftDecimal", "size",
    "sizeConnector", "source", "sourceBase", "startConnector", "startElement", "startIndices", "startTime",
    "stopTime", "supportsFraction", "suppressUnitConversion", "systemInnerX", "systemInnerY", "target", "text",
    "type", "unit", "value", "version", "x", "x1", "x2", "y", "y1", "y2",
];

/// Checks the names in a namespace of the standard. What is in annotations is free.
///
/// # Errors
/// A name that the standard does not have.
pub(crate) fn check(root: Node<'_, '_>, file: &str) -> Result<(), SspError> {
    let mut free_until = 0;
    for node in root.descendants().filter(Node::is_element) {
        let tag = node.tag_name();
        let standard = PREFIXES.iter().any(|(_, namespace)| tag.namespace() == Some(*namespace));
        if !standard || node.range().start < free_until {
            continue;
        }
        let unknown = |what: &str, name: &str, known: &[&str]| {
            let near = suggest(name, known.iter().copied());
            let near = near.map(|it| format!("; did you mean {it}?")).unwrap_or_default();
            let row = node.document().text_pos_at(node.range().start).row;
            let message = format!("SSP has no {what} {name}{near}");
            SspError::Invalid { file: file.to_owned(), place: format!("line {row}"), message }
        };
        if !ELEMENTS.contains(&tag.name()) {
            return Err(unknown("element", tag.name(), &ELEMENTS));
        }
        let mut attributes = node.attributes().filter(|it| it.namespace().is_none());
        if let Some(it) = attributes.find(|it| !ATTRIBUTES.contains(&it.name())) {
            return Err(unknown("attribute", it.name(), &ATTRIBUTES));
        }
        if ["Annotation", "Content"].contains(&tag.name()) {
            free_until = node.range().end;
        }
    }
    Ok(())
}
