//! The description of a system (SSD).

use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use super::common::{Definitions, Kind, SignalType, Transformation};
use super::dictionary::SignalDictionary;
use super::mapping::ParameterMapping;
use super::values::ParameterSet;
use crate::SspError;
use crate::annotation::Annotation;
use crate::xml::{At, SSB, SSD, SSM, SSV, check_version, child, document, is, listed};

/// How deep systems may be nested.
const DEEPEST: usize = 100;

/// A description.
#[derive(Debug)]
pub(crate) struct Description {
    /// Name of the whole.
    pub(crate) name: String,
    /// The outermost system.
    pub(crate) system: System,
    /// Units of measurement and enumerations.
    pub(crate) definitions: Definitions,
    /// Start time (s).
    pub(crate) start: Option<f64>,
    /// Stop time (s).
    pub(crate) stop: Option<f64>,
    /// Annotations of all elements but connections.
    pub(crate) annotations: Vec<Annotation>,
}

/// A system, which consists of elements.
#[derive(Debug)]
pub(crate) struct System {
    pub(crate) name: String,
    pub(crate) description: String,
    pub(crate) connectors: Vec<Connector>,
    pub(crate) bindings: Vec<Binding>,
    pub(crate) elements: Vec<Element>,
    pub(crate) connections: Vec<Connection>,
    pub(crate) dictionaries: Vec<Dictionary>,
}

/// An element of a system.
#[derive(Debug)]
pub(crate) enum Element {
    Component(Component),
    System(System),
    /// Its connectors are signals of a dictionary.
    Reference {
        name: String,
        dictionary: String,
    },
}

impl Element {
    /// Name, unique in the system.
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Component(it) => &it.name,
            Self::System(it) => &it.name,
            Self::Reference { name, .. } => name,
        }
    }
}

/// A component: an instance of a unit.
#[derive(Debug)]
pub(crate) struct Component {
    pub(crate) name: String,
    /// URI of the unit.
    pub(crate) source: String,
    pub(crate) connectors: Vec<Connector>,
    pub(crate) bindings: Vec<Binding>,
}

/// A connector.
#[derive(Debug)]
pub(crate) struct Connector {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// Its type, if it is given.
    pub(crate) signal: Option<SignalType>,
}

/// One end of a connection.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct End {
    /// The element; none for the system itself.
    pub(crate) element: Option<String>,
    pub(crate) connector: String,
}

impl std::fmt::Display for End {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match &self.element {
            Some(element) => write!(f, "{element}.{}", self.connector),
            None => f.write_str(&self.connector),
        }
    }
}

/// A connection.
#[derive(Debug)]
pub(crate) struct Connection {
    pub(crate) start: End,
    pub(crate) end: End,
    pub(crate) transformation: Option<Transformation>,
    pub(crate) keeps_unit: bool,
    pub(crate) annotations: Vec<Annotation>,
}

/// What the URI of a source is relative to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Base {
    /// The description.
    Description,
    /// The unit of the component.
    Component,
}

/// Where the content of a file is.
#[derive(Debug)]
pub(crate) enum Contents<T> {
    Inline(T),
    File { uri: String, base: Base },
}

/// Values for an element.
#[derive(Debug)]
pub(crate) struct Binding {
    /// Stands in front of all names of the parameter set.
    pub(crate) prefix: String,
    pub(crate) values: Contents<ParameterSet>,
    pub(crate) mapping: Option<Mapping>,
}

/// The mapping of a binding.
pub(crate) type Mapping = Contents<ParameterMapping>;

/// A signal dictionary by its name in the system.
#[derive(Debug)]
pub(crate) struct Dictionary {
    pub(crate) name: String,
    pub(crate) contents: Contents<SignalDictionary>,
}

impl Description {
    /// Reads the text of a description.
    ///
    /// # Errors
    /// It is invalid, or contains something that is not supported.
    pub(crate) fn parse(text: &str, file: &str) -> Result<Self, SspError> {
        document(text, file, (SSD, "SystemStructureDescription"), |root| {
            let definitions = Definitions::read(root, SSD, file)?;
            let at = At { file, place: "SystemStructureDescription" };
            let system =
                child(root, (SSD, "System")).ok_or_else(|| at.invalid("it has no System"))?;
            let mut reader = Reader { file, definitions: &definitions, annotations: Vec::new() };
            reader.annotations(root, "SystemStructureDescription");
            let system = reader.system(system, "", 0)?;
            let (mut start, mut stop) = (None, None);
            if let Some(experiment) = child(root, (SSD, "DefaultExperiment")) {
                let at = At { file, place: "DefaultExperiment" };
                start = at.double(experiment, "startTime")?;
                stop = at.double(experiment, "stopTime")?;
                reader.annotations(experiment, "DefaultExperiment");
            }
            let (name, annotations) = (at.required(root, "name")?, reader.annotations);
            Ok(Self { name, system, definitions, start, stop, annotations })
        })
    }
}

