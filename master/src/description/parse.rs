//! From XML text to [`Description`].

use std::collections::{HashMap, HashSet};
use std::str::FromStr;

use roxmltree::{Document, Node, ParsingOptions};
use thiserror::Error;

use super::{
    BaseUnit, Causality, CoSimulation, DefaultExperiment, Description, Finding, Initial, Severity,
    Type, UnitDefinition, Unknown, Value, Variability, Variable,
};

/// More XML nodes than this are refused.
const MAX_NODES: u32 = 20_000_000;

/// Why a description cannot be used.
#[derive(Debug, Error)]
pub enum DescriptionError {
    /// It is not well-formed XML.
    #[error("modelDescription.xml is not well-formed XML")]
    Xml(#[source] roxmltree::Error),
    /// It contains a document type declaration.
    #[error("modelDescription.xml contains a document type declaration (DTD), which is refused")]
    Dtd,
    /// The root is not `fmiModelDescription`.
    #[error("the root element is <{0}>, not <fmiModelDescription>")]
    Root(String),
    /// Another version of the standard.
    #[error("the unit is made for FMI {0}; this master runs FMI 2.0")]
    Version(String),
    /// No co-simulation.
    #[error("the unit has no <CoSimulation> element{}", if *.model_exchange { ": it is for model exchange only" } else { "" })]
    NoCoSimulation {
        /// It offers model exchange instead.
        model_exchange: bool,
    },
    /// An attribute is missing.
    #[error("line {line}: <{element}> lacks the attribute \"{attribute}\"")]
    Missing {
        /// Name of the element.
        element: String,
        /// Name of the attribute.
        attribute: &'static str,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// An attribute cannot be read.
    #[error("line {line}: {attribute}=\"{value}\" of <{element}> is no {expected}")]
    Invalid {
        /// Name of the element.
        element: String,
        /// Name of the attribute.
        attribute: String,
        /// Its text.
        value: String,
        /// What it should be.
        expected: &'static str,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// An identifier that would escape the unit's folder or cannot be a file name.
    #[error("modelIdentifier \"{0}\" is not a C identifier")]
    Identifier(String),
    /// A variable has no type element.
    #[error("line {line}: variable \"{name}\" has no type")]
    NoType {
        /// Name of the variable.
        name: String,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// Two variables have the same name.
    #[error("line {line}: variable \"{name}\" occurs twice")]
    Duplicate {
        /// Name of both.
        name: String,
        /// Line of the second.
        line: u32,
    },
}

type Result<T> = std::result::Result<T, DescriptionError>;

impl Description {
    /// Reads the text of a modelDescription.xml.
    ///
    /// # Errors
    /// What makes the unit unusable: no well-formed XML, a DTD, another FMI version, no
    /// co-simulation, attributes missing that cannot be guessed.
    pub fn parse(text: &str) -> Result<Self> {
        let options = ParsingOptions {
            allow_dtd: false,
            nodes_limit: MAX_NODES,
            ..ParsingOptions::default()
        };
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let document =
            Document::parse_with_options(text, options).map_err(|error| match error {
                roxmltree::Error::DtdDetected => DescriptionError::Dtd,
                other => DescriptionError::Xml(other),
            })?;
        Reader { document: &document, findings: Vec::new(), known: HashSet::new() }.read()
    }
}

struct Reader<'a> {
    document: &'a Document<'a>,
    findings: Vec<Finding>,
    /// unknown attributes are reported once each
    known: HashSet<String>,
}

impl<'a> Reader<'a> {
    fn read(mut self) -> Result<Description> {
        let root = self.document.root_element();
        if root.tag_name().name() != "fmiModelDescription" {
            return Err(DescriptionError::Root(root.tag_name().name().to_owned()));
        }
        let fmi_version = self.required(root, "fmiVersion")?.to_owned();
        if fmi_version != "2.0" {
            return Err(DescriptionError::Version(fmi_version));
        }
        let text = |name: &str| root.attribute(name).map(str::to_owned);
        let types = self.types(root)?;
        let variables = self.variables(root, &types)?;
        let by_name = self.index(&variables)?;
        let (outputs, initial_unknowns) = self.structure(root, &variables)?;
        let mut description = Description {
            fmi_version,
            model_name: self.required(root, "modelName")?.to_owned(),
            guid: self.required(root, "guid")?.to_owned(),
            description: text("description"),
            author: text("author"),
            version: text("version"),
            copyright: text("copyright"),
            license: text("license"),
            generation_tool: text("generationTool"),
            generation_date_and_time: text("generationDateAndTime"),
            variable_naming_convention: text("variableNamingConvention")
                .unwrap_or_else(|| "flat".to_owned()),
            co_simulation: self.co_simulation(root)?,
            units: self.units(root)?,
            log_categories: children(root, "LogCategories", "Category")
                .filter_map(|node| node.attribute("name").map(str::to_owned))
                .collect(),
            default_experiment: self.experiment(root)?,
            variables,
            outputs,
            initial_unknowns,
            findings: Vec::new(),
            by_name,
        };
        description.findings = self.findings;
        Ok(description)
    }

    fn co_simulation(&mut self, root: Node<'a, 'a>) -> Result<CoSimulation> {
        let Some(node) = child(root, "CoSimulation") else {
            let model_exchange = child(root, "ModelExchange").is_some();
            return Err(DescriptionError::NoCoSimulation { model_exchange });
        };
        let model_identifier = self.required(node, "modelIdentifier")?.to_owned();
        let mut letters = model_identifier.chars();
        let head = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
        if !head || !letters.all(|c| c.is_ascii_alphanumeric() || c == '_') {
            // some exporters write dashes; only what could leave the folder is unusable
            if model_identifier.is_empty()
                || model_identifier.contains(['/', '\\', ':', '\0'])
                || model_identifier.starts_with('.')
            {
                return Err(DescriptionError::Identifier(model_identifier));
            }
            self.note(
                "model-identifier",
                Severity::Error,
                format!("modelIdentifier \"{model_identifier}\" is not a C identifier"),
            );
        }
        let flag = |name| self.boolean(node, name);
        Ok(CoSimulation {
            needs_execution_tool: flag("needsExecutionTool")?,
            can_handle_variable_communication_step_size: flag(
                "canHandleVariableCommunicationStepSize",
            )?,
            can_interpolate_inputs: flag("canInterpolateInputs")?,
            can_run_asynchronuously: flag("canRunAsynchronuously")?,
            can_be_instantiated_only_once_per_process: flag("canBeInstantiatedOnlyOncePerProcess")?,
            can_not_use_memory_management_functions: flag("canNotUseMemoryManagementFunctions")?,
            can_get_and_set_fmu_state: flag("canGetAndSetFMUstate")?,
            can_serialize_fmu_state: flag("canSerializeFMUstate")?,
            provides_directional_derivative: flag("providesDirectionalDerivative")?,
            max_output_derivative_order: self
                .number(node, "maxOutputDerivativeOrder", "non-negative whole number")?
                .unwrap_or(0),
            model_identifier,
        })
    }

    fn units(&mut self, root: Node<'a, 'a>) -> Result<Vec<UnitDefinition>> {
        children(root, "UnitDefinitions", "Unit")
            .map(|node| {
                let base = child(node, "BaseUnit").map(|base| self.base_unit(base)).transpose()?;
                let display_units = node
                    .children()
                    .filter(|child| child.has_tag_name("DisplayUnit"))
                    .map(|display| {
                        let factor = self.number(display, "factor", "number")?.unwrap_or(1.0);
                        let offset = self.number(display, "offset", "number")?.unwrap_or(0.0);
                        Ok((self.required(display, "name")?.to_owned(), factor, offset))
                    })
                    .collect::<Result<_>>()?;
                Ok(UnitDefinition {
                    name: self.required(node, "name")?.to_owned(),
                    base,
                    display_units,
                })
            })
            .collect()
    }

    fn base_unit(&mut self, node: Node<'a, 'a>) -> Result<BaseUnit> {
        let mut exponents = [0; 8];
        for (name, exponent) in super::units::BASE_NAMES.iter().zip(&mut exponents) {
            *exponent = self.number(node, name, "whole number")?.unwrap_or(0);
        }
        let factor: f64 = self.number(node, "factor", "number")?.unwrap_or(1.0);
        let offset: f64 = self.number(node, "offset", "number")?.unwrap_or(0.0);
        if factor == 0.0 || !factor.is_finite() || !offset.is_finite() {
            let attribute = if offset.is_finite() { "factor" } else { "offset" };
            return Err(self.invalid(node, attribute, "finite number other than zero"));
        }
        Ok(BaseUnit { exponents, factor, offset })
    }

    fn experiment(&mut self, root: Node<'a, 'a>) -> Result<DefaultExperiment> {
        let Some(node) = child(root, "DefaultExperiment") else {
            return Ok(DefaultExperiment::default());
        };
        Ok(DefaultExperiment {
            start_time: self.number(node, "startTime", "number")?,
            stop_time: self.number(node, "stopTime", "number")?,
            tolerance: self.number(node, "tolerance", "number")?,
            step_size: self.number(node, "stepSize", "number")?,
        })
    }

    /// The attributes that a declared type lends to its variables: its child element by name.
    fn types(&mut self, root: Node<'a, 'a>) -> Result<HashMap<&'a str, Node<'a, 'a>>> {
        let mut types = HashMap::new();
        for node in children(root, "TypeDefinitions", "SimpleType") {
            if let Some(element) = node.children().find(|child| type_of(*child).is_some()) {
                types.insert(self.required(node, "name")?, element);
            }
        }
        Ok(types)
    }

    fn variables(
        &mut self,
        root: Node<'a, 'a>,
        types: &HashMap<&'a str, Node<'a, 'a>>,
    ) -> Result<Vec<Variable>> {
        children(root, "ModelVariables", "ScalarVariable")
            .map(|node| self.variable(node, types))
            .collect()
    }

    fn variable(
        &mut self,
        node: Node<'a, 'a>,
        types: &HashMap<&'a str, Node<'a, 'a>>,
    ) -> Result<Variable> {
        self.tell_unknown(
            node,
            &[
                "name",
                "valueReference",
                "description",
                "causality",
                "variability",
                "initial",
                "canHandleMultipleSetPerTimeInstant",
            ],
        );
        let name = self.required(node, "name")?.to_owned();
        let Some((kind, element)) =
            node.children().find_map(|child| type_of(child).map(|kind| (kind, child)))
        else {
            return Err(DescriptionError::NoType { name, line: self.line(node) });
        };
        let declared = element.attribute("declaredType").and_then(|name| types.get(name)).copied();
        if declared.is_none()
            && let Some(missing) = element.attribute("declaredType")
        {
            self.note(
                "declared-type",
                Severity::Error,
                format!("variable \"{name}\" has the type \"{missing}\", which is not defined"),
            );
        }
        // an attribute given by the variable wins over its type's
        let place = |attribute| match declared {
            Some(declared) if element.attribute(attribute).is_none() => declared,
            _ => element,
        };
        let causality = self.causality(node)?;
        let variability = self.variability(node, kind)?;
        let given = self.initial(node)?;
        let value_reference = self
            .number(node, "valueReference", "non-negative whole number")?
            .ok_or_else(|| self.missing(node, "valueReference"))?;
        let text = |attribute| place(attribute).attribute(attribute).map(str::to_owned);
        Ok(Variable {
            value_reference,
            kind,
            causality,
            variability,
            initial: given.or_else(|| default_initial(causality, variability)),
            initial_given: given.is_some(),
            start: self.start(element, kind)?,
            unit: text("unit"),
            display_unit: text("displayUnit"),
            min: self.number(place("min"), "min", "number")?,
            max: self.number(place("max"), "max", "number")?,
            nominal: self.number(place("nominal"), "nominal", "number")?,
            description: node.attribute("description").map(str::to_owned),
            derivative_of: self
                .number::<usize>(element, "derivative", "index of a variable")?
                .and_then(|index| index.checked_sub(1)),
            name,
        })
    }

    fn start(&mut self, element: Node<'a, 'a>, kind: Type) -> Result<Option<Value>> {
        let Some(text) = element.attribute("start") else { return Ok(None) };
        Ok(Some(match kind {
            Type::Real => match self.number(element, "start", "number")? {
                Some(value) => Value::Real(value),
                None => return Ok(None),
            },
            Type::Integer | Type::Enumeration => {
                match self.number(element, "start", "whole number")? {
                    Some(value) => Value::Integer(value),
                    None => return Ok(None),
                }
            }
            Type::Boolean => Value::Boolean(self.boolean(element, "start")?),
            Type::String => Value::String(text.to_owned()),
        }))
    }

    fn causality(&mut self, node: Node<'a, 'a>) -> Result<Causality> {
        Ok(match node.attribute("causality") {
            None | Some("local") => Causality::Local,
            Some("parameter") => Causality::Parameter,
            Some("calculatedParameter") => Causality::CalculatedParameter,
            Some("input") => Causality::Input,
            Some("output") => Causality::Output,
            Some("independent") => Causality::Independent,
            Some(_) => return Err(self.invalid(node, "causality", "causality of FMI 2.0")),
        })
    }

    fn variability(&mut self, node: Node<'a, 'a>, kind: Type) -> Result<Variability> {
        Ok(match node.attribute("variability") {
            // the standard's default is continuous, which only a Real can be
            None if kind == Type::Real => Variability::Continuous,
            None => Variability::Discrete,
            Some("constant") => Variability::Constant,
            Some("fixed") => Variability::Fixed,
            Some("tunable") => Variability::Tunable,
            Some("discrete") => Variability::Discrete,
            Some("continuous") => Variability::Continuous,
            Some(_) => return Err(self.invalid(node, "variability", "variability of FMI 2.0")),
        })
    }

    fn initial(&mut self, node: Node<'a, 'a>) -> Result<Option<Initial>> {
        Ok(match node.attribute("initial") {
            None => None,
            Some("exact") => Some(Initial::Exact),
            Some("approx") => Some(Initial::Approx),
            Some("calculated") => Some(Initial::Calculated),
            Some(_) => return Err(self.invalid(node, "initial", "exact, approx or calculated")),
        })
    }

    fn index(&self, variables: &[Variable]) -> Result<HashMap<String, usize>> {
        let mut by_name = HashMap::with_capacity(variables.len());
        let root = self.document.root_element();
        for (index, variable) in variables.iter().enumerate() {
            if by_name.insert(variable.name.clone(), index).is_some() {
                let node = children(root, "ModelVariables", "ScalarVariable").nth(index);
                return Err(DescriptionError::Duplicate {
                    name: variable.name.clone(),
                    line: node.map_or(0, |node| self.line(node)),
                });
            }
        }
        Ok(by_name)
    }

    fn structure(
        &mut self,
        root: Node<'a, 'a>,
        variables: &[Variable],
    ) -> Result<(Vec<Unknown>, Vec<Unknown>)> {
        let Some(node) = child(root, "ModelStructure") else {
            self.note(
                "model-structure",
                Severity::Error,
                "there is no <ModelStructure>: every output is taken to depend on every input"
                    .to_owned(),
            );
            return Ok((Vec::new(), Vec::new()));
        };
        let outputs = self.unknowns(node, "Outputs", variables.len())?;
        let initial = self.unknowns(node, "InitialUnknowns", variables.len())?;
        Ok((outputs, initial))
    }

    fn unknowns(
        &mut self,
        structure: Node<'a, 'a>,
        list: &'static str,
        count: usize,
    ) -> Result<Vec<Unknown>> {
        let mut unknowns = Vec::new();
        for node in children(structure, list, "Unknown") {
            let Some(variable) = self.position(node, "index", count)? else { continue };
            let dependencies = match node.attribute("dependencies") {
                None => None,
                Some(text) => {
                    let mut indices = Vec::new();
                    for word in text.split_ascii_whitespace() {
                        match word.parse::<usize>() {
                            Ok(index) if (1..=count).contains(&index) => indices.push(index - 1),
                            Ok(index) => self.out_of_range(list, index, count),
                            Err(_) => {
                                return Err(self.invalid(node, "dependencies", "list of indices"));
                            }
                        }
                    }
                    Some(indices)
                }
            };
            unknowns.push(Unknown { variable, dependencies });
        }
        Ok(unknowns)
    }

    fn position(
        &mut self,
        node: Node<'a, 'a>,
        attribute: &'static str,
        count: usize,
    ) -> Result<Option<usize>> {
        let index: usize = self
            .number(node, attribute, "index of a variable")?
            .ok_or_else(|| self.missing(node, attribute))?;
        if !(1..=count).contains(&index) {
            self.out_of_range("ModelStructure", index, count);
            return Ok(None);
        }
        Ok(Some(index - 1))
    }

    fn out_of_range(&mut self, list: &str, index: usize, count: usize) {
        self.note(
            "structure-index",
            Severity::Error,
            format!("{list} refers to variable {index}; there are variables 1 to {count}"),
        );
    }

    fn note(&mut self, rule: &'static str, severity: Severity, message: String) {
        self.findings.push(Finding { rule, severity, message });
    }

    fn tell_unknown(&mut self, node: Node<'a, 'a>, known: &[&str]) {
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            if !known.contains(&attribute.name()) && self.known.insert(attribute.name().to_owned())
            {
                let (name, element) = (attribute.name(), node.tag_name().name());
                let message = format!("unknown attribute \"{name}\" on <{element}> is ignored");
                self.note("unknown-attribute", Severity::Warning, message);
            }
        }
    }

    fn line(&self, node: Node<'a, 'a>) -> u32 {
        self.document.text_pos_at(node.range().start).row
    }

    fn required(&self, node: Node<'a, 'a>, attribute: &'static str) -> Result<&'a str> {
        node.attribute(attribute).ok_or_else(|| self.missing(node, attribute))
    }

    fn missing(&self, node: Node<'a, 'a>, attribute: &'static str) -> DescriptionError {
        let element = node.tag_name().name().to_owned();
        DescriptionError::Missing { element, attribute, line: self.line(node) }
    }

    fn invalid(
        &self,
        node: Node<'a, 'a>,
        attribute: &str,
        expected: &'static str,
    ) -> DescriptionError {
        DescriptionError::Invalid {
            element: node.tag_name().name().to_owned(),
            attribute: attribute.to_owned(),
            value: node.attribute(attribute).unwrap_or_default().to_owned(),
            expected,
            line: self.line(node),
        }
    }

    fn number<T: FromStr>(
        &self,
        node: Node<'a, 'a>,
        attribute: &str,
        expected: &'static str,
    ) -> Result<Option<T>> {
        node.attribute(attribute)
            .map(|text| text.trim().parse().map_err(|_| self.invalid(node, attribute, expected)))
            .transpose()
    }

    fn boolean(&self, node: Node<'a, 'a>, attribute: &str) -> Result<bool> {
        match node.attribute(attribute).map(str::trim) {
            Some("true" | "1") => Ok(true),
            None | Some("false" | "0") => Ok(false),
            Some(_) => Err(self.invalid(node, attribute, "true or false")),
        }
    }
}

/// The standard's default for `initial` (FMI 2.0.5, section 2.2.7).
fn default_initial(causality: Causality, variability: Variability) -> Option<Initial> {
    match causality {
        Causality::Input | Causality::Independent => None,
        Causality::Parameter => Some(Initial::Exact),
        Causality::CalculatedParameter => Some(Initial::Calculated),
        Causality::Output | Causality::Local if variability == Variability::Constant => {
            Some(Initial::Exact)
        }
        Causality::Output | Causality::Local => Some(Initial::Calculated),
    }
}

fn type_of(node: Node<'_, '_>) -> Option<Type> {
    match node.tag_name().name() {
        "Real" => Some(Type::Real),
        "Integer" => Some(Type::Integer),
        "Boolean" => Some(Type::Boolean),
        "String" => Some(Type::String),
        "Enumeration" => Some(Type::Enumeration),
        _ => None,
    }
}

fn child<'a>(node: Node<'a, 'a>, name: &'static str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn children<'a>(
    node: Node<'a, 'a>,
    list: &'static str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    child(node, list)
        .into_iter()
        .flat_map(|list| list.children())
        .filter(move |child| child.has_tag_name(name))
}
