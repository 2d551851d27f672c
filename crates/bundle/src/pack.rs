//! Packs a scenario into a bundle.

use std::collections::BTreeMap;
use std::path::Path;

use bundle_table::{FORM, Role, SCENARIO, TABLE, Table};
use fmi2_package::{Archive, PageParts};
use in_memory::accuracy::{self, Choice};
use indexmap::{IndexMap, IndexSet};
use master::Setup;
use results::summary::AccuracyReport;
use scenario::Scenario;

use crate::contents::{self, Inner, UNITS, failed};
use crate::error::BundleError;
use crate::expose::{Expose, choose};
use crate::library::Library;
use crate::limits::limits;
use crate::measures::Measures;
use crate::names::identifier;
use crate::page;
use crate::prepared::prepare;
use crate::variables::variables;

/// What to pack.
#[derive(Debug)]
pub struct Order<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// File name of the bundle without `.fmu`. The model identifier follows from it.
    pub name: &'a str,
    /// Variables to expose.
    pub expose: &'a [Expose],
    /// Whether to expose the usual variables too: free inputs, parameters, recorded signals.
    pub defaults: bool,
    /// The library.
    pub library: &'a Library,
}

/// A bundle, ready to be written.
#[derive(Debug)]
pub struct Bundled {
    archive: Archive,
    /// Its table of variables.
    pub table: Table,
    /// What a user should know: missing capabilities, and settings of the scenario that are not used.
    pub notes: Vec<String>,
    /// The platforms that it runs on.
    pub platforms: Vec<String>,
}

impl Bundled {
    /// Writes the .fmu file: it appears complete or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, file: &Path) -> Result<(), BundleError> {
        Ok(self.archive.write(file)?)
    }
}

/// Packs a scenario with its units. If the scenario asks for an accuracy, the step inside is chosen now; `tell` gets each
/// trial. The algorithm stays that of the scenario, so that packing again makes the same bundle.
///
/// # Errors
/// The scenario or a unit is invalid, a variable cannot be exposed, the library does not fit, or no step gives the accuracy.
pub fn bundle(order: &Order<'_>, tell: &mut dyn FnMut(&str)) -> Result<Bundled, BundleError> {
    match accuracy::choose_step(order.scenario, tell, &mut || false)? {
        None => pack(order, None),
        Some(Choice { scenario, report }) => {
            pack(&Order { scenario: &scenario, ..*order }, Some(&report))
        }
    }
}

fn pack(order: &Order<'_>, chosen: Option<&AccuracyReport>) -> Result<Bundled, BundleError> {
    let setup = Setup::new(order.scenario)?;
    let choices = choose(&setup, order.expose, order.defaults)?;
    let mut measures = Measures::default();
    let variables = variables(&setup, &choices, &mut measures);
    let outputs = variables.iter().filter(|it| it.role == Role::Output);
    let outputs: Vec<String> = outputs.flat_map(|it| it.ports.clone()).collect();
    let units = contents::units(&order.scenario.units)?;
    let prepared = prepare(&setup, &units, &outputs)?;
    let mut resources = prepared.files;
    resources.insert(SCENARIO.to_owned(), prepared.text.into_bytes());
    let mut documentation = BTreeMap::new();
    for unit in units.values() {
        let Inner { folder, files } = unit;
        for (name, content) in files {
            match name.strip_prefix("documentation/") {
                Some(name) => {
                    documentation.insert(format!("units/{folder}/{name}"), content.clone())
                }
                None => resources.insert(format!("{UNITS}/{folder}/{name}"), content.clone()),
            };
        }
    }
    // the binaries of other systems must not change the GUID
    let sums = resources.iter().filter(|(name, _)| !name.contains("/binaries/"));
    let sums =
        sums.map(|(name, content)| (name.clone(), format!("{:08x}", crc32fast::hash(content))));
    let experiment = order.scenario.experiment;
    let title = order.scenario.title.trim();
    let table = Table {
        form: FORM,
        identifier: identifier(order.name),
        model_name: if title.is_empty() { order.name.to_owned() } else { title.to_owned() },
        description: summary(&setup, chosen),
        license: joined(&setup, |it| it.license.as_deref()),
        copyright: joined(&setup, |it| it.copyright.as_deref()),
        start: experiment.start,
        stop: experiment.stop,
        step: experiment.step,
        tolerance: experiment.tolerance,
        limits: limits(setup.system()),
        measures: measures.0,
        variables,
        files: sums.collect(),
    };
    let text = table.to_text().map_err(BundleError::Json)?;
    resources.insert(TABLE.to_owned(), text.into_bytes());
    let description = describe(order.library, &resources[TABLE])?;
    let mut archive = Archive::new(&description)?;
    let platforms = add_binaries(&mut archive, order.library, &units)?;
    for (name, content) in resources {
        archive.file(&format!("resources/{name}"), content)?;
    }
    for (name, content) in documentation {
        archive.file(&format!("documentation/{name}"), content)?;
    }
    add_licences(&mut archive, order.library, &units)?;
    let text = page::text(&setup, &units, &table, chosen);
    let parts = PageParts { name: order.name, text: &text, ..PageParts::default() };
    archive.file("documentation/index.html", fmi2_package::page(&description, parts)?)?;
    let mut notes = notes(&setup, &table);
    notes.extend(chosen.map(|it| format!("accuracy: {}", page::accuracy(it))));
    Ok(Bundled { archive, table, notes, platforms })
}

