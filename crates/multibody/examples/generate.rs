//! Writes a vehicle file to standard output:
//! `cargo run -p multibody --example generate -- two-car > vehicle.json`, or `-- my-train.json` to see all bodies of
//! a file with a train.

use std::io::Write;
use std::process::ExitCode;

use multibody::{VehicleDescription, train};

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    let description = match read(&name) {
        Ok(description) => description,
        Err(message) => return fail(&message),
    };
    match description.to_json() {
        Ok(text) => match std::io::stdout().write_all(text.as_bytes()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(e) => fail(&e.to_string()),
        },
        Err(e) => fail(&e.to_string()),
    }
}

fn read(name: &str) -> Result<VehicleDescription, String> {
    if std::path::Path::new(name).extension().is_some_and(|it| it == "json") {
        let text = std::fs::read_to_string(name).map_err(|e| format!("cannot open {name}: {e}"))?;
        return VehicleDescription::from_json(&text).map_err(|e| format!("{name}: {e}"));
    }
    train::by_name(name).ok_or_else(|| {
        let known = train::NAMES.join(", ");
        format!("no vehicle `{name}`; use one of {known}, <n>-cars, or a .json file")
    })
}

fn fail(message: &str) -> ExitCode {
    // nothing is left to be done if even that fails
    let _ = writeln!(std::io::stderr(), "{message}");
    ExitCode::FAILURE
}
