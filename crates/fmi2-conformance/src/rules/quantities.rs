//! Rules on units of measurement and declared types (FMI 2.0.5, sections 2.2.2 and 2.2.3).

use std::collections::{BTreeMap, HashSet};

use roxmltree::Node;

use super::subject::{Subject, duplicates, several, table};
use fmi2_import::xml::{Plain as _, number};

table! {
    "unit-duplicate", "2.2.2", Error, "units have different names", unit_names;
    "unit-base", "2.2.2", Note, "every unit has a BaseUnit, which conversions need", unit_base;
    "unit-factor", "2.2.2", Error, "factors are finite and not zero; offsets are finite", factor;
    "display-unit-duplicate", "2.2.2", Error, "display units of a unit have different names", display_names;
    "unit-defined", "2.2.3", Error, "every unit in use is defined", unit_defined;
    "display-unit-alone", "2.2.3", Error, "a display unit comes with a unit", display_alone;
    "display-unit-defined", "2.2.3", Note, "every display unit in use is defined for its unit; others are ignored", display_defined;
    "type-duplicate", "2.2.3", Error, "types have different names", type_names;
    "type-name", "2.2.3", Error, "a type does not have the name of a variable", type_and_variable;
    "type-range", "2.2.3", Error, "a type's min does not exceed its max", type_range;
    "enumeration-items", "2.2.3", Error, "items of an enumeration have different names and values", items;
    "declared-type", "2.2.7", Error, "a declared type is defined and has the type of the variable", declared;
}

fn unit_names(subject: &Subject) -> Vec<String> {
    let names = subject.elements("Unit").filter_map(|node| node.attr("name"));
    duplicates(names)
        .iter()
        .map(|name| format!("the unit \"{name}\" is defined more than once"))
        .collect()
}

fn unit_base(subject: &Subject) -> Vec<String> {
    let bare =
        subject.elements("Unit").filter(|node| !node.children().any(|child| child.is("BaseUnit")));
    let names: Vec<&str> = bare.filter_map(|node| node.attr("name")).collect();
    if names.is_empty() {
        return Vec::new();
    }
    vec![format!("importers cannot convert units without a BaseUnit: {}", several(&names))]
}

fn value(node: Node, attribute: &str) -> Option<f64> {
    number(node.attr(attribute)?)
}

fn factor(subject: &Subject) -> Vec<String> {
    let object = |node: Node| {
        let factor = value(node, "factor").filter(|it| *it == 0.0 || !it.is_finite());
        let offset = value(node, "offset").filter(|it| !it.is_finite());
        factor
            .map(|it| format!("has the factor {it}"))
            .or_else(|| offset.map(|it| format!("has the offset {it}")))
    };
    let mut found = subject.each_element("BaseUnit", object);
    found.extend(subject.each_element("DisplayUnit", object));
    found
}

fn display_names(subject: &Subject) -> Vec<String> {
    subject.each_element("Unit", |node| {
        let names = node.children().filter(|child| child.is("DisplayUnit"));
        let twice = duplicates(names.filter_map(|child| child.attr("name")));
        twice.first().map(|name| format!("has the display unit \"{name}\" more than once"))
    })
}

/// The type elements (Real, Integer, …) of the declared types, by name.
fn types<'a>(subject: &Subject<'a>) -> BTreeMap<&'a str, Node<'a, 'a>> {
    let element =
        |node: Node<'a, 'a>| Some((node.attr("name")?, node.children().find(Node::is_element)?));
    subject.elements("SimpleType").filter_map(element).collect()
}

/// The Real elements of variables and types, each with the element around it.
pub(super) fn reals<'a>(
    subject: &Subject<'a>,
) -> impl Iterator<Item = (Node<'a, 'a>, Node<'a, 'a>)> {
    let around = |real: Node<'a, 'a>| Some((real, real.parent_element()?));
    let sound = |(_, around): &(Node, Node)| !subject.reading.breaks(*around);
    subject.elements("Real").filter_map(around).filter(sound)
}

/// Messages for the Reals of variables and types for which a check returns a text.
pub(super) fn each_real<'a>(
    subject: &Subject<'a>,
    check: impl Fn(Node<'a, 'a>) -> Option<String>,
) -> Vec<String> {
    let object = |(real, around)| Some(subject.about(around, &check(real)?));
    reals(subject).filter_map(object).collect()
}

