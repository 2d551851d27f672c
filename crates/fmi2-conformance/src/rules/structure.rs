//! Rules on the ModelStructure (FMI 2.0.5, section 2.2.8).

use std::collections::{BTreeSet, HashSet};

use roxmltree::Node;

use super::subject::{Subject, counted, duplicates, several, table};
use fmi2_import::description::{Causality, Initial, ModelDescription, Type, Variability, Variable};
use fmi2_import::xml::{Plain as _, number, words};

table! {
    "structure-index", "2.2.8", Error, "indices are those of variables, counted from 1", index;
    "structure-duplicate", "2.2.8", Error, "an unknown is listed at most once", duplicate;
    "outputs", "2.2.8", Error, "Outputs lists exactly the outputs", outputs;
    "derivatives", "2.2.8", Error, "Derivatives lists only derivatives of continuous states", derivatives;
    "initial-unknowns", "2.2.8", Error, "InitialUnknowns is complete", initial_missing;
    "initial-unknowns-excess", "2.2.8", Error, "InitialUnknowns lists only unknowns", initial_excess;
    "initial-unknowns-order", "2.2.8", Error, "InitialUnknowns is sorted by index", initial_order;
    "dependencies-order", "2.2.8", Error, "dependencies are in ascending order, without duplicates", order;
    "dependencies-known", "2.2.8", Warning, "outputs and derivatives depend only on inputs, states and time", known;
    "dependencies-known-initial", "2.2.8", Error, "unknowns in InitialUnknowns depend only on inputs, time and variables with initial=exact", known_initial;
    "dependencies-kind", "2.2.8", Error, "dependenciesKind has one word per dependency", kinds;
    "dependencies-kind-initial", "2.2.8", Error, "in InitialUnknowns the kind of a dependency is dependent or constant", initial_kinds;
    "dependencies-kind-type", "2.2.8", Error, "only Reals have dependencies of the kind constant, fixed, tunable or discrete", kind_types;
}

const LISTS: [&str; 3] = ["Outputs", "Derivatives", "InitialUnknowns"];

/// An `<Unknown>` element: its list, its variable and its dependencies.
struct Unknown<'a> {
    list: &'static str,
    node: Node<'a, 'a>,
    index: usize,
    dependencies: Option<Vec<usize>>,
}

impl<'a> Unknown<'a> {
    fn kinds(&self) -> Option<Vec<&'a str>> {
        Some(words(self.node.attr("dependenciesKind")?).collect())
    }
}

/// The `<Unknown>` elements without those that violate the schema.
fn entries<'a>(subject: &Subject<'a>) -> impl Iterator<Item = Unknown<'a>> {
    let sound = subject.elements("Unknown").filter(|node| !subject.reading.breaks(*node));
    sound.filter_map(|node| {
        let parent = node.parent_element()?;
        let list = LISTS.into_iter().find(|list| parent.is(list))?;
        let index = number(node.attr("index")?)?;
        let dependencies =
            node.attr("dependencies").map(|text| words(text).filter_map(number).collect());
        Some(Unknown { list, node, index, dependencies })
    })
}

/// Messages for the `<Unknown>` elements for which a check returns a text.
fn each_entry<'a>(
    subject: &Subject<'a>,
    check: impl Fn(&Unknown<'a>) -> Option<String>,
) -> Vec<String> {
    entries(subject)
        .filter_map(|entry| {
            let text = check(&entry)?;
            let line = subject.line(entry.node);
            Some(format!("line {line}: variable {} in {}: {text}", entry.index, entry.list))
        })
        .collect()
}

fn variable(description: &ModelDescription, index: usize) -> Option<&Variable> {
    description.variables.get(index.checked_sub(1)?)
}

fn index(subject: &Subject) -> Vec<String> {
    let count = subject.elements("ScalarVariable").count();
    each_entry(subject, |entry| {
        let own = std::iter::once(&entry.index);
        let all = own.chain(entry.dependencies.iter().flatten());
        let odd = all.into_iter().find(|index| !(1..=count).contains(*index))?;
        Some(format!("there is no variable {odd}; the variables are 1 to {count}"))
    })
}

