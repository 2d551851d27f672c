//! `maglev derive`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args};
use fmi2_derive::{Change, DeriveError, Derived, UnitSource};
use fmi2_import::package::REFERENCE_RESULTS;
use maglev::Error;
use results::write_whole;

const EXAMPLES: &str = "\
Examples:
  maglev derive vehicle.fmu --resource vehicle.json=my-train.json --out my-train.fmu
  maglev derive vehicle.fmu --patch vehicle.json=heavier.json --out heavier.fmu
  maglev derive guideway.fmu --resource guideway.json=mine.json --resource track.csv=track.csv \\
      --out mine.fmu

A patch changes objects member by member, removes what is null, changes lists of items with a
name by name, and replaces anything else:
  { \"bodies\": { \"car_1\": { \"mass\": 9000.0 } } }

The library in the unit prints the description for the new resources, so the unit must have
been made with fmi2-export and have a library for this system.";

/// Arguments of `maglev derive`.
#[derive(Args)]
#[command(
    after_help = EXAMPLES,
    group = ArgGroup::new("changes").args(["resource", "patch"]).required(true).multiple(true)
)]
pub struct Arguments {
    /// The unit (.fmu) to start from. It is not changed.
    unit: PathBuf,
    /// Replace a file in the unit's folder resources, or add one. Can be repeated.
    #[arg(long, value_name = "NAME=FILE", value_parser = named_file)]
    resource: Vec<(String, PathBuf)>,
    /// Patch a JSON file in resources, after all --resource. Can be repeated.
    #[arg(long, value_name = "NAME=FILE", value_parser = named_file)]
    patch: Vec<(String, PathBuf)>,
    /// The new unit.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

fn named_file(text: &str) -> Result<(String, PathBuf), String> {
    match text.split_once('=') {
        Some((name, file)) if !name.is_empty() && !file.is_empty() => {
            Ok((name.to_owned(), file.into()))
        }
        _ => Err("expected NAME=FILE, such as vehicle.json=my-train.json".to_owned()),
    }
}

/// Writes the new unit and prints what has become of its files.
pub fn run(arguments: &Arguments) -> Result<ExitCode, Error> {
    let Arguments { unit, resource, patch, out } = arguments;
    if is_same(unit, out) {
        return Err(DeriveError::Overwrites { unit: unit.clone() }.into());
    }
    let mut source = UnitSource::from(unit.clone());
    let mut add = |name: &String, change| {
        source.resources.entry(name.clone()).or_default().0.push(change);
    };
    for (name, file) in resource {
        add(name, Change::File(file.clone()));
    }
    for (name, file) in patch {
        add(name, Change::patch_of_file(name, file)?);
    }
    let stem = out.file_stem().unwrap_or_default().to_string_lossy();
    let derived = super::at_home(|| fmi2_derive::derive(&source, &stem))?;
    write_whole(out, &derived.to_bytes()?)
        .map_err(|source| Error::Write { path: out.clone(), source })?;
    super::print(&told(&derived, unit, out))
}

/// Whether both paths lead to the same file.
fn is_same(unit: &Path, out: &Path) -> bool {
    let canonical = |path: &Path| path.canonicalize().ok();
    canonical(unit).is_some_and(|unit| canonical(out) == Some(unit))
}

fn told(derived: &Derived, unit: &Path, out: &Path) -> String {
    let description = derived.package().description();
    let (model, count) = (&description.model_name, description.variables.len());
    let mut text = format!("{}: {model}, {count} variables\n", out.display());
    for (what, names) in [("replaced", &derived.replaced), ("added", &derived.added)] {
        if !names.is_empty() {
            // writing to a String cannot fail, also below
            let _ = writeln!(text, "{what} in resources: {}", names.join(", "));
        }
    }
    let (results, others): (Vec<_>, Vec<_>) =
        derived.dropped.iter().partition(|file| file.starts_with(REFERENCE_RESULTS));
    let results = (!results.is_empty()).then_some("reference results");
    let dropped: Vec<&str> = others.into_iter().map(String::as_str).chain(results).collect();
    if !dropped.is_empty() {
        let unit = unit.display();
        let _ = writeln!(text, "left out, because valid for {unit} only: {}", dropped.join(", "));
    }
    text
}
