//! Rules of the XML schema of FMI 2.0: elements, their order, attributes and their types.
//!
//! [`table`](self::table) has the schema as a table, and [`read`] compares a document with it. It also collects the
//! elements that the schema knows, so that no rule reads annotations of vendors or elements of other namespaces.

mod table;
mod types;
mod walk;

use super::subject::{Subject, table};
use walk::Fault;
pub(super) use walk::{Reading, read};

table! {
    "schema-root", "2.2.1", Error, "the root element is fmiModelDescription", |it| of(it, Fault::Root);
    "schema-element", "2.2", Error, "all elements are allowed by the schema", |it| of(it, Fault::Element);
    "schema-order", "2.2", Error, "elements are in the order of the schema", |it| of(it, Fault::Order);
    "schema-missing", "2.2", Error, "required elements exist, and lists are not empty", |it| of(it, Fault::Missing);
    "schema-repeated", "2.2", Error, "elements do not occur more often than the schema allows", |it| of(it, Fault::Repeated);
    "schema-attribute", "2.2", Error, "all attributes are allowed by the schema", |it| of(it, Fault::Attribute);
    "schema-required", "2.2", Error, "required attributes exist", |it| of(it, Fault::Required);
    "schema-value", "2.2", Error, "values of attributes have the type of the schema", |it| of(it, Fault::Value);
    "schema-text", "2.2", Error, "elements contain no text", |it| of(it, Fault::Text);
}

fn of(subject: &Subject, fault: Fault) -> Vec<String> {
    let same = subject.reading.violations.iter().filter(|violation| violation.fault == fault);
    same.map(|violation| violation.message.clone()).collect()
}
