//! The input of the rules, and helpers for their messages.

use roxmltree::{Document, Node};

use super::contents::Contents;
use super::schema::Reading;
use fmi2_import::description::{ModelDescription, Severity, Variable};
use fmi2_import::xml::Plain as _;

/// A rule on the files of an FMU.
pub struct Rule {
    /// Name in findings and in the table of rules, such as `alias-start`.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// Severity of a violation.
    pub severity: Severity,
    /// The demand, one line of the table of rules.
    pub demand: &'static str,
    /// One message per violation.
    pub(super) check: fn(&Subject) -> Vec<String>,
}

/// A .fmu file as the rules see it.
pub(super) struct Subject<'a> {
    /// The raw archive, with entries that cannot be unpacked.
    pub(super) contents: &'a Contents,
    /// modelDescription.xml, if it is well-formed XML without a DTD.
    pub(super) document: Option<&'a Document<'a>>,
    /// Why there is no document.
    pub(super) malformed: Option<&'a roxmltree::Error>,
    /// The parsed description, if it is complete enough.
    pub(super) description: Option<&'a ModelDescription>,
    /// Violations of the schema, and the elements that it knows.
    pub(super) reading: Reading<'a>,
}

impl<'a> Subject<'a> {
    /// The elements of a name that belong to the description.
    pub(super) fn elements(&self, name: &str) -> impl Iterator<Item = Node<'a, 'a>> + use<'a, '_> {
        self.reading.elements(name).iter().copied()
    }

    /// Line of an element in modelDescription.xml.
    pub(super) fn line(&self, node: Node) -> u32 {
        self.document.map_or(0, |document| document.text_pos_at(node.range().start).row)
    }

    /// A message about an element, with line and name.
    pub(super) fn about(&self, node: Node, text: &str) -> String {
        let name = node.attr("name").map(|name| format!(" \"{name}\"")).unwrap_or_default();
        format!("line {}: <{}>{name} {text}", self.line(node), node.tag_name().name())
    }

    /// Messages for the elements of a name for which a check returns a text. Elements that violate the schema are left
    /// out.
    pub(super) fn each_element(
        &self,
        name: &str,
        check: impl Fn(Node<'a, 'a>) -> Option<String>,
    ) -> Vec<String> {
        self.elements(name)
            .filter(|node| !self.reading.breaks(*node))
            .filter_map(|node| check(node).map(|text| self.about(node, &text)))
            .collect()
    }

    /// The variables with their indices from 1, without those that violate the schema.
    pub(super) fn variables(&self) -> impl Iterator<Item = (usize, &'a Variable)> {
        let described = self.description.into_iter().flat_map(|it| &it.variables).enumerate();
        described
            .map(|(position, variable)| (position + 1, variable))
            .filter(|(index, _)| !self.is_broken(*index))
    }

    /// Whether the variable of an index from 1 violates the schema. Its parsed form is then a guess.
    pub(super) fn is_broken(&self, index: usize) -> bool {
        self.variable_node(index).is_some_and(|node| self.reading.breaks(node))
    }

    /// The element of the variable of an index from 1.
    pub(super) fn variable_node(&self, index: usize) -> Option<Node<'a, 'a>> {
        self.reading.elements("ScalarVariable").get(index.checked_sub(1)?).copied()
    }

    /// Messages for the variables for which a check returns a text.
    pub(super) fn each_variable(&self, check: impl Fn(&Variable) -> Option<String>) -> Vec<String> {
        self.variables()
            .filter_map(|(_, variable)| {
                check(variable).map(|text| format!("variable \"{}\" {text}", variable.name))
            })
            .collect()
    }
}

/// Declares the rules of a file as `RULES`.
macro_rules! table {
    ($($id:literal, $section:literal, $severity:ident, $demand:literal, $check:expr;)*) => {
        pub(super) const RULES: &[$crate::rules::subject::Rule] = &[$($crate::rules::subject::Rule {
            id: $id,
            section: $section,
            severity: fmi2_import::description::Severity::$severity,
            demand: $demand,
            check: $check,
        }),*];
    };
}
pub(super) use table;

/// The first names of a list in quotes, and the number of others.
pub(super) fn several<T: std::fmt::Display>(names: &[T]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("\"{name}\"")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A number with its word in singular or plural: "1 file", "3 files".
pub(super) fn counted(count: usize, word: &str) -> String {
    format!("{count} {word}{}", if count == 1 { "" } else { "s" })
}

/// The items that occur more than once, each once.
pub(super) fn duplicates<T: Eq + std::hash::Hash + Clone>(
    items: impl Iterator<Item = T>,
) -> Vec<T> {
    let mut seen = std::collections::HashMap::new();
    let mut twice = Vec::new();
    for item in items {
        let count = seen.entry(item.clone()).or_insert(0_u32);
        *count += 1;
        if *count == 2 {
            twice.push(item);
        }
    }
    twice
}
