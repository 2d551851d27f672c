//! Rules on modelDescription.xml as a text (FMI 2.0.5, section 2.2).

use super::subject::{Subject, table};

table! {
    "description-text", "2.2", Error, "modelDescription.xml is UTF-8", text;
    "description-encoding", "2.2", Error, "modelDescription.xml declares the encoding UTF-8 in its first line", encoding;
    "description-doctype", "2.2", Error, "modelDescription.xml has no document type declaration", doctype;
    "description-xml", "2.2", Error, "modelDescription.xml is well-formed XML and can be used", well_formed;
}

fn text(subject: &Subject) -> Vec<String> {
    let bytes = subject.contents.description.as_deref().unwrap_or_default();
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return vec!["modelDescription.xml is UTF-16, not UTF-8".to_owned()];
    }
    let error = std::str::from_utf8(bytes).err();
    error.map(|error| format!("modelDescription.xml is not UTF-8: {error}")).into_iter().collect()
}

/// The encoding that the XML declaration at the start of a text names.
fn declared(text: &str) -> Option<&str> {
    let (declaration, _) = text.strip_prefix("<?xml")?.split_once("?>")?;
    let (_, after) = declaration.split_once("encoding")?;
    let after = after.trim_start().strip_prefix('=')?.trim_start();
    let quote = after.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    after[1..].split(quote).next()
}

fn encoding(subject: &Subject) -> Vec<String> {
    let Some(content) = subject.contents.text().filter(|_| text(subject).is_empty()) else {
        return Vec::new();
    };
    let demand = "must start with <?xml version=\"1.0\" encoding=\"UTF-8\"?>";
    match declared(content) {
        Some(encoding) if encoding.eq_ignore_ascii_case("UTF-8") => Vec::new(),
        Some(encoding) => {
            vec![format!("modelDescription.xml declares the encoding {encoding}; it {demand}")]
        }
        None => vec![format!("modelDescription.xml declares no encoding; it {demand}")],
    }
}

fn doctype(subject: &Subject) -> Vec<String> {
    match subject.malformed {
        Some(roxmltree::Error::DtdDetected) => vec![
            "there is a document type declaration, which can make a parser read other files and \
             addresses, and expand a few bytes to gigabytes"
                .to_owned(),
        ],
        _ => Vec::new(),
    }
}

fn well_formed(subject: &Subject) -> Vec<String> {
    let other = |error: &&roxmltree::Error| !matches!(error, roxmltree::Error::DtdDetected);
    subject.malformed.filter(other).map(ToString::to_string).into_iter().collect()
}
