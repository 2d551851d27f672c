//! Static checks of a unit: what its archive, description and binaries say, without running it.
//!
//! A [`Rule`] is one small named check with its place in the FMI 2.0.5 text. [`rules`] lists all
//! of them, [`check`] applies them to a file. They look at the raw archive and the raw XML, so that
//! also a unit that cannot be opened is told everything that is wrong with it.

mod archive;
mod binaries;
mod capabilities;
mod contents;
mod identity;
mod names;
mod quantities;
mod schema;
mod structure;
mod values;
mod variables;

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

use crate::description::{Description, Finding, Severity, Variable};
pub use contents::{Contents, Unreadable};

/// One check.
pub struct Rule {
    /// Its name.
    pub id: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// How grave a violation is.
    pub severity: Severity,
    /// What it demands.
    pub demand: &'static str,
    /// One message per violation.
    pub check: fn(&Subject) -> Vec<String>,
}

/// What the rules look at.
pub struct Subject<'a> {
    /// The archive.
    pub contents: &'a Contents,
    /// modelDescription.xml, if it is well-formed XML without a DTD.
    pub document: Option<&'a Document<'a>>,
    /// Why it is not.
    pub malformed: Option<&'a roxmltree::Error>,
    /// What the description says, if it is complete enough to be used.
    pub description: Option<&'a Description>,
    /// Violations of the schema.
    violations: Vec<schema::Violation>,
}

impl<'a> Subject<'a> {
    /// All elements of that name.
    fn elements(&self, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> + use<'a> {
        self.document
            .into_iter()
            .flat_map(|document| document.descendants())
            .filter(move |node| node.has_tag_name(name))
    }

    /// Line of an element in modelDescription.xml.
    fn line(&self, node: Node) -> u32 {
        self.document.map_or(0, |document| document.text_pos_at(node.range().start).row)
    }

    /// A message about an element: its line, its name and what is wrong.
    fn about(&self, node: Node, text: &str) -> String {
        let name = node.attribute("name").map(|name| format!(" \"{name}\"")).unwrap_or_default();
        format!("line {}: <{}>{name} {text}", self.line(node), node.tag_name().name())
    }

    /// Messages on the elements of a name that a check objects to.
    fn each_element(
        &self,
        name: &'static str,
        check: impl Fn(Node<'a, 'a>) -> Option<String>,
    ) -> Vec<String> {
        self.elements(name)
            .filter_map(|node| check(node).map(|text| self.about(node, &text)))
            .collect()
    }

    /// Messages on the variables that a check objects to.
    fn each_variable(&self, check: impl Fn(&Variable) -> Option<String>) -> Vec<String> {
        self.description
            .iter()
            .flat_map(|description| &description.variables)
            .filter_map(|variable| check(variable).map(|text| format!("{}: {text}", variable.name)))
            .collect()
    }
}

/// A table of rules.
macro_rules! table {
    ($($id:literal, $section:literal, $severity:ident, $demand:literal, $check:expr;)*) => {
        pub(super) const RULES: &[$crate::validate::Rule] = &[$($crate::validate::Rule {
            id: $id,
            section: $section,
            severity: $crate::description::Severity::$severity,
            demand: $demand,
            check: $check,
        }),*];
    };
}
use table;

/// All rules, in the order of their subjects.
pub fn rules() -> impl Iterator<Item = &'static Rule> {
    [
        archive::RULES,
        binaries::RULES,
        schema::RULES,
        identity::RULES,
        capabilities::RULES,
        quantities::RULES,
        names::RULES,
        variables::RULES,
        values::RULES,
        structure::RULES,
    ]
    .into_iter()
    .flatten()
}

/// Everything found wrong with a .fmu file, gravest first.
///
/// # Errors
/// The file cannot be read at all.
pub fn check(path: &Path) -> Result<Vec<Finding>, Unreadable> {
    let contents = Contents::read(path)?;
    let text = contents.description.as_deref().and_then(|bytes| std::str::from_utf8(bytes).ok());
    let text = text.map(|text| text.strip_prefix('\u{feff}').unwrap_or(text));
    let options = ParsingOptions { allow_dtd: false, ..ParsingOptions::default() };
    let parsed = text.map(|text| Document::parse_with_options(text, options));
    let description = text.and_then(|text| Description::parse(text).ok());
    let document = parsed.as_ref().and_then(|parsed| parsed.as_ref().ok());
    let subject = Subject {
        contents: &contents,
        document,
        malformed: parsed.as_ref().and_then(|parsed| parsed.as_ref().err()),
        description: description.as_ref(),
        violations: document.map(schema::violations).unwrap_or_default(),
    };
    let mut findings: Vec<Finding> = rules()
        .flat_map(|rule| {
            let message = |message| Finding { rule: rule.id, severity: rule.severity, message };
            (rule.check)(&subject).into_iter().map(message)
        })
        .collect();
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok(findings)
}

/// The items that occur more than once, each once.
fn doubled<T: Eq + std::hash::Hash + Clone>(items: impl Iterator<Item = T>) -> Vec<T> {
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
