//! `modelDescription.xml` and the GUID, printed from the interface table.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::sync::Arc;

use quick_xml::events::attributes::Attribute;
use sha1::{Digest as _, Sha1};
use uuid::Uuid;

use crate::interface::{
    BASE, DeclaredVariable, Dependencies, Interface, TypeAttributes, UnitOfMeasure, VariableRole,
};
use crate::logger::Category;
use crate::resources::Resources;

/// Highest order of derivatives of an input that is not declared to take more.
pub(crate) const INPUT_DERIVATIVES: u8 = 3;
/// Highest order of derivatives that an input may be declared to take.
pub(crate) const MOST_INPUT_DERIVATIVES: u32 = 5;

/// The GUID is computed from the content of the description and from the resource files that were
/// read. The same content gives the same GUID on every machine.
pub(crate) fn guid(interface: &Interface, resources: &Resources) -> Uuid {
    let namespace = version_5(&Uuid::NAMESPACE_URL, b"urn:fmi2-export:guid");
    let hash = Sha1::new().chain_update(namespace.as_bytes());
    let mut printer =
        Printer { text: Vec::with_capacity(2 * MOST_TEXT), depth: 0, hash: Some(hash) };
    printer.document(interface, None);
    let Printer { text, hash, .. } = printer;
    let hash = hash.unwrap_or_default().chain_update(text).chain_update(b"\n");
    version_5_of(hash.chain_update(resources.fingerprint()))
}

/// Bytes of text that are hashed together: they stay in the processor's cache.
const MOST_TEXT: usize = 16 * 1024;

/// [`Uuid::new_v5`], by a SHA-1 that uses the processor's instructions for it: descriptions are hashed at
/// every start.
pub(crate) fn version_5(namespace: &Uuid, content: &[u8]) -> Uuid {
    version_5_of(Sha1::new().chain_update(namespace.as_bytes()).chain_update(content))
}

fn version_5_of(hash: Sha1) -> Uuid {
    let digest = hash.finalize();
    let mut bytes = [0; 16];
    bytes.copy_from_slice(&digest[..16]);
    uuid::Builder::from_sha1_bytes(bytes).into_uuid()
}

/// The GUID as text, in the description and for instantiation.
pub(crate) fn braced(guid: &Uuid) -> String {
    guid.braced().to_string()
}

pub(crate) fn print(interface: &Interface, guid: Option<&Uuid>) -> String {
    let mut printer = Printer { text: Vec::new(), depth: 0, hash: None };
    printer.document(interface, guid);
    printer.text.push(b'\n');
    // all of it was text before
    String::from_utf8(printer.text).unwrap_or_default()
}

/// Value of an attribute.
enum Value<'a> {
    Text(&'a str),
    /// The shortest decimal that reads back as the same number, with an exponent where it is shorter.
    Number(f64),
    Integer(i64),
    Index(usize),
    Flag(bool),
}

/// Attributes in order; `None` is left out.
type Attributes<'a> = &'a [(&'a str, Option<Value<'a>>)];

/// Prints elements, indented by two spaces. Written for speed, without an allocation per attribute.
struct Printer {
    text: Vec<u8>,
    depth: usize,
    /// Takes the text, piece by piece, if only its hash is wanted.
    hash: Option<Sha1>,
}

impl Printer {
    fn open(&mut self, name: &str, attributes: Attributes<'_>) {
        self.begin(name, attributes);
        self.text.push(b'>');
        self.depth += 1;
    }

    fn empty(&mut self, name: &str, attributes: Attributes<'_>) {
        self.begin(name, attributes);
        self.text.extend_from_slice(b"/>");
    }

    fn close(&mut self, name: &str) {
        self.depth -= 1;
        self.line("</");
        self.text.extend_from_slice(name.as_bytes());
        self.text.push(b'>');
    }

    fn line(&mut self, begin: &str) {
        if let Some(hash) = &mut self.hash
            && self.text.len() > MOST_TEXT
        {
            hash.update(&self.text);
            self.text.clear();
        }
        self.text.push(b'\n');
        for _ in 0..self.depth {
            self.text.extend_from_slice(b"  ");
        }
        self.text.extend_from_slice(begin.as_bytes());
    }

