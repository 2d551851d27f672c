//! Rules on causality, variability, initial and derivatives of variables (FMI 2.0.5, section
//! 2.2.7).

use roxmltree::Node;
use serde::Serialize;

use super::subject::{Subject, several, table};
use fmi2_import::description::{Causality, Initial, Type, Variability};
use fmi2_import::xml::{Plain as _, number};

table! {
    "variability-type", "2.2.7", Error, "only a Real is continuous", continuous_type;
    "variability-missing", "2.2.7", Error, "variables that are not Real declare their variability", missing;
    "causality-variability", "2.2.7", Error, "the combination of causality and variability is allowed", variability;
    "initial", "2.2.7", Error, "initial is allowed for causality and variability", initial;
    "independent-once", "2.2.7", Error, "at most one variable is independent", independent;
    "independent-type", "2.2.7", Error, "the independent variable is a Real", independent_type;
    "derivative", "2.2.7", Error, "the attribute derivative refers to another Real", derivative;
    "derivative-discrete", "2.2.7", Warning, "the attribute derivative refers to a continuous variable", derivative_discrete;
    "state-causality", "2.2.7", Error, "states are outputs or locals", state_causality;
}

/// A value as the description writes it.
fn word(value: impl Serialize) -> String {
    let json = serde_json::to_value(value).unwrap_or_default();
    json.as_str().unwrap_or_default().to_owned()
}

fn continuous_type(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        (variable.variability == Variability::Continuous && variable.kind != Type::Real)
            .then(|| format!("is of type {}, which cannot be continuous", variable.kind))
    })
}

fn missing(subject: &Subject) -> Vec<String> {
    subject.each_element("ScalarVariable", |node| {
        let real = node.children().any(|child| child.is("Real"));
        (!real && node.attr("variability").is_none())
            .then(|| "has no variability; the default is for Reals only".to_owned())
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
            let (causality, variability) = (word(variable.causality), word(variable.variability));
            format!("has causality {causality} with variability {variability}")
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
            let (causality, variability) = (word(variable.causality), word(variable.variability));
            let given = word(given);
            format!("has initial {given} with causality {causality} and variability {variability}")
        })
    })
}

fn independent(subject: &Subject) -> Vec<String> {
    let independent = subject.variables().filter(|(_, it)| it.causality == Causality::Independent);
    let names: Vec<&str> = independent.map(|(_, it)| it.name.as_str()).collect();
    if names.len() > 1 {
        vec![format!("more than one variable is independent: {}", several(&names))]
    } else {
        vec![]
    }
}

fn independent_type(subject: &Subject) -> Vec<String> {
    subject.each_variable(|variable| {
        let wrong = variable.causality == Causality::Independent && variable.kind != Type::Real;
        wrong.then(|| format!("is independent, but is of type {}, not Real", variable.kind))
    })
}

fn derivative(subject: &Subject) -> Vec<String> {
    let count = subject.elements("ScalarVariable").count();
    subject.each_element("ScalarVariable", |node| {
        let real = node.children().find(|child| child.is("Real"))?;
        let index: usize = number(real.attr("derivative")?)?;
        let Some(state) = subject.variable_node(index) else {
            return Some(format!(
                "is the derivative of variable {index}; the variables are 1 to {count}"
            ));
        };
        let name = state.attr("name").unwrap_or_default();
        if state == node {
            return Some("is the derivative of itself".to_owned());
        }
        let real = state.children().any(|child| child.is("Real"));
        (!real && !subject.reading.breaks(state))
            .then(|| format!("is the derivative of \"{name}\", which is not Real"))
    })
}

fn derivative_discrete(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    subject.each_variable(|variable| {
        let state = description.variables.get(variable.derivative_of?)?;
        let real = state.kind == Type::Real && state.name != variable.name;
        (real && state.variability != Variability::Continuous)
            .then(|| format!("is the derivative of \"{}\", which is not continuous", state.name))
    })
}

/// The states are the variables of which the listed ones are the derivatives.
fn state_causality(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let derivative = |node: Node| -> Option<usize> { number(node.attr("index")?) };
    let listed = subject
        .elements("Unknown")
        .filter(|node| node.parent_element().is_some_and(|list| list.is("Derivatives")))
        .filter_map(derivative);
    let state = |index: usize| {
        let derivative = description.variables.get(index.checked_sub(1)?)?;
        description.variables.get(derivative.derivative_of?)
    };
    listed
        .filter_map(state)
        .filter(|state| !matches!(state.causality, Causality::Output | Causality::Local))
        .map(|state| {
            format!("the state \"{}\" has causality {}", state.name, word(state.causality))
        })
        .collect()
}
