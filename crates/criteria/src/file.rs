//! Criteria files, and those that ship.

use std::path::{Path, PathBuf};

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use strict_json::JsonError;
use thiserror::Error;

use crate::{Metric, MetricError};

/// The files in the folder `criteria` of the repository, by name.
const SHIPPED: [(&str, &str); 6] = [
    ("cjj-t-262", include_str!("../../../criteria/cjj-t-262.json")),
    ("shanghai", include_str!("../../../criteria/shanghai.json")),
    ("frequency", include_str!("../../../criteria/frequency.json")),
    ("mbbo", include_str!("../../../criteria/mbbo.json")),
    ("ride-comfort", include_str!("../../../criteria/ride-comfort.json")),
    ("stability", include_str!("../../../criteria/stability.json")),
];

/// Criteria by which `maglev check` judges a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "Criteria of runs", rename = "Criteria")]
pub struct CriteriaFile {
    /// Path or URL of the schema, for editors. Default: none.
    #[serde(rename = "$schema", default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// Title, one line. Default: empty.
    #[serde(default)]
    pub title: String,
    /// What the criteria are for, and what they leave out. Default: empty.
    #[serde(default)]
    pub description: String,
    /// The criteria, by names that become the keys of results. Each needs a bound and its source.
    pub criteria: IndexMap<String, Metric>,
}

/// Why a criteria file cannot be used.
#[derive(Debug, Error)]
pub enum CriteriaError {
    /// It cannot be read.
    #[error("cannot read the criteria {path}{}", suggested(suggestion.as_ref()))]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// A shipped name that was probably meant.
        suggestion: Option<&'static str>,
        /// What the operating system reported.
        #[source]
        source: std::io::Error,
    },
    /// It is not JSON, or has other keys or values than the format.
    #[error("invalid criteria {path}")]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong, and where.
        #[source]
        source: JsonError,
    },
    /// A criterion is invalid.
    #[error("{path}: criteria.{name}.{source}")]
    Metric {
        /// Path of the file.
        path: PathBuf,
        /// Its name.
        name: String,
        /// What is wrong with it.
        source: MetricError,
    },
    /// It has no criteria.
    #[error("{path} has no criteria")]
    Empty {
        /// Path of the file.
        path: PathBuf,
    },
}

fn suggested(name: Option<&&'static str>) -> String {
    name.map(|name| format!("; did you mean the shipped \"{name}\"?")).unwrap_or_default()
}

impl CriteriaFile {
    /// The names of the files that ship.
    #[must_use]
    pub fn shipped_names() -> [&'static str; SHIPPED.len()] {
        SHIPPED.map(|(name, _)| name)
    }

    /// The shipped file of that name.
    #[must_use]
    pub fn shipped(name: &str) -> Option<Result<Self, CriteriaError>> {
        let (_, text) = SHIPPED.iter().find(|(known, _)| *known == name)?;
        Some(Self::parse(text, Path::new(name)))
    }

    /// Reads a file, or the shipped one of that name.
    ///
    /// # Errors
    /// There is no such file, or it is invalid.
    pub fn load(name: &str) -> Result<Self, CriteriaError> {
        if let Some(shipped) = Self::shipped(name) {
            return shipped;
        }
        let path = PathBuf::from(name);
        let text = std::fs::read_to_string(&path).map_err(|source| CriteriaError::Read {
            path: path.clone(),
            suggestion: patterns::suggest(name, Self::shipped_names()),
            source,
        })?;
        Self::parse(&text, &path)
    }

    /// Reads the text of a file; `path` is for messages.
    ///
    /// # Errors
    /// It is invalid.
    pub fn parse(text: &str, path: &Path) -> Result<Self, CriteriaError> {
        let json = |source| CriteriaError::Json { path: path.to_owned(), source };
        let file: Self = strict_json::read_commented(text).map_err(json)?;
        if file.criteria.is_empty() {
            return Err(CriteriaError::Empty { path: path.to_owned() });
        }
        for (name, metric) in &file.criteria {
            let needed = || {
                let missing = |key, problem: &str| {
                    Err(MetricError { key, problem: format!("missing; {problem}") })
                };
                match () {
                    () if !metric.is_bounded() => missing("max", "a criterion needs a bound"),
                    () if metric.source.trim().is_empty() => {
                        missing("source", "say where the bound comes from, or whose choice it is")
                    }
                    () => Ok(()),
                }
            };
            metric.check(name).and_then(|()| needed()).map_err(|source| CriteriaError::Metric {
                path: path.to_owned(),
                name: name.clone(),
                source,
            })?;
        }
        Ok(file)
    }

