//! Rules on the binaries and sources (FMI 2.0.5, sections 2.1.1 and 2.3).

use std::collections::{BTreeSet, HashSet};

use object::{Architecture, BinaryFormat, Object as _};

use super::directory::ZipEntry;
use super::images::{images, missing_symbols};
use super::subject::{Subject, counted, duplicates, several, table};
use fmi2_import::package::PLATFORM;
use fmi2_import::xml::Plain as _;

table! {
    "code-missing", "2.3", Error, "the archive contains a binary or sources", code;
    "platform", "2.3", Warning, "there is a binary for this platform", platform;
    "binary-name", "2.3", Error, "binaries are named after the modelIdentifier, without a prefix lib", name;
    "binary-folder", "2.3", Note, "folders of binaries have names of the standard", folder;
    "binary-format", "2.3", Error, "binaries are for the platform of their folder", format;
    "symbols", "2.1.1", Error, "binaries export all functions of FMI 2.0 for co-simulation", symbols;
    "sources", "2.3", Error, "every file in SourceFiles is in the archive and is listed once", sources;
}

/// Folder, ending, format and architecture of binaries.
type Platform = (&'static str, &'static str, BinaryFormat, Architecture);

/// The platforms of the standard: its own names for x86, and the platform tuples of FMI 3.0.
const PLATFORMS: &[Platform] = &[
    ("linux64", "so", BinaryFormat::Elf, Architecture::X86_64),
    ("linux32", "so", BinaryFormat::Elf, Architecture::I386),
    ("win64", "dll", BinaryFormat::Pe, Architecture::X86_64),
    ("win32", "dll", BinaryFormat::Pe, Architecture::I386),
    ("darwin64", "dylib", BinaryFormat::MachO, Architecture::X86_64),
    ("darwin32", "dylib", BinaryFormat::MachO, Architecture::I386),
    ("aarch64-linux", "so", BinaryFormat::Elf, Architecture::Aarch64),
    ("aarch32-linux", "so", BinaryFormat::Elf, Architecture::Arm),
    ("x86_64-linux", "so", BinaryFormat::Elf, Architecture::X86_64),
    ("x86-linux", "so", BinaryFormat::Elf, Architecture::I386),
    ("aarch64-windows", "dll", BinaryFormat::Pe, Architecture::Aarch64),
    ("aarch32-windows", "dll", BinaryFormat::Pe, Architecture::Arm),
    ("x86_64-windows", "dll", BinaryFormat::Pe, Architecture::X86_64),
    ("x86-windows", "dll", BinaryFormat::Pe, Architecture::I386),
    ("aarch64-darwin", "dylib", BinaryFormat::MachO, Architecture::Aarch64),
    ("x86_64-darwin", "dylib", BinaryFormat::MachO, Architecture::X86_64),
    ("x86-darwin", "dylib", BinaryFormat::MachO, Architecture::I386),
];

/// Endings of libraries, to load or to link.
const LIBRARIES: &[&str] = &["so", "dll", "dylib", "a", "lib"];

fn ending(name: &str) -> &str {
    name.rsplit_once('.').map_or("", |(_, ending)| ending)
}

/// Paths of all files in a folder.
fn paths<'a>(subject: &Subject<'a>, folder: &str) -> impl Iterator<Item = String> {
    let entries = subject.contents.directory.entries.iter();
    entries
        .filter(|entry| !entry.is_folder())
        .map(ZipEntry::path)
        .filter(move |path| path.starts_with(folder))
}

/// Folder and name of each file directly in a folder of `binaries`.
fn files(subject: &Subject) -> Vec<(String, String)> {
    paths(subject, "binaries/")
        .filter_map(|path| {
            let (folder, name) = path.strip_prefix("binaries/")?.split_once('/')?;
            (!name.contains('/')).then(|| (folder.to_owned(), name.to_owned()))
        })
        .collect()
}

fn identifier<'a>(subject: &Subject<'a>) -> Option<&'a str> {
    subject.elements("CoSimulation").next()?.attr("modelIdentifier")
}

/// The unit's own library in each known folder, as far as it can be unpacked.
fn own<'a>(subject: &Subject<'a>) -> Vec<(&'static Platform, &'a [u8])> {
    let Some(identifier) = identifier(subject) else { return Vec::new() };
    let bytes = |platform: &'static Platform| {
        let path = format!("binaries/{}/{identifier}.{}", platform.0, platform.1);
        let found = subject.contents.binaries.iter().find(|(name, _)| *name == path);
        found.map(|(_, bytes)| (platform, bytes.as_slice()))
    };
    PLATFORMS.iter().filter_map(bytes).collect()
}

/// Whether there is any code: a library, or a file in `sources`.
fn has_code(subject: &Subject) -> bool {
    paths(subject, "binaries/").any(|path| LIBRARIES.contains(&ending(&path)))
        || paths(subject, "sources/").next().is_some()
}

