//! metrics.json: the figures of a run as names and numbers.

use std::path::Path;

use criteria::Verdict;
use serde_json::{Map, Value};

use crate::{METRICS, write_whole};

/// Writes metrics.json into the folder: an object with a number for each figure, null for one that is not known.
///
/// # Errors
/// The file cannot be written.
pub fn write_metrics(folder: &Path, verdicts: &[Verdict]) -> std::io::Result<()> {
    let entry = |it: &Verdict| (it.name.clone(), Value::from(it.value));
    let metrics: Map<String, Value> = verdicts.iter().map(entry).collect();
    let text = serde_json::to_string_pretty(&metrics)? + "\n";
    write_whole(&folder.join(METRICS), text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_metrics_are_names_and_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let verdict =
            |name: &str, value| Verdict { name: name.to_owned(), value, ..Verdict::default() };
        let verdicts = [verdict("b", Some(0.1 + 0.2)), verdict("a", None)];
        write_metrics(folder.path(), &verdicts).unwrap();
        let text = std::fs::read_to_string(folder.path().join(METRICS)).unwrap();
        assert_eq!(text, "{\n  \"b\": 0.30000000000000004,\n  \"a\": null\n}\n");
    }
}
