//! Rules on start values and ranges (FMI 2.0.5, section 2.2.7).

use std::collections::{HashMap, HashSet};

use super::quantities::each_real;
use super::subject::{Subject, table};
use fmi2_import::description::{Causality, Initial, Value, Variable};
use fmi2_import::xml::{self, Plain as _};

table! {
    "start-required", "2.2.7", Error, "inputs, parameters and variables with initial=exact or approx have a start", required;
    "start-forbidden", "2.2.7", Error, "calculated and independent variables have no start", forbidden;
    "start-finite", "2.2", Error, "start values are finite", finite;
    "start-outside-range", "2.2.7", Error, "start values are within min and max", outside;
    "start-enumeration", "2.2.7", Error, "the start of an enumeration is one of its items", enumeration;
    "range", "2.2.7", Error, "min does not exceed max", range;
    "range-finite", "2.2", Error, "min and max are finite", range_finite;
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
        variable.start.as_ref()?;
        let why = match (variable.causality, variable.initial) {
            (Causality::Independent, _) => "independent",
            (_, Some(Initial::Calculated)) => "calculated",
            _ => return None,
        };
        Some(format!("is {why}, but has a start value"))
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
        Some(format!("has the start value {value}, which is not finite"))
    })
}

fn outside(subject: &Subject) -> Vec<String> {
    let items = items(subject);
    subject.each_variable(|variable| {
        let value = number(variable)?;
        // findings of `range` and `start-enumeration`
        let upside_down = variable.min.zip(variable.max).is_some_and(|(min, max)| min > max);
        let declared = variable.declared_type.as_deref().and_then(|name| items.get(name));
        let no_item = declared.is_some_and(|items| items.iter().all(|it| f64::from(*it) != value));
        if upside_down || no_item {
            return None;
        }
        let low = variable.min.filter(|min| value < *min);
        let high = variable.max.filter(|max| value > *max);
        let below = low.map(|min| format!("has the start value {value}, below its min {min}"));
        below
            .or_else(|| high.map(|max| format!("has the start value {value}, above its max {max}")))
    })
}

/// The values of the items of each enumeration, by its name.
fn items<'a>(subject: &Subject<'a>) -> HashMap<&'a str, HashSet<i32>> {
    let mut items: HashMap<&str, HashSet<i32>> = HashMap::new();
    for item in subject.elements("Item") {
        let around = item.parent_element().and_then(|it| it.parent_element());
        let name = around.and_then(|it| it.attr("name"));
        if let (Some(name), Some(value)) = (name, item.attr("value").and_then(xml::number)) {
            items.entry(name).or_default().insert(value);
        }
    }
    items
}

fn enumeration(subject: &Subject) -> Vec<String> {
    let items = items(subject);
    subject.each_element("Enumeration", |node| {
        let name = node.attr("declaredType")?;
        let start = xml::number::<i32>(node.attr("start")?)?;
        let known = items.get(name)?.contains(&start);
        (!known).then(|| format!("has the start value {start}, which is not an item of \"{name}\""))
    })
}

fn range(subject: &Subject) -> Vec<String> {
    // a range from the declared type is a finding of `type-range`
    let own = |index: usize| {
        let mut children = subject.variable_node(index).into_iter().flat_map(|it| it.children());
        children.any(|child| child.attr("min").is_some() || child.attr("max").is_some())
    };
    let object = |(index, variable): (usize, &Variable)| {
        let (min, max) = (variable.min?, variable.max?);
        (min > max && min.is_finite() && max.is_finite() && own(index))
            .then(|| format!("variable \"{}\" has min {min} above max {max}", variable.name))
    };
    subject.variables().filter_map(object).collect()
}

fn range_finite(subject: &Subject) -> Vec<String> {
    each_real(subject, |real| {
        ["min", "max"].into_iter().find_map(|name| {
            let limit = xml::number::<f64>(real.attr(name)?).filter(|it| !it.is_finite())?;
            Some(format!("has {name} {limit}, which is not finite"))
        })
    })
}

fn nominal(subject: &Subject) -> Vec<String> {
    each_real(subject, |real| {
        let nominal = xml::number::<f64>(real.attr("nominal")?)?;
        (nominal <= 0.0 || !nominal.is_finite())
            .then(|| format!("has nominal {nominal}, which is not positive and finite"))
    })
}
