//! Every function in every state (FMI 2.0.5, section 4.2.4). A call that the standard allows must work. A call that it
//! does not allow must be refused, and fmi2Reset must still work after it.

use std::ptr::null_mut;

use fmi2_sys::fmi2Status as Status;

use super::lifecycle::{PLACES, as_fresh};
use crate::harness::bench::{Bench, RealInput, is_start};
use crate::harness::drive::{ReadList, same};
use crate::harness::raw::{LACKING, Raw, name, passed};
use crate::harness::{CheckResult, fault, table};
use fmi2_import::description::{Causality, CoSimulation, Severity, Type};

table! {
    "order-allowed", "4.2.4", Error, "every function works in every state in which it is allowed", allowed;
    "order-forbidden", "4.2.4", Warning, "functions are refused in states in which they are not allowed, and fmi2Reset works afterwards", forbidden;
    "after-error", "2.1.3", Error, "an error does not affect other instances; a saved state and fmi2Reset recover the instance", after_error;
}

/// A function, and whether it is allowed in each of [`PLACES`].
struct Probe {
    name: &'static str,
    /// `x`: allowed. `.`: not allowed. `,`: not allowed, but importers do it, such as an early fmi2Terminate when they
    /// clean up. `-`: the standard is unclear.
    allowed: &'static str,
    needs: fn(&CoSimulation) -> bool,
    /// `None` if the FMU has no variable for the call.
    call: fn(&Raw, &str) -> Option<Status>,
}

const fn probe(
    name: &'static str,
    allowed: &'static str,
    call: fn(&Raw, &str) -> Option<Status>,
) -> Probe {
    Probe { name, allowed, needs: |_| true, call }
}

const fn with(probe: Probe, needs: fn(&CoSimulation) -> bool) -> Probe {
    Probe { needs, ..probe }
}

fn get_real(unit: &Raw, _: &str) -> Option<Status> {
    let references = ReadList::outputs(unit.bench()).reals;
    let mut values = vec![0.0; references.len()];
    (!references.is_empty()).then(|| unit.get_real(&references, &mut values))
}

fn get_integer(unit: &Raw, _: &str) -> Option<Status> {
    let references = ReadList::outputs(unit.bench()).integers;
    let mut values = vec![0; references.len()];
    (!references.is_empty()).then(|| unit.get_integer(&references, &mut values))
}

fn get_boolean(unit: &Raw, _: &str) -> Option<Status> {
    let references = ReadList::outputs(unit.bench()).booleans;
    let mut values = vec![0; references.len()];
    (!references.is_empty()).then(|| unit.get_boolean(&references, &mut values))
}

fn get_string(unit: &Raw, _: &str) -> Option<Status> {
    let references = ReadList::outputs(unit.bench()).strings;
    (!references.is_empty()).then(|| unit.get_string(&references).0)
}

/// Sets a Real that can be set in the state: a start value before initialization, otherwise an input.
fn set_real(unit: &Raw, place: &str) -> Option<Status> {
    let early = ["instantiated", "set up"].contains(&place);
    let mut settable = unit.bench().variables(|variable| {
        variable.kind == Type::Real
            && if early { is_start(variable) } else { variable.causality == Causality::Input }
    });
    let input = RealInput::of(settable.next()?);
    Some(unit.set_real(&[input.reference], &[input.start]))
}

fn get_state(unit: &Raw, _: &str) -> Option<Status> {
    let mut saved = null_mut();
    let status = unit.get_state(&mut saved);
    if passed(status) {
        unit.free_state(&mut saved);
    }
    Some(status)
}

fn set_state(unit: &Raw, _: &str) -> Option<Status> {
    let mut saved = null_mut();
    if !passed(unit.get_state(&mut saved)) {
        return None;
    }
    let status = unit.set_state(saved);
    unit.free_state(&mut saved);
    Some(status)
}

fn serialize(unit: &Raw, _: &str) -> Option<Status> {
    let (mut saved, mut again) = (null_mut(), null_mut());
    if !passed(unit.get_state(&mut saved)) {
        return None;
    }
    let mut size = 0;
    let mut status = unit.state_size(saved, &mut size);
    let mut bytes = vec![0; size];
    if passed(status) {
        status = unit.serialize(saved, &mut bytes);
    }
    if passed(status) {
        status = unit.deserialize(&bytes, &mut again);
        unit.free_state(&mut again);
    }
    unit.free_state(&mut saved);
    Some(status)
}

fn input_derivatives(unit: &Raw, _: &str) -> Option<Status> {
    let input = unit.bench().continuous_inputs().into_iter().next()?;
    Some(unit.set_input_derivatives(&[input.reference], &[1], &[0.0]))
}

fn output_derivatives(unit: &Raw, _: &str) -> Option<Status> {
    let reference = *ReadList::outputs(unit.bench()).reals.first()?;
    Some(unit.get_output_derivatives(&[reference], &[1], &mut [0.0]))
}

fn do_step(unit: &Raw, place: &str) -> Option<Status> {
    let bench = unit.bench();
    let from = if place == "step mode" { 2 } else { 0 };
    Some(unit.do_step(bench.time(from), bench.step()))
}

