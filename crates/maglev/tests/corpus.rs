//! The corpus of the fuzz targets through the same readers, and small mutations of it: every input is
//! read or refused, and none ends the program. `fuzz/` holds the targets for long runs.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::fs;
use std::io::Cursor;
use std::path::Path;

use fmi2_import::archive::FmuArchive;
use fmi2_import::description::ModelDescription;
use proptest::prelude::*;
use proptest::sample::Index;
use scenario::Scenario;

fn corpus(kind: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(kind);
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|it| it.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| fs::read(path).unwrap()).collect()
}

/// How many of the inputs are accepted.
fn accepted(kind: &str, inputs: &[Vec<u8>]) -> usize {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    inputs
        .iter()
        .filter(|bytes| match kind {
            "archive" => archive(bytes),
            "description" => description(&text(bytes)),
            _ => {
                let parsed = Scenario::parse(&text(bytes), Path::new("scenario.json"));
                parsed.is_ok_and(|scenario| scenario.check().is_ok())
            }
        })
        .count()
}

fn archive(bytes: &[u8]) -> bool {
    let Ok(mut archive) = FmuArchive::new(Cursor::new(bytes)) else { return false };
    let names: Vec<String> = archive.files().map(str::to_owned).collect();
    for name in &names {
        assert!(!name.starts_with('/') && !name.split('/').any(|part| part == ".."), "{name}");
        let _ = archive.read(name);
    }
    archive.description().is_ok()
}

fn description(text: &str) -> bool {
    let Ok(description) = ModelDescription::parse(text) else { return false };
    for index in 0..description.variables.len() {
        let _ = description.unit_of(index);
        let _ = description.enumeration_of(index);
        let _ = description.step_dependencies(index);
        let _ = description.initial_dependencies(index);
    }
    true
}

/// So many of each kind are fit for use; the others are refused.
#[test]
fn golden_the_corpus_is_read_or_refused() {
    for (kind, fit) in [("archive", 2), ("description", 4), ("scenario", 1)] {
        let inputs = corpus(kind);
        assert!(inputs.len() > fit);
        assert_eq!(accepted(kind, &inputs), fit, "{kind}");
    }
}

proptest! {
    /// Bytes replaced, removed and doubled; `PROPTEST_CASES` says how many times.
    #[test]
    fn invariant_mutations_are_read_or_refused(
        which in any::<Index>(),
        changes in proptest::collection::vec((any::<Index>(), any::<u8>(), 0_u8..3), 1..12)
    ) {
        for kind in ["archive", "description", "scenario"] {
            let mut bytes = which.get(&corpus(kind)).clone();
            for (at, value, how) in &changes {
                let at = at.index(bytes.len());
                match how {
                    0 => bytes[at] = *value,
                    1 if bytes.len() > 1 => drop(bytes.remove(at)),
                    _ => bytes.insert(at, bytes[at]),
                }
            }
            accepted(kind, &[bytes]);
        }
    }
}
