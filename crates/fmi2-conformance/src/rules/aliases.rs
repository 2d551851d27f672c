//! Rules on variables that share a value (FMI 2.0.5, section 2.2.7).

use std::collections::BTreeMap;

use super::subject::{Subject, several, table};
use fmi2_import::description::{Causality, Initial, Type, Variability, Variable};

table! {
    "alias-settable", "2.2.7", Error, "of the variables that share a value, at most one can be set", settable;
    "alias-independent", "2.2.7", Error, "a variable that shares its value with the independent variable cannot be set", independent;
    "alias-start", "2.2.7", Error, "of the variables that share a value and are not constant, at most one has a start", start;
    "alias-constant", "2.2.7", Error, "variables that share a value are all constant or all not constant", constant;
    "alias-value", "2.2.7", Error, "constants that share a value have the same start", value;
    "alias-unit", "2.2.7", Error, "variables that share a value have the same unit", unit;
}

/// Messages for the groups of two or more variables with the same type and value reference.
fn each_alias(subject: &Subject, check: impl Fn(&[&Variable]) -> Option<String>) -> Vec<String> {
    let mut groups: BTreeMap<(Type, u32), Vec<&Variable>> = BTreeMap::new();
    for (_, variable) in subject.variables() {
        // both are read and set as fmi2Integer
        let kind = if variable.kind == Type::Enumeration { Type::Integer } else { variable.kind };
        groups.entry((kind, variable.value_reference)).or_default().push(variable);
    }
    groups
        .into_values()
        .filter(|group| group.len() > 1)
        .filter_map(|group| {
            let names: Vec<&str> = group.iter().map(|variable| variable.name.as_str()).collect();
            check(&group).map(|text| format!("{} share a value, {text}", several(&names)))
        })
        .collect()
}

fn is_constant(variable: &Variable) -> bool {
    variable.variability == Variability::Constant
}

/// Whether `fmi2SetXXX` may be called for the variable in any state.
fn is_settable(variable: &Variable) -> bool {
    let starts = matches!(variable.initial, Some(Initial::Exact | Initial::Approx));
    variable.causality == Causality::Input || starts && !is_constant(variable)
}

fn count(group: &[&Variable], test: impl Fn(&Variable) -> bool) -> usize {
    group.iter().filter(|variable| test(variable)).count()
}

fn settable(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        (count(group, is_settable) > 1).then(|| "and several of them can be set".to_owned())
    })
}

fn independent(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let time = group.iter().find(|it| it.causality == Causality::Independent)?;
        let set = group.iter().find(|it| is_settable(it))?;
        Some(format!("but \"{}\" can be set and \"{}\" is independent", set.name, time.name))
    })
}

fn start(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let starts = count(group, |it| !is_constant(it) && it.start.is_some());
        // several that can be set are a finding of `alias-settable`
        (starts > 1 && count(group, is_settable) < 2)
            .then(|| "and several of them have a start value".to_owned())
    })
}

fn constant(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let constants = count(group, is_constant);
        (constants > 0 && constants < group.len())
            .then(|| "but only some of them are constant".to_owned())
    })
}

fn value(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let mut constants = group.iter().filter(|it| is_constant(it) && it.start.is_some());
        let first = constants.next()?;
        let other = constants.find(|it| it.start != first.start)?;
        let (one, two) = (first.start.as_ref()?, other.start.as_ref()?);
        Some(format!(
            "but the constant \"{}\" is {one} and \"{}\" is {two}",
            first.name, other.name
        ))
    })
}

fn unit(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let first = group.first()?;
        let other = group.iter().find(|it| it.unit != first.unit)?;
        let name = |it: &Variable| match &it.unit {
            Some(unit) => format!("the unit \"{unit}\""),
            None => "no unit".to_owned(),
        };
        let (one, two) = (name(first), name(other));
        Some(format!("but \"{}\" has {one} and \"{}\" has {two}", first.name, other.name))
    })
}
