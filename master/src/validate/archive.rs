//! Rules on the archive (FMI 2.0.5, section 2.3).

use std::collections::HashMap;

use super::contents::Entry;
use super::{Subject, table};

table! {
    "archive-zip", "2.3", Error, "the file is a readable zip archive", zip;
    "archive-backslash", "2.3", Error, "names in the archive have forward slashes", backslash;
    "archive-escape", "2.3", Error, "no name leaves the folder: no \"..\", absolute name or drive", escape;
    "archive-dot", "2.3", Warning, "names in the archive do not begin with \"./\"", dot;
    "archive-link", "2.3", Error, "the archive holds no links", link;
    "archive-duplicate", "2.3", Error, "no name occurs twice, also not in upper and lower case", duplicate;
    "archive-compression", "2.3", Error, "files are stored or packed with Deflate", compression;
    "archive-ascii", "2.3", Note, "names in the archive are ASCII", ascii;
    "archive-control", "2.3", Error, "names in the archive have no control characters", control;
    "archive-top-level", "2.3", Note, "the top level holds what the standard names", top_level;
    "archive-refused", "2.3", Error, "the archive can be opened safely: sizes and names are sound", refused;
    "description-missing", "2.3", Error, "modelDescription.xml is at the top level", missing;
    "description-text", "2.2", Error, "modelDescription.xml is UTF-8", text;
    "description-doctype", "2.2", Error, "modelDescription.xml has no document type declaration", doctype;
    "description-xml", "2.2", Error, "modelDescription.xml is well-formed XML", well_formed;
    "documentation", "2.3", Note, "there is documentation/index.html", documentation;
}

fn names(subject: &Subject, check: impl Fn(&Entry) -> Option<String>) -> Vec<String> {
    let object = |entry| check(entry).map(|text| format!("entry \"{}\" {text}", entry.name));
    subject.contents.entries.iter().filter_map(object).collect()
}

fn zip(subject: &Subject) -> Vec<String> {
    subject.contents.damage.iter().cloned().collect()
}

fn backslash(subject: &Subject) -> Vec<String> {
    names(subject, |it| it.name.contains('\\').then(|| "has a backslash".to_owned()))
}

fn escape(subject: &Subject) -> Vec<String> {
    names(subject, |entry| {
        let name = entry.name.replace('\\', "/");
        let leaves =
            name.starts_with('/') || name.split('/').any(|part| part == ".." || part.contains(':'));
        leaves.then(|| "may be written outside of the unit's folder".to_owned())
    })
}

fn dot(subject: &Subject) -> Vec<String> {
    names(subject, |it| it.name.starts_with("./").then(|| "begins with \"./\"".to_owned()))
}

fn link(subject: &Subject) -> Vec<String> {
    names(subject, |entry| entry.link.then(|| "is a link".to_owned()))
}

fn duplicate(subject: &Subject) -> Vec<String> {
    let entries = &subject.contents.entries;
    let mut found = Vec::new();
    if let Some(declared) = subject.contents.declared_entries.filter(|&it| it != entries.len()) {
        let distinct = entries.len();
        found.push(format!("the archive has {declared} entries, but only {distinct} names"));
    }
    let mut seen: HashMap<String, &str> = HashMap::new();
    for entry in entries {
        let key = entry.name.replace('\\', "/").to_lowercase();
        if let Some(other) = seen.insert(key, &entry.name) {
            found.push(format!("entries \"{other}\" and \"{}\" are one file", entry.name));
        }
    }
    found
}

fn compression(subject: &Subject) -> Vec<String> {
    names(subject, |entry| {
        (!entry.common_compression).then(|| "is packed neither stored nor with Deflate".to_owned())
    })
}

fn ascii(subject: &Subject) -> Vec<String> {
    names(subject, |it| (!it.name.is_ascii()).then(|| "is not plain ASCII".to_owned()))
}

fn control(subject: &Subject) -> Vec<String> {
    names(subject, |entry| {
        entry.name.chars().any(char::is_control).then(|| "has a control character".to_owned())
    })
}

fn top_level(subject: &Subject) -> Vec<String> {
    const NAMED: &[&str] = &[
        "modelDescription.xml",
        "model.png",
        "documentation",
        "licenses",
        "sources",
        "binaries",
        "resources",
        "terminalsAndIcons",
        "extra",
    ];
    names(subject, |entry| {
        let name = entry.name.replace('\\', "/");
        let top = name.strip_prefix("./").unwrap_or(&name).split('/').next().unwrap_or_default();
        (!NAMED.contains(&top)).then(|| "is not of the standard; tools leave it alone".to_owned())
    })
}

fn refused(subject: &Subject) -> Vec<String> {
    // what has a rule of its own is not told twice
    let told = [zip, escape, link, duplicate, control, missing, text];
    if told.iter().any(|rule| !rule(subject).is_empty()) {
        return Vec::new();
    }
    subject.contents.refusal.iter().cloned().collect()
}

fn missing(subject: &Subject) -> Vec<String> {
    let contents = &subject.contents;
    if contents.damage.is_some() || contents.description.is_some() {
        return Vec::new();
    }
    let elsewhere = |entry: &&Entry| entry.name.ends_with("/modelDescription.xml");
    vec![match contents.entries.iter().find(elsewhere) {
        Some(entry) => format!(
            "there is no modelDescription.xml at the top level, only \"{}\": pack the folder's \
             contents, not the folder",
            entry.name
        ),
        None => "there is no modelDescription.xml".to_owned(),
    }]
}

fn text(subject: &Subject) -> Vec<String> {
    let bytes = subject.contents.description.as_deref().unwrap_or_default();
    let error = std::str::from_utf8(bytes).err();
    error.map(|error| format!("modelDescription.xml is not UTF-8: {error}")).into_iter().collect()
}

fn doctype(subject: &Subject) -> Vec<String> {
    match subject.malformed {
        Some(roxmltree::Error::DtdDetected) => vec![
            "a document type declaration can name files and addresses that a parser fetches, and \
             can blow up a few bytes to gigabytes"
                .to_owned(),
        ],
        _ => Vec::new(),
    }
}

fn well_formed(subject: &Subject) -> Vec<String> {
    let other = |error: &&roxmltree::Error| !matches!(error, roxmltree::Error::DtdDetected);
    subject.malformed.filter(other).map(ToString::to_string).into_iter().collect()
}

fn documentation(subject: &Subject) -> Vec<String> {
    let contents = &subject.contents;
    if contents.entries.is_empty() || contents.has("documentation/index.html") {
        return Vec::new();
    }
    vec!["there is no documentation/index.html".to_owned()]
}
