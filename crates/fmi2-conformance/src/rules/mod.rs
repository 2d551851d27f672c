//! Static checks of a unit: what its archive, description and binaries say, without running it.
//!
//! A [`Rule`] is one small named check with its place in the FMI 2.0.5 text. [`rules`] lists all
//! of them, [`check`] applies them to a file. They look at the raw archive and the raw XML, so that
//! also a unit that cannot be opened is told everything that is wrong with it.

mod aliases;
mod archive;
mod binaries;
mod capabilities;
mod contents;
mod directory;
mod identity;
mod images;
mod kit;
mod names;
mod quantities;
mod schema;
mod structure;
mod values;
mod variables;
mod xml;

use std::path::Path;

use roxmltree::{Document, Node, ParsingOptions};

pub use contents::{Contents, Unreadable};
use fmi2_import::description::{Finding, ModelDescription, Severity, Variable};
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
    pub check: fn(&Subject) -> Vec<String>,
}

/// What the rules look at.
pub struct Subject<'a> {
    /// The raw archive: also entries that cannot be unpacked.
    pub contents: &'a Contents,
    /// modelDescription.xml, if it is well-formed XML without a DTD.
    pub document: Option<&'a Document<'a>>,
    /// Why it is not.
    pub malformed: Option<&'a roxmltree::Error>,
    /// What the description says, if it is complete enough to be used.
    pub description: Option<&'a ModelDescription>,
    /// What the schema has to say, and the elements that it knows.
    reading: schema::Reading<'a>,
}

impl<'a> Subject<'a> {
    /// All elements of that name that belong to the description.
    fn elements(&self, name: &str) -> impl Iterator<Item = Node<'a, 'a>> + use<'a, '_> {
        self.reading.elements(name).iter().copied()
    }

    /// Line of an element in modelDescription.xml.
    fn line(&self, node: Node) -> u32 {
        self.document.map_or(0, |document| document.text_pos_at(node.range().start).row)
    }

    /// A message about an element: its line, its name and what is wrong.
    fn about(&self, node: Node, text: &str) -> String {
        let name = node.attr("name").map(|name| format!(" \"{name}\"")).unwrap_or_default();
        format!("line {}: <{}>{name} {text}", self.line(node), node.tag_name().name())
    }

    /// Messages on the elements of a name that a check objects to, unless the schema does.
    fn each_element(
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
    fn variables(&self) -> impl Iterator<Item = (usize, &'a Variable)> {
        let described = self.description.into_iter().flat_map(|it| &it.variables).enumerate();
        described
            .map(|(position, variable)| (position + 1, variable))
            .filter(|(index, _)| !self.is_broken(*index))
    }

    /// Whether the schema objects to the variable of an index from 1: what a reader made of it is
    /// a guess.
    fn is_broken(&self, index: usize) -> bool {
        self.variable_node(index).is_some_and(|node| self.reading.breaks(node))
    }

    /// The element of the variable of an index from 1.
    fn variable_node(&self, index: usize) -> Option<Node<'a, 'a>> {
        self.reading.elements("ScalarVariable").get(index.checked_sub(1)?).copied()
    }

    /// Messages on the variables that a check objects to.
    fn each_variable(&self, check: impl Fn(&Variable) -> Option<String>) -> Vec<String> {
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
        pub(super) const RULES: &[$crate::rules::Rule] = &[$($crate::rules::Rule {
            id: $id,
            section: $section,
            severity: fmi2_import::description::Severity::$severity,
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
        xml::RULES,
        binaries::RULES,
        schema::RULES,
        identity::RULES,
        kit::RULES,
        capabilities::RULES,
        quantities::RULES,
        names::RULES,
        variables::RULES,
        aliases::RULES,
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
    let text = contents.text();
    let options = ParsingOptions {
        allow_dtd: false,
        nodes_limit: fmi2_import::description::MAX_NODES,
        ..ParsingOptions::default()
    };
    let parsed = text.map(|text| Document::parse_with_options(text, options));
    let described = text.map(ModelDescription::parse);
    let document = parsed.as_ref().and_then(|parsed| parsed.as_ref().ok());
    let subject = Subject {
        contents: &contents,
        document,
        malformed: parsed.as_ref().and_then(|parsed| parsed.as_ref().err()),
        description: described.as_ref().and_then(|described| described.as_ref().ok()),
        reading: document.map(schema::read).unwrap_or_default(),
    };
    let mut findings: Vec<Finding> = rules()
        .flat_map(|rule| {
            let message = |message| Finding { rule: rule.id, severity: rule.severity, message };
            (rule.check)(&subject).into_iter().map(message)
        })
        .collect();
    let errors = findings.iter().any(|finding| finding.severity == Severity::Error);
    if let Some(Err(error)) = described.filter(|_| !errors) {
        // the rules are meant to explain every refusal; if they do not, the refusal itself counts
        let message = format!("the description cannot be used: {error}");
        findings.push(Finding { rule: "description-xml", severity: Severity::Error, message });
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok(findings)
}

/// The first names of a list in quotes, and how many more there are.
fn several<T: std::fmt::Display>(names: &[T]) -> String {
    const SHOWN: usize = 5;
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("\"{name}\"")).collect();
    match names.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// A word in singular or plural with its number: "1 file", "3 files".
fn counted(count: usize, word: &str) -> String {
    format!("{count} {word}{}", if count == 1 { "" } else { "s" })
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
