//! Derivatives of inputs and outputs, and directional derivatives (FMI 2.0.5, sections 2.1.9 and
//! 4.2.1).

use std::time::{Duration, Instant};

use fmi2_sys::fmi2Status as Status;

use crate::harness::bench::{Bench, RealInput};
use crate::harness::drive::ReadList;
use crate::harness::raw::{Raw, name, ok, passed, refused};
use crate::harness::{CheckResult, Stop, fault, skip, table};
use fmi2_import::description::{Causality, Initial, Severity, Type, Unknown, Variability};
use fmi2_import::per_type::CType;

table! {
    "input-derivatives", "4.2.1", Error, "a step with input derivatives ends like many small steps along the same lines", inputs;
    "input-derivatives-wrong", "4.2.1", Warning, "derivatives of order 0 and of variables that are not inputs are refused", wrong;
    "output-derivatives", "4.2.1", Error, "output derivatives are 0 or agree with the slope over small steps", outputs;
    "directional-derivatives", "2.1.9", Error, "directional derivatives agree with finite differences", directional;
}

/// The course of the inputs over one communication step.
#[derive(Clone, Copy, PartialEq)]
enum InputCourse {
    /// Held at their values at the start.
    Held,
    /// Held at their values in the middle of the line.
    Middle,
    /// Along a line, by input derivatives.
    Line,
    /// Along the same line in small steps, each with the value at its middle.
    Stairs,
}

/// The Real outputs after one communication step in `parts` parts.
fn along(
    bench: &Bench,
    inputs: &[RealInput],
    parts: u32,
    course: InputCourse,
) -> Result<Vec<f64>, Stop> {
    let unit = bench.initialized("unit")?;
    let references: Vec<u32> = inputs.iter().map(|input| input.reference).collect();
    let h = bench.step() / f64::from(parts);
    for part in 0..parts {
        let share = match course {
            InputCourse::Stairs => (f64::from(part) + 0.5) / f64::from(parts),
            InputCourse::Middle => 0.5,
            InputCourse::Held | InputCourse::Line => 0.0,
        };
        let at = |input: &RealInput| input.start + input.small * share;
        let values: Vec<f64> = inputs.iter().map(at).collect();
        ok(unit.set_real(&references, &values), "fmi2SetReal")?;
        if course == InputCourse::Line {
            let slopes: Vec<f64> = inputs.iter().map(|input| input.small / bench.step()).collect();
            let orders = vec![1; references.len()];
            let status = unit.set_input_derivatives(&references, &orders, &slopes);
            ok(status, "fmi2SetRealInputDerivatives")?;
        }
        ok(unit.do_step(bench.start() + f64::from(part) * h, h), "fmi2DoStep")?;
    }
    Ok(unit.read(&ReadList::outputs(bench))?.numbers())
}

/// Whether each output has no direct feed-through.
fn indirect(bench: &Bench) -> Vec<bool> {
    let description = bench.description();
    let of = ReadList::outputs(bench).reals;
    of.iter()
        .map(|reference| {
            description.with_causality(Causality::Output).any(|index| {
                let variable = &description.variables[index];
                variable.value_reference == *reference
                    && variable.kind == Type::Real
                    && variable.variability == Variability::Continuous
                    && description.step_dependencies(index).is_empty()
            })
        })
        .collect()
}

fn inputs(bench: &Bench) -> CheckResult {
    const PARTS: u32 = 64;
    if !bench.description().co_simulation.can_interpolate_inputs {
        return skip("canInterpolateInputs is false");
    }
    let inputs = bench.continuous_inputs();
    let indirect = indirect(bench);
    if inputs.is_empty() || !indirect.contains(&true) {
        return skip("no output without direct feed-through depends on a continuous input");
    }
    let held = along(bench, &inputs, 1, InputCourse::Held)?;
    let held_parts = along(bench, &inputs, PARTS, InputCourse::Held)?;
    let stairs = along(bench, &inputs, PARTS, InputCourse::Stairs)?;
    let line = along(bench, &inputs, 1, InputCourse::Line)?;
    let middle = along(bench, &inputs, 1, InputCourse::Middle)?;
    let of = ReadList::outputs(bench).reals;
    for index in (0..of.len()).filter(|&index| indirect[index]) {
        let effect = (stairs[index] - held[index]).abs();
        // smaller effects are hidden by rounding and by the solver's gain in accuracy with smaller steps
        let noise =
            1e-9 * held[index].abs() + 10.0 * (held_parts[index] - held[index]).abs() + 1e-15;
        let error = (line[index] - stairs[index]).abs();
        // a unit with large steps inside, such as a coupled system, may show an effect one step later
        let shown = (middle[index] - held[index]).abs() > 0.1 * effect;
        if effect > 10.0 * noise && shown && error > 0.1 * effect {
            let name = bench.description().name_of(CType::Real, of[index]).unwrap_or("?");
            return fault(format!(
                "{name} ends at {:?} with input derivatives, at {:?} with {PARTS} small steps \
                 along the same lines, and at {:?} with constant inputs",
                line[index], stairs[index], held[index]
            ));
        }
    }
    Ok(())
}

