//! Rules on start values and ranges (FMI 2.0.5, section 2.2.7).

use super::{Subject, table};
use crate::description::{Causality, Initial, Type, Value, Variable};

table! {
    "start-required", "2.2.7", Error, "inputs, parameters and exact variables have a start", required;
    "start-forbidden", "2.2.7", Error, "what is calculated has no start", forbidden;
    "start-finite", "2.2", Error, "start values are no NaN and not infinite", finite;
    "start-outside-range", "2.2.7", Error, "start values are within min and max", outside;
    "start-enumeration", "2.2.7", Error, "an enumeration starts with one of its items", enumeration;
    "range", "2.2.7", Error, "min does not exceed max", range;
    "range-finite", "2.2", Error, "min and max are no NaN and not infinite", range_finite;
    "nominal", "2.2.3", Error, "nominal values are positive and finite", nominal;
}

fn required(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let needed = variable.causality == Causality::Input
            || matches!(variable.initial, Some(Initial::Exact | Initial::Approx));
        (needed && variable.start.is_none()).then(|| "has no start value".to_owned())
    })
}

fn forbidden(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let calculated = variable.initial == Some(Initial::Calculated)
            || variable.causality == Causality::Independent;
        (calculated && variable.start.is_some())
            .then(|| "is calculated but has a start value".to_owned())
    })
}

fn number(variable: &Variable) -> Option<f64> {
    match variable.start.as_ref()? {
        Value::Real(value) => Some(*value),
        Value::Integer(value) => Some(f64::from(*value)),
        _ => None,
    }
}

fn finite(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let value = number(variable).filter(|value| !value.is_finite())?;
        Some(format!("start {value} is not finite"))
    })
}

fn outside(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let value = number(variable)?;
        let low = variable.min.is_some_and(|min| value < min);
        let high = variable.max.is_some_and(|max| value > max);
        (low || high).then(|| format!("start {value} is outside of its range"))
    })
}

fn enumeration(subject: &Subject) -> Vec<String> {
    subject.each_element("Enumeration", |node| {
        let (start, name) = (node.attribute("start")?, node.attribute("declaredType")?);
        let declared =
            subject.elements("SimpleType").find(|it| it.attribute("name") == Some(name))?;
        let mut items = declared.descendants().filter(|it| it.has_tag_name("Item"));
        let known = items.any(|item| item.attribute("value") == Some(start));
        (!known).then(|| format!("starts with {start}, which is no item of \"{name}\""))
    })
}

fn range(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let (min, max) = (variable.min?, variable.max?);
        (min > max).then(|| format!("min {min} exceeds max {max}"))
    })
}

fn range_finite(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let odd = [variable.min, variable.max].into_iter().flatten().find(|it| !it.is_finite())?;
        Some(format!("the range has the limit {odd}"))
    })
}

fn nominal(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let nominal = variable.nominal.filter(|_| variable.kind == Type::Real)?;
        (nominal <= 0.0 || !nominal.is_finite())
            .then(|| format!("nominal {nominal} is not positive"))
    })
}