fn code(subject: &Subject) -> Vec<String> {
    if has_code(subject) || subject.contents.damage.is_some() {
        return Vec::new();
    }
    vec!["there is neither a binary nor a source file".to_owned()]
}

fn platform(subject: &Subject) -> Vec<String> {
    let files = files(subject);
    let here = files.iter().any(|(folder, name)| {
        // a wrong file name is a finding of `binary-name`
        folder == PLATFORM && LIBRARIES.contains(&ending(name))
    });
    if identifier(subject).is_none() || here || !has_code(subject) {
        return Vec::new();
    }
    let folders: BTreeSet<&str> = files.iter().map(|(folder, _)| folder.as_str()).collect();
    let has = if folders.is_empty() {
        "there is source code only".to_owned()
    } else {
        format!("there are binaries for: {}", folders.into_iter().collect::<Vec<_>>().join(", "))
    };
    vec![format!("there is no binary for {PLATFORM}; {has}")]
}

fn name(subject: &Subject) -> Vec<String> {
    let Some(identifier) = identifier(subject) else { return Vec::new() };
    let files = files(subject);
    PLATFORMS
        .iter()
        .filter_map(|(folder, ending, ..)| {
            let own = format!("{identifier}.{ending}");
            let here = files.iter().filter(|(it, _)| it == folder);
            let names: Vec<&str> = here.map(|(_, name)| name.as_str()).collect();
            (!names.is_empty() && !names.contains(&own.as_str())).then(|| {
                format!(
                    "binaries/{folder} has no \"{own}\", which the modelIdentifier demands, but {}",
                    several(&names)
                )
            })
        })
        .collect()
}

fn folder(subject: &Subject) -> Vec<String> {
    let folders: BTreeSet<String> = files(subject).into_iter().map(|(folder, _)| folder).collect();
    folders
        .into_iter()
        .filter(|folder| PLATFORMS.iter().all(|platform| platform.0 != folder))
        .map(|folder| format!("binaries/{folder} is not a platform of the standard"))
        .collect()
}

fn format(subject: &Subject) -> Vec<String> {
    let wrong = |&((folder, ending, format, architecture), bytes): &(&Platform, &[u8])| {
        let place = format!("the .{ending} in binaries/{folder}");
        let images = match images(bytes) {
            Err(error) => return Some(format!("{place} is not a binary: {error}")),
            Ok(images) => images,
        };
        let is = |file: &object::File| (file.format(), file.architecture());
        if images.iter().any(|file| is(file) == (*format, *architecture)) {
            return None;
        }
        let found: Vec<String> = images
            .iter()
            .map(|file| format!("{:?} for {:?}", file.format(), file.architecture()))
            .collect();
        Some(format!(
            "{place} is {}, but must be {format:?} for {architecture:?}",
            found.join(" and ")
        ))
    };
    own(subject).iter().filter_map(wrong).collect()
}

fn symbols(subject: &Subject) -> Vec<String> {
    let lacks = |(platform, bytes): (&Platform, &[u8])| {
        let missing = missing_symbols(bytes).unwrap_or_default();
        let count = counted(missing.len(), "function");
        let (folder, names) = (platform.0, several(&missing));
        (!missing.is_empty())
            .then(|| format!("the binary for {folder} does not export {count}: {names}"))
    };
    own(subject).into_iter().filter_map(lacks).collect()
}

/// A path relative to `sources` without `.` and `..`; nothing if it leaves the folder.
fn resolved(name: &str) -> Option<String> {
    let mut parts = Vec::new();
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()?),
            part => parts.push(part),
        }
    }
    (!name.starts_with('/')).then(|| parts.join("/"))
}

fn sources(subject: &Subject) -> Vec<String> {
    let mut found = Vec::new();
    for list in subject.elements("SourceFiles") {
        let files = || list.children().filter(|file| file.is("File"));
        let names = || files().filter_map(|file| file.attr("name"));
        let there = |name: &str| {
            let path = resolved(name)?;
            subject.contents.has(&format!("sources/{path}")).then_some(())
        };
        let mut lost: Vec<&str> = names().filter(|name| there(name).is_none()).collect();
        let mut seen = HashSet::new();
        lost.retain(|name| seen.insert(*name));
        if !lost.is_empty() {
            let count = counted(lost.len(), "file");
            let folder = subject.contents.has_folder("sources");
            let why = if folder { "not in sources/" } else { "missing: there is no sources/" };
            let verb = if lost.len() == 1 { "is" } else { "are" };
            let text = format!("names {count} that {verb} {why}: {}", several(&lost));
            found.push(subject.about(list, &text));
        }
        for name in
            duplicates(names().map(|name| resolved(name).unwrap_or_else(|| name.to_owned())))
        {
            found.push(subject.about(list, &format!("names \"{name}\" more than once")));
        }
    }
    found
}
