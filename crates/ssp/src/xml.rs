//! XML of the SSP standard: its namespaces, and elements in them.

use std::str::FromStr;

use fmi2_import::description::MAX_NODES;
use fmi2_import::xml::{Plain as _, number, trim};
use roxmltree::{Document, Error, Node, ParsingOptions};

use crate::{SspError, names};

/// Namespace of the description of a system.
pub(crate) const SSD: &str = "http://ssp-standard.org/SSP1/SystemStructureDescription";
/// Namespace of what the formats share.
pub(crate) const SSC: &str = "http://ssp-standard.org/SSP1/SystemStructureCommon";
/// Namespace of parameter sets.
pub(crate) const SSV: &str = "http://ssp-standard.org/SSP1/SystemStructureParameterValues";
/// Namespace of parameter mappings.
pub(crate) const SSM: &str = "http://ssp-standard.org/SSP1/SystemStructureParameterMapping";
/// Namespace of signal dictionaries.
pub(crate) const SSB: &str = "http://ssp-standard.org/SSP1/SystemStructureSignalDictionary";

/// The prefixes that everyone uses.
pub(crate) const PREFIXES: [(&str, &str); 5] =
    [("ssd", SSD), ("ssc", SSC), ("ssv", SSV), ("ssm", SSM), ("ssb", SSB)];

/// Largest XML file, in bytes.
pub(crate) const MAX_SIZE: usize = 64 << 20;

/// Reads a document whose root element is `root`, and hands it over.
///
/// Some tools use the standard's prefixes without declaring them; they get their usual meaning.
///
/// # Errors
/// The text is not XML, has another root element, another version than 1.0 or 2.0 or names that the standard does not
/// have, or `read` fails.
pub(crate) fn document<T>(
    text: &str,
    file: &str,
    root: (&str, &str),
    read: impl FnOnce(Node<'_, '_>) -> Result<T, SspError>,
) -> Result<T, SspError> {
    let failed = |message: String| SspError::Xml { file: file.to_owned(), message };
    let mut text = text.to_owned();
    for _ in PREFIXES {
        let unknown = match Document::parse_with_options(&text, options()) {
            Err(Error::UnknownNamespace(prefix, _)) => prefix,
            _ => break,
        };
        match declared(&text, &unknown) {
            Some(better) => text = better,
            None => break,
        }
    }
    let document = Document::parse_with_options(&text, options())
        .map_err(|error| failed(format!("this is not valid XML: {error}")))?;
    let node = document.root_element();
    if !is(node, root) {
        let tag = node.tag_name();
        return Err(failed(format!(
            "the root element is {} in the namespace \"{}\"; expected {} in \"{}\"",
            tag.name(),
            tag.namespace().unwrap_or_default(),
            root.1,
            root.0
        )));
    }
    check_version(node, file)?;
    names::check(node, file)?;
    read(node)
}

/// A function, since the texts that options are for live differently long.
fn options<'a>() -> ParsingOptions<'a> {
    ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() }
}

/// The text with a declaration of the prefix in its root element.
fn declared(text: &str, prefix: &str) -> Option<String> {
    let (_, namespace) = PREFIXES.iter().find(|(it, _)| *it == prefix)?;
    let root = text
        .match_indices('<')
        .find(|(at, _)| text[at + 1..].starts_with(|c: char| c.is_alphabetic()))?
        .0;
    let end = root + text[root..].find([' ', '\t', '\r', '\n', '/', '>'])?;
    Some(format!("{} xmlns:{prefix}=\"{namespace}\"{}", &text[..end], &text[end..]))
}

/// An element of the standard with a version must be of a version that is known.
pub(crate) fn check_version(node: Node<'_, '_>, file: &str) -> Result<(), SspError> {
    match node.attr("version").map(trim) {
        Some("1.0" | "2.0") | None => Ok(()),
        Some(other) => Err(SspError::Unsupported {
            file: file.to_owned(),
            place: node.tag_name().name().to_owned(),
            what: format!("version \"{other}\" is not supported; 1.0 and 2.0 are"),
        }),
    }
}

