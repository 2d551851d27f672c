//! Checks that the files of a results folder belong to one run.

use std::io;
use std::path::Path;

use serde_json::Value;

use crate::file::fingerprint;
use crate::file_list::FileList;
use crate::read::json;
use crate::{AS_RUN, FILES, PARQUET, ReadError, SUMMARY, TABLE};

/// Checks the files of a folder against run-files.json. Folders of earlier versions have no such list
/// and are accepted.
///
/// # Errors
/// A file belongs to another run, or was changed after the run.
pub(crate) fn verify(folder: &Path) -> Result<(), ReadError> {
    let Some(list): Option<FileList> = json(&folder.join(FILES))? else { return Ok(()) };
    let Some(run) = &list.run else { return Ok(()) };
    let mixed = |name: &str, found: String| ReadError::Mixed {
        folder: folder.to_owned(),
        file: name.to_owned(),
        found,
        run: run.clone(),
    };
    for (name, member) in [(SUMMARY, "run"), (AS_RUN, "$comment")] {
        let content: Option<Value> = json(&folder.join(name))?;
        let Some(content) = content else { continue };
        let mark = content.get(member).and_then(Value::as_str);
        match mark.map(|mark| mark.strip_prefix("run ").unwrap_or(mark)) {
            Some(found) if found == run => {}
            Some(found) => return Err(mixed(name, format!("belongs to run {found}"))),
            None => return Err(mixed(name, "does not name its run".to_owned())),
        }
    }
    // the table that is read
    let table = [TABLE, PARQUET].into_iter().find(|name| folder.join(name).exists());
    if let Some(name) = table.filter(|name| !list.files.contains_key(*name)) {
        return Err(mixed(name, "is not in its list".to_owned()));
    }
    for (name, listed) in &list.files {
        let Some(listed) = listed else { continue };
        let path = folder.join(name);
        match fingerprint(&path) {
            Ok(found) if found == *listed => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Ok(_) => return Err(mixed(name, "has changed since".to_owned())),
            Err(source) => return Err(ReadError::File { path, source }),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error names a file of another run, one that the run did not write, and one that has changed.
    /// Other files are the user's.
    #[test]
    fn issue_files_of_two_runs_are_refused() {
        let place = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(place.path().join(name), text).unwrap();
        let refused = |file: &str, why: &str| {
            let error = verify(place.path()).unwrap_err();
            let text = error.to_string();
            assert!(text.contains(&format!("{file} {why}")) && text.contains("run one"), "{text}");
            assert!(error.help().is_some());
        };
        let table = "time,a.x\n0.0,1.0\n";
        let crc32 = crc32fast::hash(table.as_bytes());
        write("results.csv", table);
        write("summary.json", "{\"run\": \"one\"}");
        write("scenario-as-run.json", "{\"$comment\": \"run one\"}");
        verify(place.path()).unwrap();
        let list = format!(
            "{{\"run\": \"one\", \"files\": {{\"results.csv\": {{\"bytes\": {}, \"crc32\": {crc32}}}, \
             \"summary.json\": null, \"scenario-as-run.json\": null, \"p.svg\": null}}}}",
            table.len()
        );
        write("run-files.json", &list);
        write("notes.txt", "mine");
        verify(place.path()).unwrap();
        write("summary.json", "{\"run\": \"two\"}");
        refused("summary.json", "belongs to run two");
        write("summary.json", "{\"run\": \"one\"}");
        write("scenario-as-run.json", "{\"$comment\": \"run two\"}");
        refused("scenario-as-run.json", "belongs to run two");
        write("scenario-as-run.json", "{}");
        refused("scenario-as-run.json", "does not name its run");
        write("scenario-as-run.json", "{\"$comment\": \"run one\"}");
        write("results.csv", &table.replace("1.0", "2.0"));
        refused("results.csv", "has changed since");
        write("results.csv", table);
        write("results.parquet", "PAR1");
        verify(place.path()).unwrap();
        std::fs::remove_file(place.path().join("results.csv")).unwrap();
        refused("results.parquet", "is not in its list");
    }
}
