//! The systems and components of a description as lists, with their units opened.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use fmi2_import::description::ModelDescription;
use fmi2_import::package::Package;

use crate::SspError;
use crate::files::{Files, Name};
use crate::read::{
    Base, Component, Contents, Description, Element, Origin, SignalDictionary, System,
};
use crate::xml::{At, SSB, document};

/// All systems and components.
pub(super) struct Tree<'d> {
    /// Each after the system that contains it; the first is the outermost.
    pub(super) systems: Vec<SystemNode<'d>>,
    /// In the order of the description.
    pub(super) components: Vec<ComponentNode<'d>>,
    pub(super) units: Vec<Unit>,
    pub(super) dictionaries: Vec<SignalDictionary>,
    /// Remarks on names that had to change.
    pub(super) notes: Vec<String>,
    pub(super) origins: &'d [Origin],
}

/// A system.
pub(super) struct SystemNode<'d> {
    pub(super) element: &'d System,
    /// Names of the systems around it and its own, for messages; empty for the outermost.
    pub(super) path: String,
    pub(super) children: HashMap<&'d str, Child>,
}

/// What a name in a system stands for.
#[derive(Debug, Clone, Copy)]
pub(super) enum Child {
    Component(usize),
    System(usize),
    /// Reference to a dictionary.
    Dictionary(usize),
}

/// A component.
pub(super) struct ComponentNode<'d> {
    pub(super) element: &'d Component,
    /// Names of the systems around it and its own, for messages.
    pub(super) path: String,
    /// Name of the instance in the scenario.
    pub(super) instance: String,
    pub(super) unit: usize,
}

/// A unit, which components share.
pub(super) struct Unit {
    /// Key in the scenario's `units`.
    pub(super) key: String,
    /// Its file in the archive.
    pub(super) name: Name,
    /// Its path for the scenario: absolute, or relative to the scenario's folder.
    pub(super) path: PathBuf,
    /// The file.
    pub(super) file: PathBuf,
    pub(super) description: ModelDescription,
}

impl<'d> Tree<'d> {
    /// Lists a description, and puts its units into `folder`.
    pub(super) fn new(
        description: &'d Description,
        files: &mut Files,
        folder: &Path,
    ) -> Result<Self, SspError> {
        let mut tree = Self {
            systems: Vec::new(),
            components: Vec::new(),
            units: Vec::new(),
            dictionaries: Vec::new(),
            notes: Vec::new(),
            origins: &description.origins,
        };
        let mut builder = Builder { tree: &mut tree, files, folder, taken: HashSet::new() };
        builder.system(&description.system, "", &HashMap::new())?;
        Ok(tree)
    }

    /// The name of a description's file, for messages.
    pub(super) fn file(&self, origin: usize) -> &'d str {
        self.origins.get(origin).map_or("", |it| it.file.label())
    }

    /// The description of a component's unit.
    pub(super) fn description(&self, component: usize) -> &ModelDescription {
        &self.units[self.components[component].unit].description
    }
}

struct Builder<'t, 'd, 'f> {
    tree: &'t mut Tree<'d>,
    files: &'f mut Files,
    folder: &'f Path,
    /// Names of instances.
    taken: HashSet<String>,
}

