//! Empty, null, unknown and forbidden arguments (FMI 2.0.5, sections 2.1.2, 2.1.5, 2.1.7
//! and 4.2.2).

use std::ffi::c_void;
use std::ptr::{null, null_mut};

use fmi2_sys::{fmi2Status as Status, fmi2Type};

use super::lifecycle::as_fresh;
use crate::harness::bench::{Bench, RealInput, carried};
use crate::harness::drive::c_string;
use crate::harness::raw::{Making, Raw, name, passed, refused};
use crate::harness::{CheckResult, skip, table};
use fmi2_import::description::{Causality, Initial, Type, Variability, Variable};
use fmi2_import::library::Functions;

table! {
    "zero-length", "2.1.7", Error, "get and set accept null arrays when the number of variables is 0", zero_length;
    "null-arguments", "2.1.7", Warning, "null arrays, null states and null instances are refused without a crash", null_arguments;
    "wrong-reference", "2.1.2", Error, "get and set of unknown value references return an error", wrong_reference;
    "set-read-only", "2.1.2", Error, "constants and the independent variable cannot be set", read_only;
    "set-calculated", "4.2.4", Warning, "calculated outputs and locals cannot be set in step mode", calculated;
    "set-fixed-late", "4.2.4", Warning, "fixed parameters cannot be set in step mode", fixed_late;
    "guid-wrong", "2.1.5", Error, "fmi2Instantiate refuses another GUID, with a message", guid_wrong;
    "name-null", "2.1.5", Warning, "fmi2Instantiate refuses a null or empty name and a null GUID, without a crash", name_null;
    "model-exchange", "2.1.5", Error, "fmi2Instantiate refuses model exchange if the FMU is for co-simulation only", model_exchange;
    "status-kinds", "4.2.3", Error, "fmi2GetXXXStatus returns fmi2Discard for a status that the FMU does not have", status_kinds;
}

fn zero_length(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    let (c, f) = (unit.component(), bench.functions());
    bench.trace().call("unit", format_args!("get and set of 0 variables with NULL arrays"));
    // SAFETY: the check is whether the FMU leaves the arrays alone; the process may crash
    let answers = unsafe {
        [
            ("fmi2GetReal", f.get_real.map(|it| it(c, null(), 0, null_mut()))),
            ("fmi2GetInteger", f.get_integer.map(|it| it(c, null(), 0, null_mut()))),
            ("fmi2GetBoolean", f.get_boolean.map(|it| it(c, null(), 0, null_mut()))),
            ("fmi2GetString", f.get_string.map(|it| it(c, null(), 0, null_mut()))),
            ("fmi2SetReal", f.set_real.map(|it| it(c, null(), 0, null()))),
            ("fmi2SetInteger", f.set_integer.map(|it| it(c, null(), 0, null()))),
            ("fmi2SetBoolean", f.set_boolean.map(|it| it(c, null(), 0, null()))),
            ("fmi2SetString", f.set_string.map(|it| it(c, null(), 0, null()))),
            ("fmi2SetDebugLogging", f.set_debug_logging.map(|it| it(c, 0, 0, null()))),
        ]
    };
    for (call, status) in answers {
        if let Some(status) = status.filter(|status| !passed(*status)) {
            bench.find(format!("{call} of 0 variables returned {}", name(status)));
        }
    }
    unit.run(1, 2)
}

/// The text of a call with a null pointer, and the call.
type Attempt = (&'static str, fn(&Functions, *mut c_void) -> Option<Status>);

/// Memory for one value.
fn place<T: Default>() -> *mut T {
    // leaked, since the process ends with the check
    Box::into_raw(Box::default())
}

/// Calls with null for an array or a state.
#[expect(
    clippy::undocumented_unsafe_blocks,
    reason = "the check is whether the FMU handles a null pointer; the process may crash"
)]
const NULLS: [Attempt; 9] = [
    ("fmi2GetReal(vr NULL, 1)", |f, c| f.get_real.map(|it| unsafe { it(c, null(), 1, place()) })),
    ("fmi2GetReal(1, value NULL)", |f, c| {
        f.get_real.map(|it| unsafe { it(c, place(), 1, null_mut()) })
    }),
    ("fmi2SetReal(vr NULL, 1)", |f, c| f.set_real.map(|it| unsafe { it(c, null(), 1, place()) })),
    ("fmi2SetReal(1, value NULL)", |f, c| {
        f.set_real.map(|it| unsafe { it(c, place(), 1, null()) })
    }),
    ("fmi2GetInteger(1, value NULL)", |f, c| {
        f.get_integer.map(|it| unsafe { it(c, place(), 1, null_mut()) })
    }),
    ("fmi2GetBoolean(1, value NULL)", |f, c| {
        f.get_boolean.map(|it| unsafe { it(c, place(), 1, null_mut()) })
    }),
    ("fmi2GetString(1, value NULL)", |f, c| {
        f.get_string.map(|it| unsafe { it(c, place(), 1, null_mut()) })
    }),
    ("fmi2SetString(1, value NULL)", |f, c| {
        f.set_string.map(|it| unsafe { it(c, place(), 1, null()) })
    }),
    ("fmi2SetFMUstate(NULL)", |f, c| f.set_fmu_state.map(|it| unsafe { it(c, null_mut()) })),
];

