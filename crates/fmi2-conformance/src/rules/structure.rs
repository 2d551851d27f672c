//! Rules on the model structure (FMI 2.0.5, section 2.2.8).

use std::collections::{BTreeSet, HashSet};

use roxmltree::Node;

use super::subject::{Subject, counted, doubled, several, table};
use fmi2_import::description::{Causality, Initial, ModelDescription, Type, Variability, Variable};
use fmi2_import::xml::{Plain as _, number, words};

table! {
    "structure-index", "2.2.8", Error, "indices refer to variables, counted from 1", index;
    "structure-duplicate", "2.2.8", Error, "no unknown is listed twice", duplicate;
    "outputs", "2.2.8", Error, "Outputs are exactly the outputs", outputs;
    "derivatives", "2.2.8", Error, "Derivatives are derivatives of continuous states", derivatives;
    "initial-unknowns", "2.2.8", Error, "InitialUnknowns are complete", initial_missing;
    "initial-unknowns-excess", "2.2.8", Error, "InitialUnknowns hold only unknowns", initial_excess;
    "initial-unknowns-order", "2.2.8", Error, "InitialUnknowns are sorted by index", initial_order;
    "dependencies-order", "2.2.8", Error, "dependencies are ascending, none twice", order;
    "dependencies-known", "2.2.8", Warning, "outputs and derivatives depend on inputs, states and time", known;
    "dependencies-known-initial", "2.2.8", Error, "in InitialUnknowns dependencies are inputs, time, or exact", known_initial;
    "dependencies-kind", "2.2.8", Error, "dependenciesKind has one word for each dependency", kinds;
    "dependencies-kind-initial", "2.2.8", Error, "in InitialUnknowns dependencies are dependent or constant", initial_kinds;
    "dependencies-kind-type", "2.2.8", Error, "only Reals depend by constant, fixed, tunable or discrete factors", kind_types;
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
        Some(words(self.node.attr("dependenciesKind")?).collect())
    }
}

/// The entries that the schema does not object to.
fn entries<'a>(subject: &Subject<'a>) -> impl Iterator<Item = Entry<'a>> {
    let sound = subject.elements("Unknown").filter(|node| !subject.reading.breaks(*node));
    sound.filter_map(|node| {
        let parent = node.parent_element()?;
        let list = LISTS.into_iter().find(|list| parent.is(list))?;
        let index = number(node.attr("index")?)?;
        let dependencies =
            node.attr("dependencies").map(|text| words(text).filter_map(number).collect());
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
        Some(format!("there is no variable {odd}, only 1 to {count}"))
    })
}

fn duplicate(subject: &Subject) -> Vec<String> {
    let twice = doubled(entries(subject).map(|entry| (entry.list, entry.index)));
    twice.iter().map(|(list, index)| format!("{list} lists variable {index} twice")).collect()
}

/// Indices from 1 in a list.
fn listed(subject: &Subject, list: &str) -> BTreeSet<usize> {
    entries(subject).filter(|entry| entry.list == list).map(|entry| entry.index).collect()
}

/// Indices from 1 of the variables that a test accepts.
fn all(subject: &Subject, test: impl Fn(&Variable) -> bool) -> BTreeSet<usize> {
    subject.variables().filter(|(_, variable)| test(variable)).map(|(index, _)| index).collect()
}

/// What a list should hold, as one message, and what it holds besides.
fn compared(
    subject: &Subject,
    list: &'static str,
    wanted: &BTreeSet<usize>,
) -> (Option<String>, BTreeSet<usize>) {
    // without a list, or in one that breaks the schema, the schema's rules say what is wrong
    let Some(structure) = subject.elements("ModelStructure").next() else {
        return (None, BTreeSet::new());
    };
    if subject.elements(list).any(|it| subject.reading.breaks(it)) {
        return (None, BTreeSet::new());
    }
    let listed = listed(subject, list);
    let lacks: Vec<&str> = wanted.difference(&listed).filter_map(|it| name(subject, *it)).collect();
    let why = if subject.elements(list).next().is_some() { "lists" } else { "has no" };
    let count = counted(lacks.len(), "variable");
    let text = match why {
        "lists" => format!("{list} lacks {count}: {}", several(&lacks)),
        _ => format!("there is no <{list}>, which {count} should be in: {}", several(&lacks)),
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
            return Some(format!("\"{}\" has no attribute derivative", variable.name));
        }
        let state = description.variables.get(variable.derivative_of?)?;
        let odd =
            [variable, state].into_iter().find(|it| it.variability != Variability::Continuous);
        odd.map(|it| format!("\"{}\" is not continuous", it.name))
    })
}

/// Derivatives that are listed, and their states: indices from 1.
fn exposed_states(subject: &Subject, description: &ModelDescription) -> BTreeSet<usize> {
    let derivatives = listed(subject, "Derivatives");
    let state = |index: &usize| Some(variable(description, *index)?.derivative_of? + 1);
    let states: Vec<usize> = derivatives.iter().filter_map(state).collect();
    derivatives.into_iter().chain(states).collect()
}

fn guessed(variable: &Variable) -> bool {
    matches!(variable.initial, Some(Initial::Calculated | Initial::Approx))
}

fn initial_wanted(subject: &Subject, description: &ModelDescription) -> BTreeSet<usize> {
    let states = exposed_states(subject, description);
    let mut wanted = all(subject, |variable| match variable.causality {
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
    compared(subject, "InitialUnknowns", &wanted).0.into_iter().collect()
}

fn initial_excess(subject: &Subject) -> Vec<String> {
    let Some(description) = subject.description else { return Vec::new() };
    let wanted = initial_wanted(subject, description);
    let (_, excess) = compared(subject, "InitialUnknowns", &wanted);
    let names = excess.into_iter().filter_map(|index| name(subject, index));
    let text = "which is not an unknown of the initialization";
    names.map(|name| format!("InitialUnknowns lists \"{name}\", {text}")).collect()
}

fn initial_order(subject: &Subject) -> Vec<String> {
    let list: Vec<usize> = entries(subject)
        .filter(|entry| entry.list == "InitialUnknowns")
        .map(|entry| entry.index)
        .collect();
    let turn = list.windows(2).find(|pair| pair[0] > pair[1]);
    turn.map(|pair| format!("InitialUnknowns lists {} before {}", pair[0], pair[1]))
        .into_iter()
        .collect()
}

fn order(subject: &Subject) -> Vec<String> {
    each_entry(subject, |entry| {
        let list = entry.dependencies.as_ref()?;
        let turn = list.windows(2).find(|pair| pair[0] >= pair[1])?;
        Some(if turn[0] == turn[1] {
            format!("the dependency {} is listed twice", turn[0])
        } else {
            format!("the dependency {} comes before {}", turn[0], turn[1])
        })
    })
}

/// Messages on entries of these lists that depend on a variable which a test does not accept.
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
            (!always && !accepts(index, variable))
                .then(|| format!("it depends on \"{}\", which is not a known", variable.name))
        })
    })
}

fn known_initial(subject: &Subject) -> Vec<String> {
    unknown(subject, &["InitialUnknowns"], |_, variable| variable.initial == Some(Initial::Exact))
}

/// Any variable that is said to have a derivative passes for a state.
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
        if subject.is_broken(entry.index) {
            return None;
        }
        let kind = entry.kinds()?.into_iter().find(|kind| *kind != "dependent")?;
        let kind_of = unknown.kind;
        (kind_of != Type::Real)
            .then(|| format!("the kind \"{kind}\" on a variable of type {kind_of}"))
    })
}