fn duplicate(subject: &Subject) -> Vec<String> {
    let twice = duplicates(entries(subject).map(|entry| (entry.list, entry.index)));
    twice
        .iter()
        .map(|(list, index)| format!("{list} lists variable {index} more than once"))
        .collect()
}

/// The indices in a list, from 1.
fn listed(subject: &Subject, list: &str) -> BTreeSet<usize> {
    entries(subject).filter(|entry| entry.list == list).map(|entry| entry.index).collect()
}

/// The indices of the variables that satisfy a condition, from 1.
fn all(subject: &Subject, test: impl Fn(&Variable) -> bool) -> BTreeSet<usize> {
    subject.variables().filter(|(_, variable)| test(variable)).map(|(index, _)| index).collect()
}

/// A message on variables that are missing in a list, and the indices of those that do not belong there.
fn compared(
    subject: &Subject,
    list: &'static str,
    wanted: &BTreeSet<usize>,
) -> (Option<String>, BTreeSet<usize>) {
    // violations of the schema are findings of its own rules
    let Some(structure) = subject.elements("ModelStructure").next() else {
        return (None, BTreeSet::new());
    };
    if subject.elements(list).any(|it| subject.reading.breaks(it)) {
        return (None, BTreeSet::new());
    }
    let listed = listed(subject, list);
    let lacks: Vec<&str> = wanted.difference(&listed).filter_map(|it| name(subject, *it)).collect();
    let count = counted(lacks.len(), "variable");
    let text = if subject.elements(list).next().is_some() {
        format!("{list} does not list {count}: {}", several(&lacks))
    } else {
        format!("there is no <{list}>, which must list {count}: {}", several(&lacks))
    };
    let line = subject.line(structure);
    let excess = listed.difference(wanted).copied().filter(|it| !subject.is_broken(*it)).collect();
    ((!lacks.is_empty()).then(|| format!("line {line}: {text}")), excess)
}

fn name<'a>(subject: &Subject<'a>, index: usize) -> Option<&'a str> {
    variable(subject.description?, index).map(|variable| variable.name.as_str())
}

fn outputs(subject: &Subject) -> Vec<String> {
    if subject.description.is_none() {
        return Vec::new();
    }
    let wanted = all(subject, |variable| variable.causality == Causality::Output);
    let (lacks, excess) = compared(subject, "Outputs", &wanted);
    let excess = excess.into_iter().filter_map(|index| name(subject, index));
    let excess = excess.map(|name| format!("Outputs lists \"{name}\", which is not an output"));
    lacks.into_iter().chain(excess).collect()
}

fn derivatives(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    each_entry(subject, |entry| {
        let variable =
            variable(description, entry.index).filter(|_| entry.list == "Derivatives")?;
        let node = subject.variable_node(entry.index)?;
        let given = node.children().any(|child| child.attr("derivative").is_some());
        if !given {
            return Some(format!("\"{}\" does not have the attribute derivative", variable.name));
        }
        let state = description.variables.get(variable.derivative_of?)?;
        let odd =
            [variable, state].into_iter().find(|it| it.variability != Variability::Continuous);
        odd.map(|it| format!("\"{}\" is not continuous", it.name))
    })
}

/// The listed derivatives and their states, as indices from 1.
fn exposed_states(subject: &Subject, description: &ModelDescription) -> BTreeSet<usize> {
    let derivatives = listed(subject, "Derivatives");
    let state = |index: &usize| Some(variable(description, *index)?.derivative_of? + 1);
    let states: Vec<usize> = derivatives.iter().filter_map(state).collect();
    derivatives.into_iter().chain(states).collect()
}

fn is_unknown(variable: &Variable) -> bool {
    matches!(variable.initial, Some(Initial::Calculated | Initial::Approx))
}

