//! Rules for declarations, of FMI 2.0 and of importers.

use std::collections::HashMap;
use std::sync::Arc;

use crate::description::{INPUT_DERIVATIVES, MOST_INPUT_DERIVATIVES};

use super::{
    DeclaredVariable, Dependencies, Interface, TypeAttributes, UnitOfMeasure, VariableRole,
};

/// Longest name that every importer accepts.
const LONGEST_NAME: usize = 55;

/// Checks a single variable.
pub(super) fn check_variable(variable: &DeclaredVariable, faults: &mut Vec<String>) {
    let DeclaredVariable { name, data, .. } = variable;
    let mut fault = |text: String| faults.push(format!("{name}: {text}"));
    if !is_identifier(name) {
        fault("a name is a letter or _ followed by letters, digits and _".into());
    }
    if name.len() > LONGEST_NAME {
        fault(format!("the name has {} characters, at most {LONGEST_NAME} fit", name.len()));
    }
    if !is_printable(&variable.description) {
        fault("the description has a control character".into());
    }
    let offered = variable.derivatives.max(variable.interpolated);
    if offered > 0 && (variable.role != VariableRole::Output || variable.discrete) {
        fault("only continuous outputs offer derivatives".into());
    }
    let least = u32::from(INPUT_DERIVATIVES);
    if variable.taken != least && (variable.role != VariableRole::Input || variable.discrete) {
        fault("only continuous inputs take derivatives".into());
    }
    if !(least..=MOST_INPUT_DERIVATIVES).contains(&variable.taken) {
        fault(format!("inputs take derivatives up to order {least} to {MOST_INPUT_DERIVATIVES}"));
    }
    match data {
        TypeAttributes::Real { start, min, max, nominal, unit, display } => {
            if [start, min, max, nominal].into_iter().flatten().any(|value| !value.is_finite()) {
                fault("start, min, max and nominal must be finite".into());
            }
            check_range(*start, *min, *max, &mut fault);
            if nominal.is_some_and(|nominal| nominal <= 0.0) {
                fault("nominal must be greater than 0".into());
            }
            if let Some(display) = display
                && !unit.is_some_and(|unit| unit.displays.iter().any(|one| one.name == *display))
            {
                fault(format!("its unit has no display unit {display:?}"));
            }
        }
        TypeAttributes::Integer { start, min, max } => check_range(*start, *min, *max, &mut fault),
        TypeAttributes::Boolean { .. } => {}
        TypeAttributes::Text { start } => {
            if start.as_ref().is_some_and(|start| !is_printable(start)) {
                fault("the start value has a control character".into());
            }
        }
    }
}

fn check_range<V: PartialOrd + std::fmt::Debug + Copy>(
    start: Option<V>,
    min: Option<V>,
    max: Option<V>,
    fault: &mut impl FnMut(String),
) {
    if let (Some(min), Some(max)) = (min, max)
        && min > max
    {
        fault(format!("min {min:?} is above max {max:?}"));
    }
    let Some(start) = start else { return };
    if let Some(min) = min
        && start < min
    {
        fault(format!("start {start:?} is below min {min:?}"));
    }
    if let Some(max) = max
        && start > max
    {
        fault(format!("start {start:?} is above max {max:?}"));
    }
}

/// Checks that need the whole table.
pub(super) fn check_table(interface: &Interface, faults: &mut Vec<String>) {
    check_info(interface, faults);
    check_units(interface, faults);
    check_dependencies(interface, &interface.depends, faults, |known| {
        known.role == VariableRole::Input
    });
    check_dependencies(interface, &interface.initially, faults, |known| {
        matches!(known.role, VariableRole::Input | VariableRole::Parameter | VariableRole::Tunable)
    });
    for &unknown in interface.depends.keys() {
        let variable = &interface.variables[unknown];
        if variable.role != VariableRole::Output {
            faults.push(format!("{}: only outputs have dependencies", variable.name));
        }
    }
    for &unknown in interface.initially.keys() {
        let variable = &interface.variables[unknown];
        if !matches!(variable.role, VariableRole::Output | VariableRole::CalculatedParameter) {
            faults.push(format!(
                "{}: only outputs and calculated parameters have initial dependencies",
                variable.name
            ));
        }
    }
}

fn check_info(interface: &Interface, faults: &mut Vec<String>) {
    let info = &interface.info;
    if !is_identifier(&info.model_identifier) {
        faults.push("`describe` must give a model identifier that is a C identifier".into());
    }
    if info.model_name.trim().is_empty() {
        faults.push("`describe` must give a model name".into());
    }
    let texts = [
        &info.model_name,
        &info.description,
        &info.version,
        &info.author,
        &info.copyright,
        &info.license,
    ];
    if !texts.into_iter().all(|text| is_printable(text)) {
        faults.push("a text of `describe` has a control character".into());
    }
    if let Some(experiment) = &info.experiment {
        let numbers = [experiment.start, experiment.stop, experiment.step];
        let sound = numbers.iter().all(|number| number.is_finite())
            && experiment.stop > experiment.start
            && experiment.step > 0.0
            && experiment.tolerance.is_none_or(|tolerance| tolerance > 0.0 && tolerance < 1.0);
        if !sound {
            faults
                .push("the default experiment needs start < stop, step > 0, tolerance > 0".into());
        }
    }
}

/// A name must not be used for two different units.
fn check_units(interface: &Interface, faults: &mut Vec<String>) {
    let mut known: HashMap<&str, UnitOfMeasure> = HashMap::new();
    for variable in &interface.variables {
        let TypeAttributes::Real { unit: Some(unit), .. } = &variable.data else { continue };
        let first = known.entry(unit.name).or_insert(*unit);
        if first != unit {
            faults.push(format!(
                "{}: unit {:?} is defined twice, differently",
                variable.name, unit.name
            ));
        }
        let numbers = [unit.factor, unit.offset];
        if unit.name.is_empty() || !numbers.iter().all(|n| n.is_finite()) || unit.factor == 0.0 {
            faults.push(format!(
                "{}: its unit needs a name and a factor other than 0",
                variable.name
            ));
        }
    }
}

fn check_dependencies(
    interface: &Interface,
    dependencies: &Dependencies,
    faults: &mut Vec<String>,
    is_known: impl Fn(&DeclaredVariable) -> bool,
) {
    let known: Vec<bool> = interface.variables.iter().map(is_known).collect();
    let mut sound = None;
    for (&unknown, knowns) in dependencies {
        if sound.is_some_and(|last| Arc::ptr_eq(last, knowns)) {
            continue;
        }
        sound = knowns.iter().all(|&index| known[index]).then_some(knowns);
        for &wrong in knowns.iter().filter(|&&index| !known[index]) {
            let [name, wrong] = [unknown, wrong].map(|index| &interface.variables[index].name);
            faults.push(format!("{name} cannot depend on {wrong}"));
        }
    }
}

fn is_identifier(name: &str) -> bool {
    let mut characters = name.chars();
    let first = characters.next();
    first.is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
        && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// XML 1.0 cannot represent most control characters, and attributes lose line breaks.
fn is_printable(text: &str) -> bool {
    !text.chars().any(|c| c.is_control() || c == '\u{FFFE}' || c == '\u{FFFF}')
}