/// Whether the node is this element: namespace and name.
pub(crate) fn is(node: Node<'_, '_>, (namespace, name): (&str, &str)) -> bool {
    let tag = node.tag_name();
    node.is_element() && tag.name() == name && tag.namespace() == Some(namespace)
}

/// The children of this name.
pub(crate) fn children<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    name: (&'static str, &'static str),
) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |it| is(*it, name))
}

/// The first child of this name.
pub(crate) fn child<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    name: (&'static str, &'static str),
) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// The children of the list of this name.
pub(crate) fn listed<'a, 'i: 'a>(
    node: Node<'a, 'i>,
    list: (&'static str, &'static str),
    item: (&'static str, &'static str),
) -> impl Iterator<Item = Node<'a, 'i>> {
    child(node, list).into_iter().flat_map(move |list| children(list, item))
}

/// What an attribute is read for: where it is, for messages.
#[derive(Clone, Copy)]
pub(crate) struct At<'a> {
    /// Name of the file.
    pub(crate) file: &'a str,
    /// The element.
    pub(crate) place: &'a str,
}

impl At<'_> {
    /// The element breaks the standard.
    pub(crate) fn invalid(self, message: impl Into<String>) -> SspError {
        let (file, place) = (self.file.to_owned(), self.place.to_owned());
        SspError::Invalid { file, place, message: message.into() }
    }

    /// The element is beyond this program.
    pub(crate) fn unsupported(self, what: impl Into<String>) -> SspError {
        let (file, place) = (self.file.to_owned(), self.place.to_owned());
        SspError::Unsupported { file, place, what: what.into() }
    }

    /// An attribute that must be there.
    pub(crate) fn required(self, node: Node<'_, '_>, name: &str) -> Result<String, SspError> {
        let value = node.attr(name).map(str::to_owned);
        value.ok_or_else(|| self.invalid(format!("the attribute {name} is missing")))
    }

    /// A number, if the attribute is there. XML Schema writes INF and -INF.
    pub(crate) fn double(self, node: Node<'_, '_>, name: &str) -> Result<Option<f64>, SspError> {
        let Some(text) = node.attr(name) else { return Ok(None) };
        match double(text) {
            Some(number) => Ok(Some(number)),
            None => Err(self.invalid(format!("{name}=\"{text}\" is not a number"))),
        }
    }

    /// A finite number, or a default.
    pub(crate) fn finite(
        self,
        node: Node<'_, '_>,
        name: &str,
        default: f64,
    ) -> Result<f64, SspError> {
        let value = self.double(node, name)?.unwrap_or(default);
        if value.is_finite() {
            return Ok(value);
        }
        Err(self.invalid(format!("{name}=\"{value}\" is not a finite number")))
    }

    /// An integer, if the attribute is there.
    pub(crate) fn integer<T: FromStr>(
        self,
        node: Node<'_, '_>,
        name: &str,
    ) -> Result<Option<T>, SspError> {
        let Some(text) = node.attr(name) else { return Ok(None) };
        match number(text) {
            Some(number) => Ok(Some(number)),
            None => Err(self.invalid(format!("{name}=\"{text}\" is not a valid integer"))),
        }
    }

    /// A Boolean, or false.
    pub(crate) fn flag(self, node: Node<'_, '_>, name: &str) -> Result<bool, SspError> {
        let Some(text) = node.attr(name) else { return Ok(false) };
        boolean(text).ok_or_else(|| self.invalid(format!("{name}=\"{text}\" is not a Boolean")))
    }
}

/// A number as XML Schema writes it.
pub(crate) fn double(text: &str) -> Option<f64> {
    match trim(text) {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        "NaN" => Some(f64::NAN),
        other => other.parse().ok().filter(|it: &f64| it.is_finite()),
    }
}

/// A Boolean as XML Schema writes it.
pub(crate) fn boolean(text: &str) -> Option<bool> {
    match trim(text) {
        "true" | "1" => Some(true),
        "false" | "0" => Some(false),
        _ => None,
    }
}
