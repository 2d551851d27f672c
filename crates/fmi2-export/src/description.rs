//! `modelDescription.xml` and the GUID, printed from the interface table.

use std::collections::BTreeMap;
use std::fmt::{Debug, Display};
use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesStart, Event};
use uuid::Uuid;

use crate::Error;
use crate::interface::{
    BASE, DeclaredVariable, Dependencies, Interface, TypeAttributes, UnitOfMeasure, VariableRole,
};
use crate::logger::Category;
use crate::resources::Resources;

/// Highest order of derivatives of inputs that the kit takes.
pub(crate) const INPUT_DERIVATIVES: i32 = 3;

/// The GUID is computed from the content of the description and from the resource files that were
/// read. The same content gives the same GUID on every machine.
pub(crate) fn guid(interface: &Interface, resources: &Resources) -> Uuid {
    // If printing fails, `describe` fails in the same way, so the hash does not matter.
    let mut content = print(interface, None).unwrap_or_default().into_bytes();
    content.extend(resources.fingerprint());
    let kit = Uuid::new_v5(&Uuid::NAMESPACE_URL, b"urn:fmi2-export:guid");
    Uuid::new_v5(&kit, &content)
}

/// The GUID as text, in the description and for instantiation.
pub(crate) fn braced(guid: &Uuid) -> String {
    guid.braced().to_string()
}

pub(crate) fn print(interface: &Interface, guid: Option<&Uuid>) -> Result<String, Error> {
    let failed = |error: &dyn Display| Error::invalid(format!("model description: {error}"));
    let mut printer = Printer { writer: Writer::new_with_indent(Vec::new(), b' ', 2) };
    printer.document(interface, guid).map_err(|error| failed(&error))?;
    let mut text = printer.writer.into_inner();
    text.push(b'\n');
    String::from_utf8(text).map_err(|error| failed(&error))
}

