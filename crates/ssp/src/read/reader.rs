//! Reads descriptions, and those that they refer to.

use fmi2_import::xml::Plain as _;
use roxmltree::Node;

use super::common::{Definitions, Kind, SignalType, Transformation};
use super::description::{
    Base, Binding, Component, Connection, Connector, Contents, Description, Dictionary, Element,
    End, Origin, System,
};
use super::dictionary::SignalDictionary;
use super::mapping::ParameterMapping;
use super::values::ParameterSet;
use crate::SspError;
use crate::annotation::Annotation;
use crate::files::{DESCRIPTION, Files, Name, Reference};
use crate::xml::{At, SSB, SSD, SSM, SSV, check_version, child, document, is, listed};

/// How deep systems may be nested.
const DEEPEST: usize = 100;
/// How many elements a system may have: one that refers to others may have many with few lines.
const MOST: usize = 100_000;
/// How many descriptions may be read, each as often as it is referred to.
const MOST_FILES: usize = 1_000;

impl Description {
    /// Reads a description, and those that it refers to.
    ///
    /// # Errors
    /// A file cannot be read, is invalid, or contains something that is not supported.
    pub(crate) fn load(files: &mut Files, file: Name) -> Result<Self, SspError> {
        let mut loader =
            Loader { files, origins: Vec::new(), annotations: Vec::new(), elements: 0 };
        let (name, system, [start, stop]) = loader.file(file, "the archive", None)?;
        let Loader { origins, annotations, .. } = loader;
        Ok(Self { name, system, origins, start, stop, annotations })
    }
}

/// Where a system is put that is described elsewhere.
#[derive(Clone, Copy)]
struct Spot<'s> {
    /// Name of the component that refers to it.
    name: &'s str,
    /// Names of the systems around it, each with a slash.
    above: &'s str,
    depth: usize,
}

/// Reads files that refer to others.
struct Loader<'f> {
    files: &'f mut Files,
    origins: Vec<Origin>,
    annotations: Vec<Annotation>,
    /// Number of elements so far.
    elements: usize,
}

impl Loader<'_> {
    /// The name of a description, its system, and its start and stop time.
    fn file(
        &mut self,
        name: Name,
        place: &str,
        spot: Option<Spot<'_>>,
    ) -> Result<(String, System, [Option<f64>; 2]), SspError> {
        let text = self.files.text(&name, place)?;
        let file = name.label().to_owned();
        let origin = self.origins.len();
        if origin == MOST_FILES {
            let at = At { file: &file, place };
            return Err(
                at.unsupported(format!("there are more than {MOST_FILES} systems in files"))
            );
        }
        self.origins.push(Origin { file: name, definitions: Definitions::default() });
        document(&text, &file, (SSD, "SystemStructureDescription"), |root| {
            let definitions = Definitions::read(root, SSD, &file)?;
            let at = At { file: &file, place: "SystemStructureDescription" };
            let system =
                child(root, (SSD, "System")).ok_or_else(|| at.invalid("it has no System"))?;
            let within = spot.map_or(String::new(), |it| format!("{}{}/", it.above, it.name));
            let mut reader =
                Reader { file: &file, origin, within, definitions: &definitions, loader: self };
            reader.annotations(root, "SystemStructureDescription");
            let system = reader.system(system, spot)?;
            let mut times = [None, None];
            if let Some(experiment) = child(root, (SSD, "DefaultExperiment")) {
                let at = At { file: &file, place: "DefaultExperiment" };
                times = [at.double(experiment, "startTime")?, at.double(experiment, "stopTime")?];
                reader.annotations(experiment, "DefaultExperiment");
            }
            self.origins[origin].definitions = definitions;
            Ok((at.required(root, "name")?, system, times))
        })
    }
}

struct Reader<'r, 'f> {
    file: &'r str,
    origin: usize,
    /// Path of the system that the file describes, with a slash; empty for the outermost.
    within: String,
    definitions: &'r Definitions,
    loader: &'r mut Loader<'f>,
}