fn initial_wanted(subject: &Subject, description: &ModelDescription) -> BTreeSet<usize> {
    let states = exposed_states(subject, description);
    let mut wanted = all(subject, |variable| match variable.causality {
        Causality::Output => is_unknown(variable),
        Causality::CalculatedParameter => true,
        _ => false,
    });
    wanted.extend(
        states.into_iter().filter(|&index| variable(description, index).is_some_and(is_unknown)),
    );
    wanted
}

fn initial_missing(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let wanted = initial_wanted(subject, description);
    compared(subject, "InitialUnknowns", &wanted).0.into_iter().collect()
}

fn initial_excess(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let wanted = initial_wanted(subject, description);
    let (_, excess) = compared(subject, "InitialUnknowns", &wanted);
    let names = excess.into_iter().filter_map(|index| name(subject, index));
    let text = "which is not an unknown during initialization";
    names.map(|name| format!("InitialUnknowns lists \"{name}\", {text}")).collect()
}

fn initial_order(subject: &Subject) -> Vec<String> {
    let list: Vec<usize> = entries(subject)
        .filter(|entry| entry.list == "InitialUnknowns")
        .map(|entry| entry.index)
        .collect();
    let turn = list.windows(2).find(|pair| pair[0] > pair[1]);
    turn.map(|pair| format!("InitialUnknowns lists variable {} before {}", pair[0], pair[1]))
        .into_iter()
        .collect()
}

fn order(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let list = entry.dependencies.as_ref()?;
        let turn = list.windows(2).find(|pair| pair[0] >= pair[1])?;
        Some(if turn[0] == turn[1] {
            format!("the dependency {} is listed more than once", turn[0])
        } else {
            format!("the dependency {} is listed before {}", turn[0], turn[1])
        })
    })
}

/// Messages for the unknowns in these lists that depend on a variable which is neither an input nor the time, nor
/// satisfies the condition.
fn unknown(
    subject: &Subject,
    lists: &[&str],
    accepts: impl Fn(usize, &Variable) -> bool,
) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    each_entry(subject, |entry| {
        let mut dependencies =
            entry.dependencies.iter().flatten().filter(|_| lists.contains(&entry.list));
        dependencies.find_map(|&index| {
            let variable = variable(description, index).filter(|_| !subject.is_broken(index))?;
            let always = matches!(variable.causality, Causality::Input | Causality::Independent);
            (!always && !accepts(index, variable)).then(|| {
                format!("it depends on \"{}\", on which it must not depend", variable.name)
            })
        })
    })
}

fn known_initial(subject: &Subject) -> Vec<String> {
    unknown(subject, &["InitialUnknowns"], |_, variable| variable.initial == Some(Initial::Exact))
}

/// Accepts as a state any variable of which another one is declared the derivative.
fn known(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let states: HashSet<usize> =
        description.variables.iter().filter_map(|it| Some(it.derivative_of? + 1)).collect();
    unknown(subject, &["Outputs", "Derivatives"], |index, _| states.contains(&index))
}

fn kinds(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let kinds = entry.kinds()?.len();
        let Some(dependencies) = &entry.dependencies else {
            return Some("there is a dependenciesKind, but no dependencies".to_owned());
        };
        let count = dependencies.len();
        (kinds != count).then(|| format!("there are {kinds} kinds for {count} dependencies"))
    })
}

fn initial_kinds(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let kinds = entry.kinds().filter(|_| entry.list == "InitialUnknowns")?;
        let odd = kinds.into_iter().find(|kind| ["fixed", "tunable", "discrete"].contains(kind))?;
        Some(format!("the kind \"{odd}\" applies only after initialization"))
    })
}

fn kind_types(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    each_entry(subject, |entry| {
        let unknown = variable(description, entry.index)?;
        if subject.is_broken(entry.index) {
            return None;
        }
        let kind = entry.kinds()?.into_iter().find(|kind| *kind != "dependent")?;
        let kind_of = unknown.kind;
        (kind_of != Type::Real).then(|| {
            format!("the kind \"{kind}\" is for Reals, but the variable is of type {kind_of}")
        })
    })
}
