//! Runs a scenario and changes a tunable parameter at a chosen time, as a program of one's own would that adapts a
//! controller or searches for gains:
//!
//! ```sh
//! tune scenarios/one-magnet.json vehicle.gap_01 5 ems_01.gain_gap_velocity 20
//! ```
//!
//! prints how far the signal went before and after. The signal is one that the scenario records.

#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::env;
use std::error::Error;
use std::path::Path;

use master::Setup;
use scenario::{Scenario, Setting};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [scenario, signal, time, parameter, value] = arguments.as_slice() else {
        return Err("give SCENARIO SIGNAL TIME PARAMETER VALUE".into());
    };
    let (time, value) = (time.parse::<f64>()?, Setting::Number(value.parse()?));

    let scenario = Scenario::load(Path::new(scenario))?;
    let setup = Setup::new(&scenario)?;
    let place = setup
        .signals()
        .position(|name| &name == signal)
        .ok_or("the scenario does not record this signal")?;

    let mut simulation = setup.start()?;
    let mut range = (f64::INFINITY, f64::NEG_INFINITY);
    let mut changed = false;
    while simulation.remaining() > 0 {
        if !changed && simulation.time() >= time {
            println!("until {time} s: {:.6} to {:.6}", range.0, range.1);
            simulation.set(parameter, &value)?;
            (changed, range) = (true, (f64::INFINITY, f64::NEG_INFINITY));
        }
        simulation.step()?;
        let now = simulation.value(place);
        range = (range.0.min(now), range.1.max(now));
    }
    println!("until {} s: {:.6} to {:.6}", simulation.time(), range.0, range.1);
    simulation.terminate()?;
    Ok(())
}
