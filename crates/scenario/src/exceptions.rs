//! Exceptions from a row of equal instances: `ems_03` beside `ems_[01..08]`.
//!
//! A single name that belongs to a range changes that one: its settings are merged over those of the range, as a file is
//! merged over one that it extends. The range is then divided, and the instances keep their order. Two ranges that
//! overlap stay as they are, and are an error later.

use serde_json::{Map, Value};
use strict_json::merge;

/// Divides the ranges of a scenario at single names.
pub(crate) fn divide(scenario: &mut Value) {
    let Some(Value::Object(instances)) = scenario.get_mut("instances") else { return };
    let is_single = |name: &str| instances.contains_key(name) && !patterns::is_pattern(name);
    let divided: Vec<(String, Vec<String>)> = instances
        .keys()
        .filter(|key| patterns::is_pattern(key))
        .filter_map(|key| Some((key.clone(), patterns::expand(key).ok()?)))
        .filter(|(_, names)| names.iter().any(|name| is_single(name)))
        .collect();
    if divided.is_empty() {
        return;
    }
    let exceptions: Vec<String> = divided
        .iter()
        .flat_map(|(_, names)| names.iter().filter(|name| is_single(name)).cloned())
        .collect();
    let mut whole = Map::new();
    for (key, settings) in instances.iter() {
        let Some((_, names)) = divided.iter().find(|(range, _)| range == key) else {
            if !exceptions.contains(key) {
                whole.insert(key.clone(), settings.clone());
            }
            continue;
        };
        for run in names.chunk_by(|a, b| !exceptions.contains(a) && !exceptions.contains(b)) {
            match run {
                [name] if exceptions.contains(name) => {
                    let mut changed = settings.clone();
                    merge(&mut changed, &instances[name]);
                    whole.insert(name.clone(), changed);
                }
                _ => {
                    whole.extend(compact(key, run).into_iter().map(|it| (it, settings.clone())));
                }
            }
        }
    }
    *instances = whole;
}

/// Consecutive names of a range as one range, if the pattern has no other range.
fn compact(pattern: &str, names: &[String]) -> Vec<String> {
    let (Some(first), Some(last)) = (names.first(), names.last()) else { return Vec::new() };
    let shorter = || {
        let (prefix, rest) = pattern.split_once('[')?;
        let (_, suffix) = rest.split_once(']')?;
        let low = first.strip_prefix(prefix)?.strip_suffix(suffix)?;
        let high = last.strip_prefix(prefix)?.strip_suffix(suffix)?;
        Some(format!("{prefix}[{low}..{high}]{suffix}"))
    };
    // a pattern with several ranges, or with other brackets, does not give the same names again
    let fits = |it: &String| patterns::expand(it).is_ok_and(|found| found == names);
    match shorter().filter(fits) {
        Some(range) if names.len() > 1 => vec![range],
        _ => names.to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn divided(instances: Value) -> Value {
        let mut scenario = json!({ "instances": instances });
        divide(&mut scenario);
        scenario["instances"].take()
    }

    #[test]
    fn analytic_a_single_name_changes_one_of_a_range() {
        let row = json!({ "unit": "ems", "parameters": { "gain": 7, "on": true } });
        let one = json!({ "parameters": { "gain": 6, "on": null } });
        let changed = json!({ "unit": "ems", "parameters": { "gain": 6 } });
        let found = divided(json!({ "ems_[01..12]": row, "v": { "unit": "v" }, "ems_03": one }));
        let expected = json!({
            "ems_[01..02]": row, "ems_03": changed, "ems_[04..12]": row, "v": { "unit": "v" }
        });
        // also in this order
        assert_eq!(found.to_string(), expected.to_string());
        let found = divided(json!({ "m_1": one, "m_[1..3]": row, "m_3": {} }));
        let expected = json!({ "m_1": changed, "m_2": row, "m_3": row });
        assert_eq!(found.to_string(), expected.to_string());
        // two ranges in one name
        let found = divided(json!({ "a_[1..2]_[1..2]": row, "a_1_2": one }));
        let expected = json!({ "a_1_1": row, "a_1_2": changed, "a_2_1": row, "a_2_2": row });
        assert_eq!(found.to_string(), expected.to_string());
    }

    #[test]
    fn invariant_everything_else_stays_as_it_is() {
        for instances in [
            json!({ "ems_[01..08]": { "unit": "ems" }, "ems_9": {} }),
            json!({ "ems_[01..08]": { "unit": "ems" }, "ems_[02..03]": {} }),
            json!({ "a": {}, "b": {} }),
            json!({ "a_[3..1]": {}, "a_2": {} }),
            json!([]),
        ] {
            assert_eq!(divided(instances.clone()).to_string(), instances.to_string());
        }
    }
}
