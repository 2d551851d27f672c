//! Values of variables (FMI 2.0.5, sections 2.1.2, 2.1.7, 2.2.7 and 2.2.8).

use std::time::{Duration, Instant};

use crate::harness::bench::{Bench, RealInput, STEPS, is_start};
use crate::harness::drive::{ReadList, c_string};
use crate::harness::raw::{Raw, ok};
use crate::harness::{CheckResult, Stop, fault, skip, table};
use fmi2_import::description::{Causality, Initial, Type, Value, Variability};
use fmi2_import::per_type::CType;

table! {
    "start-values", "2.2.7", Error, "inputs, parameters and variables with initial=exact have their start values at first", start_values;
    "set-then-get", "2.1.7", Error, "a Real that was set reads back the same", set_then_get;
    "strings", "2.1.2", Error, "Strings are not null, are UTF-8 and are copied when set", strings;
    "booleans", "2.1.2", Error, "Booleans are 0 or 1", booleans;
    "value-range", "2.2.7", Warning, "values stay within min and max of the description", value_range;
    "independent", "2.2.7", Error, "the independent variable is the time of the communication point", independent;
    "dependencies", "2.2.8", Error, "an output does not change with an input that it does not depend on", dependencies;
}

/// An instance in initialization mode.
fn initializing<'b>(bench: &'b Bench, name: &str) -> Result<Raw<'b>, Stop> {
    let unit = bench.instance(name)?;
    ok(unit.setup_default(), "fmi2SetupExperiment")?;
    ok(unit.enter_initialization(), "fmi2EnterInitializationMode")?;
    Ok(unit)
}

fn start_values(bench: &Bench) -> CheckResult {
    let unit = initializing(bench, "unit")?;
    let known = bench.variables(|it| {
        it.kind == Type::Real
            && (it.causality == Causality::Input || it.initial == Some(Initial::Exact))
    });
    for variable in known {
        let Some(Value::Real(start)) = variable.start else { continue };
        let mut value = [f64::NAN];
        let what = format!("fmi2GetReal of {}", variable.name);
        ok(unit.get_real(&[variable.value_reference], &mut value), &what)?;
        // the number in the description may be rounded
        if (value[0] - start).abs() > 1e-9 * start.abs() || value[0].is_nan() {
            let name = &variable.name;
            return fault(format!(
                "{name} is {} at first, but its start value is {start}",
                value[0]
            ));
        }
    }
    Ok(())
}

fn set_then_get(bench: &Bench) -> CheckResult {
    let unit = initializing(bench, "unit")?;
    let settable: Vec<RealInput> = bench
        .variables(|it| it.kind == Type::Real && (it.causality == Causality::Input || is_start(it)))
        .map(RealInput::of)
        .collect();
    if settable.is_empty() {
        return skip("no Real can be set");
    }
    for input in settable {
        let (wanted, mut value) = (input.start + input.small, [f64::NAN]);
        let what = |call| format!("{call} of {}", input.name);
        ok(unit.set_real(&[input.reference], &[wanted]), &what("fmi2SetReal"))?;
        ok(unit.get_real(&[input.reference], &mut value), &what("fmi2GetReal"))?;
        if value[0].to_bits() != wanted.to_bits() {
            return fault(format!("{} was set to {wanted:?}, but is {:?}", input.name, value[0]));
        }
        unit.set_real(&[input.reference], &[input.start]);
    }
    Ok(())
}

fn strings(bench: &Bench) -> CheckResult {
    let of = bench.references(Type::String, |_| true);
    if of.is_empty() {
        return skip("there are no Strings");
    }
    let unit = initializing(bench, "unit")?;
    let inputs = bench.references(Type::String, |it| it.causality == Causality::Input);
    for (index, &reference) in inputs.iter().enumerate() {
        let text = c_string(&format!("text {index} ä"));
        ok(unit.set_string(&[reference], &[text]), "fmi2SetString")?;
        // the text is freed here: an FMU that kept the address reads something else
    }
    let mut cover = vec![0x55_u8; 4096];
    std::hint::black_box(&mut cover);
    let (status, texts) = unit.get_string(&of);
    ok(status, "fmi2GetString")?;
    for (reference, text) in of.iter().zip(texts) {
        let name = bench.description().name_of(CType::String, *reference).unwrap_or("?");
        let Some(bytes) = text else { return fault(format!("{name} is a null pointer")) };
        let Ok(text) = String::from_utf8(bytes) else {
            return fault(format!("{name} is not UTF-8"));
        };
        if let Some(index) = inputs.iter().position(|it| it == reference) {
            let wanted = format!("text {index} ä");
            if text != wanted {
                return fault(format!("{name} was set to {wanted:?}, but is {text:?}"));
            }
        }
    }
    Ok(())
}

