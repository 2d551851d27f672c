//! The table of variables in a bundle.
#![doc = include_str!("../README.md")]

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Name of the file in the FMU's folder `resources`.
pub const TABLE: &str = "bundle.json";
/// Name of the scenario in the same folder.
pub const SCENARIO: &str = "scenario.json";
/// Number of the form of the file.
pub const FORM: u32 = 1;

/// Everything that a bundle declares.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// [`FORM`].
    pub form: u32,
    /// Model identifier, which names the binaries.
    pub identifier: String,
    /// Name for display.
    pub model_name: String,
    /// One sentence.
    pub description: String,
    /// Licences of the units inside.
    pub license: String,
    /// Copyright notices of the units inside.
    pub copyright: String,
    /// Start time (s) of the default experiment.
    pub start: f64,
    /// Stop time (s) of the default experiment.
    pub stop: f64,
    /// Communication step (s) of the units inside.
    pub step: f64,
    /// Relative tolerance of the default experiment.
    pub tolerance: Option<f64>,
    /// What the bundle cannot do, and why.
    pub limits: Limits,
    /// Units of measure of the variables.
    pub measures: Vec<Measure>,
    /// The variables, in the order of the description.
    pub variables: Vec<Exposed>,
    /// Checksum of each file inside. They make the FMU's GUID depend on all of it.
    pub files: BTreeMap<String, String>,
}

/// Reasons for missing capabilities; each names the unit that lacks it.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Why communication steps must be multiples of the step inside.
    pub variable_step: Option<String>,
    /// Why states cannot be saved.
    pub states: Option<String>,
    /// Why a process can have one instance only.
    pub instances: Option<String>,
    /// Why another program is needed.
    pub alone: Option<String>,
}

/// A unit of measure: exponents of kg, m, s, A, K, mol, cd, rad, and base value = factor · value + offset.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// Name, such as `m/s`.
    pub name: String,
    /// Exponents of the base units.
    pub exponents: [i8; 8],
    /// Factor to base units.
    pub factor: f64,
    /// Offset to base units.
    pub offset: f64,
    /// Units for display: name, factor, offset.
    pub displays: Vec<(String, f64, f64)>,
}

/// Role of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Set by the importer at any time.
    Input,
    /// Set by the importer before initialization.
    Parameter,
    /// Set by the importer between steps.
    Tunable,
    /// Computed.
    Output,
}

/// Type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Real
    Real,
    /// Integer, and Enumeration by its numbers
    Integer,
    /// Boolean
    Boolean,
    /// String
    String,
}

/// A value of any type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Value {
    /// Real
    Real(f64),
    /// Integer
    Integer(i32),
    /// Boolean
    Boolean(bool),
    /// String
    String(String),
}

/// One variable of the bundle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exposed {
    /// Name in the bundle.
    pub name: String,
    /// What it means.
    pub description: String,
    /// Its role.
    pub role: Role,
    /// Its type.
    pub kind: Kind,
    /// Whether it changes at communication points only.
    pub discrete: bool,
    /// Start value of inputs and parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Value>,
    /// Smallest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min: Option<f64>,
    /// Largest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max: Option<f64>,
    /// Typical magnitude.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<f64>,
    /// Unit of measure, by its place in [`Table::measures`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measure: Option<usize>,
    /// Unit for display.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub display: Option<String>,
    /// Highest order of derivatives of an output.
    #[serde(default)]
    pub derivatives: u32,
    /// Highest order of derivatives of an output for interpolation, if that is higher.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub interpolated: u32,
    /// Highest order of derivatives that a continuous input takes, 3 to 5.
    #[serde(default = "cubic", skip_serializing_if = "is_cubic")]
    pub takes: u32,
    /// The variables inside that it stands for, `instance.variable`. An output has one.
    pub ports: Vec<String>,
    /// Of an output: the inputs that it depends on directly, by their places in [`Table::variables`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub depends: Vec<usize>,
    /// Of an output: the inputs and parameters that its first value depends on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub initially: Vec<usize>,
}

/// Every continuous input takes derivatives up to this order.
const CUBIC: u32 = 3;

const fn cubic() -> u32 {
    CUBIC
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde wants it")]
const fn is_cubic(takes: &u32) -> bool {
    *takes == CUBIC
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "as serde wants it")]
const fn is_zero(order: &u32) -> bool {
    *order == 0
}

impl Table {
    /// Reads the file.
    ///
    /// # Errors
    /// The text is not such a table.
    pub fn read(text: &str) -> Result<Self, String> {
        let table: Self = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if table.form != FORM {
            return Err(format!(
                "the bundle has form {}, and the library reads {FORM}",
                table.form
            ));
        }
        let count = table.variables.len();
        let places =
            |it: &Exposed| it.depends.iter().chain(&it.initially).all(|&place| place < count);
        let measured = |it: &Exposed| it.measure.is_none_or(|place| place < table.measures.len());
        match table.variables.iter().find(|it| !places(it) || !measured(it) || it.ports.is_empty())
        {
            None => Ok(table),
            Some(wrong) => Err(format!("the entry of {} refers to nothing", wrong.name)),
        }
    }

    /// The text of the file.
    ///
    /// # Errors
    /// A number is not finite.
    pub fn to_text(&self) -> Result<String, String> {
        serde_json::to_string_pretty(self).map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let variable = Exposed {
            name: "gap".to_owned(),
            description: String::new(),
            role: Role::Output,
            kind: Kind::Real,
            discrete: false,
            start: None,
            min: None,
            max: None,
            nominal: Some(0.1 + 0.2),
            measure: Some(0),
            display: None,
            derivatives: 1,
            interpolated: 2,
            takes: 5,
            ports: vec!["vehicle.gap_01".to_owned()],
            depends: vec![0],
            initially: Vec::new(),
        };
        let measure = Measure {
            name: "m".to_owned(),
            exponents: [0, 1, 0, 0, 0, 0, 0, 0],
            factor: 1.0,
            offset: 0.0,
            displays: Vec::new(),
        };
        Table {
            form: FORM,
            identifier: "one".to_owned(),
            model_name: "One".to_owned(),
            description: String::new(),
            license: String::new(),
            copyright: String::new(),
            start: 0.0,
            stop: 1.0,
            step: 1e-3,
            tolerance: None,
            limits: Limits::default(),
            measures: vec![measure],
            variables: vec![variable],
            files: BTreeMap::new(),
        }
    }

    #[test]
    fn invariant_a_table_survives_a_round_trip() {
        assert_eq!(Table::read(&table().to_text().unwrap()), Ok(table()));
    }

    #[test]
    fn refusal_a_table_that_refers_to_nothing_names_the_variable() {
        let read = |change: fn(&mut Table)| {
            let mut table = table();
            change(&mut table);
            Table::read(&table.to_text().unwrap()).unwrap_err()
        };
        assert!(read(|it| it.variables[0].depends = vec![1]).contains("gap"));
        assert!(read(|it| it.variables[0].measure = Some(1)).contains("gap"));
        assert!(read(|it| it.form = 2).contains("form 2"));
    }
}
