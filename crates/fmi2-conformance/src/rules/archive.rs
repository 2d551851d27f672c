//! Rules on the archive (FMI 2.0.5, section 2.3).

use std::collections::HashMap;

use super::directory::ZipEntry;
use super::subject::{Subject, duplicates, table};
use fmi2_import::archive::ArchiveError;

table! {
    "archive-zip", "2.3", Error, "the file is a readable zip archive", zip;
    "archive-extension", "2.3", Error, "the file's name ends in .fmu", extension;
    "archive-split", "2.3", Error, "the archive is one file", split;
    "archive-version", "2.3", Error, "unpacking needs at most version 2.0 of the zip format", version;
    "archive-compression", "2.3", Error, "files are stored or packed with Deflate", compression;
    "archive-descriptor", "2.3", Error, "stored files have no data descriptor: their sizes come before them", descriptor;
    "archive-encrypted", "2.3", Error, "no entry is encrypted", encrypted;
    "archive-damaged", "2.3", Error, "every file can be unpacked and has the right checksum", damaged;
    "archive-link", "2.3", Error, "the archive contains no symbolic links", link;
    "archive-backslash", "2.3", Error, "names in the archive use forward slashes", backslash;
    "archive-escape", "2.3", Error, "no name leads out of the folder: no \"..\", absolute path or drive", escape;
    "archive-control", "2.3", Error, "names in the archive have no control characters", control;
    "archive-duplicate", "2.3", Error, "no name occurs twice", duplicate;
    "archive-case", "2.3", Warning, "names do not differ only in upper and lower case", case;
    "archive-dot", "2.3", Warning, "names in the archive do not start with \"./\"", dot;
    "archive-ascii", "2.3", Note, "names in the archive are ASCII", ascii;
    "archive-top-level", "2.3", Note, "the top level contains only names of the standard", top_level;
    "archive-refused", "2.3", Error, "the sizes in the archive are within the limits of this importer", refused;
    "description-missing", "2.3", Error, "there is a modelDescription.xml at the top level", missing;
    "icon", "2.3", Warning, "model.png is a PNG image", icon;
    "documentation", "2.3", Note, "there is documentation/index.html", documentation;
}

fn entries<'a>(subject: &Subject<'a>) -> &'a [ZipEntry] {
    &subject.contents.directory.entries
}

fn each_entry(subject: &Subject, check: impl Fn(&ZipEntry) -> Option<&'static str>) -> Vec<String> {
    let object = |entry| check(entry).map(|text| format!("entry \"{}\" {text}", entry.name));
    entries(subject).iter().filter_map(object).collect()
}

fn zip(subject: &Subject) -> Vec<String> {
    // a split archive is a finding of `archive-split`
    if subject.contents.directory.split {
        return Vec::new();
    }
    subject.contents.damage.iter().cloned().collect()
}

fn extension(subject: &Subject) -> Vec<String> {
    let name = &subject.contents.file_name;
    if name.to_lowercase().ends_with(".fmu") {
        return Vec::new();
    }
    vec![format!("\"{name}\" does not end in .fmu")]
}

fn split(subject: &Subject) -> Vec<String> {
    let split = subject.contents.directory.split;
    if split { vec!["the archive is split over several files".to_owned()] } else { Vec::new() }
}

fn version(subject: &Subject) -> Vec<String> {
    let higher = |entry: &&ZipEntry| entry.version > 20;
    let mut found = entries(subject).iter().filter(higher);
    let Some(ZipEntry { name, version, .. }) = found.next() else { return Vec::new() };
    let more = match found.count() {
        0 => String::new(),
        more => format!(", and {more} more"),
    };
    let (major, minor) = (version / 10, version % 10);
    vec![format!("entry \"{name}\" needs version {major}.{minor} to unpack{more}")]
}

fn compression(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let common = matches!(entry.method, 0 | 8);
        (!common && !entry.encrypted).then_some("is neither stored nor packed with Deflate")
    })
}

fn descriptor(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let odd = entry.descriptor && entry.method != 8 && !entry.encrypted;
        odd.then_some(
            "is stored with a data descriptor (general purpose bit 3), which is for Deflate only",
        )
    })
}