fn wrong(bench: &Bench) -> CheckResult {
    if !bench.description().co_simulation.can_interpolate_inputs {
        return skip("canInterpolateInputs is false");
    }
    let inputs = bench.continuous_inputs();
    let Some(input) = inputs.first() else { return skip("there are no continuous inputs") };
    let parameter = bench.references(Type::Real, |it| it.causality == Causality::Parameter);
    let cases = [
        ("of order 0", Some(input.reference), 0),
        ("of order -1", Some(input.reference), -1),
        ("of a parameter", parameter.first().copied(), 1),
        ("of an unknown variable", Some(u32::MAX), 1),
    ];
    for (what, reference, order) in cases {
        let Some(reference) = reference else { continue };
        let unit = bench.initialized("unit")?;
        let status = unit.set_input_derivatives(&[reference], &[order], &[1.0]);
        if !refused(status) {
            bench.find(format!("fmi2SetRealInputDerivatives {what} returned {}", name(status)));
        }
    }
    Ok(())
}

fn outputs(bench: &Bench) -> CheckResult {
    if bench.description().co_simulation.max_output_derivative_order == 0 {
        return skip("maxOutputDerivativeOrder is 0");
    }
    let of = bench.references(Type::Real, |it| {
        it.causality == Causality::Output && it.variability == Variability::Continuous
    });
    if of.is_empty() {
        return skip("there are no continuous outputs");
    }
    let fed = fed_through(bench);
    let unaffected: Vec<u32> = of.iter().copied().filter(|it| !fed.contains(it)).collect();
    compare(bench, true, &unaffected)?;
    compare(bench, false, &of)
}

/// Outputs that are declared to depend directly on an input. Their derivatives include what the FMU
/// knows about the motion of its inputs, such as a speed beside a position.
fn fed_through(bench: &Bench) -> Vec<u32> {
    let description = bench.description();
    let declared = |unknown: &&Unknown| {
        let mut inputs = unknown.dependencies.iter().flatten();
        inputs.any(|&it| description.variables[it].causality == Causality::Input)
    };
    let fed = description.outputs.iter().filter(declared);
    fed.map(|unknown| description.variables[unknown.variable].value_reference).collect()
}

/// Compares derivatives of outputs with the slopes over small steps with held inputs, after two steps
/// with `moved` inputs or with those of the start.
fn compare(bench: &Bench, moved: bool, of: &[u32]) -> CheckResult {
    let unit = bench.initialized("unit")?;
    if moved {
        unit.run(0, 2)?;
    } else {
        for step in 0..2 {
            ok(unit.do_step(bench.time(step), bench.size(step)), "fmi2DoStep")?;
        }
    }
    // short compared with the fastest motion inside an FMU with this default step
    let h = bench.step() / 256.0;
    let mut points = Vec::new();
    let mut slopes = Vec::new();
    for part in 0..3_u32 {
        ok(unit.do_step(bench.time(2) + f64::from(part) * h, h), "fmi2DoStep")?;
        let mut values = vec![0.0; of.len()];
        ok(unit.get_real(of, &mut values), "fmi2GetReal")?;
        points.push(values);
        if part == 1 {
            slopes = first_derivatives(bench, &unit, of, moved)?;
        }
    }
    for (index, slope) in slopes.iter().enumerate() {
        let (before, after) =
            ((points[1][index] - points[0][index]) / h, (points[2][index] - points[1][index]) / h);
        // tolerance around the slopes on both sides: their difference, 5 % and rounding
        let slack = (after - before).abs()
            + 0.05 * after.abs().max(before.abs())
            + 1e-14 * points[1][index].abs() / h
            + 1e-10;
        let sound = (before.min(after) - slack..=before.max(after) + slack).contains(slope);
        // an FMU that does not know the derivative returns 0
        if !sound && *slope != 0.0 {
            let name = bench.description().name_of(CType::Real, of[index]).unwrap_or("?");
            return fault(format!(
                "the derivative of {name} is {slope}, but the slope over small steps is {before} before \
                 and {after} after"
            ));
        }
    }
    Ok(())
}

