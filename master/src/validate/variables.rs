//! Rules on causality, variability and initial, and on how variables relate (FMI 2.0.5, section
//! 2.2.7).

use std::collections::BTreeMap;

use super::{Subject, table};
use crate::description::{Causality, Initial, Type, Variability, Variable};

table! {
    "variability-type", "2.2.7", Error, "only a Real is continuous", continuous_type;
    "variability-missing", "2.2.7", Error, "variables that are no Real state their variability", missing;
    "causality-variability", "2.2.7", Error, "causality and variability go together", variability;
    "initial", "2.2.7", Error, "initial fits causality and variability", initial;
    "independent-once", "2.2.7", Error, "at most one variable is the independent one", independent;
    "independent-type", "2.2.7", Error, "the independent variable is a Real", independent_type;
    "derivative", "2.2.7", Error, "derivative refers to another, continuous Real", derivative;
    "alias-start", "2.2.7", Error, "of variables that share a value, one has a start, or all are constants of one value", alias_start;
    "alias-settable", "2.2.7", Error, "of variables that share a value, one can be set", alias_settable;
    "alias-constant", "2.2.7", Error, "variables that share a value are all constant, or none is", alias_constant;
    "alias-unit", "2.2.7", Error, "variables that share a value share its unit", alias_unit;
}

fn continuous_type(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        (variable.variability == Variability::Continuous && variable.kind != Type::Real)
            .then(|| format!("a {} cannot be continuous", variable.kind))
    })
}

fn missing(subject: &Subject) -> Vec<String> {
    subject.each_element("ScalarVariable", |node| {
        let real = node.children().any(|child| child.has_tag_name("Real"));
        (!real && node.attribute("variability").is_none())
            .then(|| "has no variability, and the default is for Reals only".to_owned())
    })
}

fn variability(subject: &Subject) -> Vec<String> {
    use Variability::{Constant, Continuous, Discrete, Fixed, Tunable};
    subject.each_variable(|variable| {
        let allowed: &[Variability] = match variable.causality {
            Causality::Parameter | Causality::CalculatedParameter => &[Fixed, Tunable],
            Causality::Input => &[Discrete, Continuous],
            Causality::Output => &[Constant, Discrete, Continuous],
            Causality::Local => return None,
            Causality::Independent => &[Continuous],
        };
        (!allowed.contains(&variable.variability)).then(|| {
            format!(
                "causality {:?} with variability {:?}",
                variable.causality, variable.variability
            )
        })
    })
}

fn initial(subject: &Subject) -> Vec<String> {
    use Initial::{Approx, Calculated, Exact};
    subject.each_variable(|variable| {
        if !variable.initial_given {
            return None;
        }
        let allowed: &[Initial] = match (variable.causality, variable.variability) {
            (Causality::Input | Causality::Independent, _) => &[],
            (Causality::Parameter, _) | (_, Variability::Constant) => &[Exact],
            (Causality::CalculatedParameter, _)
            | (Causality::Local, Variability::Fixed | Variability::Tunable) => {
                &[Calculated, Approx]
            }
            (Causality::Output | Causality::Local, _) => &[Exact, Approx, Calculated],
        };
        let given = variable.initial?;
        (!allowed.contains(&given)).then(|| {
            format!("initial {given:?} is not allowed with causality {:?}", variable.causality)
        })
    })
}

fn independent(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let names: Vec<&str> = description
        .with_causality(Causality::Independent)
        .map(|index| description.variables[index].name.as_str())
        .collect();
    if names.len() > 1 { vec![format!("{} are all independent", names.join(", "))] } else { vec![] }
}

fn independent_type(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let wrong = variable.causality == Causality::Independent && variable.kind != Type::Real;
        wrong.then(|| format!("the independent variable is {}, no Real", variable.kind))
    })
}

fn derivative(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    subject.each_variable(|variable| {
        let of = variable.derivative_of?;
        let Some(state) = description.variables.get(of) else {
            return Some(format!("derivative of variable {}, which is not there", of + 1));
        };
        let sound = state.kind == Type::Real && state.name != variable.name;
        if !sound {
            return Some(format!("derivative of \"{}\", which is no other Real", state.name));
        }
        let continuous = state.variability == Variability::Continuous;
        (!continuous).then(|| format!("derivative of \"{}\", which is not continuous", state.name))
    })
}

/// Messages on groups of two or more variables that share a type and value reference.
fn each_alias(subject: &Subject, check: impl Fn(&[&Variable]) -> Option<String>) -> Vec<String> {
    let mut groups: BTreeMap<(Type, u32), Vec<&Variable>> = BTreeMap::new();
    for variable in subject.description.iter().flat_map(|it| &it.variables) {
        // both travel as fmi2Integer
        let kind = if variable.kind == Type::Enumeration { Type::Integer } else { variable.kind };
        groups.entry((kind, variable.value_reference)).or_default().push(variable);
    }
    groups
        .into_values()
        .filter(|group| group.len() > 1)
        .filter_map(|group| {
            let names: Vec<&str> = group.iter().map(|variable| variable.name.as_str()).collect();
            check(&group).map(|text| format!("{} share a value, {text}", names.join(", ")))
        })
        .collect()
}

fn alias_start(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let mut starts = group.iter().filter_map(|variable| variable.start.as_ref());
        let first = starts.next()?;
        let constant = group.iter().all(|it| it.variability == Variability::Constant);
        let wrong = if constant { starts.any(|it| it != first) } else { starts.next().is_some() };
        wrong.then(|| "but more than one of them has a start value".to_owned())
    })
}

fn alias_settable(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let settable = |variable: &&&Variable| {
            matches!(variable.causality, Causality::Input | Causality::Parameter)
        };
        (group.iter().filter(settable).count() > 1).then(|| "and several can be set".to_owned())
    })
}

fn alias_constant(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let constant = |variable: &&Variable| variable.variability == Variability::Constant;
        let some = group.iter().any(constant);
        (some && !group.iter().all(constant)).then(|| "but only some are constant".to_owned())
    })
}

fn alias_unit(subject: &Subject) -> Vec<String> {
    each_alias(subject, |group| {
        let mut units = group.iter().map(|variable| &variable.unit);
        let first = units.next()?;
        units.any(|unit| unit != first).then(|| "but not a unit".to_owned())
    })
}