impl<'d> Builder<'_, 'd, '_> {
    fn system(
        &mut self,
        system: &'d System,
        path: &str,
        outer: &HashMap<&'d str, usize>,
    ) -> Result<usize, SspError> {
        let index = self.tree.systems.len();
        let node = SystemNode { element: system, path: path.to_owned(), children: HashMap::new() };
        self.tree.systems.push(node);
        // names are looked up here, then in the systems around
        let mut known = outer.clone();
        for dictionary in &system.dictionaries {
            let contents =
                self.dictionary(&dictionary.name, &dictionary.contents, system.origin)?;
            known.insert(&dictionary.name, self.tree.dictionaries.len());
            self.tree.dictionaries.push(contents);
        }
        let mut children = HashMap::new();
        for element in &system.elements {
            let path = match path {
                "" => element.name().to_owned(),
                _ => format!("{path}/{}", element.name()),
            };
            let child = match element {
                Element::System(inner) => Child::System(self.system(inner, &path, &known)?),
                Element::Component(component) => {
                    Child::Component(self.component(component, path, system.origin)?)
                }
                Element::Reference { name, dictionary } => {
                    let place = format!("SignalDictionaryReference \"{name}\"");
                    let at = At { file: self.tree.file(system.origin), place: &place };
                    let found = known.get(dictionary.as_str()).copied();
                    Child::Dictionary(found.ok_or_else(|| {
                        at.invalid(format!("there is no signal dictionary \"{dictionary}\""))
                    })?)
                }
            };
            children.insert(element.name(), child);
        }
        self.tree.systems[index].children = children;
        Ok(index)
    }

    fn dictionary(
        &mut self,
        name: &str,
        contents: &Contents<SignalDictionary>,
        origin: usize,
    ) -> Result<SignalDictionary, SspError> {
        let (uri, base) = match contents {
            Contents::Inline(dictionary) => return Ok(dictionary.clone()),
            Contents::File { uri, base } => (uri, base),
        };
        let place = format!("SignalDictionary \"{name}\"");
        if *base != Base::Description {
            let at = At { file: self.tree.file(origin), place: &place };
            return Err(at.invalid("sourceBase=\"component\" has no meaning here"));
        }
        let file = self.files.resolve(&self.tree.origins[origin].file, uri, &place)?;
        let text = self.files.text(&file, &place)?;
        let file = file.label();
        document(&text, file, (SSB, "SignalDictionary"), |it| SignalDictionary::read(it, file))
    }

    fn component(
        &mut self,
        component: &'d Component,
        path: String,
        origin: usize,
    ) -> Result<usize, SspError> {
        let place = format!("Component \"{path}\"");
        let base = &self.tree.origins[origin].file;
        let name = self.files.resolve(base, &component.source, &place)?;
        let unit = match self.tree.units.iter().position(|unit| unit.name == name) {
            Some(unit) => unit,
            None => self.open(name, &path, &place)?,
        };
        let instance = self.instance(&path);
        if instance != path {
            self.tree.notes.push(format!("{place} is the instance {instance}"));
        }
        self.tree.components.push(ComponentNode { element: component, path, instance, unit });
        Ok(self.tree.components.len() - 1)
    }

    fn open(&mut self, name: Name, component: &str, place: &str) -> Result<usize, SspError> {
        let path = self.files.place(&name, self.folder, place)?;
        let file = self.folder.join(&path);
        let description = Package::describe(&file)
            .map_err(|source| SspError::Unit { component: component.to_owned(), source })?;
        let last = name.last();
        let stem = last.rsplit_once('.').map_or(last, |(stem, _)| stem);
        let is_taken = |key: &str| self.tree.units.iter().any(|unit| unit.key == key);
        let key = unique(stem.to_owned(), is_taken);
        self.tree.units.push(Unit { key, name, path, file, description });
        Ok(self.tree.units.len() - 1)
    }

    /// The name of an instance: that of the component, without what names of instances cannot have.
    fn instance(&mut self, path: &str) -> String {
        let plain = |c: char| if c.is_control() || ".*".contains(c) { '_' } else { c };
        let mut name: String = path.chars().map(plain).collect();
        if patterns::is_pattern(&name) {
            name = name.replace(['[', ']'], "_");
        }
        let name = unique(name, |name| self.taken.contains(name));
        self.taken.insert(name.clone());
        name
    }
}

/// The name, with a number at its end if it is taken.
pub(crate) fn unique(name: String, is_taken: impl Fn(&str) -> bool) -> String {
    if !is_taken(&name) {
        return name;
    }
    let numbered = (2_u32..).map(|k| format!("{name}_{k}")).find(|it| !is_taken(it));
    numbered.unwrap_or(name)
}