    fn begin(&mut self, name: &str, attributes: Attributes<'_>) {
        self.line("<");
        self.text.extend_from_slice(name.as_bytes());
        for (key, value) in attributes {
            if let Some(value) = value {
                self.attribute(key, value);
            }
        }
    }

    fn attribute(&mut self, key: &str, value: &Value<'_>) {
        let text = &mut self.text;
        text.push(b' ');
        text.extend_from_slice(key.as_bytes());
        text.extend_from_slice(b"=\"");
        match value {
            Value::Text(value) => push_escaped(text, value),
            Value::Number(value) => drop(write!(text, "{value:?}")),
            Value::Integer(value) => drop(write!(text, "{value}")),
            Value::Index(value) => push_index(text, *value),
            Value::Flag(value) => text.extend_from_slice(if *value { b"true" } else { b"false" }),
        }
        text.push(b'"');
    }

    fn document(&mut self, interface: &Interface, guid: Option<&Uuid>) {
        let info = &interface.info;
        self.text.extend_from_slice(b"<?xml version=\"1.0\" encoding=\"UTF-8\"?>");
        let root = "fmiModelDescription";
        let guid_text = guid.map(braced).unwrap_or_default();
        self.open(
            root,
            &[
                ("fmiVersion", text("2.0")),
                ("modelName", text(&info.model_name)),
                ("guid", text(&guid_text)),
                ("description", filled(&info.description)),
                ("author", filled(&info.author)),
                ("version", filled(&info.version)),
                ("copyright", filled(&info.copyright)),
                ("license", filled(&info.license)),
                ("generationTool", text(concat!("fmi2-export ", env!("CARGO_PKG_VERSION")))),
                ("variableNamingConvention", text("flat")),
                ("numberOfEventIndicators", text("0")),
            ],
        );
        self.co_simulation(interface);
        self.units(interface);
        self.categories();
        self.experiment(interface);
        if guid.is_some() {
            self.annotations(interface);
        }
        self.open("ModelVariables", &[]);
        for variable in &interface.variables {
            self.variable(variable);
        }
        self.close("ModelVariables");
        self.structure(interface);
        self.close(root);
    }

    fn co_simulation(&mut self, interface: &Interface) {
        let order = interface.max_output_derivative_order();
        let limits = &interface.limits;
        self.empty(
            "CoSimulation",
            &[
                ("modelIdentifier", text(&interface.info.model_identifier)),
                ("needsExecutionTool", Some(Value::Flag(limits.alone.is_some()))),
                (
                    "canHandleVariableCommunicationStepSize",
                    Some(Value::Flag(limits.variable_step.is_none())),
                ),
                ("canInterpolateInputs", text("true")),
                ("maxOutputDerivativeOrder", integer(order)),
                // The standard spells it this way.
                ("canRunAsynchronuously", text("false")),
                (
                    "canBeInstantiatedOnlyOncePerProcess",
                    Some(Value::Flag(limits.instances.is_some())),
                ),
                ("canNotUseMemoryManagementFunctions", text("true")),
                ("canGetAndSetFMUstate", Some(Value::Flag(limits.states.is_none()))),
                ("canSerializeFMUstate", Some(Value::Flag(limits.states.is_none()))),
                ("providesDirectionalDerivative", Some(Value::Flag(limits.directional.is_none()))),
            ],
        );
    }

    fn units(&mut self, interface: &Interface) {
        let mut used: BTreeMap<&str, &UnitOfMeasure> = BTreeMap::new();
        for variable in &interface.variables {
            if let TypeAttributes::Real { unit: Some(unit), .. } = &variable.data {
                used.insert(unit.name, unit);
            }
        }
        if used.is_empty() {
            return;
        }
        self.open("UnitDefinitions", &[]);
        for unit in used.into_values() {
            self.unit(unit);
        }
        self.close("UnitDefinitions");
    }

    fn unit(&mut self, unit: &UnitOfMeasure) {
        self.open("Unit", &[("name", text(unit.name))]);
        let mut base: Vec<_> = BASE
            .into_iter()
            .zip(unit.exponents)
            .map(|(name, exponent)| {
                (name, (exponent != 0).then(|| Value::Integer(exponent.into())))
            })
            .collect();
        base.push(("factor", (unit.factor != 1.0).then_some(Value::Number(unit.factor))));
        base.push(("offset", (unit.offset != 0.0).then_some(Value::Number(unit.offset))));
        self.empty("BaseUnit", &base);
        for display in unit.displays {
            self.empty(
                "DisplayUnit",
                &[
                    ("name", text(display.name)),
                    ("factor", (display.factor != 1.0).then_some(Value::Number(display.factor))),
                    ("offset", (display.offset != 0.0).then_some(Value::Number(display.offset))),
                ],
            );
        }
        self.close("Unit");
    }

