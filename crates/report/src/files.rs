//! Whether the files of a folder are of one run: run-files.json lists what a run has written.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;

use crate::error::ReportError;

/// The list in a folder of results.
const LIST: &str = "run-files.json";
/// Tables, of which a report reads the first that is there.
const TABLES: [&str; 2] = ["results.csv", "results.parquet"];

/// The content of the list.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(default)]
struct List {
    run: Option<String>,
    files: BTreeMap<String, Option<Stamp>>,
}

/// What tells a file from that of another run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
struct Stamp {
    bytes: u64,
    crc32: u32,
}

/// Checks that a folder has the files of one run only. Folders without a list, of earlier versions,
/// are accepted.
///
/// # Errors
/// A file is of another run, or was changed after the run.
pub(crate) fn check(folder: &Path) -> Result<(), ReportError> {
    let Some(list): Option<List> = crate::run::json(&folder.join(LIST))? else { return Ok(()) };
    let Some(run) = &list.run else { return Ok(()) };
    let mixed = |name: &str, found: String| ReportError::Mixed {
        folder: folder.to_owned(),
        file: name.to_owned(),
        found,
        run: run.clone(),
    };
    for (name, place) in [("summary.json", "run"), ("scenario-as-run.json", "$comment")] {
        let content: Option<Value> = crate::run::json(&folder.join(name))?;
        let Some(content) = content else { continue };
        let mark = content.get(place).and_then(Value::as_str);
        match mark.map(|mark| mark.strip_prefix("run ").unwrap_or(mark)) {
            Some(found) if found == run => {}
            Some(found) => return Err(mixed(name, format!("is of run {found}"))),
            None => return Err(mixed(name, "does not name its run".to_owned())),
        }
    }
    let table = TABLES.iter().find(|name| folder.join(name).exists());
    if let Some(name) = table.filter(|name| !list.files.contains_key(**name)) {
        return Err(mixed(name, "was not written by it".to_owned()));
    }
    for (name, stamp) in &list.files {
        let Some(stamp) = stamp else { continue };
        let path = folder.join(name);
        match fingerprint(&path) {
            Ok(found) if found == *stamp => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Ok(_) => return Err(mixed(name, "is not the file that it wrote".to_owned())),
            Err(source) => return Err(ReportError::Read { path, source }),
        }
    }
    Ok(())
}

fn fingerprint(path: &Path) -> io::Result<Stamp> {
    let mut file = std::fs::File::open(path)?;
    let mut hasher = Checksum::default();
    let bytes = io::copy(&mut file, &mut hasher)?;
    Ok(Stamp { bytes, crc32: hasher.0.finalize() })
}

/// CRC-32 of what is written to it.
#[derive(Default)]
struct Checksum(crc32fast::Hasher);

impl io::Write for Checksum {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of another run, one that the run did not write and one that has changed are named;
    /// files of the user are not looked at.
    #[test]
    fn issue_files_of_two_runs_are_refused() {
        let place = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(place.path().join(name), text).unwrap();
        let refused = |file: &str, why: &str| {
            let error = check(place.path()).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(&format!("{file} {why}")) && text.contains("run one"), "{text}");
            assert!(error.is_bad_input() && error.help().is_some());
        };
        let table = "time,a.x\n0.0,1.0\n";
        let crc32 = crc32fast::hash(table.as_bytes());
        write("results.csv", table);
        write("summary.json", "{\"run\": \"one\"}");
        write("scenario-as-run.json", "{\"$comment\": \"run one\"}");
        check(place.path()).unwrap();
        let list = format!(
            "{{\"run\": \"one\", \"files\": {{\"results.csv\": {{\"bytes\": {}, \"crc32\": {crc32}}}, \
             \"summary.json\": null, \"scenario-as-run.json\": null, \"p.svg\": null}}}}",
            table.len()
        );
        write("run-files.json", &list);
        write("notes.txt", "mine");
        check(place.path()).unwrap();
        write("summary.json", "{\"run\": \"two\"}");
        refused("summary.json", "is of run two");
        write("summary.json", "{\"run\": \"one\"}");
        write("scenario-as-run.json", "{\"$comment\": \"run two\"}");
        refused("scenario-as-run.json", "is of run two");
        write("scenario-as-run.json", "{}");
        refused("scenario-as-run.json", "does not name its run");
        write("scenario-as-run.json", "{\"$comment\": \"run one\"}");
        write("results.csv", &table.replace("1.0", "2.0"));
        refused("results.csv", "is not the file that it wrote");
        write("results.csv", table);
        write("results.parquet", "PAR1");
        check(place.path()).unwrap();
        std::fs::remove_file(place.path().join("results.csv")).unwrap();
        refused("results.parquet", "was not written by it");
    }
}