struct Reader<'f> {
    file: &'f str,
    definitions: &'f Definitions,
    annotations: Vec<Annotation>,
}

impl Reader<'_> {
    fn annotations(&mut self, node: Node<'_, '_>, place: &str) {
        self.annotations.extend(Annotation::read_all(node, place));
    }

    fn system(
        &mut self,
        node: Node<'_, '_>,
        above: &str,
        depth: usize,
    ) -> Result<System, SspError> {
        let name = node.attr("name").unwrap_or_default().to_owned();
        let place = format!("System \"{above}{name}\"");
        let at = At { file: self.file, place: &place };
        if depth > DEEPEST {
            return Err(at.unsupported(format!("systems are nested more than {DEEPEST} deep")));
        }
        self.annotations(node, &place);
        let inner = if depth == 0 { String::new() } else { format!("{above}{name}/") };
        let mut elements = Vec::new();
        for list in node.children().filter(|it| is(*it, (SSD, "Elements"))) {
            for element in list.children().filter(Node::is_element) {
                elements.push(self.element(element, &inner, depth)?);
            }
        }
        let mut names: Vec<&str> = elements.iter().map(Element::name).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(at.invalid(format!("two elements have the name \"{}\"", pair[0])));
        }
        let connections = listed(node, (SSD, "Connections"), (SSD, "Connection"));
        let connections = connections.map(|it| self.connection(it, &place));
        let connections = connections.collect::<Result<_, SspError>>()?;
        let dictionaries = listed(node, (SSD, "SignalDictionaries"), (SSD, "SignalDictionary"));
        let dictionaries = dictionaries.map(|it| self.dictionary(it));
        Ok(System {
            dictionaries: dictionaries.collect::<Result<_, SspError>>()?,
            description: node.attr("description").unwrap_or_default().to_owned(),
            connectors: self.connectors(node, &place)?,
            bindings: self.bindings(node, &place)?,
            name,
            elements,
            connections,
        })
    }

    fn element(
        &mut self,
        node: Node<'_, '_>,
        above: &str,
        depth: usize,
    ) -> Result<Element, SspError> {
        let kind = node.tag_name().name();
        let name = node.attr("name").unwrap_or_default().to_owned();
        let place = format!("{kind} \"{above}{name}\"");
        let at = At { file: self.file, place: &place };
        if name.is_empty() {
            return Err(at.invalid("it has no name"));
        }
        if is(node, (SSD, "System")) {
            return self.system(node, above, depth + 1).map(Element::System);
        }
        self.annotations(node, &place);
        if is(node, (SSD, "SignalDictionaryReference")) {
            let dictionary = at.required(node, "dictionary")?;
            return Ok(Element::Reference { name, dictionary });
        }
        if !is(node, (SSD, "Component")) {
            return Err(at.unsupported("elements of this kind are not supported"));
        }
        let source = node.attr("source").unwrap_or_default().to_owned();
        match node.attr("type") {
            None | Some("application/x-fmu-sharedlibrary") => {}
            Some("application/x-ssp-definition" | "application/x-ssp-package") => {
                return Err(at.unsupported("a system in a file of its own is not supported"));
            }
            Some(other) => {
                return Err(at.unsupported(format!("the type \"{other}\" is not supported")));
            }
        }
        match node.attr("implementation") {
            None | Some("any" | "CoSimulation") => {}
            Some(other) => {
                return Err(at.unsupported(format!(
                    "implementation=\"{other}\" is not supported, only co-simulation is"
                )));
            }
        }
        let lower = source.to_ascii_lowercase();
        if lower.ends_with(".ssp") || lower.ends_with(".ssd") {
            return Err(at.unsupported("a system in a file of its own is not supported"));
        }
        if source.is_empty() {
            return Err(at.unsupported("it has no source, so nothing can be run"));
        }
        let (connectors, bindings) = (self.connectors(node, &place)?, self.bindings(node, &place)?);
        Ok(Element::Component(Component { name, source, connectors, bindings }))
    }

    fn connectors(&mut self, node: Node<'_, '_>, above: &str) -> Result<Vec<Connector>, SspError> {
        let connectors = listed(node, (SSD, "Connectors"), (SSD, "Connector"));
        connectors
            .map(|it| {
                let name = it.attr("name").unwrap_or_default().to_owned();
                let place = format!("Connector \"{name}\" of {above}");
                let at = At { file: self.file, place: &place };
                let kind = Kind::named(&at.required(it, "kind")?);
                let signal = SignalType::read(it, self.definitions, at)?;
                Ok(Connector { name, kind, signal })
            })
            .collect()
    }

    fn connection(&self, node: Node<'_, '_>, above: &str) -> Result<Connection, SspError> {
        let end = |element: &str, connector: &str| End {
            element: node.attr(element).filter(|it| !it.is_empty()).map(str::to_owned),
            connector: node.attr(connector).unwrap_or_default().to_owned(),
        };
        let (start, end) =
            (end("startElement", "startConnector"), end("endElement", "endConnector"));
        let place = format!("Connection from {start} to {end} in {above}");
        let at = At { file: self.file, place: &place };
        if start.connector.is_empty() || end.connector.is_empty() {
            return Err(at.invalid("startConnector or endConnector is missing"));
        }
        if node.attr("startIndices").or(node.attr("endIndices")).is_some() {
            return Err(at.unsupported("elements of arrays are not supported"));
        }
        let transformation = Transformation::read(node, at)?.filter(|it| !it.is_identity());
        if matches!(transformation, Some(Transformation::Numbers(_) | Transformation::Items(_))) {
            return Err(at.unsupported(
                "mapping tables are not supported on connections, only LinearTransformation is",
            ));
        }
        Ok(Connection {
            start,
            end,
            transformation,
            keeps_unit: at.flag(node, "suppressUnitConversion")?,
            annotations: Annotation::read_all(node, &place),
        })
    }

    fn bindings(&mut self, node: Node<'_, '_>, above: &str) -> Result<Vec<Binding>, SspError> {
        let bindings = listed(node, (SSD, "ParameterBindings"), (SSD, "ParameterBinding"));
        let bindings: Vec<_> = bindings.collect();
        bindings
            .into_iter()
            .enumerate()
            .map(|(k, it)| {
                let place = format!("ParameterBinding {} of {above}", k + 1);
                self.annotations(it, &place);
                self.binding(it, At { file: self.file, place: &place })
            })
            .collect()
    }

    fn binding(&self, node: Node<'_, '_>, at: At<'_>) -> Result<Binding, SspError> {
        let (file, definitions) = (self.file, self.definitions);
        let values = contents(
            node,
            child(node, (SSD, "ParameterValues")),
            ("application/x-ssp-parameter-set", (SSV, "ParameterSet")),
            at,
            |set| ParameterSet::read(set, file, definitions),
        )?;
        let mapping = child(node, (SSD, "ParameterMapping"));
        let mapping = mapping.map(|it| {
            let kind = ("application/x-ssp-parameter-mapping", (SSM, "ParameterMapping"));
            contents(it, Some(it), kind, at, |mapping| ParameterMapping::read(mapping, file))
        });
        let prefix = node.attr("prefix").unwrap_or_default().to_owned();
        Ok(Binding { prefix, values, mapping: mapping.transpose()? })
    }

    fn dictionary(&self, node: Node<'_, '_>) -> Result<Dictionary, SspError> {
        let name = node.attr("name").unwrap_or_default().to_owned();
        let place = format!("SignalDictionary \"{name}\"");
        let at = At { file: self.file, place: &place };
        let kind = ("application/x-ssp-signal-dictionary", (SSB, "SignalDictionary"));
        let file = self.file;
        let contents = contents(node, Some(node), kind, at, |it| SignalDictionary::read(it, file))?;
        Ok(Dictionary { name, contents })
    }
}

/// The content of `node`: in the file that its source names, or in line in `inside`.
fn contents<'a, 'i: 'a, T>(
    node: Node<'a, 'i>,
    inside: Option<Node<'a, 'i>>,
    (kind, root): (&str, (&'static str, &'static str)),
    at: At<'_>,
    read: impl FnOnce(Node<'a, 'i>) -> Result<T, SspError>,
) -> Result<Contents<T>, SspError> {
    if let Some(other) = node.attr("type").filter(|it| *it != kind) {
        return Err(at.unsupported(format!("the type \"{other}\" is not supported")));
    }
    let base = match node.attr("sourceBase") {
        None | Some("SSD") => Base::Description,
        Some("component") => Base::Component,
        Some(other) => return Err(at.invalid(format!("sourceBase=\"{other}\" is not known"))),
    };
    if let Some(uri) = node.attr("source") {
        return Ok(Contents::File { uri: uri.to_owned(), base });
    }
    let inline = inside.and_then(|it| child(it, root));
    let inline = inline
        .ok_or_else(|| at.invalid(format!("it has neither a source nor {} in line", root.1)))?;
    check_version(inline, at.file)?;
    read(inline).map(Contents::Inline)
}
