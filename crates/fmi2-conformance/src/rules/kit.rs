//! Rule on units of the kit `fmi2-export`, whose GUID follows from description and resources
//! (FMI 2.0.5, section 2.2.1: a fingerprint of the relevant information).

use uuid::Uuid;

use super::contents::made_by_kit;
use super::subject::{Subject, table};
use fmi2_import::xml::Plain as _;

table! {
    "guid-content", "2.2.1", Warning, "the GUID follows from description and resources, in units of fmi2-export", content;
}

/// More resources than these can be read in too many orders to try them all.
const MOST: usize = 4;

fn content(subject: &Subject) -> Vec<String> {
    let resources = &subject.contents.resources;
    let Some(text) = subject.contents.text().filter(|text| made_by_kit(text)) else {
        return Vec::new();
    };
    let root = subject.elements("fmiModelDescription").next();
    let Some(guid) = root.and_then(|root| root.attr("guid")) else { return Vec::new() };
    // the resources that cannot be unpacked are another rule's
    if resources.len() > MOST || !subject.contents.damaged.is_empty() {
        return Vec::new();
    }
    let printed = printed(text, guid);
    let follows = |read: &[&(String, Uuid)]| guid == braced(&printed, read);
    if any_order(resources, &mut Vec::new(), &follows) {
        return Vec::new();
    }
    vec![format!(
        "the GUID {guid} does not follow from the description and the resources: one of them was \
         changed after the unit was made. If the resources were, the unit refuses to be \
         instantiated; fmi2-package makes the description that belongs to them"
    )]
}

/// The description as it counts into the GUID: without the GUID itself and without annotations.
fn printed(text: &str, guid: &str) -> String {
    let mut text = text.replacen(&format!("guid=\"{guid}\""), "guid=\"\"", 1);
    let block = text.find("  <VendorAnnotations>\n").zip(text.find("</VendorAnnotations>\n"));
    if let Some((start, end)) = block {
        text.replace_range(start..end + "</VendorAnnotations>\n".len(), "");
    }
    text
}

/// The GUID of a description and the resources that were read for it, in that order.
fn braced(printed: &str, read: &[&(String, Uuid)]) -> String {
    let mut content = printed.as_bytes().to_vec();
    for (name, hash) in read {
        content.extend_from_slice(name.as_bytes());
        content.push(0);
        content.extend_from_slice(hash.as_bytes());
    }
    let kit = Uuid::new_v5(&Uuid::NAMESPACE_URL, b"urn:fmi2-export:guid");
    Uuid::new_v5(&kit, &content).braced().to_string()
}

/// Whether a test holds for some of the resources in some order.
fn any_order<'a>(
    resources: &'a [(String, Uuid)],
    read: &mut Vec<&'a (String, Uuid)>,
    test: &impl Fn(&[&(String, Uuid)]) -> bool,
) -> bool {
    if test(read) {
        return true;
    }
    resources.iter().any(|next| {
        if read.contains(&next) {
            return false;
        }
        read.push(next);
        let found = any_order(resources, read, test);
        read.pop();
        found
    })
}
