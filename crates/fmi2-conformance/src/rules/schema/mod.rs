//! Rules that the XML schema of FMI 2.0 makes: elements, their order, attributes and their types.
//!
//! [`table`] is that schema as a table; [`read`] walks the document along it. It also gathers the
//! elements that the schema knows where they are, so that no rule looks at what a vendor wrote
//! into annotations, or at elements of another namespace.

mod table;
mod types;
mod walk;

use super::subject::{Subject, table};
use walk::Fault;
pub(super) use walk::{Reading, read};

table! {
    "schema-root", "2.2.1", Error, "the root element is fmiModelDescription", |it| of(it, Fault::Root);
    "schema-element", "2.2", Error, "there are no elements that the schema does not allow", |it| of(it, Fault::Element);
    "schema-order", "2.2", Error, "elements come in the order of the schema", |it| of(it, Fault::Order);
    "schema-missing", "2.2", Error, "required elements are there, and lists are not empty", |it| of(it, Fault::Missing);
    "schema-repeated", "2.2", Error, "elements do not occur more often than the schema allows", |it| of(it, Fault::Repeated);
    "schema-attribute", "2.2", Error, "there are no attributes that the schema does not allow", |it| of(it, Fault::Attribute);
    "schema-required", "2.2", Error, "required attributes are there", |it| of(it, Fault::Required);
    "schema-value", "2.2", Error, "attributes have values of the schema's types", |it| of(it, Fault::Value);
    "schema-text", "2.2", Error, "elements hold no stray text", |it| of(it, Fault::Text);
}

fn of(subject: &Subject, fault: Fault) -> Vec<String> {
    let same = subject.reading.violations.iter().filter(|violation| violation.fault == fault);
    same.map(|violation| violation.message.clone()).collect()
}
