//! Rules that the XML schema of FMI 2.0 makes: elements, their order, attributes and their types.
//!
//! [`ROOT`] is that schema as a table; [`violations`] walks the document along it.

use roxmltree::{Document, Node};

use super::{Subject, table};

table! {
    "schema-root", "2.2.1", Error, "the root element is fmiModelDescription", |it| of(it, Fault::Root);
    "schema-element", "2.2", Error, "there are no elements that the schema does not know", |it| of(it, Fault::Element);
    "schema-order", "2.2", Error, "elements come in the order of the schema", |it| of(it, Fault::Order);
    "schema-missing", "2.2", Error, "required elements are there, and lists are not empty", |it| of(it, Fault::Missing);
    "schema-repeated", "2.2", Error, "elements do not occur more often than the schema allows", |it| of(it, Fault::Repeated);
    "schema-attribute", "2.2", Error, "there are no attributes that the schema does not know", |it| of(it, Fault::Attribute);
    "schema-required", "2.2", Error, "required attributes are there", |it| of(it, Fault::Required);
    "schema-value", "2.2", Error, "attributes have values of the schema's types", |it| of(it, Fault::Value);
    "schema-text", "2.2", Error, "elements hold no stray text", |it| of(it, Fault::Text);
}

fn of(subject: &Subject, fault: Fault) -> Vec<String> {
    let same = subject.violations.iter().filter(|violation| violation.fault == fault);
    same.map(|violation| violation.message.clone()).collect()
}

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
    fault: Fault,
    message: String,
}

/// Type of an attribute's value.
#[derive(Clone, Copy)]
enum Kind {
    Text,
    Real,
    Integer,
    Unsigned,
    Boolean,
    Date,
    /// A list of variable indices.
    Indices,
    OneOf(&'static [&'static str]),
    /// A list of these words.
    ManyOf(&'static [&'static str]),
}
use Kind::{Boolean, Date, Indices, Integer, ManyOf, OneOf, Real, Text, Unsigned};

struct Element {
    name: &'static str,
    required: &'static [(&'static str, Kind)],
    optional: &'static [(&'static str, Kind)],
    content: Content,
}

enum Content {
    /// Groups that follow each other.
    Groups(&'static [Group]),
    /// Whatever a tool likes.
    Anything,
}

/// `least` to `most` elements out of `any_of`.
struct Group {
    any_of: &'static [&'static Element],
    least: usize,
    most: usize,
}

const EMPTY: Content = Content::Groups(&[]);

const fn one(element: &'static [&'static Element]) -> Group {
    Group { any_of: element, least: 1, most: 1 }
}

const fn maybe(element: &'static [&'static Element]) -> Group {
    Group { any_of: element, least: 0, most: 1 }
}

const fn many(element: &'static [&'static Element]) -> Group {
    Group { any_of: element, least: 1, most: usize::MAX }
}