/// Attributes in order; `None` is left out.
type Attributes<'a> = &'a [(&'a str, Option<String>)];

struct Printer {
    writer: Writer<Vec<u8>>,
}

impl Printer {
    fn open(&mut self, name: &str, attributes: Attributes<'_>) -> io::Result<()> {
        self.writer.write_event(Event::Start(element(name, attributes)))
    }

    fn empty(&mut self, name: &str, attributes: Attributes<'_>) -> io::Result<()> {
        self.writer.write_event(Event::Empty(element(name, attributes)))
    }

    fn close(&mut self, name: &str) -> io::Result<()> {
        self.writer.write_event(Event::End(BytesStart::new(name).to_end()))
    }

    fn document(&mut self, interface: &Interface, guid: Option<&Uuid>) -> io::Result<()> {
        let info = &interface.info;
        self.writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        let root = "fmiModelDescription";
        self.open(
            root,
            &[
                ("fmiVersion", text("2.0")),
                ("modelName", text(&info.model_name)),
                ("guid", text(guid.map(braced).unwrap_or_default())),
                ("description", filled(&info.description)),
                ("author", filled(&info.author)),
                ("version", filled(&info.version)),
                ("copyright", filled(&info.copyright)),
                ("license", filled(&info.license)),
                ("generationTool", text(concat!("fmi2-export ", env!("CARGO_PKG_VERSION")))),
                ("variableNamingConvention", text("flat")),
                ("numberOfEventIndicators", text("0")),
            ],
        )?;
        self.co_simulation(interface)?;
        self.units(interface)?;
        self.categories()?;
        self.experiment(interface)?;
        if guid.is_some() {
            self.annotations(interface)?;
        }
        self.open("ModelVariables", &[])?;
        for variable in &interface.variables {
            self.variable(variable)?;
        }
        self.close("ModelVariables")?;
        self.structure(interface)?;
        self.close(root)
    }

    fn co_simulation(&mut self, interface: &Interface) -> io::Result<()> {
        let order = interface.max_output_derivative_order();
        let limits = &interface.limits;
        self.empty(
            "CoSimulation",
            &[
                ("modelIdentifier", text(&interface.info.model_identifier)),
                ("needsExecutionTool", text(limits.alone.is_some())),
                ("canHandleVariableCommunicationStepSize", text(limits.variable_step.is_none())),
                ("canInterpolateInputs", text("true")),
                ("maxOutputDerivativeOrder", text(order)),
                // The standard spells it this way.
                ("canRunAsynchronuously", text("false")),
                ("canBeInstantiatedOnlyOncePerProcess", text(limits.instances.is_some())),
                ("canNotUseMemoryManagementFunctions", text("true")),
                ("canGetAndSetFMUstate", text(limits.states.is_none())),
                ("canSerializeFMUstate", text(limits.states.is_none())),
                ("providesDirectionalDerivative", text(limits.directional.is_none())),
            ],
        )
    }

    fn units(&mut self, interface: &Interface) -> io::Result<()> {
        let mut used: BTreeMap<&str, &UnitOfMeasure> = BTreeMap::new();
        for variable in &interface.variables {
            if let TypeAttributes::Real { unit: Some(unit), .. } = &variable.data {
                used.insert(unit.name, unit);
            }
        }
        if used.is_empty() {
            return Ok(());
        }
        self.open("UnitDefinitions", &[])?;
        for unit in used.into_values() {
            self.unit(unit)?;
        }
        self.close("UnitDefinitions")
    }

    fn unit(&mut self, unit: &UnitOfMeasure) -> io::Result<()> {
        self.open("Unit", &[("name", text(unit.name))])?;
        let mut base: Vec<_> = BASE
            .into_iter()
            .zip(unit.exponents)
            .map(|(name, exponent)| (name, (exponent != 0).then(|| exponent.to_string())))
            .collect();
        base.push(("factor", (unit.factor != 1.0).then(|| number(unit.factor))));
        base.push(("offset", (unit.offset != 0.0).then(|| number(unit.offset))));
        self.empty("BaseUnit", &base)?;
        for display in unit.displays {
            self.empty(
                "DisplayUnit",
                &[
                    ("name", text(display.name)),
                    ("factor", (display.factor != 1.0).then(|| number(display.factor))),
                    ("offset", (display.offset != 0.0).then(|| number(display.offset))),
                ],
            )?;
        }
        self.close("Unit")
    }

    fn categories(&mut self) -> io::Result<()> {
        self.open("LogCategories", &[])?;
        for category in Category::ALL {
            let name = category.name().to_string_lossy().into_owned();
            let description = text(category.description());
            self.empty("Category", &[("name", Some(name)), ("description", description)])?;
        }
        self.close("LogCategories")
    }

    fn experiment(&mut self, interface: &Interface) -> io::Result<()> {
        let Some(experiment) = &interface.info.experiment else { return Ok(()) };
        self.empty(
            "DefaultExperiment",
            &[
                ("startTime", Some(number(experiment.start))),
                ("stopTime", Some(number(experiment.stop))),
                ("tolerance", experiment.tolerance.map(number)),
                ("stepSize", Some(number(experiment.step))),
            ],
        )
    }

    /// Capabilities that the standard cannot express: the highest order of input derivatives,
    /// accepted in one call for all orders, and the outputs that offer derivatives, by order.
    /// Without them an importer would have to try, and after `fmi2Error` an instance must not be
    /// continued. They do not change what a unit computes, so they are not part of the GUID.
    fn annotations(&mut self, interface: &Interface) -> io::Result<()> {
        self.open("VendorAnnotations", &[])?;
        self.open("Tool", &[("name", text("fmi2-export"))])?;
        let inputs = [("inputs", text(INPUT_DERIVATIVES))];
        let highest = interface.max_output_derivative_order();
        if highest == 0 {
            self.empty("Derivatives", &inputs)?;
        } else {
            self.open("Derivatives", &inputs)?;
            for order in 1..=highest {
                let variables = interface.variables.iter().enumerate();
                let offering = variables.filter(|(_, variable)| variable.derivatives == order);
                let list = ranges(offering.map(|(index, _)| index + 1));
                if !list.is_empty() {
                    let attributes = [("order", text(order)), ("variables", Some(list))];
                    self.empty("Outputs", &attributes)?;
                }
            }
            self.close("Derivatives")?;
        }
        self.close("Tool")?;
        self.close("VendorAnnotations")
    }

    fn variable(&mut self, variable: &DeclaredVariable) -> io::Result<()> {
        let (causality, variability, initial) = class(variable);
        self.open(
            "ScalarVariable",
            &[
                ("name", text(&variable.name)),
                ("valueReference", text(variable.reference)),
                ("description", filled(&variable.description)),
                ("causality", text(causality)),
                ("variability", text(variability)),
                ("initial", initial.map(str::to_owned)),
            ],
        )?;
        match &variable.data {
            TypeAttributes::Real { start, min, max, nominal, unit, display } => self.empty(
                "Real",
                &[
                    ("unit", unit.map(|unit| unit.name.to_owned())),
                    ("displayUnit", display.map(str::to_owned)),
                    ("min", min.map(number)),
                    ("max", max.map(number)),
                    ("nominal", nominal.map(number)),
                    ("start", start.map(number)),
                ],
            )?,
            TypeAttributes::Integer { start, min, max } => self.empty(
                "Integer",
                &[
                    ("min", min.map(|min| min.to_string())),
                    ("max", max.map(|max| max.to_string())),
                    ("start", start.map(|start| start.to_string())),
                ],
            )?,
            TypeAttributes::Boolean { start } => {
                self.empty("Boolean", &[("start", start.map(|start| start.to_string()))])?;
            }
            TypeAttributes::Text { start } => self.empty("String", &[("start", start.clone())])?,
        }
        self.close("ScalarVariable")
    }

    fn structure(&mut self, interface: &Interface) -> io::Result<()> {
        let outputs = indices(interface, |role| role == VariableRole::Output);
        let unknowns = indices(interface, |role| {
            matches!(role, VariableRole::Output | VariableRole::CalculatedParameter)
        });
        self.open("ModelStructure", &[])?;
        self.unknowns("Outputs", &outputs, &interface.depends)?;
        self.unknowns("InitialUnknowns", &unknowns, &interface.initially)?;
        self.close("ModelStructure")
    }

    fn unknowns(
        &mut self,
        name: &str,
        unknowns: &[usize],
        dependencies: &Dependencies,
    ) -> io::Result<()> {
        if unknowns.is_empty() {
            return Ok(());
        }
        self.open(name, &[])?;
        for unknown in unknowns {
            // FMI counts from 1. A BTreeSet is ascending, as the standard asks.
            let list = dependencies.get(unknown).map(|knowns| {
                let knowns: Vec<_> = knowns.iter().map(|known| (known + 1).to_string()).collect();
                knowns.join(" ")
            });
            self.empty("Unknown", &[("index", text(unknown + 1)), ("dependencies", list)])?;
        }
        self.close(name)
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

fn element<'a>(name: &'a str, attributes: Attributes<'a>) -> BytesStart<'a> {
    let mut element = BytesStart::new(name);
    for (key, value) in attributes {
        if let Some(value) = value {
            element.push_attribute((*key, value.as_str()));
        }
    }
    element
}

fn text(value: impl Display) -> Option<String> {
    Some(value.to_string())
}

fn filled(value: &str) -> Option<String> {
    (!value.is_empty()).then(|| value.to_owned())
}

/// The shortest decimal that reads back as the same number, with an exponent where it is shorter.
fn number(value: impl Debug) -> String {
    format!("{value:?}")
}
