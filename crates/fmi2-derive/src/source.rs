//! An .fmu file with changes of its resources, and how scenarios write it.

use std::borrow::Cow;
use std::fmt;
use std::path::{Path, PathBuf};

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Serialize, Serializer};
use serde_json::{Map, Value};

use crate::DeriveError;
use crate::resource::content_of;

/// A unit: an .fmu file, and changes of its resources if there are any.
///
/// In JSON it is the path, or an object with `fmu` and `resources`.
#[derive(Debug, Clone, PartialEq)]
pub struct UnitSource {
    /// Path of the .fmu file.
    pub fmu: PathBuf,
    /// Changes by the names of the files in the unit's folder `resources`.
    pub resources: Resources,
}

/// Changes of files by their names.
pub type Resources = IndexMap<String, Changes>;

/// Changes of one file, in the order in which they are applied.
///
/// In JSON it is one change or a list.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Changes(pub Vec<Change>);

/// A change of a file in a unit's resources.
///
/// In JSON it is the path of a file or an object.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// A file that replaces it, or that is added.
    File(PathBuf),
    /// A patch of a JSON file, see [`strict_json::merge_by_name`].
    Patch(Map<String, Value>),
}

impl Change {
    /// The patch in a JSON file.
    ///
    /// # Errors
    /// The file cannot be read, or is not a JSON object. `name` is the resource, for messages.
    pub fn patch_of_file(name: &str, path: &Path) -> Result<Self, DeriveError> {
        let failed = |message| DeriveError::PatchFile { path: path.to_owned(), message };
        let text = String::from_utf8(content_of(name, path)?);
        let text = text.map_err(|error| failed(error.to_string()))?;
        match strict_json::parse(&text).map_err(|error| failed(error.to_string()))? {
            Value::Object(patch) => Ok(Self::Patch(patch)),
            _ => Err(failed("it is not an object".to_owned())),
        }
    }
}

impl From<PathBuf> for UnitSource {
    fn from(fmu: PathBuf) -> Self {
        Self { fmu, resources: Resources::new() }
    }
}

impl UnitSource {
    /// Applies a function to each path: that of the .fmu file and those of the files that replace resources.
    ///
    /// # Errors
    /// The first error of the function.
    pub fn map_paths<E>(&mut self, map: impl Fn(&Path) -> Result<PathBuf, E>) -> Result<(), E> {
        self.fmu = map(&self.fmu)?;
        for change in self.resources.values_mut().flat_map(|changes| &mut changes.0) {
            if let Change::File(path) = change {
                *path = map(path)?;
            }
        }
        Ok(())
    }
}

impl Serialize for UnitSource {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        #[derive(Serialize)]
        struct Object<'a> {
            fmu: &'a Path,
            resources: &'a Resources,
        }
        match self {
            Self { fmu, resources } if resources.is_empty() => fmu.serialize(serializer),
            Self { fmu, resources } => Object { fmu, resources }.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for UnitSource {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SourceVisitor;

        impl<'de> Visitor<'de> for SourceVisitor {
            type Value = UnitSource;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the path of a .fmu file, or an object with \"fmu\" and \"resources\"")
            }

            fn visit_str<E: de::Error>(self, path: &str) -> Result<UnitSource, E> {
                Ok(PathBuf::from(path).into())
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<UnitSource, A::Error> {
                let WithResources { fmu, resources } =
                    WithResources::deserialize(MapAccessDeserializer::new(map))?;
                Ok(UnitSource { fmu, resources })
            }
        }

        deserializer.deserialize_any(SourceVisitor)
    }
}

impl Serialize for Changes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.as_slice() {
            [only] => only.serialize(serializer),
            several => several.serialize(serializer),
        }
    }
}

impl Serialize for Change {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::File(path) => path.serialize(serializer),
            Self::Patch(patch) => patch.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for Changes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ChangesVisitor;

        impl<'de> Visitor<'de> for ChangesVisitor {
            type Value = Changes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(
                    "the path of a file, an object that patches the resource, or a list of these",
                )
            }

