//! Comparison of a document with the schema.

use std::collections::{HashMap, HashSet};

use roxmltree::{Attribute, Document, Node, NodeId};

use super::table::{Content, Element, Group, ROOT};
use super::types;
use fmi2_import::xml::Plain as _;

/// A kind of violation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    Root,
    Element,
    Order,
    Missing,
    Repeated,
    Attribute,
    Required,
    Value,
    Text,
}

/// A violation of the schema.
pub(super) struct Violation {
    pub(super) fault: Fault,
    pub(super) message: String,
}

/// Violations of the schema in a document, and the elements that it knows.
#[derive(Default)]
pub(in crate::rules) struct Reading<'a> {
    pub(super) violations: Vec<Violation>,
    /// The elements of the description by name, in document order.
    elements: HashMap<&'static str, Vec<Node<'a, 'a>>>,
    /// Elements that violate the schema, or contain an element that does.
    broken: HashSet<NodeId>,
}

impl<'a> Reading<'a> {
    /// The elements of a name.
    pub(in crate::rules) fn elements(&self, name: &str) -> &[Node<'a, 'a>] {
        self.elements.get(name).map_or(&[], Vec::as_slice)
    }

    /// Whether the schema does not allow an element in its place.
    pub(in crate::rules) fn is_unknown(&self, node: Node<'a, 'a>) -> bool {
        !self.elements(node.tag_name().name()).contains(&node)
    }

    /// Whether an element violates the schema, or contains one that does. Other findings there would only follow from
    /// that.
    pub(in crate::rules) fn breaks(&self, node: Node) -> bool {
        self.broken.contains(&node.id())
    }
}

/// Compares a document with the schema.
pub(in crate::rules) fn read<'a>(document: &'a Document<'a>) -> Reading<'a> {
    let mut walk = Walk { document, foreign: false, found: Reading::default() };
    let root = document.root_element();
    if root.is(ROOT.name) {
        walk.element(root, &ROOT);
    } else {
        let space = space(root.tag_name().namespace());
        walk.violation(
            root,
            Fault::Root,
            &format!("{space} is the root element, but must be <{}>", ROOT.name),
        );
    }
    walk.found
}

/// Namespace of attributes that refer to the schema of a document.
const INSTANCE: &str = "http://www.w3.org/2001/XMLSchema-instance";

/// A namespace in a message.
fn space(namespace: Option<&str>) -> String {
    namespace.map(|it| format!(" of the namespace \"{it}\"")).unwrap_or_default()
}

struct Walk<'a> {
    document: &'a Document<'a>,
    /// Inside an annotation, whose elements are not those of the description.
    foreign: bool,
    found: Reading<'a>,
}

impl<'a> Walk<'a> {
    fn violation(&mut self, node: Node<'a, 'a>, fault: Fault, text: &str) {
        let line = self.document.text_pos_at(node.range().start).row;
        let message = format!("line {line}: <{}>{text}", node.tag_name().name());
        self.found.broken.extend(node.ancestors().map(|it| it.id()));
        self.found.violations.push(Violation { fault, message });
    }

    fn element(&mut self, node: Node<'a, 'a>, element: &'static Element) {
        if !self.foreign {
            self.found.elements.entry(element.name).or_default().push(node);
        }
        match element.content {
            Content::Anything => {
                let instance = |it: &Attribute| it.namespace() == Some(INSTANCE);
                for attribute in node.attributes().filter(instance) {
                    self.foreign_attribute(node, element, &attribute);
                }
                return self.anything(node);
            }
            Content::OneOfAny => self.one_of_any(node),
            Content::Groups(groups) => self.children(node, groups),
            Content::Empty => self.empty(node),
        }
        self.attributes(node, element);
    }

    /// Any content is allowed, but whole descriptions in it must conform to the schema.
    fn anything(&mut self, node: Node<'a, 'a>) {
        let before = std::mem::replace(&mut self.foreign, true);
        for inner in node.descendants().skip(1).filter(|inner| inner.is(ROOT.name)) {
            self.element(inner, &ROOT);
        }
        self.foreign = before;
    }

    fn one_of_any(&mut self, node: Node<'a, 'a>) {
        self.stray_text(node);
        if let Some(second) = node.children().filter(Node::is_element).nth(1) {
            let text = format!(" is one too many in <{}>; enclose both in one element", tag(node));
            self.violation(second, Fault::Repeated, &text);
        }
        self.anything(node);
    }

    fn empty(&mut self, node: Node<'a, 'a>) {
        self.children(node, &[]);
        let blank = |child: &Node| child.is_text() && child.text().is_some_and(is_blank);
        if node.children().any(|child| blank(&child)) {
            self.violation(node, Fault::Text, " must be empty, but contains white space");
        }
    }