    fn categories(&mut self) {
        self.open("LogCategories", &[]);
        for category in Category::ALL {
            let name = category.name().to_string_lossy();
            let description = text(category.description());
            self.empty("Category", &[("name", text(&name)), ("description", description)]);
        }
        self.close("LogCategories");
    }

    fn experiment(&mut self, interface: &Interface) {
        let Some(experiment) = &interface.info.experiment else { return };
        self.empty(
            "DefaultExperiment",
            &[
                ("startTime", Some(Value::Number(experiment.start))),
                ("stopTime", Some(Value::Number(experiment.stop))),
                ("tolerance", experiment.tolerance.map(Value::Number)),
                ("stepSize", Some(Value::Number(experiment.step))),
            ],
        );
    }

    /// Capabilities that the standard cannot express: the highest order of input derivatives,
    /// accepted in one call for all orders, inputs that take more, and the outputs that offer
    /// derivatives, by order: those worth their cost for extrapolation, and those that have more for
    /// interpolation.
    /// Without them an importer would have to try, and after `fmi2Error` an instance must not be
    /// continued. They do not change what a unit computes, so they are not part of the GUID.
    fn annotations(&mut self, interface: &Interface) {
        self.open("VendorAnnotations", &[]);
        self.open("Tool", &[("name", text("fmi2-export"))]);
        let inputs = [("inputs", integer(INPUT_DERIVATIVES))];
        let mut lists = Vec::new();
        let mut list = |element, order: u32, chosen: &dyn Fn(&DeclaredVariable) -> bool| {
            let variables = interface.variables.iter().enumerate();
            let listed = ranges(variables.filter(|(_, it)| chosen(it)).map(|(index, _)| index + 1));
            if !listed.is_empty() {
                lists.push((element, order, listed));
            }
        };
        let least = u32::from(INPUT_DERIVATIVES);
        for order in least + 1..=MOST_INPUT_DERIVATIVES {
            list("Inputs", order, &|it| it.taken == order);
        }
        let highest = interface.max_output_derivative_order();
        for order in 1..=highest {
            list("Outputs", order, &|it| it.derivatives == order);
        }
        for order in 1..=highest {
            list("Interpolation", order, &|it| it.interpolated == order && order > it.derivatives);
        }
        if lists.is_empty() {
            self.empty("Derivatives", &inputs);
        } else {
            self.open("Derivatives", &inputs);
            for (element, order, listed) in lists {
                self.empty(element, &[("order", integer(order)), ("variables", text(&listed))]);
            }
            self.close("Derivatives");
        }
        self.close("Tool");
        self.close("VendorAnnotations");
    }

    fn variable(&mut self, variable: &DeclaredVariable) {
        let (causality, variability, initial) = class(variable);
        self.open(
            "ScalarVariable",
            &[
                ("name", text(&variable.name)),
                ("valueReference", integer(variable.reference)),
                ("description", filled(&variable.description)),
                ("causality", text(causality)),
                ("variability", text(variability)),
                ("initial", initial.map(Value::Text)),
            ],
        );
        match &variable.data {
            TypeAttributes::Real { start, min, max, nominal, unit, display } => self.empty(
                "Real",
                &[
                    ("unit", unit.map(|unit| Value::Text(unit.name))),
                    ("displayUnit", display.map(Value::Text)),
                    ("min", min.map(Value::Number)),
                    ("max", max.map(Value::Number)),
                    ("nominal", nominal.map(Value::Number)),
                    ("start", start.map(Value::Number)),
                ],
            ),
            TypeAttributes::Integer { start, min, max } => self.empty(
                "Integer",
                &[
                    ("min", min.and_then(integer)),
                    ("max", max.and_then(integer)),
                    ("start", start.and_then(integer)),
                ],
            ),
            TypeAttributes::Boolean { start } => {
                self.empty("Boolean", &[("start", start.map(Value::Flag))]);
            }
            TypeAttributes::Text { start } => {
                self.empty("String", &[("start", start.as_deref().map(Value::Text))])
            }
        }
        self.close("ScalarVariable");
    }