const fn leaf(name: &'static str, required: &'static [(&'static str, Kind)]) -> Element {
    Element { name, required, optional: &[], content: EMPTY }
}

const fn list(name: &'static str, content: &'static [Group]) -> Element {
    Element { name, required: &[], optional: &[], content: Content::Groups(content) }
}

static ROOT: Element = Element {
    name: "fmiModelDescription",
    required: &[("fmiVersion", Text), ("modelName", Text), ("guid", Text)],
    optional: &[
        ("description", Text),
        ("author", Text),
        ("version", Text),
        ("copyright", Text),
        ("license", Text),
        ("generationTool", Text),
        ("generationDateAndTime", Date),
        ("variableNamingConvention", OneOf(&["flat", "structured"])),
        ("numberOfEventIndicators", Unsigned),
    ],
    content: Content::Groups(&[
        Group { any_of: &[&MODEL_EXCHANGE, &CO_SIMULATION], least: 1, most: 2 },
        maybe(&[&UNIT_DEFINITIONS]),
        maybe(&[&TYPE_DEFINITIONS]),
        maybe(&[&LOG_CATEGORIES]),
        maybe(&[&DEFAULT_EXPERIMENT]),
        maybe(&[&VENDOR_ANNOTATIONS]),
        one(&[&MODEL_VARIABLES]),
        one(&[&MODEL_STRUCTURE]),
    ]),
};

static MODEL_EXCHANGE: Element = Element {
    name: "ModelExchange",
    required: &[("modelIdentifier", Text)],
    optional: &[
        ("needsExecutionTool", Boolean),
        ("completedIntegratorStepNotNeeded", Boolean),
        ("canBeInstantiatedOnlyOncePerProcess", Boolean),
        ("canNotUseMemoryManagementFunctions", Boolean),
        ("canGetAndSetFMUstate", Boolean),
        ("canSerializeFMUstate", Boolean),
        ("providesDirectionalDerivative", Boolean),
    ],
    content: Content::Groups(&[maybe(&[&SOURCE_FILES])]),
};

static CO_SIMULATION: Element = Element {
    name: "CoSimulation",
    required: &[("modelIdentifier", Text)],
    optional: &[
        ("needsExecutionTool", Boolean),
        ("canHandleVariableCommunicationStepSize", Boolean),
        ("canInterpolateInputs", Boolean),
        ("maxOutputDerivativeOrder", Unsigned),
        ("canRunAsynchronuously", Boolean),
        ("canBeInstantiatedOnlyOncePerProcess", Boolean),
        ("canNotUseMemoryManagementFunctions", Boolean),
        ("canGetAndSetFMUstate", Boolean),
        ("canSerializeFMUstate", Boolean),
        ("providesDirectionalDerivative", Boolean),
    ],
    content: Content::Groups(&[maybe(&[&SOURCE_FILES])]),
};

static SOURCE_FILES: Element = list("SourceFiles", &[many(&[&FILE])]);
static FILE: Element = leaf("File", &[("name", Text)]);

static UNIT_DEFINITIONS: Element = list("UnitDefinitions", &[many(&[&UNIT])]);
static UNIT: Element = Element {
    name: "Unit",
    required: &[("name", Text)],
    optional: &[],
    content: Content::Groups(&[
        maybe(&[&BASE_UNIT]),
        Group { any_of: &[&DISPLAY_UNIT], least: 0, most: usize::MAX },
    ]),
};
static BASE_UNIT: Element = Element {
    name: "BaseUnit",
    required: &[],
    optional: &[
        ("kg", Integer),
        ("m", Integer),
        ("s", Integer),
        ("A", Integer),
        ("K", Integer),
        ("mol", Integer),
        ("cd", Integer),
        ("rad", Integer),
        ("factor", Real),
        ("offset", Real),
    ],
    content: EMPTY,
};
static DISPLAY_UNIT: Element = Element {
    name: "DisplayUnit",
    required: &[("name", Text)],
    optional: &[("factor", Real), ("offset", Real)],
    content: EMPTY,
};

static TYPE_DEFINITIONS: Element = list("TypeDefinitions", &[many(&[&SIMPLE_TYPE])]);
static SIMPLE_TYPE: Element = Element {
    name: "SimpleType",
    required: &[("name", Text)],
    optional: &[("description", Text)],
    content: Content::Groups(&[one(&[
        &TYPE_REAL,
        &TYPE_INTEGER,
        &TYPE_BOOLEAN,
        &TYPE_STRING,
        &TYPE_ENUMERATION,
    ])]),
};
static TYPE_REAL: Element = Element {
    name: "Real",
    required: &[],
    optional: &[
        ("quantity", Text),
        ("unit", Text),
        ("displayUnit", Text),
        ("relativeQuantity", Boolean),
        ("min", Real),
        ("max", Real),
        ("nominal", Real),
        ("unbounded", Boolean),
    ],
    content: EMPTY,
};
static TYPE_INTEGER: Element = Element {
    name: "Integer",
    required: &[],
    optional: &[("quantity", Text), ("min", Integer), ("max", Integer)],
    content: EMPTY,
};
static TYPE_BOOLEAN: Element = leaf("Boolean", &[]);
static TYPE_STRING: Element = leaf("String", &[]);
static TYPE_ENUMERATION: Element = Element {
    name: "Enumeration",
    required: &[],
    optional: &[("quantity", Text)],
    content: Content::Groups(&[many(&[&ITEM])]),
};
static ITEM: Element = Element {
    name: "Item",
    required: &[("name", Text), ("value", Integer)],
    optional: &[("description", Text)],
    content: EMPTY,
};

static LOG_CATEGORIES: Element = list("LogCategories", &[many(&[&CATEGORY])]);
static CATEGORY: Element = Element {
    name: "Category",
    required: &[("name", Text)],
    optional: &[("description", Text)],
    content: EMPTY,
};

static DEFAULT_EXPERIMENT: Element = Element {
    name: "DefaultExperiment",
    required: &[],
    optional: &[("startTime", Real), ("stopTime", Real), ("tolerance", Real), ("stepSize", Real)],
    content: EMPTY,
};

static VENDOR_ANNOTATIONS: Element = list("VendorAnnotations", &[many(&[&TOOL])]);
static ANNOTATIONS: Element = list("Annotations", &[many(&[&TOOL])]);
static TOOL: Element = Element {
    name: "Tool",
    required: &[("name", Text)],
    optional: &[],
    content: Content::Anything,
};

static MODEL_VARIABLES: Element = list("ModelVariables", &[many(&[&SCALAR_VARIABLE])]);
static SCALAR_VARIABLE: Element = Element {
    name: "ScalarVariable",
    required: &[("name", Text), ("valueReference", Unsigned)],
    optional: &[
        ("description", Text),
        (
            "causality",
            OneOf(&["parameter", "calculatedParameter", "input", "output", "local", "independent"]),
        ),
        ("variability", OneOf(&["constant", "fixed", "tunable", "discrete", "continuous"])),
        ("initial", OneOf(&["exact", "approx", "calculated"])),
        ("canHandleMultipleSetPerTimeInstant", Boolean),
    ],
    content: Content::Groups(&[
        one(&[&REAL, &INTEGER, &BOOLEAN, &STRING, &ENUMERATION]),
        maybe(&[&ANNOTATIONS]),
    ]),
};
static REAL: Element = Element {
    name: "Real",
    required: &[],
    optional: &[
        ("declaredType", Text),
        ("quantity", Text),
        ("unit", Text),
        ("displayUnit", Text),
        ("relativeQuantity", Boolean),
        ("min", Real),
        ("max", Real),
        ("nominal", Real),
        ("unbounded", Boolean),
        ("start", Real),
        ("derivative", Unsigned),
        ("reinit", Boolean),
    ],
    content: EMPTY,
};
static INTEGER: Element = Element {
    name: "Integer",
    required: &[],
    optional: &[
        ("declaredType", Text),
        ("quantity", Text),
        ("min", Integer),
        ("max", Integer),
        ("start", Integer),
    ],
    content: EMPTY,
};
static BOOLEAN: Element = Element {
    name: "Boolean",
    required: &[],
    optional: &[("declaredType", Text), ("start", Boolean)],
    content: EMPTY,
};
static STRING: Element = Element {
    name: "String",
    required: &[],
    optional: &[("declaredType", Text), ("start", Text)],
    content: EMPTY,
};
static ENUMERATION: Element = Element {
    name: "Enumeration",
    required: &[("declaredType", Text)],
    optional: &[("quantity", Text), ("min", Integer), ("max", Integer), ("start", Integer)],
    content: EMPTY,
};

static MODEL_STRUCTURE: Element = list(
    "ModelStructure",
    &[maybe(&[&OUTPUTS]), maybe(&[&DERIVATIVES]), maybe(&[&INITIAL_UNKNOWNS])],
);
static OUTPUTS: Element = list("Outputs", &[many(&[&UNKNOWN])]);
static DERIVATIVES: Element = list("Derivatives", &[many(&[&UNKNOWN])]);
static INITIAL_UNKNOWNS: Element = list("InitialUnknowns", &[many(&[&UNKNOWN])]);
static UNKNOWN: Element = Element {
    name: "Unknown",
    required: &[("index", Unsigned)],
    optional: &[
        ("dependencies", Indices),
        ("dependenciesKind", ManyOf(&["dependent", "constant", "fixed", "tunable", "discrete"])),
    ],
    content: EMPTY,
};

/// All violations, in the order of the document.
pub(super) fn violations(document: &Document) -> Vec<Violation> {
    let mut walk = Walk { document, found: Vec::new() };
    let root = document.root_element();
    let space = root.tag_name().namespace();
    if root.has_tag_name(ROOT.name) && space.is_none() {
        walk.element(root, &ROOT);
    } else {
        let space = space.map(|it| format!(" of the namespace {it}")).unwrap_or_default();
        walk.tell(root, Fault::Root, &format!("{space} is the root, not <{}>", ROOT.name));
    }
    walk.found
}

struct Walk<'a> {
    document: &'a Document<'a>,
    found: Vec<Violation>,
}

impl Walk<'_> {
    fn tell(&mut self, node: Node, fault: Fault, text: &str) {
        let line = self.document.text_pos_at(node.range().start).row;
        let message = format!("line {line}: <{}>{text}", node.tag_name().name());
        self.found.push(Violation { fault, message });
    }

    fn element(&mut self, node: Node, element: &'static Element) {
        self.attributes(node, element);
        if let Content::Groups(groups) = element.content {
            self.children(node, groups);
        }
    }

    fn attributes(&mut self, node: Node, element: &Element) {
        for (name, _) in element.required {
            if node.attribute(*name).is_none() {
                self.tell(node, Fault::Required, &format!(" lacks the attribute \"{name}\""));
            }
        }
        // attributes of a namespace, such as xsi:schemaLocation, are for XML tools
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            let (name, value) = (attribute.name(), attribute.value());
            let known = element.required.iter().chain(element.optional);
            match known.clone().find(|(it, _)| *it == name) {
                None => {
                    let near = known.map(|(it, _)| *it).max_by(|a, b| {
                        strsim::jaro_winkler(a, name).total_cmp(&strsim::jaro_winkler(b, name))
                    });
                    let hint = near
                        .filter(|it| strsim::jaro_winkler(it, name) > 0.9)
                        .map(|it| format!("; did you mean \"{it}\"?"))
                        .unwrap_or_default();
                    let text = format!(" has the unknown attribute \"{name}\"{hint}");
                    self.tell(node, Fault::Attribute, &text);
                }
                Some((_, kind)) => {
                    if let Err(expected) = fits(*kind, value) {
                        let text = format!(" has {name}=\"{value}\", which is no {expected}");
                        self.tell(node, Fault::Value, &text);
                    }
                }
            }
        }
    }

    fn children(&mut self, node: Node, groups: &'static [Group]) {
        let mut counts = vec![0_usize; groups.len()];
        let mut furthest = 0;
        for child in node.children() {
            if child.is_text() {
                let text = child.text().unwrap_or_default().trim();
                if !text.is_empty() {
                    let start: String = text.chars().take(20).collect();
                    self.tell(node, Fault::Text, &format!(" holds the text \"{start}\""));
                }
                continue;
            }
            if !child.is_element() {
                continue;
            }
            let place = groups.iter().enumerate().find_map(|(index, group)| {
                group.any_of.iter().find(|it| child.has_tag_name(it.name)).map(|it| (index, *it))
            });
            let Some((index, element)) = place else {
                let text = format!(" does not belong into <{}>", node.tag_name().name());
                self.tell(child, Fault::Element, &text);
                continue;
            };
            if index < furthest {
                let earlier = groups[furthest].any_of[0].name;
                self.tell(child, Fault::Order, &format!(" must come before <{earlier}>"));
            }
            furthest = furthest.max(index);
            counts[index] += 1;
            if counts[index] > groups[index].most {
                let text = format!(" is one too many in <{}>", node.tag_name().name());
                self.tell(child, Fault::Repeated, &text);
            }
            self.element(child, element);
        }
        for (group, count) in groups.iter().zip(counts) {
            if count < group.least {
                let names: Vec<&str> = group.any_of.iter().map(|it| it.name).collect();
                let text = format!(" lacks an element <{}>", names.join("> or <"));
                self.tell(node, Fault::Missing, &text);
            }
        }
    }
}

