//! What is packed and what is refused; packing a whole unit is tested in tests/python/test_kit.py.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};
use std::{fs, path::Path};

use fmi2_package::{Archive, Error, describe, platform};

const XML: &str =
    r#"<fmiModelDescription><CoSimulation modelIdentifier="one"/></fmiModelDescription>"#;

fn entries(bytes: &[u8]) -> BTreeMap<String, String> {
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let count = zip.len();
    let read = |index| {
        let mut entry = zip.by_index(index).unwrap();
        let mut text = String::new();
        entry.read_to_string(&mut text).unwrap();
        (entry.name().unwrap().into_owned(), text)
    };
    (0..count).map(read).collect()
}

#[test]
fn golden_every_platform_gets_its_extension() {
    let folder = tempfile::tempdir().unwrap();
    let library = folder.path().join("library");
    fs::write(&library, "code").unwrap();
    let mut archive = Archive::new(XML).unwrap();
    for name in ["linux64", "linux32", "win64", "darwin64"] {
        archive.binary(name, &library).unwrap();
    }
    let names: Vec<String> = entries(&archive.to_bytes().unwrap()).into_keys().collect();
    let expected = [
        "binaries/darwin64/one.dylib",
        "binaries/linux32/one.so",
        "binaries/linux64/one.so",
        "binaries/win64/one.dll",
        "modelDescription.xml",
    ];
    assert_eq!(names, expected);
    assert_eq!(platform("linux", "x86_64"), Some("linux64"));
    assert_eq!(platform("plan9", "x86_64"), None);
}

#[test]
fn invariant_folders_are_packed_whole_and_equal_files_give_equal_bytes() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("inner")).unwrap();
    fs::write(folder.path().join("b.txt"), "b").unwrap();
    fs::write(folder.path().join("inner").join("a.txt"), "a").unwrap();
    let make = || {
        let mut archive = Archive::new(XML).unwrap();
        archive.folder("resources", folder.path()).unwrap();
        archive.to_bytes().unwrap()
    };
    let first = make();
    let found = entries(&first);
    assert_eq!(found["resources/b.txt"], "b");
    assert_eq!(found["resources/inner/a.txt"], "a");
    assert_eq!(found["modelDescription.xml"], XML);
    fs::write(folder.path().join("b.txt"), "b").unwrap();
    assert_eq!(make(), first);
    let file = folder.path().join("one.fmu");
    fs::write(&file, &first).unwrap();
    assert_eq!(Archive::open(&file).unwrap().to_bytes().unwrap(), first);
    fs::remove_file(file).unwrap();
    fs::write(folder.path().join("b.txt"), "c").unwrap();
    assert_ne!(make(), first);
}

#[test]
fn invariant_a_failed_write_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let archive = Archive::new(XML).unwrap();
    let error = archive.write(&folder.path().join("missing").join("one.fmu")).unwrap_err();
    assert!(matches!(error, Error::File { .. }), "{error}");
    archive.write(&folder.path().join("one.fmu")).unwrap();
    let names: Vec<_> =
        fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(names, ["one.fmu"]);
}

#[test]
fn issue_what_is_not_a_unit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.so");
    fs::write(&text, "no library").unwrap();
    assert!(matches!(describe(&text, None), Err(Error::Load { .. })));
    let missing = describe(Path::new("/nonexistent/one.so"), None).unwrap_err();
    assert!(missing.to_string().starts_with("/nonexistent/one.so"), "{missing}");
    assert!(matches!(Archive::new("<a/>"), Err(Error::Description(_))));
    assert!(matches!(Archive::new("<a"), Err(Error::Description(_))));
    let mut archive = Archive::new(XML).unwrap();
    for name in ["", "resources/größe", "resources\\a", "a\nb"] {
        assert!(matches!(archive.file(name, ""), Err(Error::Name(_))), "{name:?}");
    }
}
