//! The description of a system (SSD).

use super::common::{Definitions, Kind, SignalType, Transformation};
use super::dictionary::SignalDictionary;
use super::mapping::ParameterMapping;
use super::values::ParameterSet;
use crate::annotation::Annotation;
use crate::files::Name;

/// A description, with the systems that it takes from other files.
#[derive(Debug)]
pub(crate) struct Description {
    /// Name of the whole.
    pub(crate) name: String,
    /// The outermost system.
    pub(crate) system: System,
    /// The files of the description; the first is its own.
    pub(crate) origins: Vec<Origin>,
    /// Start time (s).
    pub(crate) start: Option<f64>,
    /// Stop time (s).
    pub(crate) stop: Option<f64>,
    /// Annotations of all elements but connections.
    pub(crate) annotations: Vec<Annotation>,
}

/// A file with a description.
#[derive(Debug)]
pub(crate) struct Origin {
    pub(crate) file: Name,
    /// Its units of measurement and enumerations.
    pub(crate) definitions: Definitions,
}

/// A system, which consists of elements.
#[derive(Debug)]
pub(crate) struct System {
    /// Position of its file among the origins.
    pub(crate) origin: usize,
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
    /// The description that the component refers to, by its position among the origins.
    Inside(usize),
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
    /// Position of its file among the origins.
    pub(crate) origin: usize,
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