    fn structure(&mut self, interface: &Interface) {
        let outputs = indices(interface, |role| role == VariableRole::Output);
        let unknowns = indices(interface, |role| {
            matches!(role, VariableRole::Output | VariableRole::CalculatedParameter)
        });
        self.open("ModelStructure", &[]);
        self.unknowns("Outputs", &outputs, &interface.depends);
        self.unknowns("InitialUnknowns", &unknowns, &interface.initially);
        self.close("ModelStructure");
    }

    fn unknowns(&mut self, name: &str, unknowns: &[usize], dependencies: &Dependencies) {
        if unknowns.is_empty() {
            return;
        }
        self.open(name, &[]);
        // neighbours often depend on the same: the text of their lists is copied
        let (mut last, mut list) = (None, Vec::new());
        for &unknown in unknowns {
            // FMI counts from 1; dependencies are ascending, as the standard asks
            self.begin("Unknown", &[("index", Some(Value::Index(unknown + 1)))]);
            if let Some(knowns) = dependencies.get(&unknown) {
                self.text.extend_from_slice(b" dependencies=\"");
                if !last.is_some_and(|last| Arc::ptr_eq(last, knowns)) {
                    list.clear();
                    push_indices(&mut list, knowns);
                    last = Some(knowns);
                }
                self.text.extend_from_slice(&list);
                self.text.push(b'"');
            }
            self.text.extend_from_slice(b"/>");
        }
        self.close(name);
    }
}

/// Causality, variability and `initial` of a variable. `initial` is left out where the standard
/// forbids it or has the same default.
fn class(variable: &DeclaredVariable) -> (&'static str, &'static str, Option<&'static str>) {
    let varying = if variable.discrete { "discrete" } else { "continuous" };
    match variable.role {
        VariableRole::Input => ("input", varying, None),
        VariableRole::Parameter => ("parameter", "fixed", Some("exact")),
        VariableRole::Tunable => ("parameter", "tunable", Some("exact")),
        VariableRole::CalculatedParameter => ("calculatedParameter", "fixed", Some("calculated")),
        VariableRole::Output => ("output", varying, Some("calculated")),
        VariableRole::Local => ("local", varying, Some("calculated")),
        VariableRole::Constant => ("local", "constant", Some("exact")),
    }
}

/// Ascending numbers as a list of numbers and ranges: `3 5-12`.
fn ranges(numbers: impl Iterator<Item = usize>) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for number in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let run = |&(first, last): &(usize, usize)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    runs.iter().map(run).collect::<Vec<_>>().join(" ")
}

fn indices(interface: &Interface, wanted: impl Fn(VariableRole) -> bool) -> Vec<usize> {
    let variables = interface.variables.iter().enumerate();
    variables.filter(|(_, variable)| wanted(variable.role)).map(|(index, _)| index).collect()
}

fn text(value: &str) -> Option<Value<'_>> {
    Some(Value::Text(value))
}

fn filled(value: &str) -> Option<Value<'_>> {
    (!value.is_empty()).then_some(Value::Text(value))
}

fn integer<'a>(value: impl Into<i64>) -> Option<Value<'a>> {
    Some(Value::Integer(value.into()))
}

fn push_escaped(text: &mut Vec<u8>, value: &str) {
    let special = |c: u8| c < b' ' || matches!(c, b'<' | b'>' | b'&' | b'"' | b'\'');
    if value.bytes().any(special) {
        text.extend_from_slice(Attribute::from(("", value)).value.as_bytes());
    } else {
        text.extend_from_slice(value.as_bytes());
    }
}

/// A list of indices, from 1.
fn push_indices(text: &mut Vec<u8>, indices: &[usize]) {
    for (k, index) in indices.iter().enumerate() {
        if k > 0 {
            text.push(b' ');
        }
        push_index(text, index + 1);
    }
}

/// The digits of a number: faster than `write!`, for lists of many thousand dependencies.
fn push_index(text: &mut Vec<u8>, mut value: usize) {
    let (mut digits, mut first) = ([0; 20], 20);
    loop {
        first -= 1;
        digits[first] = b'0' + (value % 10) as u8;
        value /= 10;
        if value == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[first..]);
}
