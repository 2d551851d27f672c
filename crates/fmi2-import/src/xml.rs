//! XML as the schema of FMI 2.0 defines it.
//!
//! The schema's elements and attributes are in no namespace, while roxmltree compares only local names.
//! Numbers, Booleans and lists may have white space around them. XML has four white space characters,
//! Unicode more.

use roxmltree::Node;

/// Name and attributes of an element in no namespace.
pub trait Plain<'a> {
    /// Whether it is an element with this name in no namespace.
    fn is(&self, name: &str) -> bool;
    /// Value of the attribute with this name in no namespace.
    fn attr(&self, name: &str) -> Option<&'a str>;
}

impl<'a> Plain<'a> for Node<'a, '_> {
    fn is(&self, name: &str) -> bool {
        let tag = self.tag_name();
        self.is_element() && tag.name() == name && tag.namespace().is_none()
    }

    fn attr(&self, name: &str) -> Option<&'a str> {
        self.attributes()
            .find(|attribute| attribute.name() == name && attribute.namespace().is_none())
            .map(|attribute| attribute.value())
    }
}

fn is_space(c: char) -> bool {
    matches!(c, ' ' | '\t' | '\n' | '\r')
}

/// The text without white space around it.
pub fn trim(text: &str) -> &str {
    text.trim_matches(is_space)
}

/// The words of a list.
pub fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(is_space).filter(|word| !word.is_empty())
}

/// A number, which may have white space around it. The schema also allows "-0" for unsigned numbers.
pub fn number<T: std::str::FromStr>(text: &str) -> Option<T> {
    let text = trim(text);
    let zeros = || text.strip_prefix('-').filter(|zeros| zeros.bytes().all(|b| b == b'0'));
    text.parse().ok().or_else(|| zeros()?.parse().ok())
}
