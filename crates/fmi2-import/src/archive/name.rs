//! Checking the names of entries.

use super::ArchiveError;

/// The name of an entry with forward slashes and without `./`; `None` if nothing is left.
///
/// # Errors
/// The name is dangerous.
pub(super) fn safe_name(
    raw: &str,
    warnings: &mut Vec<String>,
) -> Result<Option<String>, ArchiveError> {
    let refuse = |why| Err(ArchiveError::UnsafeName { name: raw.to_owned(), why });
    if raw.chars().any(char::is_control) {
        return refuse("control character");
    }
    let slashed = raw.replace('\\', "/");
    if slashed != raw {
        warnings.push(format!("entry \"{raw}\" contains backslashes"));
    }
    if slashed.starts_with('/') {
        return refuse("absolute name");
    }
    let mut parts = Vec::new();
    for part in slashed.split('/') {
        match part {
            "" | "." => {}
            ".." => return refuse("\"..\""),
            _ if part.contains(':') => return refuse("drive letter or stream"),
            _ => parts.push(part),
        }
    }
    if slashed.starts_with("./") {
        warnings.push(format!("entry \"{raw}\" begins with \"./\""));
    }
    Ok((!parts.is_empty()).then(|| parts.join("/")))
}
