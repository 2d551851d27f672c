//! Mapping tables: along connections, and of values.

use fmi2_import::description::{Enumeration, Type};
use serde_json::{Map, Value};

use super::ports::{Edge, Port, Ports};
use crate::SspError;
use crate::read::{Items, ParameterValue, Transformation};

/// One end of a chain of connections.
struct Terminal<'t> {
    /// For messages.
    name: String,
    kind: Type,
    /// The items that its unit defines.
    own: Option<&'t Enumeration>,
    /// Those of the description.
    described: Option<&'t Items>,
}

impl<'t> Terminal<'t> {
    fn new(ports: &'t Ports<'_, '_>, port: &Port) -> Option<Self> {
        let Port::Component(component, name) = port else { return None };
        let description = ports.tree.description(*component);
        let index = description.find(name)?;
        Some(Self {
            name: format!("{}.{name}", ports.tree.components[*component].instance),
            kind: description.variables[index].kind,
            own: description.enumeration_of(index),
            described: ports.items(*component, name),
        })
    }

    fn has(&self, wanted: i64) -> bool {
        let in_range = i32::try_from(wanted).is_ok();
        in_range
            && self.own.is_none_or(|it| it.items.iter().any(|(_, it)| i64::from(*it) == wanted))
    }

    /// The item of this name: by its name if the unit has it, otherwise by the value that the description gives.
    fn item(&self, wanted: &str) -> Option<Value> {
        if self.own.is_some_and(|it| it.items.iter().any(|(name, _)| name == wanted)) {
            return Some(wanted.into());
        }
        let (_, value) = self.described?.iter().find(|(name, _)| name == wanted)?;
        self.has(*value).then(|| (*value).into())
    }
}

/// The table of a scenario's connection for a chain of connections, the last of which comes first.
pub(super) fn along(
    ports: &Ports<'_, '_>,
    edges: &[&Edge<'_>],
) -> Result<Option<Map<String, Value>>, SspError> {
    let mut all: Option<Transformation> = None;
    for edge in edges.iter().rev() {
        if let Some(table) = edge.table {
            all = Some(match &all {
                None => table.clone(),
                Some(first) => composed(first, table).ok_or_else(|| {
                    edge.at().unsupported("it continues a mapping table of another kind")
                })?,
            });
        }
    }
    let (Some(table), Some(first), Some(last)) = (all, edges.last(), edges.first()) else {
        return Ok(None);
    };
    let with_table = edges.iter().find(|it| it.table.is_some()).unwrap_or(last);
    let at = with_table.at();
    if edges.iter().any(|it| it.hop.linear.is_some()) {
        return Err(at.invalid("a LinearTransformation and a mapping table follow each other"));
    }
    let ends = (Terminal::new(ports, &first.from), Terminal::new(ports, &last.to));
    let (Some(from), Some(to)) = ends else { return Ok(None) };
    let whole = |it: &Terminal<'_>| matches!(it.kind, Type::Integer | Type::Enumeration);
    let is = |kind: &str| {
        at.invalid(format!(
            "its mapping table is for {kind}, but {} is of type {} and {} of type {}",
            from.name, from.kind, to.name, to.kind
        ))
    };
    let mut map = Map::new();
    match table {
        Transformation::Linear(_) => return Ok(None),
        Transformation::Booleans(pairs) => {
            if (from.kind, to.kind) != (Type::Boolean, Type::Boolean) {
                return Err(is("Booleans"));
            }
            map.extend(pairs.iter().map(|(a, b)| (a.to_string(), (*b).into())));
        }
        Transformation::Integers(mut pairs) => {
            if !whole(&from) || !whole(&to) {
                return Err(is("Integers and Enumerations"));
            }
            // entries for values that the source does not have are ignored
            pairs.retain(|(source, _)| from.has(*source));
            // all others stay as they are
            if let (Some(items), Some(_)) = (from.own, to.own) {
                let others = items.items.iter().map(|(_, it)| i64::from(*it));
                let listed: Vec<i64> = pairs.iter().map(|pair| pair.0).collect();
                pairs.extend(others.filter(|it| !listed.contains(it)).map(|it| (it, it)));
            }
            for (source, target) in pairs {
                if !to.has(target) {
                    return Err(at.invalid(format!(
                        "it makes {target} of {source}, which is not a value of {}",
                        to.name
                    )));
                }
                map.insert(source.to_string(), target.into());
            }
        }
        Transformation::Items(pairs) => {
            if !whole(&from) || !whole(&to) {
                return Err(is("Enumerations"));
            }
            for (source, target) in pairs {
                let unknown = |name: &str, of: &Terminal<'_>| {
                    at.invalid(format!("\"{name}\" is not an item of {}", of.name))
                };
                let key = from.item(&source).ok_or_else(|| unknown(&source, &from))?;
                let key = key.as_str().map_or_else(|| key.to_string(), str::to_owned);
                map.insert(key, to.item(&target).ok_or_else(|| unknown(&target, &to))?);
            }
        }
    }
    Ok(Some(map))
}

/// Two tables, one after the other.
fn composed(first: &Transformation, then: &Transformation) -> Option<Transformation> {
    use Transformation::{Booleans, Integers, Items};
    Some(match (first, then) {
        (Booleans(a), Booleans(b)) => Booleans(joined(a, b)),
        (Integers(a), Integers(b)) => Integers(joined(a, b)),
        (Items(a), Items(b)) => Items(joined(a, b)),
        _ => return None,
    })
}

fn joined<T: Clone + PartialEq>(first: &[(T, T)], then: &[(T, T)]) -> Vec<(T, T)> {
    let onward = |(source, target): &(T, T)| (source.clone(), replaced(then, target));
    let mut all: Vec<(T, T)> = first.iter().map(onward).collect();
    let is_new = |(source, _): &&(T, T)| !first.iter().any(|(it, _)| it == source);
    all.extend(then.iter().filter(is_new).cloned());
    all
}

fn replaced<T: Clone + PartialEq>(table: &[(T, T)], value: &T) -> T {
    let found = table.iter().find(|(source, _)| source == value);
    found.map_or_else(|| value.clone(), |(_, target)| target.clone())
}

/// A value after a table. None if the table is for other types.
pub(super) fn value(table: &Transformation, value: &ParameterValue) -> Option<ParameterValue> {
    use ParameterValue::{Boolean, Integer, Item};
    Some(match (table, value) {
        (Transformation::Booleans(pairs), Boolean(it)) => Boolean(replaced(pairs, it)),
        (Transformation::Integers(pairs), Integer(it) | Item(_, Some(it))) => {
            match pairs.iter().find(|(source, _)| source == it) {
                Some((_, target)) => Integer(*target),
                None => value.clone(),
            }
        }
        (Transformation::Items(pairs), Item(it, _)) => {
            match pairs.iter().find(|(source, _)| source == it) {
                Some((_, target)) => Item(target.clone(), None),
                None => value.clone(),
            }
        }
        _ => return None,
    })
}
