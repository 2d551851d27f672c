//! Files of a tuning.

use std::path::{Component, Path, PathBuf};

use maglev::Error;
use scenario::Scenario;
use serde_json::{Map, Value, json};
use tune::TuneResult;

use super::confirm::Confirmation;
use crate::commands::analysis::Files;

/// Everything as JSON.
pub fn as_json(result: &TuneResult, confirmed: &[Confirmation]) -> String {
    // plain data, which always prints
    let mut value = serde_json::to_value(result).unwrap_or_default();
    if !confirmed.is_empty() {
        value["confirmed"] = serde_json::to_value(confirmed).unwrap_or_default();
    }
    serde_json::to_string(&value).unwrap_or_default() + "\n"
}

/// Writes tune.json, tuned.json and the picture of the front.
pub fn write(
    result: &TuneResult,
    confirmed: &[Confirmation],
    scenario: &Scenario,
    path: &Path,
    folder: &Path,
) -> Result<(), Error> {
    let files = Files::new(folder)?;
    files.write("tune.json", as_json(result, confirmed).as_bytes())?;
    files.write("tuned.json", tuned(result, scenario, path, folder).as_bytes())?;
    if result.front.is_empty() {
        return Ok(());
    }
    files.picture("front", tune::front_picture(result), 2.0)
}

/// A scenario that extends the given one by the values found.
fn tuned(result: &TuneResult, scenario: &Scenario, path: &Path, folder: &Path) -> String {
    let mut instances = Map::new();
    let mut set = |key: &str, variable: &str, value: f64| {
        let entry = instances.entry(key).or_insert_with(|| json!({ "parameters": {} }));
        entry["parameters"][variable] = json!(value);
    };
    for it in &result.parameters {
        let Some((_, variable)) = it.target.rsplit_once('.') else { continue };
        for key in scenario.instances.keys() {
            let names = patterns::expand(key).unwrap_or_else(|_| vec![key.clone()]);
            let mine: Vec<&String> =
                names.iter().filter(|name| it.instances.contains(name)).collect();
            if mine.len() == names.len() {
                set(key, variable, it.after);
            } else {
                mine.into_iter().for_each(|name| set(name, variable, it.after));
            }
        }
    }
    let mut file = json!({
        "extends": relative(path, folder),
        "title": format!("{}, tuned", scenario.title),
        "instances": Value::Object(instances),
    });
    let own: Vec<String> = scenario.overrides.iter().map(|it| format!("--set {it}")).collect();
    if !own.is_empty() {
        file["$comment"] = json!(format!("Tuned with {}", own.join(" ")));
    }
    serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
}

/// The path of a file from a folder.
fn relative(path: &Path, folder: &Path) -> String {
    let (Ok(path), Ok(folder)) = (path.canonicalize(), folder.canonicalize()) else {
        return path.to_string_lossy().into_owned();
    };
    let (to, from): (Vec<Component<'_>>, Vec<Component<'_>>) =
        (path.components().collect(), folder.components().collect());
    let same = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    let up = std::iter::repeat_n(Component::ParentDir, from.len() - same);
    up.chain(to[same..].iter().copied()).collect::<PathBuf>().to_string_lossy().into_owned()
}
