//! From a JSON value to a type, with errors that name the nearest allowed word.

use std::fmt;

use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{self, Deserializer, Expected, IntoDeserializer, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::Value;

use crate::place::{PathStep, position};

/// Why a value does not have the type's form, without the place.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}{}", hint.as_deref().unwrap_or_default())]
pub struct FormError {
    message: String,
    /// What is allowed, to follow the message.
    hint: Option<String>,
}

impl FormError {
    /// An error in words.
    #[must_use]
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), hint: None }
    }

    /// The error for a word that is not one of those that are allowed.
    pub(crate) fn unknown(what: &str, word: &str, allowed: &[&str]) -> Self {
        let hint = match (patterns::suggest(word, allowed.iter().copied()), allowed) {
            (Some(near), _) => format!("; did you mean `{near}`?"),
            (None, []) => "; none is allowed here".to_owned(),
            (None, all) => format!("; allowed: `{}`", all.join("`, `")),
        };
        Self { message: format!("unknown {what} `{word}`"), hint: Some(hint) }
    }

    /// The error with line and column of the place in a text.
    #[must_use]
    pub fn located(&self, text: &str, steps: &[PathStep]) -> String {
        let Some((line, column)) = position(text, steps) else { return self.to_string() };
        let Self { message, hint } = self;
        format!("{message} at line {line} column {column}{}", hint.as_deref().unwrap_or_default())
    }
}

impl de::Error for FormError {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        Self::unknown("field", field, expected)
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        Self::unknown("value", variant, expected)
    }

    fn invalid_type(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::other("type", found, expected)
    }

    fn invalid_value(found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        Self::other("value", found, expected)
    }
}

impl FormError {
    /// The error for something else than what is expected.
    fn other(what: &str, found: Unexpected<'_>, expected: &dyn Expected) -> Self {
        let expected = in_json(&expected.to_string());
        Self::new(match found {
            Unexpected::Unit => format!("invalid {what}: null, expected {expected}"),
            Unexpected::Float(number) => {
                format!("invalid {what}: number `{number}`, expected {expected}")
            }
            Unexpected::Str(text) => format!("invalid {what}: text {text:?}, expected {expected}"),
            Unexpected::Seq => format!("invalid {what}: list, expected {expected}"),
            Unexpected::Map => format!("invalid {what}: object, expected {expected}"),
            found => format!("invalid {what}: {found}, expected {expected}"),
        })
    }
}

/// What a type of Rust is in JSON, in words.
fn in_json(expected: &str) -> String {
    match expected {
        "f32" | "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number of at least 0",
        "i8" | "i16" | "i32" | "i64" | "isize" => "a whole number",
        "a boolean" => "true or false",
        "a string" => "a text",
        "a sequence" => "a list",
        "a map" => "an object",
        other if other.starts_with("struct ") => "an object",
        other => return other.to_owned(),
    }
    .to_owned()
}

/// A value to make a type of.
pub(crate) struct Typed(pub(crate) Value);

impl<'de> Deserializer<'de> for Typed {
    type Error = FormError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FormError> {
        match self.0 {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(value),
            Value::String(text) => visitor.visit_string(text),
            Value::Number(number) => match (number.as_u64(), number.as_i64(), number.as_f64()) {
                (Some(number), _, _) => visitor.visit_u64(number),
                (_, Some(number), _) => visitor.visit_i64(number),
                (_, _, number) => visitor.visit_f64(number.unwrap_or(f64::NAN)),
            },
            Value::Array(items) => {
                let mut items = SeqDeserializer::new(items.into_iter().map(Typed));
                let value = visitor.visit_seq(&mut items)?;
                items.end()?;
                Ok(value)
            }
            Value::Object(members) => {
                let members = members.into_iter().map(|(key, value)| (key, Typed(value)));
                let mut members = MapDeserializer::new(members);
                let value = visitor.visit_map(&mut members)?;
                members.end()?;
                Ok(value)
            }
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, FormError> {
        match self.0 {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, FormError> {
        visitor.visit_newtype_struct(self)
    }

    /// Words only: no format has enumerations that carry data.
    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, FormError> {
        match self.0 {
            Value::String(word) => visitor.visit_enum(word.into_deserializer()),
            other => Err(de::Error::custom(format!("invalid value: {other}, expected a text"))),
        }
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit
        unit_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

impl IntoDeserializer<'_, FormError> for Typed {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Deserialize;
    use serde::de::DeserializeOwned;
    use serde_json::json;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Kind {
        Spherical,
        Revolute,
    }

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Joint {
        kind: Kind,
        at: [f64; 2],
        limit: Option<i32>,
        #[serde(default)]
        named: BTreeMap<String, u8>,
    }

    fn made<T: DeserializeOwned>(value: Value) -> Result<T, String> {
        T::deserialize(Typed(value)).map_err(|error| error.to_string())
    }

    #[test]
    fn analytic_a_value_becomes_the_type_that_serde_json_makes_of_it() {
        for value in [
            json!({"kind": "revolute", "at": [1, -2.5], "limit": -7, "named": {"a": 1}}),
            json!({"kind": "spherical", "at": [-0.0, 1e300], "limit": null}),
        ] {
            let expected: Joint = serde_json::from_value(value.clone()).unwrap();
            assert_eq!(made::<Joint>(value).unwrap(), expected);
        }
        assert_eq!(made::<f64>(json!(-0.0)).unwrap().to_bits(), (-0.0_f64).to_bits());
    }

    #[test]
    fn analytic_the_nearest_key_or_word_is_named_or_all_are() {
        let joint = |key: &str, kind: &str| json!({"kind": kind, key: [0, 1]});
        for (value, message) in [
            (joint("att", "revolute"), "unknown field `att`; did you mean `at`?"),
            (
                joint("colour", "revolute"),
                "unknown field `colour`; allowed: `kind`, `at`, `limit`, `named`",
            ),
            (joint("at", "revolut"), "unknown value `revolut`; did you mean `revolute`?"),
            (joint("at", "?"), "unknown value `?`; allowed: `spherical`, `revolute`"),
        ] {
            assert_eq!(made::<Joint>(value).unwrap_err(), message);
        }
    }

    #[test]
    fn issue_values_of_another_form_are_refused() {
        for (value, part) in [
            (json!({"kind": 3, "at": [0, 1]}), "invalid value: 3"),
            (json!({"kind": "revolute", "at": [0]}), "array of length 2"),
            (json!({"kind": "revolute", "at": [0, 1, 2]}), "length 3"),
            (json!({"kind": "revolute", "at": [0, null]}), "null, expected a number"),
            (json!({"kind": "revolute", "at": [0, "9"]}), "text \"9\", expected a number"),
            (
                json!({"kind": "revolute", "at": [0, 1], "named": {"a": 2.5}}),
                "number `2.5`, expected a whole number of at least 0",
            ),
            (
                json!({"kind": "revolute", "at": [0, 1], "named": {"a": -1}}),
                "integer `-1`, expected a whole number of at least 0",
            ),
            (json!({"kind": "revolute", "at": [0, 1], "named": {"a": 256}}), "256"),
            (json!({"kind": "revolute"}), "missing field `at`"),
            (json!(null), "null, expected an object"),
        ] {
            let error = made::<Joint>(value).unwrap_err();
            assert!(error.contains(part), "{error}");
        }
    }
}
