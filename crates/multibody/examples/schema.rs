//! Writes the JSON schema of vehicle files to standard output:
//! `cargo run -p multibody --example schema > fmu-vehicle/resources/schema.json`.

use std::io::Write;

use multibody::VehicleDescription;

fn main() -> std::io::Result<()> {
    std::io::stdout().write_all(VehicleDescription::schema().as_bytes())
}
