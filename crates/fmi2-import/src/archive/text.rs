//! Decoding modelDescription.xml.

use super::ArchiveError;

/// The text of a description, and whether it was in ISO 8859-1 instead of UTF-8.
///
/// # Errors
/// It is in another encoding.
pub fn text(bytes: Vec<u8>) -> Result<(String, bool), ArchiveError> {
    String::from_utf8(bytes).map(|text| (text, false)).or_else(|error| {
        let bytes = error.into_bytes();
        let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_lowercase();
        if !head.contains("iso-8859-1") {
            return Err(ArchiveError::NotText);
        }
        // the first 256 code points of Unicode are those of ISO 8859-1
        Ok((bytes.into_iter().map(char::from).collect(), true))
    })
}
