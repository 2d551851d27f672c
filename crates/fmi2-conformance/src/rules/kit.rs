//! Rule on FMUs made with `fmi2-export`. Their GUID is a hash of description and resources (FMI 2.0.5, section 2.2.1: a
//! fingerprint of the relevant information).

use uuid::Uuid;

use super::contents::made_by_kit;
use super::subject::{Subject, table};
use fmi2_import::xml::Plain as _;

table! {
    "guid-content", "2.2.1", Warning, "in FMUs made with fmi2-export, the GUID is the hash of description and resources", content;
}

/// Largest number of resources. More can be read in too many orders to try all of them.
const MOST: usize = 4;

fn content(subject: &Subject) -> Vec<String> {
    let resources = &subject.contents.resources;
    let Some(text) = subject.contents.text().filter(|text| made_by_kit(text)) else {
        return Vec::new();
    };
    let root = subject.elements("fmiModelDescription").next();
    let Some(guid) = root.and_then(|root| root.attr("guid")) else { return Vec::new() };
    // resources that cannot be unpacked are a finding of `archive-damaged`
    if resources.len() > MOST || !subject.contents.damaged.is_empty() {
        return Vec::new();
    }
    let printed = printed(text, guid);
    let follows = |read: &[&(String, Uuid)]| guid == braced(&printed, read);
    if any_order(resources, &mut Vec::new(), &follows) {
        return Vec::new();
    }
    vec![format!(
        "the GUID {guid} is not the hash of the description and the resources: one of them was \
         changed after the FMU was made. With other resources the FMU refuses to be instantiated; \
         `maglev derive` makes a unit with other resources"
    )]
}

/// The description as the GUID depends on it: without the GUID and without annotations.
fn printed(text: &str, guid: &str) -> String {
    let mut text = text.replacen(&format!("guid=\"{guid}\""), "guid=\"\"", 1);
    let block = text.find("  <VendorAnnotations>\n").zip(text.find("</VendorAnnotations>\n"));
    if let Some((start, end)) = block {
        text.replace_range(start..end + "</VendorAnnotations>\n".len(), "");
    }
    text
}

/// The GUID of a description and resources in the order in which the FMU reads them.
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

/// Whether a test holds for any of the resources in any order.
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
