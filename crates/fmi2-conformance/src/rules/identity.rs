//! Rules on names, version and default experiment of an FMU (FMI 2.0.5, sections 2.1.1, 2.2.1 and 2.2.4 to 2.2.6).

use roxmltree::Node;

use super::subject::{Subject, duplicates, table};
use fmi2_import::xml::{Plain as _, number};

table! {
    "fmi-version", "2.2.1", Error, "fmiVersion is 2.0", version;
    "co-simulation", "2.2.1", Error, "the FMU supports co-simulation", co_simulation;
    "interface-once", "2.2.1", Error, "ModelExchange and CoSimulation occur at most once", once;
    "guid", "2.2.1", Error, "the GUID is not empty", guid;
    "model-name", "2.2.1", Warning, "the modelName is not empty", model_name;
    "model-identifier", "2.1.1", Error, "the modelIdentifier is a C identifier", identifier;
    "model-identifier-length", "2.1.1", Note, "the modelIdentifier is short enough for a file name", length;
    "generation-date", "2.2.1", Note, "generationDateAndTime is in UTC, as YYYY-MM-DDThh:mm:ssZ", date;
    "log-categories", "2.2.4", Error, "log categories have different names", log_categories;
    "experiment-interval", "2.2.5", Error, "the default experiment does not stop before it starts", interval;
    "experiment-value", "2.2.5", Error, "tolerance and stepSize of the default experiment are positive", positive;
    "experiment-step", "2.2.5", Warning, "the stepSize of the default experiment does not exceed its interval", step;
    "annotations", "2.2.6", Error, "a list of annotations has at most one entry per tool", annotations;
}

/// Longest modelIdentifier that leaves room for folders in a path of 260 characters.
const LONGEST_IDENTIFIER: usize = 55;

/// An attribute of the root.
fn root<'a>(subject: &Subject<'a>, attribute: &str) -> Option<&'a str> {
    subject.elements("fmiModelDescription").next()?.attr(attribute)
}

fn version(subject: &Subject) -> Vec<String> {
    let other = root(subject, "fmiVersion").filter(|version| *version != "2.0");
    other
        .map(|version| format!("fmiVersion is \"{version}\", but must be \"2.0\""))
        .into_iter()
        .collect()
}

fn co_simulation(subject: &Subject) -> Vec<String> {
    let Some(root) = subject.elements("fmiModelDescription").next() else { return Vec::new() };
    // an unknown element is a finding of `schema-element`
    let unknown = |child: &Node| child.is_element() && subject.reading.is_unknown(*child);
    let offered = subject.elements("CoSimulation").next().is_some();
    if !offered && !root.children().any(|child| unknown(&child)) {
        vec!["there is no <CoSimulation>: the FMU does not support co-simulation".to_owned()]
    } else {
        Vec::new()
    }
}

fn once(subject: &Subject) -> Vec<String> {
    ["ModelExchange", "CoSimulation"]
        .into_iter()
        .filter(|name| subject.elements(name).count() > 1)
        .map(|name| format!("<{name}> occurs more than once; importers use the first or the last"))
        .collect()
}

fn guid(subject: &Subject) -> Vec<String> {
    let empty = root(subject, "guid").is_some_and(|guid| guid.trim().is_empty());
    if empty { vec!["the guid is empty".to_owned()] } else { Vec::new() }
}

fn model_name(subject: &Subject) -> Vec<String> {
    let empty = root(subject, "modelName").is_some_and(|name| name.trim().is_empty());
    if empty { vec!["the modelName is empty".to_owned()] } else { Vec::new() }
}

fn identifier(subject: &Subject) -> Vec<String> {
    let check = |node: Node| {
        let identifier = node.attr("modelIdentifier")?;
        let mut letters = identifier.chars();
        let head = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
        let sound = head && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
        (!sound)
            .then(|| format!("has modelIdentifier=\"{identifier}\", which is not a C identifier"))
    };
    let interfaces = ["ModelExchange", "CoSimulation"];
    interfaces.into_iter().flat_map(|name| subject.each_element(name, check)).collect()
}

fn length(subject: &Subject) -> Vec<String> {
    subject.each_element("CoSimulation", |node| {
        let length = node.attr("modelIdentifier")?.len();
        (length > LONGEST_IDENTIFIER).then(|| {
            format!("has a modelIdentifier of {length} characters, which is more than {LONGEST_IDENTIFIER}")
        })
    })
}

fn date(subject: &Subject) -> Vec<String> {
    let local = root(subject, "generationDateAndTime")
        .filter(|date| !(date.len() == 20 && date.ends_with('Z')));
    local
        .map(|date| {
            format!("generationDateAndTime=\"{date}\" is not in UTC as YYYY-MM-DDThh:mm:ssZ")
        })
        .into_iter()
        .collect()
}

fn log_categories(subject: &Subject) -> Vec<String> {
    let names = subject.elements("Category").filter_map(|node| node.attr("name"));
    duplicates(names)
        .iter()
        .map(|name| format!("there are two log categories \"{name}\""))
        .collect()
}

/// A number of the default experiment.
fn experiment(subject: &Subject, attribute: &str) -> Option<f64> {
    subject.elements("DefaultExperiment").next()?.attr(attribute).and_then(number)
}

fn interval(subject: &Subject) -> Vec<String> {
    let start = experiment(subject, "startTime").unwrap_or(0.0);
    let stop = experiment(subject, "stopTime");
    if !start.is_finite() || stop.is_some_and(|stop| !stop.is_finite()) {
        return vec!["startTime and stopTime must be finite".to_owned()];
    }
    let early = stop.filter(|stop| *stop < start);
    let text = |stop| format!("stopTime {stop} is before startTime {start}");
    early.map(text).into_iter().collect()
}

fn positive(subject: &Subject) -> Vec<String> {
    ["stepSize", "tolerance"]
        .into_iter()
        .filter_map(|name| Some((name, experiment(subject, name)?)))
        .filter(|(_, value)| !(*value > 0.0 && value.is_finite()))
        .map(|(name, value)| format!("{name} is {value}, which is not positive"))
        .collect()
}

fn step(subject: &Subject) -> Vec<String> {
    let start = experiment(subject, "startTime").unwrap_or(0.0);
    match (experiment(subject, "stopTime"), experiment(subject, "stepSize")) {
        (Some(stop), Some(step)) if stop > start && step > stop - start => {
            vec![format!("stepSize {step} exceeds the interval from {start} to {stop}")]
        }
        _ => Vec::new(),
    }
}

fn annotations(subject: &Subject) -> Vec<String> {
    let lists = ["VendorAnnotations", "Annotations"].map(|name| subject.elements(name));
    let mut found = Vec::new();
    for list in lists.into_iter().flatten() {
        let tools = list.children().filter(|child| child.is("Tool"));
        for name in duplicates(tools.filter_map(|tool| tool.attr("name"))) {
            found.push(subject.about(list, &format!("lists the tool \"{name}\" more than once")));
        }
    }
    found
}