fn booleans(bench: &Bench) -> CheckResult {
    let of = ReadList::all(bench);
    if of.booleans.is_empty() {
        return skip("there are no Booleans");
    }
    let unit = bench.initialized("unit")?;
    unit.run(0, 2)?;
    let values = unit.read(&of)?;
    let odd =
        values.booleans().iter().zip(&of.booleans).find(|(value, _)| !(0..=1).contains(*value));
    let Some((value, &reference)) = odd else { return Ok(()) };
    let name = bench.description().name_of(CType::Boolean, reference).unwrap_or("?");
    fault(format!("the Boolean {name} is {value}"))
}

fn value_range(bench: &Bench) -> CheckResult {
    let limited = |bench: &Bench| {
        let real = |it: &&fmi2_import::description::Variable| {
            it.kind == Type::Real && (it.min.is_some() || it.max.is_some())
        };
        bench.description().variables.iter().filter(real).cloned().collect::<Vec<_>>()
    };
    let (limited, unit) = (limited(bench), bench.initialized("unit")?);
    if limited.is_empty() {
        return skip("no Real has a range");
    }
    let references: Vec<u32> = limited.iter().map(|it| it.value_reference).collect();
    let mut values = vec![0.0; references.len()];
    for step in 0..STEPS {
        unit.run(step, step + 1)?;
        ok(unit.get_real(&references, &mut values), "fmi2GetReal")?;
        for (variable, value) in limited.iter().zip(&values) {
            let low = variable.min.is_some_and(|min| *value < min);
            if low || variable.max.is_some_and(|max| *value > max) {
                let name = &variable.name;
                return fault(format!("{name} is {value}, which is outside its range"));
            }
        }
    }
    Ok(())
}

fn independent(bench: &Bench) -> CheckResult {
    let mut variables = bench.variables(|it| it.causality == Causality::Independent);
    let Some(time) = variables.next() else { return skip("there is no independent variable") };
    let unit = bench.initialized("unit")?;
    for step in 0..STEPS {
        unit.run(step, step + 1)?;
        let mut value = [f64::NAN];
        ok(unit.get_real(&[time.value_reference], &mut value), "fmi2GetReal of the time")?;
        let reached = bench.time(step + 1);
        // an FMU with internal steps must still reach the communication point
        if (value[0] - reached).abs() > 1e-3 * bench.step() || value[0].is_nan() {
            return fault(format!(
                "{} is {} at the communication point {reached}",
                time.name, value[0]
            ));
        }
    }
    Ok(())
}

fn dependencies(bench: &Bench) -> CheckResult {
    const LIMIT: Duration = Duration::from_secs(2);
    let description = bench.description();
    let inputs: Vec<usize> = description
        .with_causality(Causality::Input)
        .filter(|&index| description.variables[index].kind == Type::Real)
        .collect();
    let outputs: Vec<usize> = description
        .with_causality(Causality::Output)
        .filter(|&index| {
            let output = &description.variables[index];
            output.kind == Type::Real && output.variability != Variability::Constant
        })
        .collect();
    if inputs.is_empty() || outputs.is_empty() {
        return skip("there are no Real inputs and outputs");
    }
    let references: Vec<u32> =
        outputs.iter().map(|&index| description.variables[index].value_reference).collect();
    let depends: Vec<Vec<usize>> =
        outputs.iter().map(|&output| description.initial_dependencies(output)).collect();
    let unit = initializing(bench, "unit")?;
    let (mut before, mut after) = (vec![0.0; outputs.len()], vec![0.0; outputs.len()]);
    let begin = Instant::now();
    for index in inputs {
        let input = RealInput::of(&description.variables[index]);
        ok(unit.get_real(&references, &mut before), "fmi2GetReal")?;
        ok(unit.set_real(&[input.reference], &[input.start + input.small]), "fmi2SetReal")?;
        ok(unit.get_real(&references, &mut after), "fmi2GetReal")?;
        ok(unit.set_real(&[input.reference], &[input.start]), "fmi2SetReal")?;
        for (place, &output) in outputs.iter().enumerate() {
            let changed = before[place].to_bits() != after[place].to_bits();
            if changed && !depends[place].contains(&index) {
                let name = &description.variables[output].name;
                return fault(format!(
                    "{name} changes with {} in initialization mode, but InitialUnknowns declare no \
                     such dependency",
                    input.name
                ));
            }
        }
        if begin.elapsed() > LIMIT {
            break;
        }
    }
    Ok(())
}
