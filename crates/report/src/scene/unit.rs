//! The units of a scenario that carry a layout file.

use std::fs::File;
use std::io::Read as _;
use std::path::Path;

use serde_json::Value;
use zip::ZipArchive;

use crate::error::ReportError;
use crate::scenario::{Instance, Scenario};

/// Largest file of a unit that is read (bytes): a layout of 1000 cars has 40 MB.
const LARGEST: u64 = 64 << 20;

/// An instance whose unit carries a layout file.
#[derive(Debug)]
pub(super) struct Unit<'a> {
    instance: Instance<'a>,
    file: &'static str,
    layout: String,
    description: String,
}

impl<'a> Unit<'a> {
    /// The first instance whose unit has `resources/{file}`.
    pub(super) fn find(
        scenario: &'a Scenario,
        file: &'static str,
    ) -> Result<Option<Self>, ReportError> {
        let mut seen = Vec::new();
        for instance in scenario.instances() {
            if seen.contains(&instance.path) {
                continue;
            }
            if let Some(layout) = read(&instance.path, &format!("resources/{file}"))? {
                let description = read(&instance.path, "modelDescription.xml")?.unwrap_or_default();
                return Ok(Some(Self { instance, file, layout, description }));
            }
            seen.push(instance.path);
        }
        Ok(None)
    }

    /// The layout, read by its own crate.
    pub(super) fn layout<T, E: std::fmt::Display>(
        &self,
        reader: impl Fn(&str) -> Result<T, E>,
    ) -> Result<T, ReportError> {
        reader(&self.layout)
            .map_err(|error| self.unusable(&format!("resources/{}: {error}", self.file)))
    }

    /// An error about this unit.
    pub(super) fn unusable(&self, message: &str) -> ReportError {
        ReportError::Unit { path: self.instance.path.clone(), message: message.to_owned() }
    }

    /// The value of a number parameter: what the scenario gives, or what the unit starts with.
    pub(super) fn parameter(&self, name: &str) -> Option<f64> {
        self.instance.value(name).and_then(Value::as_f64).or_else(|| {
            let document = roxmltree::Document::parse(&self.description).ok()?;
            let variable = document.descendants().find(|it| {
                it.has_tag_name("ScalarVariable") && it.attribute("name") == Some(name)
            })?;
            variable.children().find_map(|it| it.attribute("start"))?.parse().ok()
        })
    }

    /// The full name of one of this instance's variables.
    pub(super) fn variable(&self, name: &str) -> String {
        format!("{}.{name}", self.instance.name)
    }
}

/// A text file of an archive, `None` if it has no such file.
fn read(path: &Path, name: &str) -> Result<Option<String>, ReportError> {
    let unusable = |message: String| ReportError::Unit { path: path.to_owned(), message };
    let file = File::open(path).map_err(|error| unusable(error.to_string()))?;
    let mut archive = ZipArchive::new(file).map_err(|error| unusable(error.to_string()))?;
    let entry = match archive.by_name(name) {
        Ok(entry) => entry,
        Err(zip::result::ZipError::FileNotFound) => return Ok(None),
        Err(error) => return Err(unusable(format!("{name}: {error}"))),
    };
    let mut text = String::new();
    entry
        .take(LARGEST)
        .read_to_string(&mut text)
        .map_err(|error| unusable(format!("{name}: {error}")))?;
    Ok(Some(text))
}