/// Whether a value is of the type, and if not, what it should be.
fn fits(kind: Kind, value: &str) -> Result<(), String> {
    let trimmed = value.trim();
    let (fits, expected) = match kind {
        Text => (true, String::new()),
        Real => (real(trimmed), "number".to_owned()),
        Integer => (trimmed.parse::<i32>().is_ok(), "whole number of 32 bits".to_owned()),
        Unsigned => {
            (trimmed.parse::<u32>().is_ok(), "whole number from 0 to 4294967295".to_owned())
        }
        Boolean => (["true", "false", "1", "0"].contains(&trimmed), "true or false".to_owned()),
        Date => (date(trimmed), "date and time such as 2026-01-31T12:00:00Z".to_owned()),
        Indices => {
            let mut words = trimmed.split_ascii_whitespace();
            (words.all(|word| word.parse::<u32>().is_ok()), "list of indices".to_owned())
        }
        OneOf(words) => (words.contains(&trimmed), format!("one of {}", words.join(", "))),
        ManyOf(words) => {
            let mut each = trimmed.split_ascii_whitespace();
            (each.all(|word| words.contains(&word)), format!("list of {}", words.join(", ")))
        }
    };
    if fits { Ok(()) } else { Err(expected) }
}

/// A number as XML schema's `double`: that knows INF and NaN, but not `inf`, `nan` or `infinity`.
fn real(text: &str) -> bool {
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    match digits {
        "INF" | "NaN" => true,
        _ => !digits.starts_with(|c: char| c.is_alphabetic()) && text.parse::<f64>().is_ok(),
    }
}

/// `YYYY-MM-DDThh:mm:ss`, with fractions and a zone if one likes.
fn date(text: &str) -> bool {
    let shape = "dddd-dd-ddTdd:dd:dd";
    let fits = |(pattern, c): (char, char)| match pattern {
        'd' => c.is_ascii_digit(),
        other => c == other,
    };
    text.len() >= shape.len()
        && text.is_ascii()
        && shape.chars().zip(text.chars()).all(fits)
        && text[shape.len()..].chars().all(|c| c.is_ascii_digit() || "Z+-:.".contains(c))
}
