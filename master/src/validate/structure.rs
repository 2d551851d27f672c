//! Rules on the model structure (FMI 2.0.5, section 2.2.8).

use std::collections::{BTreeSet, HashSet};

use roxmltree::Node;

use super::{Subject, doubled, table};
use crate::description::{Causality, Description, Initial, Type, Variable};

table! {
    "structure-index", "2.2.8", Error, "indices refer to variables, counted from 1", index;
    "structure-duplicate", "2.2.8", Error, "no unknown is listed twice", duplicate;
    "outputs", "2.2.8", Error, "Outputs are exactly the outputs", outputs;
    "derivatives", "2.2.8", Error, "Derivatives are derivatives of continuous states", derivatives;
    "initial-unknowns", "2.2.8", Warning, "InitialUnknowns are complete", initial_missing;
    "initial-unknowns-excess", "2.2.8", Error, "InitialUnknowns hold only unknowns", initial_excess;
    "initial-unknowns-order", "2.2.8", Error, "InitialUnknowns are sorted by index", initial_order;
    "dependencies-order", "2.2.8", Error, "dependencies are ascending, without doubles", order;
    "dependencies-known", "2.2.8", Error, "dependencies are knowns: inputs, states, or what is set before", known;
    "dependencies-kind", "2.2.8", Error, "dependenciesKind has one word for each dependency", kinds;
    "dependencies-kind-initial", "2.2.8", Error, "in InitialUnknowns dependencies are dependent or constant", initial_kinds;
    "dependencies-kind-type", "2.2.8", Warning, "only Reals depend by constant, fixed, tunable or discrete factors", kind_types;
}

const LISTS: [&str; 3] = ["Outputs", "Derivatives", "InitialUnknowns"];

/// An `<Unknown>` with the list that it is in, its variable and its dependencies.
struct Entry<'a> {
    list: &'static str,
    node: Node<'a, 'a>,
    index: usize,
    dependencies: Option<Vec<usize>>,
}

impl<'a> Entry<'a> {
    fn kinds(&self) -> Option<Vec<&'a str>> {
        Some(self.node.attribute("dependenciesKind")?.split_ascii_whitespace().collect())
    }
}

fn entries<'a>(subject: &Subject<'a>) -> impl Iterator<Item = Entry<'a>> + use<'a> {
    subject.elements("Unknown").filter_map(|node| {
        let parent = node.parent_element()?;
        let list = LISTS.into_iter().find(|list| parent.has_tag_name(*list))?;
        let index = node.attribute("index")?.trim().parse().ok()?;
        let dependencies = node.attribute("dependencies").map(|text| {
            text.split_ascii_whitespace().filter_map(|word| word.parse().ok()).collect()
        });
        Some(Entry { list, node, index, dependencies })
    })
}

/// Messages on the entries that a check objects to.
fn each_entry<'a>(
    subject: &Subject<'a>,
    check: impl Fn(&Entry<'a>) -> Option<String>,
) -> Vec<String> {
    entries(subject)
        .filter_map(|entry| {
            let text = check(&entry)?;
            let line = subject.line(entry.node);
            Some(format!("line {line}: {} of variable {}: {text}", entry.list, entry.index))
        })
        .collect()
}

fn variable(description: &Description, index: usize) -> Option<&Variable> {
    description.variables.get(index.checked_sub(1)?)
}

fn index(subject: &Subject) -> Vec<String> {
    let count = subject.elements("ScalarVariable").count();
    each_entry(subject, |entry| {
        let own = std::iter::once(&entry.index);
        let all = own.chain(entry.dependencies.iter().flatten());
        let odd = all.into_iter().find(|index| !(1..=count).contains(*index))?;
        Some(format!("{odd} is no variable; there are variables 1 to {count}"))
    })
}

fn duplicate(subject: &Subject) -> Vec<String> {
    let twice = doubled(entries(subject).map(|entry| (entry.list, entry.index)));
    twice.iter().map(|(list, index)| format!("{list} has variable {index} twice")).collect()
}

/// Indices from 1 in a list.
fn listed(subject: &Subject, list: &str) -> BTreeSet<usize> {
    entries(subject).filter(|entry| entry.list == list).map(|entry| entry.index).collect()
}

/// Indices from 1 of the variables that a test accepts.
fn all(description: &Description, test: impl Fn(&Variable) -> bool) -> BTreeSet<usize> {
    let numbered = description.variables.iter().enumerate();
    numbered.filter(|(_, variable)| test(variable)).map(|(index, _)| index + 1).collect()
}

fn names(description: &Description, indices: impl Iterator<Item = usize>) -> Vec<&str> {
    indices.filter_map(|it| variable(description, it)).map(|it| it.name.as_str()).collect()
}

