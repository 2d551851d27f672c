//! From XML text to [`ModelDescription`].
//!
//! A missing or wrong value is replaced by a default, with a finding. Without a sensible default (no value
//! reference, no type, a duplicate name) it is an error.

mod derivatives;
mod structure;
mod types;
mod variables;

use std::collections::HashSet;
use std::str::FromStr;

use roxmltree::{Document, Node, ParsingOptions};
use thiserror::Error;

use crate::xml::{self, Plain as _};

use super::{CoSimulation, DefaultExperiment, Finding, ModelDescription, Places, Severity, Type};

/// Largest number of XML nodes. Each takes about 100 bytes of memory.
pub const MAX_NODES: u32 = 5_000_000;

/// Why a description cannot be used.
#[derive(Debug, Error)]
pub enum DescriptionError {
    /// It is not well-formed XML.
    #[error("modelDescription.xml is not well-formed XML")]
    Xml(#[source] roxmltree::Error),
    /// It contains a document type declaration.
    #[error(
        "modelDescription.xml contains a document type declaration (DTD), which is not allowed"
    )]
    Dtd,
    /// The root element is not `fmiModelDescription`.
    #[error("the root element is <{0}>, not <fmiModelDescription>")]
    Root(String),
    /// It is for another version of the standard.
    #[error("the unit is for FMI {0}; only FMI 2.0 is supported")]
    Version(String),
    /// It is not for co-simulation.
    #[error("the unit has no <CoSimulation> element{}", if *.model_exchange { ": it is for model exchange only" } else { "" })]
    NoCoSimulation {
        /// Whether it is for model exchange.
        model_exchange: bool,
    },
    /// An attribute is missing.
    #[error("line {line}: <{element}> lacks the attribute \"{attribute}\"")]
    Missing {
        /// Name of the XML element.
        element: String,
        /// Name of the XML attribute.
        attribute: &'static str,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// An attribute cannot be read.
    #[error("line {line}: {attribute}=\"{value}\" of <{element}> is not {expected}")]
    Invalid {
        /// Name of the XML element.
        element: String,
        /// Name of the XML attribute.
        attribute: String,
        /// Text of the attribute.
        value: String,
        /// What the schema expects, with its article.
        expected: &'static str,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// The identifier would lead out of the FMU's folder or cannot be a file name.
    #[error("modelIdentifier \"{0}\" is not a C identifier")]
    Identifier(String),
    /// A variable has no type element.
    #[error("line {line}: variable \"{name}\" has no type")]
    NoType {
        /// Name of the variable that has the defect.
        name: String,
        /// Line in modelDescription.xml.
        line: u32,
    },
    /// Two variables have the same name.
    #[error("line {line}: duplicate variable \"{name}\"")]
    Duplicate {
        /// Name of both variables.
        name: String,
        /// Line of the second.
        line: u32,
    },
}

type Result<T> = std::result::Result<T, DescriptionError>;

impl ModelDescription {
    /// Reads the text of a modelDescription.xml.
    ///
    /// # Errors
    /// The FMU is unusable: no well-formed XML, a DTD, another FMI version, no co-simulation, or missing
    /// attributes that have no default.
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
    fn read(mut self) -> Result<ModelDescription> {
        let root = self.document.root_element();
        if !root.is("fmiModelDescription") {
            return Err(DescriptionError::Root(root.tag_name().name().to_owned()));
        }
        let fmi_version = self.version(root)?;
        let co_simulation = self.co_simulation(root)?;
        let text = |name: &str| root.attr(name).map(str::to_owned);
        let model_name = text("modelName").unwrap_or_else(|| {
            let message = "modelName is missing; modelIdentifier is used instead".to_owned();
            self.note("model-name", Severity::Error, message);
            co_simulation.model_identifier.clone()
        });
        let types = self.types(root);
        let enumerations = self.enumerations(root)?;
        let mut variables = self.variables(root, &types)?;
        let by_name = self.index(&variables)?;
        let units = self.units(root)?;
        self.undefined_units(&mut variables, &units);
        let (outputs, initial_unknowns) = self.structure(root, &variables)?;
        let mut description = ModelDescription {
            fmi_version,
            model_name,
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
            co_simulation,
            offers_model_exchange: child(root, "ModelExchange").is_some(),
            derivatives: derivatives::derivatives(root, variables.len()),
            places: Places::new(&units, &outputs, &initial_unknowns),
            units,
            log_categories: children(root, "LogCategories", "Category")
                .filter_map(|node| node.attr("name").map(str::to_owned))
                .collect(),
            default_experiment: self.experiment(root),
            enumerations,
            variables,
            outputs,
            initial_unknowns,
            findings: Vec::new(),
            by_name,
        };
        description.findings = self.findings;
        Ok(description)
    }

    fn version(&mut self, root: Node<'a, 'a>) -> Result<String> {
        let version = self.required(root, "fmiVersion")?.to_owned();
        if version.starts_with("2.0.") {
            let message = format!("fmiVersion \"{version}\" should be \"2.0\"");
            self.note("fmi-version", Severity::Error, message);
        } else if version != "2.0" {
            return Err(DescriptionError::Version(version));
        }
        Ok(version)
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
            // some exporters write dashes; unusable is only what could lead out of the folder
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
        let source_files = children(node, "SourceFiles", "File")
            .filter_map(|file| file.attr("name").map(str::to_owned))
            .collect();
        let mut flag = |name| self.boolean(node, name).unwrap_or(false);
        let mut co_simulation = CoSimulation {
            needs_execution_tool: flag("needsExecutionTool"),
            can_handle_variable_communication_step_size: flag(
                "canHandleVariableCommunicationStepSize",
            ),
            can_interpolate_inputs: flag("canInterpolateInputs"),
            can_run_asynchronuously: flag("canRunAsynchronuously"),
            can_be_instantiated_only_once_per_process: flag("canBeInstantiatedOnlyOncePerProcess"),
            can_not_use_memory_management_functions: flag("canNotUseMemoryManagementFunctions"),
            can_get_and_set_fmu_state: flag("canGetAndSetFMUstate"),
            can_serialize_fmu_state: flag("canSerializeFMUstate"),
            provides_directional_derivative: flag("providesDirectionalDerivative"),
            max_output_derivative_order: 0,
            source_files,
            model_identifier,
        };
        co_simulation.max_output_derivative_order =
            self.optional(node, "maxOutputDerivativeOrder", "a non-negative integer").unwrap_or(0);
        if co_simulation.needs_execution_tool {
            let tool = root.attr("generationTool").unwrap_or("not named");
            let message = format!("the unit needs another program that must be installed ({tool})");
            self.note("execution-tool", Severity::Note, message);
        }
        Ok(co_simulation)
    }

    fn experiment(&mut self, root: Node<'a, 'a>) -> DefaultExperiment {
        let Some(node) = child(root, "DefaultExperiment") else {
            return DefaultExperiment::default();
        };
        DefaultExperiment {
            start_time: self.optional(node, "startTime", "a number"),
            stop_time: self.optional(node, "stopTime", "a number"),
            tolerance: self.optional(node, "tolerance", "a number"),
            step_size: self.optional(node, "stepSize", "a number"),
        }
    }

    fn note(&mut self, rule: &'static str, severity: Severity, message: String) {
        self.findings.push(Finding { rule, severity, message });
    }

    fn note_unknown(&mut self, node: Node<'a, 'a>, known: &[&str]) {
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
        node.attr(attribute).ok_or_else(|| self.missing(node, attribute))
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
            value: node.attr(attribute).unwrap_or_default().to_owned(),
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
        node.attr(attribute)
            .map(|text| xml::number(text).ok_or_else(|| self.invalid(node, attribute, expected)))
            .transpose()
    }

    /// An optional number. If it cannot be read, there is a finding and it is ignored.
    fn optional<T: FromStr>(
        &mut self,
        node: Node<'a, 'a>,
        attribute: &str,
        expected: &'static str,
    ) -> Option<T> {
        self.number(node, attribute, expected).unwrap_or_else(|error| self.ignored(&error))
    }

    /// Adds a finding about an attribute that cannot be read.
    fn ignored<T>(&mut self, error: &DescriptionError) -> Option<T> {
        let message = format!("{error}; it is ignored");
        self.note("attribute-value", Severity::Error, message);
        None
    }

    /// A Boolean. Some exporters write True and False.
    fn boolean(&mut self, node: Node<'a, 'a>, attribute: &str) -> Option<bool> {
        let text = xml::trim(node.attr(attribute)?);
        match text {
            "true" | "1" => return Some(true),
            "false" | "0" => return Some(false),
            _ => {}
        }
        let value = text.to_ascii_lowercase().parse().ok();
        let error = self.invalid(node, attribute, "true or false");
        if value.is_none() {
            return self.ignored(&error);
        }
        self.note("attribute-value", Severity::Error, error.to_string());
        value
    }
}

fn type_of(node: Node<'_, '_>) -> Option<Type> {
    if node.tag_name().namespace().is_some() {
        return None;
    }
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
    node.children().find(|child| child.is(name))
}

fn children<'a>(
    node: Node<'a, 'a>,
    list: &'static str,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    child(node, list)
        .into_iter()
        .flat_map(|list| list.children())
        .filter(move |child| child.is(name))
}
