//! Rules on units of measurement and declared types (FMI 2.0.5, sections 2.2.2 and 2.2.3).

use roxmltree::Node;

use super::{Subject, doubled, table};

table! {
    "unit-duplicate", "2.2.2", Error, "units have different names", unit_names;
    "unit-base", "2.2.2", Warning, "every unit has a BaseUnit to convert by", unit_base;
    "unit-factor", "2.2.2", Error, "factors are finite and not zero, offsets finite", factor;
    "display-unit-duplicate", "2.2.2", Error, "display units of a unit have different names", display_names;
    "unit-defined", "2.2.7", Error, "every unit used is defined", unit_defined;
    "display-unit-defined", "2.2.7", Error, "every display unit used is defined for its unit", display_defined;
    "display-unit-alone", "2.2.3", Error, "a display unit comes with a unit", display_alone;
    "type-duplicate", "2.2.3", Error, "types have different names", type_names;
    "type-name", "2.2.3", Error, "no type is named as a variable", type_and_variable;
    "type-range", "2.2.3", Error, "a type's min does not exceed its max", type_range;
    "enumeration-items", "2.2.3", Error, "items of an enumeration differ in name and value", items;
    "declared-type", "2.2.7", Error, "declared types are defined, and for that kind of variable", declared;
    "type-widened", "2.2.7", Error, "a variable's range lies within its type's", widened;
}

fn each_unit(subject: &Subject, check: impl Fn(Node) -> Option<String>) -> Vec<String> {
    subject.each_element("Unit", check)
}

fn unit_names(subject: &Subject) -> Vec<String> {
    let names = subject.elements("Unit").filter_map(|node| node.attribute("name"));
    doubled(names).iter().map(|name| format!("the unit \"{name}\" is defined twice")).collect()
}

fn unit_base(subject: &Subject) -> Vec<String> {
    each_unit(subject, |node| {
        let based = node.children().any(|child| child.has_tag_name("BaseUnit"));
        (!based).then(|| "has no BaseUnit".to_owned())
    })
}

fn number(node: Node, attribute: &str) -> Option<f64> {
    match node.attribute(attribute)?.trim() {
        "INF" | "+INF" => Some(f64::INFINITY),
        "-INF" => Some(f64::NEG_INFINITY),
        text => text.parse().ok(),
    }
}

fn factor(subject: &Subject) -> Vec<String> {
    let object = |node: Node| {
        let factor = number(node, "factor").filter(|it| *it == 0.0 || !it.is_finite());
        let offset = number(node, "offset").filter(|it| !it.is_finite());
        factor
            .map(|it| format!("has the factor {it}"))
            .or_else(|| offset.map(|it| format!("has the offset {it}")))
    };
    let mut found = subject.each_element("BaseUnit", object);
    found.extend(subject.each_element("DisplayUnit", object));
    found
}

fn display_names(subject: &Subject) -> Vec<String> {
    each_unit(subject, |node| {
        let names = node.children().filter(|child| child.has_tag_name("DisplayUnit"));
        let twice = doubled(names.filter_map(|child| child.attribute("name")));
        twice.first().map(|name| format!("has the display unit \"{name}\" twice"))
    })
}

/// The type that a variable's type element declares.
fn declared_element<'a>(subject: &Subject<'a>, element: Node) -> Option<Node<'a, 'a>> {
    let name = element.attribute("declaredType")?;
    subject
        .elements("SimpleType")
        .find(|node| node.attribute("name") == Some(name))?
        .children()
        .find(Node::is_element)
}

/// An attribute of a variable's type element, or else of its declared type.
fn inherited<'a>(subject: &Subject<'a>, element: Node<'a, 'a>, name: &str) -> Option<&'a str> {
    element.attribute(name).or_else(|| declared_element(subject, element)?.attribute(name))
}

