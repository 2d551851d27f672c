//! What the rules look at, and how they report what they find.

use roxmltree::{Document, Node};

use super::contents::Contents;
use super::schema::Reading;
use fmi2_import::description::{ModelDescription, Severity, Variable};
use fmi2_import::xml::Plain as _;

/// One check.
pub struct Rule {
    /// Name in findings and in the table of rules, such as `alias-start`.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// How grave a violation is.
    pub severity: Severity,
    /// What the rule demands, one line of the table of rules.
    pub demand: &'static str,
    /// One message per violation.
    pub(super) check: fn(&Subject) -> Vec<String>,
}

/// What the rules look at.
pub(super) struct Subject<'a> {
    /// The raw archive: also entries that cannot be unpacked.
    pub(super) contents: &'a Contents,
    /// modelDescription.xml, if it is well-formed XML without a DTD.
    pub(super) document: Option<&'a Document<'a>>,
    /// Why it is not.
    pub(super) malformed: Option<&'a roxmltree::Error>,
    /// What the description says, if it is complete enough to be used.
    pub(super) description: Option<&'a ModelDescription>,
    /// What the schema has to say, and the elements that it knows.
    pub(super) reading: Reading<'a>,
}

impl<'a> Subject<'a> {
    /// All elements of that name that belong to the description.
    pub(super) fn elements(&self, name: &str) -> impl Iterator<Item = Node<'a, 'a>> + use<'a, '_> {
        self.reading.elements(name).iter().copied()
    }

    /// Line of an element in modelDescription.xml.
    pub(super) fn line(&self, node: Node) -> u32 {
        self.document.map_or(0, |document| document.text_pos_at(node.range().start).row)
    }

    /// A message about an element: its line, its name and what is wrong.
    pub(super) fn about(&self, node: Node, text: &str) -> String {
        let name = node.attr("name").map(|name| format!(" \"{name}\"")).unwrap_or_default();
        format!("line {}: <{}>{name} {text}", self.line(node), node.tag_name().name())
    }

    /// Messages on the elements of a name that a check objects to, unless the schema does.
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

    /// The variables, each with its index from 1, which the schema does not object to.
    pub(super) fn variables(&self) -> impl Iterator<Item = (usize, &'a Variable)> {
        let described = self.description.into_iter().flat_map(|it| &it.variables).enumerate();
        described
            .map(|(position, variable)| (position + 1, variable))
            .filter(|(index, _)| !self.is_broken(*index))
    }

    /// Whether the schema objects to the variable of an index from 1: what a reader made of it is
    /// a guess.
    pub(super) fn is_broken(&self, index: usize) -> bool {
        self.variable_node(index).is_some_and(|node| self.reading.breaks(node))
    }

    /// The element of the variable of an index from 1.
    pub(super) fn variable_node(&self, index: usize) -> Option<Node<'a, 'a>> {
        self.reading.elements("ScalarVariable").get(index.checked_sub(1)?).copied()
    }

    /// Messages on the variables that a check objects to.
    pub(super) fn each_variable(&self, check: impl Fn(&Variable) -> Option<String>) -> Vec<String> {
        self.variables()
            .filter_map(|(_, variable)| {
                check(variable).map(|text| format!("variable \"{}\" {text}", variable.name))
            })
            .collect()
    }
}

/// A table of rules.
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

/// The first names of a list in quotes, and how many more there are.
pub(super) fn several<T: std::fmt::Display>(names: &[T]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("\"{name}\"")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A word in singular or plural with its number: "1 file", "3 files".
pub(super) fn counted(count: usize, word: &str) -> String {
    format!("{count} {word}{}", if count == 1 { "" } else { "s" })
}

/// The items that occur more than once, each once.
pub(super) fn doubled<T: Eq + std::hash::Hash + Clone>(items: impl Iterator<Item = T>) -> Vec<T> {
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
