//! Rules on the files of an FMU: archive, description, binaries. Nothing is loaded.
//!
//! A [`Rule`] is one small function with its place in the FMI 2.0.5 text. [`rules`] lists all of them, [`check`]
//! applies them to a file. They read the raw archive and the raw XML, so that an FMU that cannot be opened gets all its
//! findings too.

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
mod subject;
mod values;
mod variables;
mod xml;

use std::path::Path;

use roxmltree::{Document, ParsingOptions};

use contents::Contents;
pub use contents::Unreadable;
use fmi2_import::description::{Finding, ModelDescription, Severity};
pub use subject::Rule;
use subject::Subject;

/// All rules, by subject.
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

/// The findings of all rules in a .fmu file, most severe first.
///
/// # Errors
/// The file cannot be opened or read.
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
        // the rules should explain every refusal; if none does, the refusal itself is the finding
        let message = format!("cannot use the description: {error}");
        findings.push(Finding { rule: "description-xml", severity: Severity::Error, message });
    }
    findings.sort_by_key(|finding| std::cmp::Reverse(finding.severity));
    Ok(findings)
}
