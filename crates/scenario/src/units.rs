//! The member `units` of a file: paths become relative to the working directory, and changes of resources add up along
//! files that extend each other.

use std::path::Path;

use serde_json::{Map, Value, json};

const UNITS: &str = "units";
const FMU: &str = "fmu";
const RESOURCES: &str = "resources";

/// Puts a folder in front of all paths in the units of a scenario.
pub(crate) fn locate(scenario: &mut Value, folder: &Path) {
    for unit in units(scenario) {
        if let Value::Object(members) = unit {
            if let Some(fmu) = members.get_mut(FMU) {
                join(fmu, folder);
            }
            for changes in resources(members) {
                match changes {
                    Value::Array(list) => list.iter_mut().for_each(|it| join(it, folder)),
                    change => join(change, folder),
                }
            }
        } else {
            join(unit, folder);
        }
    }
}

/// Prepares the units of a file that extends `base` for the merge with it. By RFC 7396 alone, a patch of a resource would
/// be merged into that of the base, which loses a null. So it follows those of the base in a list, which the merge leaves
/// as it is. Paths and lists replace what the base has.
pub(crate) fn extend(file: &mut Value, base: &mut Value) {
    let Some(Value::Object(files)) = file.get_mut(UNITS) else { return };
    for (name, unit) in files {
        let Value::Object(members) = unit else { continue };
        let mut base = base.get_mut(UNITS).and_then(|units| units.get_mut(name));
        if let Some(path) = base.as_mut().filter(|unit| unit.is_string()) {
            **path = json!({ FMU: path.take() });
        }
        let Some(Value::Object(changed)) = members.get_mut(RESOURCES) else { continue };
        for (resource, change) in changed.iter_mut().filter(|(_, change)| change.is_object()) {
            let earlier = base.as_ref().and_then(|unit| unit.get(RESOURCES)?.get(resource));
            let mut list = match earlier.cloned() {
                Some(Value::Array(list)) => list,
                earlier => earlier.into_iter().collect(),
            };
            list.push(change.take());
            *change = list.into();
        }
    }
}

fn units(scenario: &mut Value) -> impl Iterator<Item = &mut Value> {
    let units = scenario.get_mut(UNITS).and_then(Value::as_object_mut);
    units.into_iter().flat_map(Map::values_mut)
}

fn resources(unit: &mut Map<String, Value>) -> impl Iterator<Item = &mut Value> {
    let resources = unit.get_mut(RESOURCES).and_then(Value::as_object_mut);
    resources.into_iter().flat_map(Map::values_mut)
}

/// Other values than texts are errors of the form, which are found later.
fn join(path: &mut Value, folder: &Path) {
    if let Value::String(text) = path {
        // both parts come from JSON or from a path that is printed as JSON
        *text = folder.join(&*text).to_string_lossy().into_owned();
    }
}