/// One message for all Reals for which a check returns the same word.
fn each_word<'a>(
    subject: &Subject<'a>,
    check: impl Fn(Node<'a, 'a>) -> Option<&'a str>,
    message: impl Fn(&str, &str) -> String,
) -> Vec<String> {
    let mut users: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (real, around) in reals(subject) {
        if let Some(word) = check(real) {
            users.entry(word).or_default().push(around.attr("name").unwrap_or_default());
        }
    }
    users.into_iter().map(|(word, names)| message(word, &several(&names))).collect()
}

fn unit_defined(subject: &Subject) -> Vec<String> {
    let defined: HashSet<&str> =
        subject.elements("Unit").filter_map(|node| node.attr("name")).collect();
    each_word(
        subject,
        |real| real.attr("unit").filter(|unit| !defined.contains(unit)),
        |unit, users| format!("the unit \"{unit}\" of {users} is not defined"),
    )
}

fn display_alone(subject: &Subject) -> Vec<String> {
    let types = types(subject);
    let lent = |real: Node| types.get(real.attr("declaredType")?)?.attr("unit");
    each_word(
        subject,
        |real| {
            let alone = real.attr("unit").or_else(|| lent(real)).is_none();
            real.attr("displayUnit").filter(|_| alone)
        },
        |display, users| format!("the display unit \"{display}\" of {users} has no unit"),
    )
}

fn display_defined(subject: &Subject) -> Vec<String> {
    let types = types(subject);
    let units: BTreeMap<&str, Node> =
        subject.elements("Unit").filter_map(|node| Some((node.attr("name")?, node))).collect();
    each_word(
        subject,
        |real| {
            let display = real.attr("displayUnit")?;
            let lent = || types.get(real.attr("declaredType")?)?.attr("unit");
            let unit = units.get(real.attr("unit").or_else(lent)?)?;
            let known = unit.attr("name") == Some(display)
                || unit.children().any(|child| child.attr("name") == Some(display));
            (!known).then_some(display)
        },
        |display, users| {
            format!("the display unit \"{display}\" of {users} is not defined; importers ignore it")
        },
    )
}

fn type_names(subject: &Subject) -> Vec<String> {
    let names = subject.elements("SimpleType").filter_map(|node| node.attr("name"));
    duplicates(names)
        .iter()
        .map(|name| format!("the type \"{name}\" is defined more than once"))
        .collect()
}

fn type_and_variable(subject: &Subject) -> Vec<String> {
    let variables: HashSet<&str> =
        subject.elements("ScalarVariable").filter_map(|node| node.attr("name")).collect();
    subject.each_element("SimpleType", |node| {
        let clash = variables.contains(node.attr("name")?);
        clash.then(|| "is also the name of a variable".to_owned())
    })
}

fn type_range(subject: &Subject) -> Vec<String> {
    subject.each_element("SimpleType", |node| {
        let element = node.children().find(Node::is_element)?;
        let (min, max) = (value(element, "min")?, value(element, "max")?);
        (min > max && min.is_finite() && max.is_finite())
            .then(|| format!("has min {min} above max {max}"))
    })
}

fn items(subject: &Subject) -> Vec<String> {
    subject.each_element("SimpleType", |node| {
        let element = node.children().find(|child| child.is("Enumeration"))?;
        let items = || element.children().filter(|it| it.is("Item"));
        let names = duplicates(items().filter_map(|item| item.attr("name")));
        let values = duplicates(items().filter_map(|item| number::<i32>(item.attr("value")?)));
        let name = names.first().map(|it| format!("has the item \"{it}\" more than once"));
        name.or_else(|| {
            values.first().map(|it| format!("has more than one item with the value {it}"))
        })
    })
}

/// The type element of a variable.
fn type_element<'a>(variable: Node<'a, 'a>) -> Option<Node<'a, 'a>> {
    variable.children().find(|child| child.is_element() && !child.is("Annotations"))
}

fn declared(subject: &Subject) -> Vec<String> {
    let types = types(subject);
    let mut undefined: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    let mut found = Vec::new();
    for variable in subject.elements("ScalarVariable") {
        let Some(element) = type_element(variable) else { continue };
        let Some(name) = element.attr("declaredType") else { continue };
        let Some(declared) = types.get(name) else {
            undefined.entry(name).or_default().push(variable.attr("name").unwrap_or_default());
            continue;
        };
        let (is, of) = (declared.tag_name().name(), element.tag_name().name());
        if is != of {
            let text = format!("is of type {of}, but its declared type \"{name}\" is {is}");
            found.push(subject.about(variable, &text));
        }
    }
    let message = |(name, users): (&str, Vec<&str>)| {
        format!("the type \"{name}\" of {} is not defined", several(&users))
    };
    found.extend(undefined.into_iter().map(message));
    found
}
