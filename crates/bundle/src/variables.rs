//! The variables of a bundle, as its table lists them.

use std::collections::HashMap;

use bundle_table::{Exposed, Kind, Role, Value};
use fmi2_import::description::{self, Type, Variability};
use master::Setup;

use crate::dependencies::Dependencies;
use crate::expose::{Choice, start};
use crate::measures::Measures;

/// The entries of the table.
pub(crate) fn variables(
    setup: &Setup,
    choices: &[Choice],
    measures: &mut Measures,
) -> Vec<Exposed> {
    let mut exposed = HashMap::new();
    for (place, choice) in choices.iter().enumerate() {
        if choice.role != Role::Output {
            exposed.extend(choice.ports.iter().map(|&port| (port, place)));
        }
    }
    let dependencies = Dependencies::new(setup.system(), exposed);
    choices.iter().map(|choice| entry(setup, choice, measures, &dependencies)).collect()
}

fn entry(
    setup: &Setup,
    choice: &Choice,
    measures: &mut Measures,
    dependencies: &Dependencies<'_>,
) -> Exposed {
    let system = setup.system();
    let port = choice.ports[0];
    let instance = &system.instances[port.instance];
    let (variable, unit) = (system.variable(port), instance.description());
    let is_output = choice.role == Role::Output;
    let measure = unit.unit_of(port.variable.0).and_then(|it| measures.place(it, &instance.unit));
    let display = variable.display_unit.clone().filter(|name| {
        measure.is_some_and(|place| measures.0[place].displays.iter().any(|it| it.0 == *name))
    });
    let mut text = sentence(setup, choice);
    if let Some(name) = variable.unit.as_ref().filter(|_| measure.is_none()) {
        text += &format!(" [{name}]");
    }
    let items = unit.enumeration_of(port.variable.0).filter(|_| variable.kind == Type::Enumeration);
    let (mut min, mut max) = (variable.min, variable.max);
    if let Some(items) = items {
        let listed = items.items.iter().map(|(name, value)| format!("{value} = {name}"));
        text += &format!(" ({})", listed.collect::<Vec<_>>().join(", "));
        let numbers = || items.items.iter().map(|(_, value)| f64::from(*value));
        (min, max) = (numbers().reduce(f64::min), numbers().reduce(f64::max));
    }
    let start = if is_output { None } else { start(setup, port).map(value) };
    // some exporters give bounds that the start value breaks
    let number = match start {
        Some(Value::Real(x)) => Some(x),
        Some(Value::Integer(x)) => Some(f64::from(x)),
        _ => None,
    };
    min = min.filter(|min| min.is_finite() && number.is_none_or(|x| x >= *min));
    max = max.filter(|max| max.is_finite() && number.is_none_or(|x| x <= *max));
    let (mut derivatives, mut interpolated) = (0, 0);
    if is_output && instance.every == 1 {
        let order = |order: usize| u32::try_from(order).unwrap_or(0);
        derivatives = order(unit.output_derivative_order(port.variable.0));
        let most = order(unit.interpolation_order(port.variable.0));
        interpolated = if most > derivatives { most } else { 0 };
    }
    // a unit that steps slower extrapolates the polynomial itself
    let taken = choice.ports.iter().map(|port| {
        let instance = &system.instances[port.instance];
        if instance.every > 1 { 3 } else { instance.input_derivatives_of(port.variable, true) }
    });
    let taken = if choice.role == Role::Input { taken.min().unwrap_or(0) } else { 0 };
    Exposed {
        name: choice.name.clone(),
        description: printable(&text),
        role: choice.role,
        kind: match variable.kind {
            Type::Real => Kind::Real,
            Type::Integer | Type::Enumeration => Kind::Integer,
            Type::Boolean => Kind::Boolean,
            Type::String => Kind::String,
        },
        discrete: variable.variability != Variability::Continuous || instance.every > 1,
        start,
        min,
        max,
        nominal: variable.nominal.map(f64::abs).filter(|it| it.is_finite() && *it > 0.0),
        measure,
        display,
        derivatives,
        interpolated,
        // with lower orders a unit gets the polynomial anew at each step inside
        takes: u32::try_from(taken).unwrap_or(0).clamp(3, 5),
        ports: choice.ports.iter().map(|&port| system.port_name(port)).collect(),
        depends: if is_output { dependencies.stepping(port) } else { Vec::new() },
        initially: if is_output { dependencies.initial(port) } else { Vec::new() },
    }
}

/// The description of the variable inside, with the instances that it belongs to.
fn sentence(setup: &Setup, choice: &Choice) -> String {
    let system = setup.system();
    let name = |k: usize| system.instances[choice.ports[k].instance].name.as_str();
    let of = match choice.ports.len() {
        1 => name(0).to_owned(),
        count => format!("{} to {} ({count} instances)", name(0), name(count - 1)),
    };
    match &system.variable(choice.ports[0]).description {
        Some(text) if !text.is_empty() => format!("{of}: {text}"),
        _ => format!("{of}: {}", system.variable(choice.ports[0]).name),
    }
}

fn value(value: description::Value) -> Value {
    match value {
        description::Value::Real(x) => Value::Real(x),
        description::Value::Integer(x) => Value::Integer(x),
        description::Value::Boolean(x) => Value::Boolean(x),
        description::Value::String(x) => Value::String(printable(&x)),
    }
}

/// XML cannot represent most control characters.
fn printable(text: &str) -> String {
    let odd = |c: char| c.is_control() || c == '\u{FFFE}' || c == '\u{FFFF}';
    text.chars().map(|c| if odd(c) { ' ' } else { c }).collect()
}
