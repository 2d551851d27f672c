//! JSON read strictly: doubled keys are errors, and the place of anything in the text can be found.

use std::fmt;

use serde::de::{self, DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::{Map, Value};
use serde_path_to_error::{Path, Segment};

/// A JSON value without doubled keys, of which `serde_json` would silently keep the last.
pub(crate) struct Strict(pub Value);

impl<'de> de::Deserialize<'de> for Strict {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(StrictVisitor).map(Self)
    }
}

struct StrictVisitor;

impl<'de> Visitor<'de> for StrictVisitor {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a JSON value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E>(self, value: f64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(Strict(item)) = access.next_element()? {
            items.push(item);
        }
        Ok(items.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Value, A::Error> {
        let mut map = Map::new();
        while let Some(key) = access.next_key::<String>()? {
            if map.contains_key(&key) {
                return Err(de::Error::custom(format!("the key \"{key}\" occurs twice")));
            }
            let Strict(value) = access.next_value()?;
            map.insert(key, value);
        }
        Ok(map.into())
    }
}

/// One step into a JSON value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PathStep {
    /// The member of an object.
    Key(String),
    /// The item of an array.
    Index(usize),
}

/// The steps of a path as far as they lead through objects and arrays.
pub(crate) fn steps(path: &Path) -> Vec<PathStep> {
    path.iter()
        .map_while(|segment| match segment {
            Segment::Map { key } => Some(PathStep::Key(key.clone())),
            Segment::Seq { index } => Some(PathStep::Index(*index)),
            Segment::Enum { .. } | Segment::Unknown => None,
        })
        .collect()
}

/// How many of the steps a value has.
pub(crate) fn depth(value: &Value, steps: &[PathStep]) -> usize {
    let mut at = value;
    for (k, step) in steps.iter().enumerate() {
        let next = match step {
            PathStep::Key(key) => at.get(key),
            PathStep::Index(index) => at.get(index),
        };
        match next {
            Some(inner) => at = inner,
            None => return k,
        }
    }
    steps.len()
}

/// Line and column of what the steps lead to in a JSON text: of a member's name, of an item's content.
///
/// The text is read once more by a visitor that follows the steps and gives up at their end:
/// `serde_json` says where that was.
pub(crate) fn position(text: &str, steps: &[PathStep]) -> Option<(usize, usize)> {
    if steps.is_empty() {
        return None;
    }
    let mut json = serde_json::Deserializer::from_str(text);
    let error = (&mut json).deserialize_any(Walk(steps)).err()?;
    Some((error.line(), error.column()))
}

/// Goes the steps, and fails at their end.
struct Walk<'a>(&'a [PathStep]);

impl<'de> DeserializeSeed<'de> for Walk<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    /// Scalars end here too: a visitor that does not expect them is an error.
    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the end of the path")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut access: A) -> Result<(), A::Error> {
        let Some((PathStep::Index(index), rest)) = self.0.split_first() else { return arrived() };
        for _ in 0..*index {
            access.next_element::<IgnoredAny>()?;
        }
        access.next_element_seed(Walk(rest))?;
        arrived()
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<(), A::Error> {
        let Some((PathStep::Key(wanted), rest)) = self.0.split_first() else { return arrived() };
        while let Some(key) = access.next_key::<String>()? {
            match key == *wanted {
                true if rest.is_empty() => return arrived(),
                true => access.next_value_seed(Walk(rest))?,
                false => access.next_value::<IgnoredAny>().map(drop)?,
            }
        }
        arrived()
    }
}

fn arrived<E: de::Error>() -> Result<(), E> {
    Err(E::custom("here"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "{\n  \"a\": [\n    1,\n    {\"b\": \"x\"}\n  ],\n  \"c\": {}\n}";

    #[test]
    fn analytic_positions_are_lines_of_the_text() {
        let key = |name: &str| PathStep::Key(name.to_owned());
        let line = |steps: &[PathStep]| position(TEXT, steps).map(|(line, _)| line);
        assert_eq!(line(&[key("a")]), Some(2));
        assert_eq!(line(&[key("a"), PathStep::Index(0)]), Some(3));
        assert_eq!(line(&[key("a"), PathStep::Index(1), key("b")]), Some(4));
        assert_eq!(line(&[key("c")]), Some(6));
        // what is not there is where its object ends
        assert_eq!(line(&[key("c"), key("d")]), Some(6));
        assert_eq!(line(&[]), None);
    }

    #[test]
    fn issue_doubled_keys_are_refused_at_any_depth() {
        for text in [r#"{"a": 1, "a": 2}"#, r#"[{"b": {"a": 1, "a": 1}}]"#] {
            let error = serde_json::from_str::<Strict>(text).err().unwrap().to_string();
            assert!(error.contains("\"a\" occurs twice"), "{error}");
        }
        let Strict(value) = serde_json::from_str(TEXT).unwrap();
        assert_eq!(value, serde_json::from_str::<Value>(TEXT).unwrap());
        assert_eq!(
            depth(&value, &[PathStep::Key("a".into()), PathStep::Index(1), PathStep::Index(0)]),
            2
        );
    }
}