    fn stray_text(&mut self, node: Node<'a, 'a>) {
        for child in node.children().filter(Node::is_text) {
            let text = child.text().unwrap_or_default();
            if !is_blank(text) {
                let start: String = text.trim().chars().take(20).collect();
                self.violation(
                    node,
                    Fault::Text,
                    &format!(" contains the text \"{start}\", which is not allowed"),
                );
            }
        }
    }

    fn attributes(&mut self, node: Node<'a, 'a>, element: &Element) {
        for (name, _) in element.required {
            if node.attr(name).is_none() {
                self.violation(
                    node,
                    Fault::Required,
                    &format!(" does not have the required attribute \"{name}\""),
                );
            }
        }
        for attribute in node.attributes() {
            if attribute.namespace().is_some() {
                self.foreign_attribute(node, element, &attribute);
            } else {
                self.own_attribute(node, element, &attribute);
            }
        }
    }

    fn own_attribute(&mut self, node: Node<'a, 'a>, element: &Element, attribute: &Attribute) {
        let (name, value) = (attribute.name(), attribute.value());
        let known = element.required.iter().chain(element.optional);
        let Some((_, kind)) = known.clone().find(|(it, _)| *it == name) else {
            let hint = patterns::suggest(name, known.map(|(it, _)| *it))
                .map(|it| format!("; did you mean \"{it}\"?"))
                .unwrap_or_default();
            let text = format!(" has the unknown attribute \"{name}\"{hint}");
            return self.violation(node, Fault::Attribute, &text);
        };
        if let Err(expected) = types::fits(*kind, value) {
            let text = format!(" has {name}=\"{value}\", which is not {expected}");
            self.violation(node, Fault::Value, &text);
        }
    }

    /// Of other namespaces, only references to the schema and the name of the element's own type are allowed.
    fn foreign_attribute(&mut self, node: Node<'a, 'a>, element: &Element, attribute: &Attribute) {
        let (name, namespace) = (attribute.name(), attribute.namespace());
        let allowed = namespace == Some(INSTANCE)
            && match name {
                "schemaLocation" | "noNamespaceSchemaLocation" => true,
                "type" => type_name(element.name) == Some(attribute.value().trim()),
                _ => false,
            };
        if !allowed {
            let text = format!(" has the attribute \"{name}\"{}", space(namespace));
            self.violation(node, Fault::Attribute, &(text + ", which the schema does not allow"));
        }
    }

    fn children(&mut self, node: Node<'a, 'a>, groups: &'static [Group]) {
        self.stray_text(node);
        let mut counts = vec![0_usize; groups.len()];
        let mut furthest = 0;
        let mut progress = Progress::default();
        for child in node.children().filter(Node::is_element) {
            let place = groups.iter().enumerate().find_map(|(index, group)| {
                let position = group.any_of.iter().position(|it| child.is(it.name))?;
                Some((index, position, group.any_of[position]))
            });
            let Some((index, position, element)) = place else {
                let space = space(child.tag_name().namespace());
                let text = format!("{space} is not allowed in <{}>", tag(node));
                self.violation(child, Fault::Element, &text);
                continue;
            };
            let group = &groups[index];
            counts[index] += 1;
            if index < furthest {
                let earlier = groups[furthest].any_of[0].name;
                self.violation(child, Fault::Order, &format!(" must come before <{earlier}>"));
            } else if counts[index] > group.most || !progress.takes(position, group.rounds) {
                let text = format!(" is one too many in <{}>", tag(node));
                self.violation(child, Fault::Repeated, &text);
            }
            furthest = furthest.max(index);
            self.element(child, element);
        }
        for (group, count) in groups.iter().zip(counts) {
            if count < group.least {
                let names: Vec<&str> = group.any_of.iter().map(|it| it.name).collect();
                let text =
                    format!(" does not contain the required element <{}>", names.join("> or <"));
                self.violation(node, Fault::Missing, &text);
            }
        }
    }
}

/// Progress in a group whose elements may repeat in their order.
#[derive(Default)]
struct Progress {
    round: usize,
    next: usize,
}

impl Progress {
    /// Whether the element at that position of its group may come next.
    fn takes(&mut self, position: usize, rounds: usize) -> bool {
        if rounds == 0 {
            return true;
        }
        if position < self.next {
            self.round += 1;
        }
        self.next = position + 1;
        self.round < rounds
    }
}

fn tag<'a>(node: Node<'a, 'a>) -> &'a str {
    node.tag_name().name()
}

fn is_blank(text: &str) -> bool {
    fmi2_import::xml::trim(text).is_empty()
}

/// The name of an element's type in the schema, if the type has one.
fn type_name(element: &str) -> Option<&'static str> {
    Some(match element {
        "ScalarVariable" => "fmi2ScalarVariable",
        "SimpleType" => "fmi2SimpleType",
        "Unit" => "fmi2Unit",
        "VendorAnnotations" | "Annotations" => "fmi2Annotation",
        "Outputs" | "Derivatives" => "fmi2VariableDependency",
        _ => return None,
    })
}