fn encrypted(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| entry.encrypted.then_some("is encrypted"))
}

fn damaged(subject: &Subject) -> Vec<String> {
    let damaged = subject.contents.damaged.iter();
    damaged.map(|(name, why)| format!("entry \"{name}\" cannot be unpacked: {why}")).collect()
}

fn link(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| entry.link.then_some("is a symbolic link"))
}

fn backslash(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| entry.name.contains('\\').then_some("has a backslash in its name"))
}

fn escape(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let name = entry.name.replace('\\', "/");
        let leaves =
            name.starts_with('/') || name.split('/').any(|part| part == ".." || part.contains(':'));
        leaves.then_some("would be written outside of the folder")
    })
}

fn control(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        entry.name.chars().any(char::is_control).then_some("has a control character in its name")
    })
}

fn duplicate(subject: &Subject) -> Vec<String> {
    let twice = duplicates(entries(subject).iter().map(ZipEntry::path));
    twice.iter().map(|name| format!("the entry \"{name}\" occurs more than once")).collect()
}

fn case(subject: &Subject) -> Vec<String> {
    let mut seen: HashMap<String, String> = HashMap::new();
    let mut found = Vec::new();
    for path in entries(subject).iter().map(ZipEntry::path) {
        match seen.get(&path.to_lowercase()) {
            Some(other) if *other != path => {
                found.push(format!("\"{other}\" and \"{path}\" are the same file on some systems"));
            }
            Some(_) => {}
            None => drop(seen.insert(path.to_lowercase(), path)),
        }
    }
    found
}

fn dot(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| entry.name.starts_with("./").then_some("starts with \"./\""))
}

fn ascii(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| (!entry.name.is_ascii()).then_some("has a name that is not ASCII"))
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
    let tops = entries(subject).iter().map(ZipEntry::path);
    let mut tops: Vec<String> =
        tops.filter_map(|path| Some(path.split('/').next()?.to_owned())).collect();
    tops.sort_unstable();
    tops.dedup();
    tops.retain(|top| !top.is_empty() && !NAMED.contains(&top.as_str()));
    tops.iter()
        .map(|top| format!("\"{top}\" is not a name of the standard; tools ignore it"))
        .collect()
}

fn refused(subject: &Subject) -> Vec<String> {
    // other refusals have their own rules
    let Some(refusal) = &subject.contents.refusal else { return Vec::new() };
    match refusal {
        ArchiveError::TooMany { .. } | ArchiveError::TooLarge { .. } => vec![refusal.to_string()],
        _ => Vec::new(),
    }
}

fn missing(subject: &Subject) -> Vec<String> {
    const NAME: &str = "modelDescription.xml";
    let contents = subject.contents;
    let there = |entry: &ZipEntry| entry.path() == NAME;
    if contents.damage.is_some() || entries(subject).iter().any(there) {
        return Vec::new();
    }
    let similar =
        |path: &String| path.rsplit('/').next().is_some_and(|last| last.eq_ignore_ascii_case(NAME));
    vec![match entries(subject).iter().map(ZipEntry::path).find(similar) {
        Some(path) if path.contains('/') => format!(
            "there is no {NAME} at the top level, but there is \"{path}\"; pack the contents of \
             the folder, not the folder"
        ),
        Some(path) => format!("there is no {NAME}, but there is \"{path}\""),
        None => format!("there is no {NAME}"),
    }]
}

fn icon(subject: &Subject) -> Vec<String> {
    let png = |bytes: &Vec<u8>| bytes.starts_with(b"\x89PNG\r\n\x1a\n");
    match &subject.contents.icon {
        Some(bytes) if !png(bytes) => vec!["model.png is not a PNG image".to_owned()],
        _ => Vec::new(),
    }
}

fn documentation(subject: &Subject) -> Vec<String> {
    let contents = subject.contents;
    if entries(subject).is_empty() || contents.has("documentation/index.html") {
        return Vec::new();
    }
    vec!["there is no documentation/index.html".to_owned()]
}