/// Messages on the Reals, of variables and of types, that a check objects to.
fn each_real<'a>(
    subject: &Subject<'a>,
    check: impl Fn(Node<'a, 'a>) -> Option<String>,
) -> Vec<String> {
    subject
        .elements("Real")
        .filter_map(|node| {
            let text = check(node)?;
            Some(subject.about(node.parent_element().unwrap_or(node), &text))
        })
        .collect()
}

fn unit_defined(subject: &Subject) -> Vec<String> {
    each_real(subject, |real| {
        let unit = real.attribute("unit")?;
        let defined = subject.elements("Unit").any(|node| node.attribute("name") == Some(unit));
        (!defined).then(|| format!("has the unit \"{unit}\", which is not defined"))
    })
}

fn display_defined(subject: &Subject) -> Vec<String> {
    each_real(subject, |real| {
        let display = real.attribute("displayUnit")?;
        let unit = inherited(subject, real, "unit")?;
        let unit = subject.elements("Unit").find(|node| node.attribute("name") == Some(unit))?;
        let own = unit.attribute("name") == Some(display);
        let defined = own || unit.children().any(|child| child.attribute("name") == Some(display));
        (!defined).then(|| format!("has the display unit \"{display}\", which is not defined"))
    })
}

fn display_alone(subject: &Subject) -> Vec<String> {
    each_real(subject, |real| {
        let display = real.attribute("displayUnit")?;
        let alone = inherited(subject, real, "unit").is_none();
        alone.then(|| format!("has the display unit \"{display}\" without a unit"))
    })
}

fn type_names(subject: &Subject) -> Vec<String> {
    let names = subject.elements("SimpleType").filter_map(|node| node.attribute("name"));
    doubled(names).iter().map(|name| format!("the type \"{name}\" is defined twice")).collect()
}

fn type_and_variable(subject: &Subject) -> Vec<String> {
    subject.each_element("SimpleType", |node| {
        let name = node.attribute("name")?;
        let clash = subject.elements("ScalarVariable").any(|it| it.attribute("name") == Some(name));
        clash.then(|| "is also the name of a variable".to_owned())
    })
}

fn type_range(subject: &Subject) -> Vec<String> {
    subject.each_element("SimpleType", |node| {
        let element = node.children().find(Node::is_element)?;
        let (min, max) = (number(element, "min")?, number(element, "max")?);
        (min > max).then(|| format!("has min {min} above max {max}"))
    })
}

fn items(subject: &Subject) -> Vec<String> {
    subject.each_element("SimpleType", |node| {
        let items = || node.descendants().filter(|it| it.has_tag_name("Item"));
        let names = doubled(items().filter_map(|item| item.attribute("name")));
        let values = doubled(items().filter_map(|item| item.attribute("value")));
        let name = names.first().map(|it| format!("has the item \"{it}\" twice"));
        name.or_else(|| values.first().map(|it| format!("has two items of the value {it}")))
    })
}

/// The type element of a variable.
fn type_element<'a>(variable: Node<'a, 'a>) -> Option<Node<'a, 'a>> {
    variable.children().find(|child| child.is_element() && !child.has_tag_name("Annotations"))
}

fn declared(subject: &Subject) -> Vec<String> {
    subject.each_element("ScalarVariable", |node| {
        let element = type_element(node)?;
        let name = element.attribute("declaredType")?;
        let Some(declared) = declared_element(subject, element) else {
            return Some(format!("has the type \"{name}\", which is not defined"));
        };
        let (is, of) = (declared.tag_name().name(), element.tag_name().name());
        (is != of).then(|| format!("is {of}, but its type \"{name}\" is for {is}"))
    })
}

fn widened(subject: &Subject) -> Vec<String> {
    subject.each_element("ScalarVariable", |node| {
        let element = type_element(node)?;
        let declared = declared_element(subject, element)?;
        let wider = |name: &str, beyond: fn(f64, f64) -> bool| {
            let (own, lent) = (number(element, name)?, number(declared, name)?);
            beyond(own, lent).then(|| format!("has {name} {own}, outside of its type's {lent}"))
        };
        wider("min", |own, lent| own < lent).or_else(|| wider("max", |own, lent| own > lent))
    })
}
