//! Writes a vehicle file to standard output:
//! `cargo run -p multibody --example generate -- two-car > vehicle.json`.

use std::io::Write;
use std::process::ExitCode;

use multibody::train;

fn main() -> ExitCode {
    let name = std::env::args().nth(1).unwrap_or_default();
    let Some(description) = train::by_name(&name) else {
        return fail(&format!(
            "`{name}` is no known vehicle; use one of {}, or <n>-cars",
            train::NAMES.join(", ")
        ));
    };
    match description.to_json() {
        Ok(text) => match std::io::stdout().write_all(text.as_bytes()) {
            Ok(()) => ExitCode::SUCCESS,
            Err(e) => fail(&e.to_string()),
        },
        Err(e) => fail(&e.to_string()),
    }
}

fn fail(message: &str) -> ExitCode {
    // nothing is left to be done if even that fails
    let _ = writeln!(std::io::stderr(), "{message}");
    ExitCode::FAILURE
}
