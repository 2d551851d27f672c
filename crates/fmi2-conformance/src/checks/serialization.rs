//! Serialized states (FMI 2.0.5, section 2.1.8).

use std::ptr::null_mut;

use super::lifecycle::PLACES;
use super::states::{onward, save};
use crate::harness::bench::Bench;
use crate::harness::drive::same;
use crate::harness::raw::{Raw, name, ok, refused};
use crate::harness::resume::{self, Continuation};
use crate::harness::{CheckResult, Stop, fault, skip, table};
use fmi2_import::description::Severity;

table! {
    "serialized", "2.1.8", Error, "a run continues from a serialized state with the same values, bit for bit", serialized;
    "serialized-process", "2.1.8", Error, "a run continues from a serialized state in another process with the same values, bit for bit", process;
    "serialized-damaged", "2.1.8", Warning, "a serialized state of another length is refused, and a damaged one does not crash", damaged;
}

fn capable(bench: &Bench) -> CheckResult {
    if bench.description().co_simulation.can_serialize_fmu_state {
        return Ok(());
    }
    skip("canSerializeFMUstate is false")
}

/// The serialized state of the instance.
fn bytes(unit: &Raw) -> Result<Vec<u8>, Stop> {
    let mut saved = save(unit)?;
    let mut size = 0;
    ok(unit.state_size(saved, &mut size), "fmi2SerializedFMUstateSize")?;
    let mut bytes = vec![0; size];
    ok(unit.serialize(saved, &mut bytes), "fmi2SerializeFMUstate")?;
    ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    Ok(bytes)
}

fn serialized(bench: &Bench) -> CheckResult {
    capable(bench)?;
    for (place, go) in PLACES.into_iter().filter(|(place, _)| *place != "terminated") {
        bench.part(&format!("a state serialized when {place}"));
        let unit = bench.instance("unit")?;
        go(&unit)?;
        let bytes = bytes(&unit)?;
        let wanted = onward(&unit, place)?;
        let mut saved = null_mut();
        ok(unit.deserialize(&bytes, &mut saved), "fmi2DeSerializeFMUstate")?;
        ok(unit.set_state(saved), "fmi2SetFMUstate")?;
        same(
            bench,
            &onward(&unit, place)?,
            &wanted,
            &format!("from the serialized state of {place}"),
        )?;
        ok(unit.free_state(&mut saved), "fmi2FreeFMUstate")?;
    }
    Ok(())
}

fn process(bench: &Bench) -> CheckResult {
    capable(bench)?;
    let unit = bench.initialized("unit")?;
    unit.run(0, 3)?;
    let bytes = bytes(&unit)?;
    let wanted = unit.record(3, 6)?;
    resume::elsewhere(bench, &Continuation { bytes, from: 3, wanted })
}

fn damaged(bench: &Bench) -> CheckResult {
    capable(bench)?;
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    let sound = bytes(&unit)?;
    for length in [0, 1, sound.len() / 2, sound.len() - 1] {
        let mut saved = null_mut();
        let status = unit.deserialize(&sound[..length], &mut saved);
        if !refused(status) {
            let (all, status) = (sound.len(), name(status));
            return fault(format!(
                "fmi2DeSerializeFMUstate of {length} of the {all} bytes of a state returned {status}"
            ));
        }
    }
    // the standard does not demand it, but a damaged file must not crash the process
    let unit = bench.initialized("another")?;
    let mut saved = null_mut();
    let rubbish = vec![0xA5; sound.len()];
    if !refused(unit.deserialize(&rubbish, &mut saved)) && !saved.is_null() {
        unit.free_state(&mut saved);
        let text = "fmi2DeSerializeFMUstate accepted bytes that are not a state of the FMU";
        bench.observe(Severity::Note, text);
    }
    Ok(())
}