/// Calls with a null instance.
#[expect(
    clippy::undocumented_unsafe_blocks,
    reason = "the check is whether the FMU handles a null pointer; the process may crash"
)]
const NO_INSTANCE: [Attempt; 4] = [
    ("fmi2DoStep(NULL)", |f, c| f.do_step.map(|it| unsafe { it(c, 0.0, 1.0, 0) })),
    ("fmi2Reset(NULL)", |f, c| f.reset.map(|it| unsafe { it(c) })),
    ("fmi2Terminate(NULL)", |f, c| f.terminate.map(|it| unsafe { it(c) })),
    ("fmi2GetReal(NULL)", |f, c| f.get_real.map(|it| unsafe { it(c, place(), 1, place()) })),
];

fn null_arguments(bench: &Bench) -> CheckResult {
    let fresh = bench.initialized("fresh")?.record(0, 2)?;
    let states = bench.description().co_simulation.can_get_and_set_fmu_state;
    let attempt = |(call, attempt): Attempt, component| {
        bench.trace().call("unit", format_args!("{call}"));
        if let Some(status) = attempt(bench.functions(), component).filter(|it| !refused(*it)) {
            bench.find(format!("{call} returned {}", name(status)));
        }
    };
    for case in NULLS {
        if case.0.contains("FMUstate") && !states {
            continue;
        }
        bench.part(case.0);
        let unit = bench.initialized("unit")?;
        unit.run(0, 1)?;
        attempt(case, unit.component());
        as_fresh(&unit, &fresh, &format!("after {}", case.0))?;
    }
    for case in NO_INSTANCE {
        bench.part(case.0);
        attempt(case, null_mut());
    }
    Ok(())
}

/// A value reference of no variable of the type.
fn unknown(bench: &Bench, kind: Type) -> u32 {
    let known = bench.references(kind, |_| true);
    known.last().map_or(7, |last| last.saturating_add(1_000_000))
}

