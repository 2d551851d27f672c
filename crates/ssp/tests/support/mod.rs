//! Units without binaries, and archives of systems made of them.
#![allow(dead_code, reason = "each test program uses a part")]

use std::fs::{self, File};
use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;
use tempfile::TempDir;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// A folder of a test.
pub struct Bench {
    folder: TempDir,
}

/// The description of a unit: each variable as an XML element, with the attributes of its type. mm and K are defined.
pub fn unit(variables: &[&str]) -> String {
    let outputs: String = variables
        .iter()
        .enumerate()
        .filter(|(_, it)| it.contains("output"))
        .map(|(k, _)| format!("<Unknown index=\"{}\" dependencies=\"\"/>", k + 1))
        .collect();
    let variables: String = variables
        .iter()
        .enumerate()
        .map(|(k, it)| {
            it.replacen("<ScalarVariable", &format!("<ScalarVariable valueReference=\"{k}\""), 1)
        })
        .collect();
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="u" guid="g">
<CoSimulation modelIdentifier="u" canHandleVariableCommunicationStepSize="true"/>
<UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit><Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
</UnitDefinitions>
<TypeDefinitions><SimpleType name="Mode"><Enumeration><Item name="off" value="1"/><Item name="on" value="2"/>
</Enumeration></SimpleType></TypeDefinitions>
<DefaultExperiment stopTime="2" stepSize="0.01"/>
<ModelVariables>{variables}</ModelVariables>
<ModelStructure><Outputs>{outputs}</Outputs></ModelStructure></fmiModelDescription>"#
    )
}

/// The input u (m), the output y (mm), parameters of all types.
pub fn plain() -> String {
    let parameter = |name: &str, kind: &str| {
        format!(
            r#"<ScalarVariable name="{name}" causality="parameter" variability="fixed">{kind}</ScalarVariable>"#
        )
    };
    unit(&[
        r#"<ScalarVariable name="u" causality="input"><Real start="0" unit="m"/></ScalarVariable>"#,
        r#"<ScalarVariable name="v[1]" causality="input"><Real start="0"/></ScalarVariable>"#,
        r#"<ScalarVariable name="y" causality="output"><Real unit="mm"/></ScalarVariable>"#,
        &parameter("gain", r#"<Real start="1" unit="m"/>"#),
        &parameter("count", r#"<Integer start="1"/>"#),
        &parameter("on", r#"<Boolean start="false"/>"#),
        &parameter("file", r#"<String start=""/>"#),
        &parameter("mode", r#"<Enumeration declaredType="Mode" start="1"/>"#),
    ])
}

/// A zip archive.
pub fn pack(path: &Path, entries: &[(&str, &[u8])]) {
    let mut zip = ZipWriter::new(File::create(path).unwrap());
    for (name, content) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(content).unwrap();
    }
    zip.finish().unwrap();
}

/// The text of a description with this content.
pub fn ssd(system: &str, rest: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription version="1.0" name="a system"
 xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
 xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
 xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
 xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary">
<ssd:System name="root">{system}</ssd:System>{rest}</ssd:SystemStructureDescription>"#
    )
}

impl Bench {
    pub fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        bench.write_unit("u.fmu", &plain(), &[]);
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    }

    /// A unit with further files.
    pub fn write_unit(&self, name: &str, description: &str, files: &[(&str, &str)]) {
        let mut entries = vec![("modelDescription.xml", description.as_bytes())];
        entries.extend(files.iter().map(|(name, text)| (*name, text.as_bytes())));
        pack(&self.path(name), &entries);
    }

    /// An archive with the unit as resources/u.fmu and u2.fmu, and further files.
    pub fn archive(&self, ssd: &str, files: &[(&str, &str)]) -> PathBuf {
        let unit = fs::read(self.path("u.fmu")).unwrap();
        let path = self.path("system.ssp");
        let mut entries = vec![
            ("SystemStructure.ssd", ssd.as_bytes()),
            ("resources/u.fmu", &unit),
            ("resources/u2.fmu", &unit),
        ];
        entries.extend(files.iter().map(|(name, text)| (*name, text.as_bytes())));
        pack(&path, &entries);
        path
    }

    /// The scenario of an archive, and the notes.
    pub fn import(&self, archive: &Path) -> Result<(Value, Vec<String>), String> {
        let folder = self.path("imported");
        let imported = ssp::import(archive, &folder).map_err(|error| chain(&error))?;
        let text = fs::read_to_string(&imported.scenario).unwrap();
        Ok((serde_json::from_str(&text).unwrap(), imported.notes))
    }
}

/// An error with its causes.
pub fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(error) = source {
        text += &format!("; {error}");
        source = error.source();
    }
    text
}
