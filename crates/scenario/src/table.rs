//! Tables of a connection, and the items of Enumerations: which value of an output becomes which of an input.

use fmi2_import::description::{Enumeration, Type};
use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Replaced values by the name of the item, the number, or `true` and `false`.
pub type Table = IndexMap<String, TableValue>;

/// A value that a table puts in the place of another.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected the name of an item, an integer, or true or false")]
pub enum TableValue {
    /// For a Boolean input.
    Boolean(bool),
    /// For an Integer or Enumeration input.
    Number(i32),
    /// For an Enumeration input: the name of an item.
    Item(String),
}

/// The type of one end of a connection: an Enumeration may have items.
pub type End<'a> = (Type, Option<&'a Enumeration>);

/// Why a table does not fit the ends of its connection.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum TableError {
    /// Types without tables.
    #[error(
        "a map is for a Boolean to a Boolean, or between Integers and Enumerations, not for {from} to {to}"
    )]
    Types {
        /// Type of the output.
        from: Type,
        /// Type of the input.
        to: Type,
    },
    /// A value that one of the ends does not have.
    #[error(
        "in the map, {value} is not a value of the {end}, which is of type {kind}{}",
        listed(items)
    )]
    Value {
        /// The value as it is written.
        value: String,
        /// `output` or `input`.
        end: &'static str,
        /// Its type.
        kind: Type,
        /// The items of an Enumeration.
        items: Vec<String>,
    },
    /// Two Enumerations without a common item.
    #[error("no item in common: {} and {}", from.join(", "), to.join(", "))]
    NoCommonItem {
        /// Names and values of the output's items.
        from: Vec<String>,
        /// Names and values of the input's items.
        to: Vec<String>,
    },
    /// Two entries for one value of the output, by its name and its number.
    #[error("the map has two entries for the value {value}")]
    Twice {
        /// The value of the output.
        value: i32,
    },
}

fn listed(items: &[String]) -> String {
    if items.is_empty() { String::new() } else { format!(" with the items {}", items.join(", ")) }
}

impl TableError {
    /// How to fix it, where that is known.
    #[must_use]
    pub fn help(&self) -> Option<&'static str> {
        match self {
            Self::NoCommonItem { .. } => Some(
                "Enumerations are connected by the names of their items; check that these two belong \
                 together, or give the connection a \"map\"",
            ),
            Self::Types { .. } => Some("compute the value in a unit in between"),
            Self::Value { .. } | Self::Twice { .. } => None,
        }
    }
}

/// The items of an Enumeration for messages.
fn names(enumeration: &Enumeration) -> Vec<String> {
    enumeration.items.iter().map(|(name, value)| format!("\"{name}\" ({value})")).collect()
}

/// Pairs of values, from output to input, sorted.
pub type Pairs = Vec<(i32, i32)>;

/// The values of an Enumeration, and those of a table: pairs of values, and items of the output that the input lacks.
///
/// A table comes first. To an Enumeration, other values pass by the names of the items, or by their values if the output
/// has none, and there are no others than the pairs. To an Integer or Boolean, other values stay as they are.
///
/// # Errors
/// The types have no tables, an entry does not fit them, or two Enumerations have no item in common.
pub fn pairs(
    table: Option<&Table>,
    from: End<'_>,
    to: End<'_>,
) -> Result<(Pairs, Vec<String>), TableError> {
    let whole = |kind| matches!(kind, Type::Integer | Type::Enumeration);
    if (from.0, to.0) != (Type::Boolean, Type::Boolean) && !(whole(from.0) && whole(to.0)) {
        return Err(TableError::Types { from: from.0, to: to.0 });
    }
    let mut found = Pairs::new();
    for (key, value) in table.into_iter().flatten() {
        let key = match (from.0, key.as_str()) {
            (Type::Boolean, "false") => TableValue::Boolean(false),
            (Type::Boolean, "true") => TableValue::Boolean(true),
            _ => TableValue::Item(key.clone()),
        };
        found.push((number(&key, from, "output")?, number(value, to, "input")?));
    }
    found.sort_unstable();
    if let Some(twice) = found.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(TableError::Twice { value: twice[0].0 });
    }
    let mut unknown = Vec::new();
    if let Some(target) = to.1 {
        let listed: Vec<i32> = found.iter().map(|pair| pair.0).collect();
        let mut others = Pairs::new();
        match from.1 {
            None => others.extend(target.items.iter().map(|&(_, value)| (value, value))),
            Some(source) => {
                for (name, value) in &source.items {
                    match target.items.iter().find(|(it, _)| it == name) {
                        Some(&(_, other)) => others.push((*value, other)),
                        None if listed.contains(value) => {}
                        None => unknown.push(format!("\"{name}\" ({value})")),
                    }
                }
            }
        }
        found.extend(others.into_iter().filter(|(value, _)| !listed.contains(value)));
        if let Some(source) = from.1.filter(|_| found.is_empty()) {
            return Err(TableError::NoCommonItem { from: names(source), to: names(target) });
        }
        found.sort_unstable();
    }
    Ok((found, unknown))
}

/// A value of one end of a connection as a number. Keys of JSON are texts, so a text may be a number.
fn number(
    value: &TableValue,
    (kind, items): End<'_>,
    end: &'static str,
) -> Result<i32, TableError> {
    let item = |wanted: i32| items.is_none_or(|it| it.items.iter().any(|(_, it)| *it == wanted));
    let number = match (value, kind) {
        (TableValue::Boolean(it), Type::Boolean) => Some(i32::from(*it)),
        (TableValue::Number(it), Type::Integer | Type::Enumeration) => {
            Some(*it).filter(|it| item(*it))
        }
        (TableValue::Item(text), Type::Integer | Type::Enumeration) => {
            let named = items.and_then(|it| it.items.iter().find(|(name, _)| name == text));
            let parsed = || text.parse().ok().filter(|it| end == "output" && item(*it));
            named.map(|(_, value)| *value).or_else(parsed)
        }
        _ => None,
    };
    number.ok_or_else(|| TableError::Value {
        value: match value {
            TableValue::Boolean(it) => it.to_string(),
            TableValue::Number(it) => it.to_string(),
            TableValue::Item(it) => format!("\"{it}\""),
        },
        end,
        kind,
        items: items.map(names).unwrap_or_default(),
    })
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