fn summary(setup: &Setup, chosen: Option<&AccuracyReport>) -> String {
    let system = setup.system();
    let units: IndexSet<&str> =
        system.instances.iter().map(|it| it.description().model_name.as_str()).collect();
    let units: Vec<&str> = units.into_iter().collect();
    let step = chosen.map_or_else(String::new, |it| {
        let step = setup.scenario().experiment.step;
        format!("; the step inside, {step} s, was chosen for an accuracy of {:e}", it.wanted)
    });
    format!("{} coupled instances of {}{step}", system.instances.len(), units.join(", "))
}

/// A text of all units, each once.
fn joined(
    setup: &Setup,
    text: impl Fn(&fmi2_import::description::ModelDescription) -> Option<&str>,
) -> String {
    let all = setup.system().instances.iter().filter_map(|it| text(it.description()));
    let all: IndexSet<&str> = all.map(str::trim).filter(|it| !it.is_empty()).collect();
    all.into_iter().collect::<Vec<_>>().join("; ")
}

/// The description, which the library prints from the table.
fn describe(library: &Library, table: &[u8]) -> Result<String, BundleError> {
    use fmi2_import::package::{BINARY_EXTENSION, PLATFORM};
    let folder = tempfile::tempdir().map_err(failed(Path::new("a temporary folder")))?;
    let here = library.binaries().find(|(platform, ..)| *platform == PLATFORM);
    let Some((_, _, binary)) = here else {
        return Err(BundleError::Platform { library: library.path.clone() });
    };
    let file = folder.path().join(format!("bundle.{BINARY_EXTENSION}"));
    std::fs::write(&file, binary).map_err(failed(&file))?;
    let path = folder.path().join(TABLE);
    std::fs::write(&path, table).map_err(failed(&path))?;
    Ok(fmi2_package::describe(&file, Some(folder.path()))?)
}

/// Adds the library for each platform that all units have. Returns these.
fn add_binaries(
    archive: &mut Archive,
    library: &Library,
    units: &IndexMap<String, Inner>,
) -> Result<Vec<String>, BundleError> {
    let identifier = archive.identifier().to_owned();
    let mut platforms = Vec::new();
    for (platform, end, content) in library.binaries() {
        if units.values().all(|unit| unit.platforms().contains(&platform)) {
            archive.file(&format!("binaries/{platform}/{identifier}.{end}"), content)?;
            platforms.push(platform.to_owned());
        }
    }
    if platforms.is_empty() {
        return Err(BundleError::Platform { library: library.path.clone() });
    }
    Ok(platforms)
}

/// Adds the licences of the library. Those of the units are in their documentation.
fn add_licences(
    archive: &mut Archive,
    library: &Library,
    units: &IndexMap<String, Inner>,
) -> Result<(), BundleError> {
    const LICENCES: &str = "documentation/licenses/";
    for (name, content) in library.archive.files().filter(|(name, _)| name.starts_with(LICENCES)) {
        let mut content = content.to_vec();
        if name.ends_with("/license.txt") {
            content.extend(b"\nThe units inside (resources/units), with the licences in their documentation:\n");
            for Inner { folder, .. } in units.values() {
                content.extend(format!("  {folder}: documentation/units/{folder}\n").into_bytes());
            }
        }
        archive.file(name, content)?;
    }
    Ok(())
}

fn notes(setup: &Setup, table: &Table) -> Vec<String> {
    let mut notes = page::sentences(&table.limits);
    let scenario = setup.scenario();
    let isolated =
        scenario.isolation.all || scenario.instances.values().any(|it| it.isolate == Some(true));
    if isolated {
        notes.push(
            "isolated units run in the importer's process: a bundle starts no process".to_owned(),
        );
    }
    if scenario.real_time.is_some() {
        notes.push("real_time is not used: the importer decides when to step".to_owned());
    }
    notes
}