/// First derivatives of outputs; 0 where the FMU discards the call, which is noted unless `quiet`.
fn first_derivatives(bench: &Bench, unit: &Raw, of: &[u32], quiet: bool) -> Result<Vec<f64>, Stop> {
    let mut discarded = 0;
    let slopes = of.iter().map(|&reference| {
        let mut slope = [0.0];
        let status = unit.get_output_derivatives(&[reference], &[1], &mut slope);
        if status == Status::fmi2Discard {
            discarded += 1;
            return Ok(0.0);
        }
        ok(status, "fmi2GetRealOutputDerivatives of order 1")?;
        Ok(slope[0])
    });
    let slopes = slopes.collect::<Result<Vec<f64>, Stop>>()?;
    if discarded > 0 && !quiet {
        bench.observe(
            Severity::Note,
            format!(
                "fmi2GetRealOutputDerivatives returned fmi2Discard for {discarded} outputs; by the \
                 standard an unknown derivative is 0"
            ),
        );
    }
    Ok(slopes)
}

fn directional(bench: &Bench) -> CheckResult {
    const LIMIT: Duration = Duration::from_secs(2);
    let description = bench.description();
    if !description.co_simulation.provides_directional_derivative {
        return skip("providesDirectionalDerivative is false");
    }
    let unit = bench.instance("unit")?;
    ok(unit.setup_default(), "fmi2SetupExperiment")?;
    ok(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
    let (begin, mut tested) = (Instant::now(), 0);
    for unknown in &description.initial_unknowns {
        let (of, Some(dependencies)) =
            (&description.variables[unknown.variable], &unknown.dependencies)
        else {
            continue;
        };
        let knowns = dependencies.iter().map(|&index| &description.variables[index]).filter(|it| {
            let state = it.initial == Some(Initial::Exact) && it.causality != Causality::Parameter;
            it.kind == Type::Real
                && it.variability == Variability::Continuous
                && (it.causality == Causality::Input || state)
        });
        if of.kind != Type::Real {
            continue;
        }
        // there can be thousands of pairs: two of each unknown are enough
        for known in knowns.take(2).map(RealInput::of) {
            slope(bench, &unit, (&of.name, of.value_reference), &known)?;
            tested += 1;
            if tested > 200 || begin.elapsed() > LIMIT {
                return Ok(());
            }
        }
    }
    if tested == 0 { skip("no Real unknown depends on a Real known") } else { Ok(()) }
}

fn slope(bench: &Bench, unit: &Raw, of: (&str, u32), known: &RealInput) -> CheckResult {
    let (name_of, reference) = of;
    let mut given = [f64::NAN];
    let status = unit.directional(&[reference], known.reference, &mut given);
    if !passed(status) {
        return fault(format!(
            "fmi2GetDirectionalDerivative of {name_of} by {} returned {}",
            known.name,
            name(status)
        ));
    }
    let at = |offset: f64| -> Result<f64, Stop> {
        let mut value = [f64::NAN];
        ok(unit.set_real(&[known.reference], &[known.start + offset]), "fmi2SetReal")?;
        ok(unit.get_real(&[reference], &mut value), "fmi2GetReal")?;
        Ok(value[0])
    };
    let d = known.small;
    let (low, middle, high) = (at(0.0)?, at(d)?, at(2.0 * d)?);
    at(0.0)?;
    // the slope at the start by a second-order difference, and its error
    let seen = (-3.0 * low + 4.0 * middle - high) / (2.0 * d);
    let bend = (high - 2.0 * middle + low).abs() / d.abs();
    // outputs of an iterative solver have about nine digits; the absolute term is for differences of large forces
    let noise = 1e-9 * low.abs() + 1e-11;
    let slack = 0.02 * seen.abs() + bend + noise / d.abs();
    if (given[0] - seen).abs() > slack || given[0].is_nan() {
        let by = &known.name;
        bench.trace().call("unit", format_args!("(differences by {d})"));
        return fault(format!(
            "the derivative of {name_of} by {by} is {}, but finite differences give {seen}",
            given[0]
        ));
    }
    Ok(())
}
