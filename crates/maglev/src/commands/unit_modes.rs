//! `maglev inspect --modes`: a unit's own linearisation, shown as a table.

use std::fmt::Write as _;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use fmi2_import::instance::Instance;
use fmi2_import::library::Functions;
use fmi2_import::package::Package;
use maglev::Error;
use master::initialize::InitializeError;
use serde_json::Value;

use super::table::table;

/// Most groups of bodies shown per mode.
const GROUPS: usize = 3;
/// Title of the column of groups.
const MOVES: &str = "what moves (share of kinetic energy)";
/// Groups with a smaller share are not shown.
const LEAST_SHARE: f64 = 0.02;

/// Initializes an instance with its start values and prints its modes.
pub fn run(package: Package, options: Option<&str>, json: bool) -> Result<ExitCode, Error> {
    let functions = Functions::load(&package)?;
    let dead = Arc::new(AtomicBool::new(false));
    let name = package.description().co_simulation.model_identifier.clone();
    let mut unit =
        Instance::new(&Arc::new(package), functions, &dead, &name).map_err(Error::Instantiate)?;
    let started = |e| master::Error::from(InitializeError::from(e));
    unit.setup_experiment(None, 0.0, 1.0).map_err(started)?;
    unit.enter_initialization_mode().map_err(started)?;
    unit.exit_initialization_mode().map_err(started)?;
    let request = options.map_or_else(|| "modes".to_owned(), |options| format!("modes {options}"));
    let answer = unit.report(&request).map_err(Error::Report)?;
    // the answer is valid even if the unit fails to terminate
    let _ = unit.terminate();
    match serde_json::from_str::<Value>(&answer) {
        Ok(report) if !json => super::print(&page(&report)),
        Ok(report) => {
            super::print(&(serde_json::to_string_pretty(&report).unwrap_or(answer) + "\n"))
        }
        // not JSON: the unit's own text
        Err(_) => super::print(&(answer + "\n")),
    }
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(report: &Value) -> String {
    let mut text = String::new();
    for (name, value) in report.as_object().into_iter().flatten() {
        match value {
            Value::Array(_) => {}
            Value::Object(inner) => {
                for (name, value) in inner {
                    let _ = writeln!(text, "{:<28}{}", words(name), plain(value));
                }
            }
            _ => {
                let _ = writeln!(text, "{:<28}{}", words(name), plain(value));
            }
        }
    }
    let head = ["mode", "freq. Hz", "damping", "eigenvalue 1/s", MOVES].map(str::to_owned).to_vec();
    let modes = report["modes"].as_array().into_iter().flatten();
    let rows = modes.enumerate().map(|(k, mode)| {
        let number = |name: &str| {
            mode[name].as_f64().map_or_else(|| "-".to_owned(), |it| format!("{it:.4}"))
        };
        let [real, imaginary] = ["real", "imaginary"].map(|name| mode[name].as_f64());
        vec![
            (k + 1).to_string(),
            number("frequency_hz"),
            number("damping_ratio"),
            real.zip(imaginary).map_or_else(|| "-".to_owned(), |(re, im)| root(re, im)),
            moving(&mode["participation"]),
        ]
    });
    text + "\n" + &table(std::iter::once(head).chain(rows), &[0, 1, 2])
}

/// An eigenvalue, or a pair of conjugate ones.
pub(super) fn root(real: f64, imaginary: f64) -> String {
    if imaginary == 0.0 { format!("{real:.4}") } else { format!("{real:.4} ± {imaginary:.4}i") }
}

fn words(name: &str) -> String {
    name.replace('_', " ")
}

fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn moving(participation: &Value) -> String {
    let parts = participation.as_array().into_iter().flatten();
    shown(families(
        parts.filter_map(|part| Some((part["body"].as_str()?, part["share"].as_f64()?))),
    ))
}

/// Groups of names that differ in numbers only, the largest first: name, count, share.
pub(super) fn families<'a>(
    parts: impl Iterator<Item = (&'a str, f64)>,
) -> Vec<(String, usize, f64)> {
    let mut groups: Vec<(String, usize, f64)> = Vec::new();
    for (name, share) in parts {
        let family = family(name);
        match groups.iter_mut().find(|group| group.0 == family) {
            Some(group) => (group.1, group.2) = (group.1 + 1, group.2 + share),
            None => groups.push((family, 1, share)),
        }
    }
    groups.sort_by(|a, b| b.2.total_cmp(&a.2));
    groups
}

/// The largest groups, as text.
pub(super) fn shown(groups: Vec<(String, usize, f64)>) -> String {
    let shown: Vec<String> = groups
        .iter()
        .filter(|group| group.2 >= LEAST_SHARE)
        .take(GROUPS)
        .map(|(name, count, share)| format!("{name} ({count}) {:.0} %", 100.0 * share))
        .collect();
    shown.join(", ")
}

/// A name with `#` for each run of digits.
fn family(name: &str) -> String {
    let mut text = String::new();
    for c in name.chars() {
        if !c.is_ascii_digit() {
            text.push(c);
        } else if !text.ends_with('#') {
            text.push('#');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bodies_of_a_family_are_counted_together() {
        let parts = serde_json::json!([
            {"body": "bogie_1_left", "share": 0.5},
            {"body": "bogie_12_left", "share": 0.25},
            {"body": "car", "share": 0.24},
            {"body": "dust", "share": 0.01},
        ]);
        assert_eq!(moving(&parts), "bogie_#_left (2) 75 %, car (1) 24 %");
        assert_eq!(moving(&Value::Null), "");
    }

    #[test]
    fn golden_a_page_of_modes() {
        let report = serde_json::json!({
            "vehicle": "toy", "options": {"at": "equilibrium"}, "degrees_of_freedom": 2,
            "modes": [
                {"real": -1.0, "imaginary": 2.0, "frequency_hz": 0.35588, "damping_ratio": 0.44721,
                 "participation": [{"body": "mass", "share": 1.0}]},
                {"real": -3.0, "imaginary": 0.0, "frequency_hz": null, "damping_ratio": 1.0,
                 "participation": []},
            ],
        });
        let page = page(&report);
        let lines: Vec<&str> = page.lines().collect();
        assert!(lines.iter().any(|line| line.split_whitespace().eq(["at", "equilibrium"])));
        assert!(
            lines[lines.len() - 2].contains("  0.3559   0.4472  -1.0000 ± 2.0000i  mass (1) 100 %")
        );
        assert!(lines[lines.len() - 1].ends_with("  -   1.0000  -3.0000"));
    }
}