            fn visit_str<E: de::Error>(self, path: &str) -> Result<Changes, E> {
                Ok(Changes(vec![ChangeVisitor.visit_str(path)?]))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Changes, A::Error> {
                Ok(Changes(vec![ChangeVisitor.visit_map(map)?]))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Changes, A::Error> {
                let mut changes = Vec::new();
                while let Some(change) = list.next_element()? {
                    changes.push(change);
                }
                Ok(Changes(changes))
            }
        }

        deserializer.deserialize_any(ChangesVisitor)
    }
}

impl<'de> Deserialize<'de> for Change {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ChangeVisitor)
    }
}

struct ChangeVisitor;

impl<'de> Visitor<'de> for ChangeVisitor {
    type Value = Change;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the path of a file, or an object that patches the resource")
    }

    fn visit_str<E: de::Error>(self, path: &str) -> Result<Change, E> {
        Ok(Change::File(path.into()))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Change, A::Error> {
        Map::deserialize(MapAccessDeserializer::new(map)).map(Change::Patch)
    }
}

/// A unit with changed resources. Only units made with fmi2-export can have them: the unit's library prints the
/// description that results.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "UnitWithResources")]
struct WithResources {
    /// Path of the .fmu file, relative to the scenario file.
    fmu: PathBuf,
    /// Changes of the files in the unit's folder `resources`, by their names.
    #[serde(default, skip_serializing_if = "Resources::is_empty")]
    resources: Resources,
}

impl JsonSchema for UnitSource {
    fn schema_name() -> Cow<'static, str> {
        "Unit".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "A unit: the path of its .fmu file, relative to the scenario file, or an object.",
            "anyOf": [{ "type": "string" }, generator.subschema_for::<WithResources>()]
        })
    }
}

impl JsonSchema for Changes {
    fn schema_name() -> Cow<'static, str> {
        "Changes".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one = json_schema!({ "anyOf": [{ "type": "string" }, { "type": "object" }] });
        json_schema!({
            "description": "Changes of a file in the resources of a unit.",
            "anyOf": [
                {
                    "description": "Path of a file, relative to the scenario file, that replaces the resource or is \
                                    added.",
                    "type": "string"
                },
                {
                    "description": "A patch of a JSON file: objects are merged member by member, null removes a \
                                    member, lists of items with a `name` are changed by name, and anything else is \
                                    replaced. The patch of such a list is a list, or an object with names as keys; \
                                    `*` in a key stands for any text.",
                    "type": "object"
                },
                { "description": "Several changes in order.", "type": "array", "items": one }
            ]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<UnitSource, String> {
        strict_json::read(text).map_err(|error| error.to_string())
    }

    #[test]
    fn invariant_sources_survive_a_round_trip() {
        for text in [
            r#""a.fmu""#,
            r#"{"fmu":"a.fmu","resources":{"v.json":"my.json"}}"#,
            r#"{"fmu":"a.fmu","resources":{"v.json":{"bodies":{"car":null}},"t.csv":"t.csv"}}"#,
            r#"{"fmu":"a.fmu","resources":{"v.json":["my.json",{"mass":1.5}]}}"#,
        ] {
            assert_eq!(serde_json::to_string(&read(text).unwrap()).unwrap(), text);
        }
        let plain = read(r#"{"fmu": "a.fmu"}"#).unwrap();
        assert_eq!(serde_json::to_string(&plain).unwrap(), r#""a.fmu""#);
    }

    #[test]
    fn refusal_other_forms_name_the_place() {
        for (text, part) in [
            ("3", "expected the path of a .fmu file, or an object with \"fmu\""),
            (r#"{"resources": {}}"#, "missing field `fmu`"),
            (r#"{"fmu": "a", "resource": {}}"#, "did you mean `resources`?"),
            (r#"{"fmu": "a", "resources": {"v": 3}}"#, "at resources.v: invalid type: integer `3`"),
            (r#"{"fmu": "a", "resources": {"v": ["a", 3]}}"#, "at resources.v[1]: invalid type"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn invariant_all_paths_are_mapped() {
        let mut source =
            read(r#"{"fmu": "a.fmu", "resources": {"v": ["b", {"c": "d"}]}}"#).unwrap();
        source.map_paths(|path| Ok::<_, ()>(Path::new("x").join(path))).unwrap();
        let expected = r#"{"fmu":"x/a.fmu","resources":{"v":["x/b",{"c":"d"}]}}"#;
        assert_eq!(serde_json::to_string(&source).unwrap(), expected);
    }
}