/// Reads all kinds of status. Each call may return fmi2Discard at any time.
fn retrieve(unit: &Raw, _: &str) -> Option<Status> {
    let answers = [
        unit.status(0, &mut 0),
        unit.real_status(2, &mut 0.0),
        unit.integer_status(0),
        unit.boolean_status(3, &mut 0),
        unit.string_status(1),
    ];
    let worst = answers.into_iter().find(|it| !passed(*it) && *it != Status::fmi2Discard);
    Some(worst.unwrap_or(Status::fmi2OK))
}

const PROBES: &[Probe] = &[
    probe("fmi2SetDebugLogging", "xxxxxx", |unit, _| Some(unit.debug_logging(false, &[]))),
    probe("fmi2SetupExperiment", "xx....", |unit, _| Some(unit.setup_default())),
    probe("fmi2EnterInitializationMode", ",x....", |unit, _| Some(unit.enter_initialization())),
    probe("fmi2ExitInitializationMode", "..x...", |unit, _| Some(unit.exit_initialization())),
    probe("fmi2Terminate", ",,,xx,", |unit, _| Some(unit.terminate())),
    probe("fmi2Reset", "xxxxxx", |unit, _| Some(unit.reset())),
    probe("fmi2GetReal", ",,xxxx", get_real),
    probe("fmi2GetInteger", ",,xxxx", get_integer),
    probe("fmi2GetBoolean", ",,xxxx", get_boolean),
    probe("fmi2GetString", ",,xxxx", get_string),
    probe("fmi2SetReal", "xxxxx,", set_real),
    with(probe("fmi2GetFMUstate", "xxxxxx", get_state), |it| it.can_get_and_set_fmu_state),
    with(probe("fmi2SetFMUstate", "xxxxxx", set_state), |it| it.can_get_and_set_fmu_state),
    with(probe("fmi2SerializeFMUstate", "xxxxxx", serialize), |it| it.can_serialize_fmu_state),
    with(probe("fmi2SetRealInputDerivatives", "xxxxx.", input_derivatives), |it| {
        it.can_interpolate_inputs
    }),
    with(probe("fmi2GetRealOutputDerivatives", "...-xx", output_derivatives), |it| {
        it.max_output_derivative_order > 0
    }),
    probe("fmi2DoStep", "...xx.", do_step),
    probe("fmi2CancelStep", "......", |unit, _| Some(unit.cancel_step())),
    probe("fmi2GetXXXStatus", ",,,xxx", retrieve),
];

/// A call that was tried.
struct Tried<'a> {
    call: &'a str,
    place: &'a str,
    mark: char,
}

/// Tries each function of the FMU in each state with one of the marks, on a new instance.
fn each(
    bench: &Bench,
    wanted: &[char],
    mut judge: impl FnMut(Tried, Raw, Status) -> CheckResult,
) -> CheckResult {
    for probe in PROBES {
        if !(probe.needs)(&bench.description().co_simulation) {
            continue;
        }
        for ((place, go), mark) in PLACES.into_iter().zip(probe.allowed.chars()) {
            if !wanted.contains(&mark) {
                continue;
            }
            bench.part(&format!("{} when {place}", probe.name));
            let unit = bench.instance("unit")?;
            go(&unit)?;
            if let Some(status) = (probe.call)(&unit, place) {
                judge(Tried { call: probe.name, place, mark }, unit, status)?;
            }
        }
    }
    Ok(())
}

fn allowed(bench: &Bench) -> CheckResult {
    each(bench, &['x'], |Tried { call, place, .. }, _, status| {
        if !passed(status) {
            bench.find(format!("{call} when {place} returned {}", name(status)));
        }
        Ok(())
    })
}

fn forbidden(bench: &Bench) -> CheckResult {
    let fresh = bench.initialized("fresh")?.record(0, 2)?;
    each(bench, &['.', ','], |Tried { call, place, mark }, unit, status| {
        let message =
            format!("{call} when {place}, which is not allowed, returned {}", name(status));
        if status == Status::fmi2Fatal || status == LACKING {
            bench.observe(Severity::Error, message);
            return Ok(());
        }
        if passed(status) && call != "fmi2GetXXXStatus" {
            let severity = if mark == '.' { Severity::Warning } else { Severity::Note };
            bench.observe(severity, message);
        }
        as_fresh(&unit, &fresh, &format!("after {call} when {place}"))
    })
}

fn after_error(bench: &Bench) -> CheckResult {
    let capable = bench.description().co_simulation.can_get_and_set_fmu_state;
    let wanted = bench.initialized("undisturbed")?.record(0, 6)?;
    let (unit, other) = (bench.initialized("unit")?, bench.initialized("other")?);
    unit.run(0, 2)?;
    other.run(0, 2)?;
    let mut saved = null_mut();
    if capable && !passed(unit.get_state(&mut saved)) {
        return fault("fmi2GetFMUstate failed");
    }
    // a step of -1 s is an error for any FMU
    let status = unit.do_step(bench.time(2), -1.0);
    if status == Status::fmi2Fatal {
        return fault("a step of -1 s returned fmi2Fatal, which ends all instances");
    }
    same(bench, &other.record(2, 4)?, &wanted[2..4], "another instance")?;
    if capable {
        if !passed(unit.set_state(saved)) {
            return fault("fmi2SetFMUstate after an error failed");
        }
        same(bench, &unit.record(2, 6)?, &wanted[2..6], "the restored state after an error")?;
        unit.do_step(bench.time(6), -1.0);
        unit.free_state(&mut saved);
    }
    as_fresh(&unit, &wanted[..2], "after an error")
}