    /// The JSON schema of criteria files, as text with a final line feed.
    #[must_use]
    pub fn json_schema() -> String {
        // a schema is a plain JSON value, which always prints
        let mut schema = schemars::schema_for!(Self).to_value();
        strict_json::allow_comments(&mut schema);
        serde_json::to_string_pretty(&schema).unwrap_or_default() + "\n"
    }
}

impl CriteriaError {
    /// How to fix it.
    #[must_use]
    pub fn help(&self) -> &'static str {
        match self {
            Self::Read { .. } => {
                "give the path of a file, or one of cjj-t-262, shanghai, frequency, mbbo, ride-comfort, stability"
            }
            _ => "docs/criteria.md explains the format; `maglev schema criteria` prints its schema",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_comments_are_ignored_anywhere() {
        let text = r#"{"$comment": "of our line", "criteria": {"gap": {"$comment": ["to be", "discussed"],
            "signal": "a.b", "figure": "max", "max": 1, "source": "us"}}}"#;
        let file = CriteriaFile::parse(text, Path::new("c.json")).unwrap();
        assert_eq!(file.criteria.len(), 1);
        let wrong = text.replace("\"of our line\"", "3");
        let error = CriteriaFile::parse(&wrong, Path::new("c.json")).unwrap_err();
        let said = std::error::Error::source(&error).unwrap().to_string();
        assert!(said.contains("$comment") && said.contains("a text"), "{said}");
        assert!(CriteriaFile::json_schema().contains("\"$comment\""));
    }

    #[test]
    fn golden_published_schema_is_current() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../criteria/schema.json");
        let published = std::fs::read_to_string(path).unwrap_or_default();
        let current = published == CriteriaFile::json_schema();
        assert!(current, "stale; run: maglev schema criteria > criteria/schema.json");
    }

    /// Names are unique across the files, since they are judged together.
    #[test]
    fn invariant_shipped_criteria_are_valid_and_cite_their_source() {
        let mut seen = std::collections::HashSet::new();
        let names = CriteriaFile::shipped_names();
        for name in &names {
            let file = CriteriaFile::shipped(name).unwrap().unwrap();
            assert!(!file.title.is_empty() && !file.description.is_empty(), "{name}");
            for (key, metric) in &file.criteria {
                assert!(seen.insert(key.clone()), "{key}");
                assert!(!metric.title.is_empty(), "{key}");
            }
            let missing = CriteriaError::Empty { path: PathBuf::new() };
            assert!(!missing.help().is_empty());
        }
        let io = std::io::Error::other("x");
        let read = CriteriaError::Read { path: PathBuf::new(), suggestion: None, source: io };
        assert!(names.iter().all(|name| read.help().contains(name)), "{}", read.help());
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../criteria");
        let files = std::fs::read_dir(folder).unwrap().map(|it| it.unwrap().file_name());
        let files = files.filter(|it| it != "schema.json").count();
        assert_eq!(files, names.len(), "a file in criteria/ does not ship");
    }

    #[test]
    fn refusal_bad_files_name_the_place() {
        let parse = |text: &str| CriteriaFile::parse(text, Path::new("c.json")).unwrap_err();
        let chain = |text: &str| {
            let error = parse(text);
            let source = std::error::Error::source(&error).map(ToString::to_string);
            format!("{error}: {}", source.unwrap_or_default())
        };
        let one = |body: &str| format!(r#"{{"criteria": {{"gap": {{{body}}}}}}}"#);
        for (text, parts) in [
            (one(r#""signal": "v.gap", "figure": "mni""#), ["criteria.gap.figure", "min"]),
            (one(r#""signal": "v.gap", "figur": "min""#), ["criteria.gap", "figure"]),
            (one(r#""signal": "v.gap", "figure": "min", "min": "x""#), ["gap.min", "1/3800"]),
            (one(r#""signal": "v.gap", "figure": "min""#), ["criteria.gap.max", "needs a bound"]),
            (
                one(r#""signal": "v.gap", "figure": "min", "min": 1"#),
                ["criteria.gap.source", "missing"],
            ),
            (one(r#""figure": "min""#), ["criteria.gap.signal", "missing"]),
            (one(r#""quantity": "wz", "max": 1"#), ["criteria.gap.quantity", "sperling_index"]),
            (one(r#""signal": "a.b", "figure": "max", "over": "length""#), ["over", "span_length"]),
            (r#"{"criteria": {}}"#.to_owned(), ["c.json", "no criteria"]),
            (r#"{"criteria": {"a": {}, "a": {}}}"#.to_owned(), ["criteria", "twice"]),
            ("{".to_owned(), ["c.json", "EOF"]),
        ] {
            let said = chain(&text);
            for part in parts {
                assert!(said.contains(part), "{text}: {said}");
            }
        }
        let error = CriteriaFile::load("mbob").unwrap_err();
        assert!(error.to_string().contains("the shipped \"mbbo\"?"), "{error}");
    }
}
