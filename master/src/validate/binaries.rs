//! Rules on the binaries and sources (FMI 2.0.5, sections 2.1.1 and 2.3).

use std::collections::BTreeSet;

use object::{Architecture, BinaryFormat, Object as _};

use super::{Subject, doubled, table};
use crate::library::missing_symbols;
use crate::package::PLATFORM;

table! {
    "code-missing", "2.3", Error, "the archive holds a binary, or sources", code;
    "platform", "2.3", Warning, "there is a binary for this system", platform;
    "binary-name", "2.3", Error, "binaries are named by the modelIdentifier, without lib", name;
    "binary-folder", "2.3", Warning, "folders of binaries are named as the standard does", folder;
    "binary-format", "2.3", Error, "binaries fit the platform of their folder", format;
    "symbols", "2.1.1", Error, "binaries export all functions of FMI 2.0 for co-simulation", symbols;
    "sources", "2.3", Error, "every file in SourceFiles is in the archive, and is named once", sources;
}

/// Folder, ending, format and architecture of binaries.
type Platform = (&'static str, &'static str, BinaryFormat, Architecture);

/// What the standard names.
const PLATFORMS: &[Platform] = &[
    ("linux64", "so", BinaryFormat::Elf, Architecture::X86_64),
    ("linux32", "so", BinaryFormat::Elf, Architecture::I386),
    ("win64", "dll", BinaryFormat::Pe, Architecture::X86_64),
    ("win32", "dll", BinaryFormat::Pe, Architecture::I386),
    ("darwin64", "dylib", BinaryFormat::MachO, Architecture::X86_64),
];

/// Folder, name and bytes of each file directly in a folder of `binaries`.
fn libraries<'a>(subject: &Subject<'a>) -> impl Iterator<Item = (&'a str, &'a str, &'a [u8])> {
    subject.contents.binaries.iter().filter_map(|(path, bytes)| {
        let (folder, name) = path.strip_prefix("binaries/")?.split_once('/')?;
        (!name.contains('/')).then_some((folder, name, bytes.as_slice()))
    })
}

fn identifier<'a>(subject: &Subject<'a>) -> Option<&'a str> {
    subject.elements("CoSimulation").next()?.attribute("modelIdentifier")
}

/// The unit's own library in each known folder.
fn own<'a>(subject: &Subject<'a>) -> Vec<(&'static Platform, &'a [u8])> {
    let Some(identifier) = identifier(subject) else { return Vec::new() };
    libraries(subject)
        .filter_map(|(folder, name, bytes)| {
            let platform = PLATFORMS.iter().find(|platform| platform.0 == folder)?;
            (name == format!("{identifier}.{}", platform.1)).then_some((platform, bytes))
        })
        .collect()
}

fn has_sources(subject: &Subject) -> bool {
    subject.contents.entries.iter().any(|entry| entry.name.starts_with("sources/"))
}

fn code(subject: &Subject) -> Vec<String> {
    let empty = subject.contents.binaries.is_empty() && !has_sources(subject);
    if empty && subject.contents.damage.is_none() {
        vec!["there is neither a binary nor a source".to_owned()]
    } else {
        Vec::new()
    }
}

fn platform(subject: &Subject) -> Vec<String> {
    if subject.document.is_none() || own(subject).iter().any(|(it, _)| it.0 == PLATFORM) {
        return Vec::new();
    }
    let folders: BTreeSet<&str> = libraries(subject).map(|(folder, ..)| folder).collect();
    let has = folders.into_iter().collect::<Vec<_>>().join(", ");
    let has = if has.is_empty() { "nothing" } else { &has };
    vec![format!("there is no binary for {PLATFORM}; there are binaries for: {has}")]
}

fn name(subject: &Subject) -> Vec<String> {
    let Some(identifier) = identifier(subject) else { return Vec::new() };
    let own = own(subject);
    PLATFORMS
        .iter()
        .filter(|platform| own.iter().all(|(it, _)| it.0 != platform.0))
        .filter_map(|(folder, ending, ..)| {
            let other = libraries(subject).find(|(it, ..)| it == folder)?.1;
            Some(format!("binaries/{folder} has no {identifier}.{ending}, but {other}"))
        })
        .collect()
}

fn folder(subject: &Subject) -> Vec<String> {
    let folders: BTreeSet<&str> = libraries(subject).map(|(folder, ..)| folder).collect();
    folders
        .into_iter()
        .filter(|folder| PLATFORMS.iter().all(|platform| platform.0 != *folder))
        .map(|folder| format!("binaries/{folder} is no platform of FMI 2.0"))
        .collect()
}

fn format(subject: &Subject) -> Vec<String> {
    let wrong = |&((folder, ending, format, architecture), bytes): &(&Platform, &[u8])| {
        let place = format!("the .{ending} in binaries/{folder}");
        match object::File::parse(bytes) {
            Err(error) => Some(format!("{place} is no binary: {error}")),
            Ok(file) if file.format() != *format || file.architecture() != *architecture => {
                let (is, of) = (file.format(), file.architecture());
                Some(format!("{place} is {is:?} for {of:?}, not {format:?} for {architecture:?}"))
            }
            Ok(_) => None,
        }
    };
    own(subject).iter().filter_map(wrong).collect()
}

fn symbols(subject: &Subject) -> Vec<String> {
    let mut found = Vec::new();
    for (platform, bytes) in own(subject) {
        let missing = missing_symbols(bytes).unwrap_or_default();
        let folder = platform.0;
        found.extend(missing.into_iter().map(|it| format!("the binary for {folder} lacks {it}")));
    }
    found
}

fn sources(subject: &Subject) -> Vec<String> {
    let lists = || subject.elements("SourceFiles");
    let mut found = Vec::new();
    for list in lists() {
        let names = || list.children().filter_map(|file| file.attribute("name"));
        for name in names().filter(|name| !subject.contents.has(&format!("sources/{name}"))) {
            found.push(subject.about(list, &format!("names \"{name}\", which is not in sources/")));
        }
        for name in doubled(names()) {
            found.push(subject.about(list, &format!("names \"{name}\" twice")));
        }
    }
    found
}