fn wrong_reference(bench: &Bench) -> CheckResult {
    let fresh = bench.initialized("fresh")?.record(0, 2)?;
    type Wrong = (&'static str, Type, fn(&Raw, u32) -> Status);
    let attempts: [Wrong; 8] = [
        ("fmi2GetReal", Type::Real, |it, r| it.get_real(&[r], &mut [0.0])),
        ("fmi2SetReal", Type::Real, |it, r| it.set_real(&[r], &[0.0])),
        ("fmi2GetInteger", Type::Integer, |it, r| it.get_integer(&[r], &mut [0])),
        ("fmi2SetInteger", Type::Integer, |it, r| it.set_integer(&[r], &[0])),
        ("fmi2GetBoolean", Type::Boolean, |it, r| it.get_boolean(&[r], &mut [0])),
        ("fmi2SetBoolean", Type::Boolean, |it, r| it.set_boolean(&[r], &[0])),
        ("fmi2GetString", Type::String, |it, r| it.get_string(&[r]).0),
        ("fmi2SetString", Type::String, |it, r| it.set_string(&[r], &[c_string("x")])),
    ];
    for (call, kind, attempt) in attempts {
        bench.part(&format!("{call} of an unknown variable"));
        for reference in [unknown(bench, kind), u32::MAX] {
            let unit = bench.initialized("unit")?;
            unit.run(0, 1)?;
            let status = attempt(&unit, reference);
            if !refused(status) {
                bench.find(format!(
                    "{call} of value reference {reference} returned {}",
                    name(status)
                ));
            }
            as_fresh(&unit, &fresh, &format!("after {call} of an unknown variable"))?;
        }
    }
    Ok(())
}

/// Sets Reals that cannot be set, each on a new instance.
fn forbidden(bench: &Bench, what: &str, test: impl Fn(&Variable) -> bool) -> CheckResult {
    // FMUs treat variables of one kind alike: a few are enough
    const TRIED: usize = 5;
    let fresh = bench.initialized("fresh")?.record(0, 2)?;
    let settable = bench.references(Type::Real, |it| it.causality == Causality::Input);
    let all: Vec<RealInput> = bench
        .variables(|it| carried(it.kind) == Type::Real && test(it))
        .filter(|it| !settable.contains(&it.value_reference))
        .map(RealInput::of)
        .take(TRIED)
        .collect();
    if all.is_empty() {
        return skip(format!("no Real is {what}"));
    }
    for input in all {
        bench.part(&format!("fmi2SetReal of {}, {what}", input.name));
        let unit = bench.initialized("unit")?;
        unit.run(0, 1)?;
        let status = unit.set_real(&[input.reference], &[input.start + input.small]);
        if !refused(status) {
            let text = format!("fmi2SetReal of {}, {what}, returned {}", input.name, name(status));
            bench.find(text);
        }
        as_fresh(&unit, &fresh, &format!("after fmi2SetReal of {}", input.name))?;
    }
    Ok(())
}

fn read_only(bench: &Bench) -> CheckResult {
    forbidden(bench, "constant or independent", |it| {
        it.variability == Variability::Constant || it.causality == Causality::Independent
    })
}

fn calculated(bench: &Bench) -> CheckResult {
    forbidden(bench, "calculated", |it| {
        matches!(it.causality, Causality::Output | Causality::Local)
            && it.variability == Variability::Continuous
            && it.initial == Some(Initial::Calculated)
    })
}

fn fixed_late(bench: &Bench) -> CheckResult {
    forbidden(bench, "a fixed parameter", |it| {
        it.causality == Causality::Parameter && it.variability == Variability::Fixed
    })
}

/// Calls fmi2Instantiate with an argument that it must refuse, and returns the number of messages.
fn refuse(bench: &Bench, what: &str, change: impl FnOnce(&mut Making)) -> Option<usize> {
    bench.part(&format!("fmi2Instantiate with {what}"));
    let mut making = bench.making("unit");
    change(&mut making);
    match Raw::make(bench, &making) {
        Ok(_) => {
            bench.find(format!("fmi2Instantiate with {what} returned an instance"));
            None
        }
        Err(records) => Some(records.len()),
    }
}

fn guid_wrong(bench: &Bench) -> CheckResult {
    let messages = refuse(bench, "another GUID", |it| it.guid = Some(c_string("{another}")));
    if messages == Some(0) {
        bench.find("fmi2Instantiate refused another GUID without a message to the logger");
    }
    bench.initialized("afterwards")?.run(0, 2)
}

fn name_null(bench: &Bench) -> CheckResult {
    refuse(bench, "a null name", |it| it.name = None);
    refuse(bench, "an empty name", |it| it.name = Some(c_string("")));
    refuse(bench, "a null GUID", |it| it.guid = None);
    Ok(())
}

fn model_exchange(bench: &Bench) -> CheckResult {
    if bench.offers_model_exchange() {
        return skip("the FMU supports model exchange");
    }
    refuse(bench, "type fmi2ModelExchange", |it| it.kind = fmi2Type::fmi2ModelExchange);
    Ok(())
}

fn status_kinds(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    // kinds 0 to 3 have the types Status, String, Real and Boolean; kind 77 does not exist
    for kind in [0, 1, 2, 3, 77] {
        let answers = [
            ("fmi2GetStatus", unit.status(kind, &mut 0), kind == 0),
            ("fmi2GetStringStatus", unit.string_status(kind), kind == 1),
            ("fmi2GetRealStatus", unit.real_status(kind, &mut 0.0), kind == 2),
            ("fmi2GetBooleanStatus", unit.boolean_status(kind, &mut 0), kind == 3),
            ("fmi2GetIntegerStatus", unit.integer_status(kind), false),
        ];
        for (call, status, offered) in answers {
            if status != Status::fmi2Discard && !(offered && passed(status)) {
                bench.find(format!("{call} of kind {kind} returned {}", name(status)));
            }
        }
    }
    unit.run(1, 2)
}
