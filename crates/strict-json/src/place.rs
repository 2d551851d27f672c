//! Places in a JSON document, and where they are in its text.

use std::fmt::{self, Write as _};

use serde::de::{self, DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_json::Value;
use serde_path_to_error::{Path, Segment};

/// One step into a JSON value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PathStep {
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

/// How many of the steps lead to something in a value.
#[must_use]
pub fn depth(value: &Value, steps: &[PathStep]) -> usize {
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

/// Most steps that a message shows; no format needs as many.
const MAX_SHOWN: usize = 16;

/// The steps as messages write them, such as `plots[0].panels`. A very long way ends with `…`.
#[must_use]
pub fn shown(steps: &[PathStep]) -> String {
    let mut text = String::new();
    for step in steps.iter().take(MAX_SHOWN) {
        // writing to a String cannot fail
        let _ = match step {
            PathStep::Index(index) => write!(text, "[{index}]"),
            PathStep::Key(key) if text.is_empty() => write!(text, "{key}"),
            PathStep::Key(key) => write!(text, ".{key}"),
        };
    }
    if steps.len() > MAX_SHOWN {
        text.push('…');
    }
    text
}

/// Line and column of what the steps lead to in a JSON text: of a member's name, of an item's content, and without
/// steps of the whole value. What is missing is at the end of its object.
///
/// The text is read once more by a visitor that follows the steps and stops at their end with an error, in which
/// `serde_json` reports where that was.
#[must_use]
pub fn position(text: &str, steps: &[PathStep]) -> Option<(usize, usize)> {
    let text = crate::content(text);
    if steps.is_empty() {
        return Some(start(text));
    }
    let mut json = serde_json::Deserializer::from_str(text);
    let error = (&mut json).deserialize_any(Walk(steps)).err()?;
    Some((error.line(), error.column()))
}

/// Line and column of the first character that is not white space.
fn start(text: &str) -> (usize, usize) {
    let (blank, _) = text.split_at(text.len() - text.trim_start().len());
    let last = blank.rsplit('\n').next().unwrap_or_default();
    (1 + blank.matches('\n').count(), 1 + last.len())
}

/// Follows the steps, and fails at their end.
struct Walk<'a>(&'a [PathStep]);

impl<'de> DeserializeSeed<'de> for Walk<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Walk<'_> {
    type Value = ();

    /// A scalar ends the walk too: it has no `visit_` function here, which is an error.
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
    fn analytic_depth_counts_the_steps_that_exist() {
        let value = serde_json::from_str(TEXT).unwrap();
        let steps = [PathStep::Key("a".into()), PathStep::Index(1), PathStep::Index(0)];
        assert_eq!(depth(&value, &steps), 2);
        assert_eq!(shown(&steps), "a[1][0]");
    }

    #[test]
    fn issue_a_long_way_is_cut_short() {
        let error = crate::parse(&"[".repeat(200)).unwrap_err().to_string();
        assert!(error.contains("recursion limit"), "{error}");
        assert!(error.contains("[0]…: ") && error.len() < 120, "{error}");
    }

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
        assert_eq!(position(TEXT, &[]), Some((1, 1)));
        assert_eq!(position("\n  {}", &[]), Some((2, 3)));
        assert_eq!(position(&format!("\u{feff}{TEXT}"), &[key("c")]), position(TEXT, &[key("c")]));
    }
}
