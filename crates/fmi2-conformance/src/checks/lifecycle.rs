//! From fmi2Instantiate to fmi2FreeInstance (FMI 2.0.5, sections 2.1.5, 2.1.6 and 4.2.4).

use fmi2_sys::fmi2Status as Status;

use crate::harness::bench::{Bench, STEPS};
use crate::harness::drive::{ReadList, ReadValues, same};
use crate::harness::raw::{Raw, name, ok, passed};
use crate::harness::{CheckResult, Stop, fault, table};
use fmi2_import::description::Severity;
use fmi2_import::per_type::CType;

table! {
    "load", "2.1.4", Error, "the binary loads, has all functions, and returns version 2.0 and platform default", load;
    "run", "4.2.4", Error, "in an ordinary run every call returns fmi2OK", run;
    "outputs-finite", "2.1.7", Error, "in an ordinary run no value is NaN or infinite", finite;
    "repeatable", "4.1", Error, "two instances with the same calls have the same values, bit for bit", repeatable;
    "free-any-time", "4.2.4", Error, "fmi2FreeInstance works before, during and after initialization, and after steps", free;
    "free-null", "2.1.5", Error, "fmi2FreeInstance ignores null", free_null;
    "terminate-twice", "2.1.6", Error, "a second or an early fmi2Terminate does not crash", terminate;
    "reset", "2.1.6", Error, "after fmi2Reset in any state an instance runs like a new one, bit for bit", reset;
    "start-time", "2.1.6", Error, "a run can start at any time", start_time;
}

fn load(bench: &Bench) -> CheckResult {
    for (symbol, found) in bench.functions().found() {
        if !found {
            bench.find(format!("the binary does not export {symbol}"));
        }
    }
    Ok(())
}

fn run(bench: &Bench) -> CheckResult {
    let unit = bench.instance("unit")?;
    let mut warned = false;
    let mut call = |status: Status, what: &str| {
        warned |= status == Status::fmi2Warning;
        ok(status, what)
    };
    call(unit.setup_default(), "fmi2SetupExperiment")?;
    call(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
    call(unit.exit_initialization(), "fmi2ExitInitializationMode")?;
    for step in 0..STEPS {
        call(unit.do_step(bench.time(step), bench.step()), "fmi2DoStep")?;
        unit.read(&ReadList::all(bench))?;
    }
    call(unit.terminate(), "fmi2Terminate")?;
    unit.read(&ReadList::all(bench))?;
    if warned {
        let text = "a call in an ordinary run returned fmi2Warning; some importers stop there";
        bench.observe(Severity::Warning, text);
    }
    Ok(())
}

fn finite(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    let of = ReadList::all(bench);
    for step in 0..STEPS {
        unit.run(step, step + 1)?;
        let values = unit.read(&of)?.numbers();
        let odd = values.iter().zip(&of.reals).find(|(value, _)| !value.is_finite());
        if let Some((value, &reference)) = odd {
            let name = bench.description().name_of(CType::Real, reference).unwrap_or("?");
            return fault(format!("{name} is {value} after step {}", step + 1));
        }
    }
    Ok(())
}

fn repeatable(bench: &Bench) -> CheckResult {
    let record = |name| bench.initialized(name)?.record(0, STEPS);
    let first = record("first")?;
    same(bench, &record("second")?, &first, "the second instance")
}

/// A state of an instance, and the calls that lead to it.
type Place = (&'static str, fn(&Raw) -> CheckResult);

/// The states of an instance, in the order of its life.
pub(super) const PLACES: [Place; 6] = [
    ("instantiated", |_| Ok(())),
    ("set up", |unit| ok(unit.setup_default(), "fmi2SetupExperiment")),
    ("initialization mode", |unit| {
        ok(unit.setup_default(), "fmi2SetupExperiment")?;
        ok(unit.enter_initialization(), "fmi2EnterInitializationMode")
    }),
    ("initialized", |unit| unit.initialize()),
    ("step mode", |unit| {
        unit.initialize()?;
        unit.run(0, 2)
    }),
    ("terminated", |unit| {
        unit.initialize()?;
        unit.run(0, 2)?;
        ok(unit.terminate(), "fmi2Terminate")
    }),
];

fn free(bench: &Bench) -> CheckResult {
    for (place, go) in PLACES {
        bench.part(&format!("fmi2FreeInstance when {place}"));
        let unit = bench.instance("unit")?;
        go(&unit)?;
        unit.free();
    }
    let other = bench.initialized("another afterwards")?;
    other.run(0, 2)
}

fn free_null(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    let before = bench.initialized("undisturbed")?.record(0, 2)?;
    if let Some(function) = bench.functions().free_instance {
        bench.trace().call("null", format_args!("fmi2FreeInstance(NULL)"));
        // SAFETY: the standard allows null; the check is whether the FMU does
        unsafe { function(std::ptr::null_mut()) };
    }
    same(bench, &unit.record(0, 2)?, &before, "an instance after fmi2FreeInstance(NULL)")
}

fn terminate(bench: &Bench) -> CheckResult {
    for (place, go) in PLACES {
        bench.part(&format!("fmi2Terminate twice when {place}"));
        let unit = bench.instance("unit")?;
        go(&unit)?;
        for _ in 0..2 {
            let status = unit.terminate();
            if !passed(status) && status != Status::fmi2Error {
                let status = name(status);
                return fault(format!("fmi2Terminate when {place} returned {status}"));
            }
        }
    }
    Ok(())
}

/// Resets the instance, and compares its run with that of a new instance.
pub(super) fn as_fresh(unit: &Raw, fresh: &[ReadValues], what: &str) -> CheckResult {
    ok(unit.reset(), &format!("fmi2Reset {what}"))?;
    unit.initialize().map_err(|stop| after_reset(stop, what))?;
    let record = unit.record(0, fresh.len()).map_err(|stop| after_reset(stop, what))?;
    same(unit.bench(), &record, fresh, &format!("reset {what}"))
}

fn after_reset(stop: Stop, what: &str) -> Stop {
    match stop {
        Stop::Fault(text) => Stop::Fault(format!("reset {what}: {text}")),
        skip @ Stop::Skip(_) => skip,
    }
}

fn reset(bench: &Bench) -> CheckResult {
    let fresh = bench.initialized("fresh")?.record(0, 3)?;
    for (place, go) in PLACES {
        bench.part(&format!("fmi2Reset when {place}"));
        let unit = bench.instance("unit")?;
        let inputs = bench.inputs();
        let starts: Vec<_> = bench.starts();
        // fmi2Reset must also restore start values and inputs
        if let Some(start) = starts.first() {
            unit.set_real(&[start.reference], &[start.start + start.small]);
        }
        go(&unit)?;
        if place == "initialized" {
            unit.move_inputs(&inputs, 3)?;
        }
        as_fresh(&unit, &fresh, &format!("when {place}"))?;
    }
    Ok(())
}

fn start_time(bench: &Bench) -> CheckResult {
    let begin = bench.start() + 1000.0 * bench.step();
    let unit = bench.instance("unit")?;
    ok(unit.setup(begin, None), "fmi2SetupExperiment with a later start")?;
    ok(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
    ok(unit.exit_initialization(), "fmi2ExitInitializationMode")?;
    for n in 0..3_u32 {
        let time = begin + f64::from(n) * bench.step();
        ok(unit.do_step(time, bench.step()), &format!("fmi2DoStep at {time}, begun at {begin}"))?;
    }
    Ok(())
}