impl Reader<'_, '_> {
    fn annotations(&mut self, node: Node<'_, '_>, place: &str) {
        let found = Annotation::read_all(node, place).into_iter();
        let here = |it| Annotation { origin: self.origin, within: self.within.clone(), ..it };
        self.loader.annotations.extend(found.map(here));
    }

    fn system(&mut self, node: Node<'_, '_>, spot: Option<Spot<'_>>) -> Result<System, SspError> {
        let own = node.attr("name").unwrap_or_default();
        let Spot { name, above, depth } = spot.unwrap_or(Spot { name: own, above: "", depth: 0 });
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
        self.loader.elements += elements.len();
        if self.loader.elements > MOST {
            return Err(at.unsupported(format!("there are more than {MOST} elements")));
        }
        let names: Vec<&str> = elements.iter().map(Element::name).collect();
        distinct(names, "elements", at)?;
        let connections = listed(node, (SSD, "Connections"), (SSD, "Connection"));
        let connections = connections.map(|it| self.connection(it, &place));
        let connections = connections.collect::<Result<_, SspError>>()?;
        let dictionaries = listed(node, (SSD, "SignalDictionaries"), (SSD, "SignalDictionary"));
        let dictionaries = dictionaries.map(|it| self.dictionary(it));
        let dictionaries = dictionaries.collect::<Result<Vec<_>, SspError>>()?;
        distinct(dictionaries.iter().map(|it| &*it.name).collect(), "signal dictionaries", at)?;
        Ok(System {
            origin: self.origin,
            dictionaries,
            description: node.attr("description").unwrap_or_default().to_owned(),
            connectors: self.connectors(node, &place)?,
            bindings: self.bindings(node, &place)?,
            name: name.to_owned(),
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
        let spot = Spot { name: &name, above, depth: depth + 1 };
        if is(node, (SSD, "System")) {
            return self.system(node, Some(spot)).map(Element::System);
        }
        self.annotations(node, &place);
        if is(node, (SSD, "SignalDictionaryReference")) {
            let dictionary = at.required(node, "dictionary")?;
            return Ok(Element::Reference { name, dictionary });
        }
        if !is(node, (SSD, "Component")) {
            return Err(at.unsupported("elements of this kind are not supported"));
        }
        let Some(source) = node.attr("source").map(str::to_owned) else {
            return Err(at.unsupported("it has no source, so nothing can be run"));
        };
        let is_named = |ends: &[&str]| {
            let file = source.split('#').next().unwrap_or_default().to_ascii_lowercase();
            ends.iter().any(|end| file.ends_with(end))
        };
        let is_system = match node.attr("type") {
            Some("application/x-ssp-definition" | "application/x-ssp-package") => true,
            None | Some("application/x-fmu-sharedlibrary") => {
                is_named(&[".ssp", ".ssd"]) || source.starts_with('#')
            }
            Some(other) => {
                return Err(at.unsupported(format!("the type \"{other}\" is not supported")));
            }
        };
        match node.attr("implementation") {
            None | Some("any" | "CoSimulation") => {}
            Some(_) if is_system => {}
            Some(other) => {
                return Err(at.unsupported(format!(
                    "implementation=\"{other}\" is not supported, only co-simulation is"
                )));
            }
        }
        let (connectors, bindings) = (self.connectors(node, &place)?, self.bindings(node, &place)?);
        if !is_system {
            return Ok(Element::Component(Component { name, source, connectors, bindings }));
        }
        let mut system = self.elsewhere(node, &source, spot, at)?;
        interface(&mut system, &connectors, at)?;
        let base = system.origin;
        let mut own = bindings;
        // of a component, files are those of the system that it refers to
        own.iter_mut().for_each(|it| it.enter(base));
        system.bindings.append(&mut own);
        Ok(Element::System(system))
    }

    /// The system that a component refers to: in this file, in another one, or in an archive.
    fn elsewhere(
        &mut self,
        node: Node<'_, '_>,
        source: &str,
        spot: Spot<'_>,
        at: At<'_>,
    ) -> Result<System, SspError> {
        let base = self.loader.origins[self.origin].file.clone();
        let (file, fragment) = match self.loader.files.follow(&base, source, at.place)? {
            Reference::File(file, fragment) => (file, fragment),
            Reference::Here(id) => {
                let mut all = node.document().root_element().descendants();
                let found = all.find(|it| is(*it, (SSD, "System")) && it.attr("id") == Some(&*id));
                let found =
                    found.ok_or_else(|| at.invalid(format!("no System has the id \"{id}\"")))?;
                return self.system(found, Some(spot));
            }
        };
        if spot.depth > DEEPEST {
            return Err(at.unsupported(format!("systems are nested more than {DEEPEST} deep")));
        }
        let is_description = match node.attr("type") {
            Some("application/x-ssp-definition") => true,
            Some("application/x-ssp-package") => false,
            _ => file.last().to_ascii_lowercase().ends_with(".ssd"),
        };
        let file = match (is_description, fragment) {
            (true, None) => file,
            (true, Some(_)) => {
                return Err(at.unsupported(format!(
                    "source=\"{source}\": only archives and this file have parts to refer to"
                )));
            }
            (false, variant) => {
                let description = variant.as_deref().unwrap_or(DESCRIPTION);
                self.loader.files.enter(&file, description, at.place)?
            }
        };
        self.loader.file(file, at.place, Some(spot)).map(|it| it.1)
    }

    fn connectors(&mut self, node: Node<'_, '_>, above: &str) -> Result<Vec<Connector>, SspError> {
        let connectors = listed(node, (SSD, "Connectors"), (SSD, "Connector"));
        connectors
            .map(|it| {
                let name = it.attr("name").unwrap_or_default().to_owned();
                let place = format!("Connector \"{name}\" of {above}");
                let at = At { file: self.file, place: &place };
                let kind = Kind::named(&at.required(it, "kind")?);
                let signal = SignalType::read(it, self.definitions);
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
        Ok(Connection {
            start,
            end,
            transformation: Transformation::read(node, at)?.filter(|it| !it.is_identity()),
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
        Ok(Binding { origin: self.origin, prefix, values, mapping: mapping.transpose()? })
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

impl Binding {
    /// Makes files inside the component those beside the description that it refers to.
    fn enter(&mut self, description: usize) {
        let values = match &mut self.values {
            Contents::File { base, .. } => Some(base),
            Contents::Inline(_) => None,
        };
        let mapping = match &mut self.mapping {
            Some(Contents::File { base, .. }) => Some(base),
            _ => None,
        };
        for base in values.into_iter().chain(mapping).filter(|it| **it == Base::Component) {
            *base = Base::Inside(description);
        }
    }
}

/// The connectors of a component that refers to a system are those of that system.
fn interface(system: &mut System, outer: &[Connector], at: At<'_>) -> Result<(), SspError> {
    for connector in outer {
        let Some(own) = system.connectors.iter_mut().find(|it| it.name == connector.name) else {
            return Err(at.invalid(format!(
                "the system that it refers to has no connector \"{}\"",
                connector.name
            )));
        };
        let unit = |it: &Connector| it.signal.as_ref().and_then(|it| it.unit.clone());
        match (unit(own), unit(connector)) {
            (None, Some(_)) => own.signal.clone_from(&connector.signal),
            (Some((inside, a)), Some((outside, b))) if a != b => {
                return Err(at.unsupported(format!(
                    "its connector \"{}\" is in {outside}, but in {inside} in the system that it refers to",
                    connector.name
                )));
            }
            _ => {}
        }
    }
    Ok(())
}

/// Names must differ.
fn distinct(mut names: Vec<&str>, what: &str, at: At<'_>) -> Result<(), SspError> {
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(at.invalid(format!("two {what} have the name \"{}\"", pair[0]))),
        None => Ok(()),
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
