//! Communication steps of all sizes, and extreme inputs (FMI 2.0.5, section 4.2.2).

use std::ptr::null_mut;

use fmi2_sys::fmi2Status as Status;

use super::lifecycle::as_fresh;
use crate::harness::bench::Bench;
use crate::harness::drive::ReadList;
use crate::harness::raw::{Raw, name, ok, passed, refused};
use crate::harness::{CheckResult, Stop, fault, skip, table};
use fmi2_import::description::Type;
use fmi2_import::per_type::CType;

table! {
    "step-varying", "4.3.1", Error, "steps of varying size work if the FMU declares it", varying;
    "step-extreme", "4.2.2", Error, "a tiny and a huge step end with any status but fmi2Fatal; fmi2Reset recovers the instance", extreme;
    "step-split", "4.2.2", Warning, "with constant inputs an interval ends alike in one, two, many and unequal steps", split;
    "step-rounded", "4.2.2", Error, "communication points with rounding errors of a sum are accepted", rounded;
    "step-invalid", "4.2.2", Error, "steps of zero and negative size are refused; fmi2Reset recovers the instance", invalid;
    "step-not-finite", "4.2.2", Warning, "steps of NaN and infinite size are refused; fmi2Reset recovers the instance", not_finite;
    "step-elsewhere", "4.2.2", Warning, "a step that does not start at the end of the last one is refused", elsewhere;
    "step-past-stop", "2.1.6", Warning, "a step past the stop time is refused", past_stop;
    "inputs-extreme", "2.1.3", Error, "steps with NaN, infinite and huge inputs end with any status but fmi2Fatal; fmi2Reset recovers the instance", inputs;
}

fn variable(bench: &Bench) -> bool {
    bench.description().co_simulation.can_handle_variable_communication_step_size
}

fn varying(bench: &Bench) -> CheckResult {
    if !variable(bench) {
        return skip("canHandleVariableCommunicationStepSize is false");
    }
    let unit = bench.initialized("unit")?;
    let mut time = bench.start();
    for factor in [1.0, 0.5, 1e-3, 3.0, 0.37, 1.0, 2.0, 0.01, 1.0] {
        let size = factor * bench.step();
        ok(unit.do_step(time, size), &format!("fmi2DoStep at {time} s over {size} s"))?;
        unit.read(&ReadList::all(bench))?;
        time += size;
    }
    Ok(())
}

/// Makes a call that may fail, but must not return fmi2Fatal, and after which fmi2Reset must work.
fn survives(
    bench: &Bench,
    what: &str,
    call: impl FnOnce(&Raw) -> Result<Status, Stop>,
) -> Result<Status, Stop> {
    bench.part(what);
    let fresh = bench.initialized("fresh")?.record(0, 2)?;
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    let status = call(&unit)?;
    if status == Status::fmi2Fatal {
        return fault(format!("{what} returned fmi2Fatal, which ends all instances"));
    }
    as_fresh(&unit, &fresh, &format!("after {what}"))?;
    Ok(status)
}

fn extreme(bench: &Bench) -> CheckResult {
    for factor in [1e-9, 300.0] {
        let size = factor * bench.step();
        survives(bench, &format!("a step of {size} s"), |unit| {
            let status = unit.do_step(bench.time(1), size);
            if status == Status::fmi2Discard {
                let mut last = f64::NAN;
                let answer = unit.real_status(2, &mut last);
                if !passed(answer) || !last.is_finite() {
                    return fault(format!(
                        "after fmi2Discard, fmi2GetRealStatus(fmi2LastSuccessfulTime) returned {} \
                         with {last}",
                        name(answer)
                    ));
                }
            }
            Ok(status)
        })?;
    }
    Ok(())
}

/// The Real outputs after steps of these sizes, in multiples of the step.
fn after(bench: &Bench, sizes: &[f64]) -> Result<Vec<f64>, Stop> {
    let unit = bench.initialized("unit")?;
    let mut done = 0.0;
    for size in sizes {
        let (time, h) = (bench.start() + done * bench.step(), size * bench.step());
        ok(unit.do_step(time, h), &format!("fmi2DoStep at {time} s over {h} s"))?;
        done += size;
    }
    Ok(unit.read(&ReadList::outputs(bench))?.numbers())
}

