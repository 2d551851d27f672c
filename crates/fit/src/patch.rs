//! The fitted values as a change of the scenario.

use std::path::Path;

use scenario::Scenario;
use serde_json::{Map, Value, json};

use crate::Fit;

/// Options of `maglev run` that set the fitted values.
#[must_use]
pub fn options(fit: &Fit) -> Vec<String> {
    let own = fit.parameters.iter().filter(|it| it.target != crate::varied::OFFSET);
    own.map(|it| format!("--set '{}={}'", it.target, it.value)).collect()
}

/// A scenario that extends another one by the fitted values. None if a target does not cover whole members of
/// `instances`, which a scenario that extends cannot express; the options can.
#[must_use]
pub fn patch(fit: &Fit, scenario: &Scenario, extends: &Path) -> Option<Value> {
    let mut instances = Map::new();
    for it in fit.parameters.iter().filter(|it| it.target != crate::varied::OFFSET) {
        let (pattern, variable) = it.target.split_once('.')?;
        let mut covered = 0;
        for (name, entry) in &scenario.instances {
            let members = patterns::expand(name).unwrap_or_else(|_| vec![name.clone()]);
            let hit = members.iter().filter(|member| matches(pattern, member)).count();
            if hit == 0 {
                continue;
            }
            if hit < members.len() {
                return None;
            }
            covered += 1;
            let list = if entry.start.contains_key(variable) { "start" } else { "parameters" };
            let entry = instances.entry(name.clone()).or_insert_with(|| json!({}));
            entry[list][variable] = json!(it.value);
        }
        if covered == 0 {
            return None;
        }
    }
    let title = format!("{}, fitted to {}", scenario.title, fit.file);
    Some(json!({ "extends": extends, "title": title, "instances": instances }))
}

fn matches(pattern: &str, name: &str) -> bool {
    let globs = patterns::expand(pattern).unwrap_or_else(|_| vec![pattern.to_owned()]);
    globs.iter().any(|glob| glob == name || patterns::matches(glob, name))
}