fn outputs(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let wanted = all(description, |variable| variable.causality == Causality::Output);
    let listed = listed(subject, "Outputs");
    let lacks = names(description, wanted.difference(&listed).copied());
    let excess = names(description, listed.difference(&wanted).copied());
    let lacks = lacks.into_iter().map(|name| format!("Outputs lack {name}"));
    let excess = excess.into_iter().map(|name| format!("Outputs list {name}, which is no output"));
    lacks.chain(excess).collect()
}

fn derivatives(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    each_entry(subject, |entry| {
        let variable = variable(description, entry.index)?;
        (entry.list == "Derivatives" && variable.derivative_of.is_none())
            .then(|| format!("\"{}\" has no attribute derivative", variable.name))
    })
}

/// Variables that Derivatives and their states are: indices from 1.
fn exposed_states(subject: &Subject, description: &Description) -> BTreeSet<usize> {
    let mut indices = listed(subject, "Derivatives");
    let states = names_of_states(description, &indices);
    indices.extend(states);
    indices
}

fn names_of_states(description: &Description, derivatives: &BTreeSet<usize>) -> Vec<usize> {
    let state = |index: &usize| Some(variable(description, *index)?.derivative_of? + 1);
    derivatives.iter().filter_map(state).collect()
}

fn guessed(variable: &Variable) -> bool {
    matches!(variable.initial, Some(Initial::Calculated | Initial::Approx))
}

fn initial_wanted(subject: &Subject, description: &Description) -> BTreeSet<usize> {
    let states = exposed_states(subject, description);
    let mut wanted = all(description, |variable| match variable.causality {
        Causality::Output => guessed(variable),
        Causality::CalculatedParameter => true,
        _ => false,
    });
    wanted.extend(
        states.into_iter().filter(|&index| variable(description, index).is_some_and(guessed)),
    );
    wanted
}

fn initial_missing(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let wanted = initial_wanted(subject, description);
    let listed = listed(subject, "InitialUnknowns");
    names(description, wanted.difference(&listed).copied())
        .into_iter()
        .map(|name| format!("InitialUnknowns lack {name}"))
        .collect()
}

fn initial_excess(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    // states and their derivatives may be exposed without <Derivatives>
    let state: HashSet<usize> =
        description.variables.iter().filter_map(|it| Some(it.derivative_of? + 1)).collect();
    let wanted = initial_wanted(subject, description);
    each_entry(subject, |entry| {
        let variable = variable(description, entry.index)?;
        let belongs = wanted.contains(&entry.index)
            || (guessed(variable)
                && (variable.derivative_of.is_some() || state.contains(&entry.index)));
        (entry.list == "InitialUnknowns" && !belongs)
            .then(|| format!("\"{}\" is no unknown of the initialization", variable.name))
    })
}

fn initial_order(subject: &Subject) -> Vec<String> {
    let list: Vec<usize> = entries(subject)
        .filter(|entry| entry.list == "InitialUnknowns")
        .map(|entry| entry.index)
        .collect();
    let turn = list.windows(2).find(|pair| pair[0] > pair[1]);
    turn.map(|pair| format!("InitialUnknowns have {} before {}", pair[0], pair[1]))
        .into_iter()
        .collect()
}

fn order(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let list = entry.dependencies.as_ref()?;
        let turn = list.windows(2).find(|pair| pair[0] >= pair[1])?;
        Some(format!("dependency {} comes before {}", turn[0], turn[1]))
    })
}

fn known(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let states: HashSet<usize> =
        description.variables.iter().filter_map(|it| Some(it.derivative_of? + 1)).collect();
    each_entry(subject, |entry| {
        let mut dependencies = entry.dependencies.iter().flatten();
        dependencies.find_map(|&index| {
            let variable = variable(description, index)?;
            let known = matches!(variable.causality, Causality::Input | Causality::Independent)
                || states.contains(&index)
                || (entry.list == "InitialUnknowns"
                    && (variable.initial == Some(Initial::Exact)
                        || variable.causality == Causality::Parameter));
            (!known).then(|| format!("it depends on \"{}\", which is no known", variable.name))
        })
    })
}

fn kinds(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let kinds = entry.kinds()?.len();
        let Some(dependencies) = &entry.dependencies else {
            return Some("dependenciesKind without dependencies".to_owned());
        };
        let count = dependencies.len();
        (kinds != count).then(|| format!("{kinds} kinds for {count} dependencies"))
    })
}

fn initial_kinds(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let kinds = entry.kinds().filter(|_| entry.list == "InitialUnknowns")?;
        let odd = kinds.into_iter().find(|kind| ["fixed", "tunable", "discrete"].contains(kind))?;
        Some(format!("the kind \"{odd}\" is for the time after the initialization"))
    })
}

fn kind_types(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    each_entry(subject, |entry| {
        let unknown = variable(description, entry.index)?;
        let kind = entry.kinds()?.into_iter().find(|kind| *kind != "dependent")?;
        let kind_of = unknown.kind;
        (kind_of != Type::Real)
            .then(|| format!("the kind \"{kind}\" on a variable of type {kind_of}"))
    })
}