fn split(bench: &Bench) -> CheckResult {
    // allowed difference as a fraction of the change over the interval
    const SHARE: f64 = 0.02;
    if !variable(bench) {
        return skip("canHandleVariableCommunicationStepSize is false");
    }
    let of = ReadList::outputs(bench);
    if of.reals.is_empty() {
        return skip("there are no Real outputs");
    }
    let begin = bench.initialized("unit")?.read(&of)?.numbers();
    let wanted = after(bench, &[1.0; 8])?;
    let splits: [&[f64]; 4] =
        [&[8.0], &[4.0, 4.0], &[0.25; 32], &[0.5, 1.7, 0.3, 2.5, 0.01, 1.49, 1.5]];
    for sizes in splits {
        bench.part(&format!("the time of eight steps in {} steps", sizes.len()));
        for (index, (got, wanted)) in after(bench, sizes)?.iter().zip(&wanted).enumerate() {
            // what is at rest changes by rounding errors, what is kept near zero by what is left of it
            let rounding = nominal(bench, of.reals[index]).map_or(1e-10, |it| 5e-4 * it).max(1e-12);
            let scale = (wanted - begin[index]).abs() + 1e-6 * wanted.abs() + rounding;
            if (got - wanted).abs() > SHARE * scale {
                let name = bench.description().name_of(CType::Real, of.reals[index]).unwrap_or("?");
                return fault(format!(
                    "{name} ends at {got} with steps of {sizes:?} times the step size, but at \
                     {wanted} with eight equal steps"
                ));
            }
        }
    }
    Ok(())
}

/// Typical magnitude of a Real, if its description says one.
fn nominal(bench: &Bench, reference: u32) -> Option<f64> {
    let mut variables = bench.description().variables.iter();
    let found = variables.find(|it| it.kind == Type::Real && it.value_reference == reference);
    found.and_then(|it| it.nominal).map(f64::abs)
}

fn rounded(bench: &Bench) -> CheckResult {
    const COUNT: usize = 1000;
    let unit = bench.initialized("unit")?;
    let mut time = bench.start();
    bench.trace().quietly(&format!("unit: {COUNT} × fmi2DoStep with t = t + h"), || {
        for step in 0..COUNT {
            let status = unit.do_step(time, bench.step());
            if status == Status::fmi2Discard && unit.wants_end() {
                break;
            }
            ok(status, &format!("step {step} at {time:?} s"))?;
            time += bench.step();
        }
        Ok(())
    })
}

fn invalid(bench: &Bench) -> CheckResult {
    refuse(bench, [0.0, -bench.step()])
}

fn not_finite(bench: &Bench) -> CheckResult {
    refuse(bench, [f64::NAN, f64::INFINITY])
}

/// Tries steps of sizes that must be refused.
fn refuse(bench: &Bench, sizes: [f64; 2]) -> CheckResult {
    for size in sizes {
        let what = format!("a step of {size} s");
        let status = survives(bench, &what, |unit| Ok(unit.do_step(bench.time(1), size)))?;
        if !refused(status) {
            bench.find(format!("{what} returned {}", name(status)));
        }
    }
    Ok(())
}

fn elsewhere(bench: &Bench) -> CheckResult {
    for from in [0, 3] {
        let time = bench.time(from);
        let what = format!("a step at {time} s, after the last one ended at {} s", bench.time(1));
        let status = survives(bench, &what, |unit| Ok(unit.do_step(time, bench.step())))?;
        if !refused(status) {
            bench.find(format!("{what}, returned {}", name(status)));
        }
    }
    Ok(())
}

fn past_stop(bench: &Bench) -> CheckResult {
    let unit = bench.instance("unit")?;
    ok(unit.setup(bench.start(), Some(bench.time(2))), "fmi2SetupExperiment with a stop time")?;
    ok(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
    ok(unit.exit_initialization(), "fmi2ExitInitializationMode")?;
    unit.run(0, 2)?;
    let status = unit.do_step(bench.time(2), bench.step());
    if !refused(status) {
        bench.find(format!("a step past the stop time returned {}", name(status)));
    }
    Ok(())
}

fn inputs(bench: &Bench) -> CheckResult {
    let inputs = bench.inputs();
    if inputs.is_empty() {
        return skip("there are no Real inputs");
    }
    let references: Vec<u32> = inputs.iter().map(|input| input.reference).collect();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, f64::MIN_POSITIVE] {
        let values = vec![value; references.len()];
        survives(bench, &format!("steps with inputs of {value:e}"), |unit| {
            let status = unit.set_real(&references, &values);
            if !passed(status) {
                return Ok(status);
            }
            for step in 1..4 {
                let status = unit.do_step(bench.time(step), bench.step());
                if !passed(status) {
                    return Ok(status);
                }
            }
            // reading must end, with any value
            let mut out = vec![0.0; references.len()];
            Ok(unit.get_real(&references, &mut out))
        })?;
    }
    let unit = bench.initialized("afterwards")?;
    let mut saved = null_mut();
    if bench.description().co_simulation.can_get_and_set_fmu_state {
        unit.get_state(&mut saved);
        unit.free_state(&mut saved);
    }
    unit.run(0, 2)
}
