//! Steps units by hand: loads them, connects them, watches a signal and changes a parameter on the
//! way. Takes the path of any unit with a Real input `u`, outputs `y` and `z` and a tunable `gain`.

#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;
use std::path::Path;

use master::Setup;
use scenario::{Scenario, Setting};

fn main() -> Result<(), Box<dyn Error>> {
    let unit = std::env::args().nth(1).unwrap_or_else(|| "unit.fmu".to_owned());
    let text = r#"{
        "units": { "unit": "UNIT" },
        "instances": { "a": { "unit": "unit", "start": { "u": 1.0 } }, "b": { "unit": "unit" } },
        "connections": [ { "from": "a.z", "to": "b.u" } ],
        "experiment": { "stop": 1.0, "step": 0.1 },
        "record": { "signals": ["a.z", "b.y"] }
    }"#;
    let scenario = Scenario::parse(&text.replace("UNIT", &unit), Path::new("by_hand"))?;
    let setup = Setup::new(&scenario)?;
    let mut simulation = setup.start()?;
    while simulation.remaining() > 0 {
        if simulation.done() == 5 {
            simulation.set("a.gain", &Setting::Number(3.0))?;
        }
        simulation.step()?;
        println!("{:.1} {} {:.6}", simulation.time(), simulation.value(0), simulation.value(1));
    }
    simulation.terminate()?;
    Ok(())
}
