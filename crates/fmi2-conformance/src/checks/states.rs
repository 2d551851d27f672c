//! Saved states (FMI 2.0.5, section 2.1.8).

use std::ptr::null_mut;

use super::lifecycle::PLACES;
use crate::harness::bench::Bench;
use crate::harness::drive::{ReadValues, same};
use crate::harness::raw::{Raw, SavedState, name, ok, passed};
use crate::harness::{CheckResult, Stop, fault, skip, table};

table! {
    "state-restored", "2.1.8", Error, "a run continues from a restored state with the same values, bit for bit, wherever it was saved", restored;
    "state-inputs", "2.1.8", Error, "a saved state contains the inputs and their derivatives", with_inputs;
    "state-independent", "2.1.8", Error, "a saved state does not change when the instance continues or other states are saved or freed", independent;
    "state-memory", "2.1.8", Error, "a state can be saved again in the same memory; fmi2FreeFMUstate sets the pointer to null and ignores null", memory;
}

/// Skips the check for FMUs without saved states.
fn capable(bench: &Bench) -> CheckResult {
    if bench.description().co_simulation.can_get_and_set_fmu_state {
        return Ok(());
    }
    skip("canGetAndSetFMUstate is false")
}

pub(super) fn save(unit: &Raw) -> Result<SavedState, Stop> {
    let mut saved = null_mut();
    ok(unit.get_state(&mut saved), "fmi2GetFMUstate")?;
    if saved.is_null() { fault("fmi2GetFMUstate returned a null pointer") } else { Ok(saved) }
}

/// Continues from one of [`PLACES`], and records three steps.
pub(super) fn onward(unit: &Raw, place: &str) -> Result<Vec<ReadValues>, Stop> {
    match place {
        "instantiated" => unit.initialize()?,
        "set up" => {
            ok(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
            ok(unit.exit_initialization(), "fmi2ExitInitializationMode")?;
        }
        "initialization mode" => {
            ok(unit.exit_initialization(), "fmi2ExitInitializationMode")?;
        }
        _ => {}
    }
    let from = if place == "step mode" { 2 } else { 0 };
    unit.record(from, from + 3)
}

fn restored(bench: &Bench) -> CheckResult {
    capable(bench)?;
    for (place, go) in PLACES.into_iter().filter(|(place, _)| *place != "terminated") {
        bench.part(&format!("a state saved when {place}"));
        let unit = bench.instance("unit")?;
        go(&unit)?;
        let mut saved = save(&unit)?;
        let wanted = onward(&unit, place)?;
        for turn in ["first", "second"] {
            ok(unit.set_state(saved), "fmi2SetFMUstate")?;
            let got = onward(&unit, place)?;
            same(bench, &got, &wanted, &format!("the {turn} run from the state of {place}"))?;
        }
        ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    }
    Ok(())
}

fn with_inputs(bench: &Bench) -> CheckResult {
    capable(bench)?;
    let inputs = bench.inputs();
    let slopes = bench.continuous_inputs();
    if inputs.is_empty() {
        return skip("there are no Real inputs");
    }
    let unit = bench.initialized("unit")?;
    unit.run(0, 2)?;
    unit.move_inputs(&inputs, 3)?;
    let references: Vec<u32> = slopes.iter().map(|input| input.reference).collect();
    let slope = |factor: f64| -> Vec<f64> {
        slopes.iter().map(|input| factor * input.small / bench.step()).collect()
    };
    let orders = vec![1; references.len()];
    let interpolates = bench.description().co_simulation.can_interpolate_inputs;
    let set_slopes = |factor| {
        if !interpolates || references.is_empty() {
            return Ok(());
        }
        let status = unit.set_input_derivatives(&references, &orders, &slope(factor));
        ok(status, "fmi2SetRealInputDerivatives")
    };
    set_slopes(1.0)?;
    let mut saved = save(&unit)?;
    let go = || {
        ok(unit.do_step(bench.time(2), bench.step()), "fmi2DoStep")?;
        unit.record(3, 5)
    };
    let wanted = go()?;
    unit.move_inputs(&inputs, 1)?;
    set_slopes(-2.0)?;
    ok(unit.set_state(saved), "fmi2SetFMUstate")?;
    let got = go()?;
    ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    same(bench, &got, &wanted, "from a state that was saved after inputs were set")
}

fn independent(bench: &Bench) -> CheckResult {
    capable(bench)?;
    let wanted = bench.initialized("undisturbed")?.record(0, 6)?;
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    let mut early = save(&unit)?;
    unit.run(1, 3)?;
    let mut late = save(&unit)?;
    unit.run(3, 6)?;
    for (saved, step) in [(early, 1), (late, 3), (early, 1)] {
        ok(unit.set_state(saved), "fmi2SetFMUstate")?;
        let got = unit.record(step, step + 3)?;
        same(bench, &got, &wanted[step..step + 3], &format!("from the state of step {step}"))?;
    }
    ok(unit.free_state(&mut late), "fmi2FreeFMUstate")?;
    ok(unit.set_state(early), "fmi2SetFMUstate after another state was freed")?;
    same(bench, &unit.record(1, 3)?, &wanted[1..3], "after another state was freed")?;
    ok(unit.free_state(&mut early), "fmi2FreeFMUstate")
}

fn memory(bench: &Bench) -> CheckResult {
    capable(bench)?;
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    let mut saved = save(&unit)?;
    unit.run(1, 2)?;
    ok(unit.get_state(&mut saved), "fmi2GetFMUstate into an older state")?;
    let wanted = unit.record(2, 4)?;
    ok(unit.set_state(saved), "fmi2SetFMUstate of a state saved again")?;
    same(bench, &unit.record(2, 4)?, &wanted, "from a state saved again")?;
    ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    if !saved.is_null() {
        bench.find("fmi2FreeFMUstate did not set the pointer to null");
        saved = null_mut();
    }
    let status = unit.free_state(&mut saved);
    if !passed(status) {
        bench.find(format!("fmi2FreeFMUstate of a null state returned {}", name(status)));
    }
    Ok(())
}
