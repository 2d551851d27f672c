//! Rules on what a unit calls itself (FMI 2.0.5, sections 2.1.1, 2.2.1 and 2.2.4 to 2.2.6).

use super::{Subject, doubled, table};

table! {
    "fmi-version", "2.2.1", Error, "fmiVersion is 2.0", version;
    "co-simulation", "2.2.1", Error, "the unit offers co-simulation", co_simulation;
    "readable", "2.2", Error, "the description is complete enough to run the unit", readable;
    "guid", "2.2.1", Error, "the GUID is not empty", guid;
    "model-name", "2.2.1", Warning, "the model's name is not empty", model_name;
    "model-identifier", "2.1.1", Error, "the modelIdentifier is a C identifier", identifier;
    "model-identifier-length", "2.1.1", Note, "the modelIdentifier is short, which file names need", length;
    "generation-date", "2.2.1", Warning, "generationDateAndTime is in UTC, with Z at its end", date;
    "log-categories", "2.2.4", Error, "log categories are not doubled", log_categories;
    "experiment-interval", "2.2.5", Error, "the default experiment's stop follows its start", interval;
    "experiment-value", "2.2.5", Error, "tolerance and step of the default experiment are positive", positive;
    "experiment-step", "2.2.5", Warning, "the default experiment's step fits into its interval", step;
    "annotations", "2.2.6", Error, "a tool has one VendorAnnotations entry", annotations;
}

/// Longest modelIdentifier that leaves room for folders in a path of 260 characters.
const LONGEST_IDENTIFIER: usize = 55;

/// An attribute of the root.
fn root<'a>(subject: &Subject<'a>, attribute: &str) -> Option<&'a str> {
    subject.elements("fmiModelDescription").next()?.attribute(attribute)
}

fn version(subject: &Subject) -> Vec<String> {
    let other = root(subject, "fmiVersion").filter(|version| *version != "2.0");
    other.map(|version| format!("fmiVersion is \"{version}\"")).into_iter().collect()
}

fn co_simulation(subject: &Subject) -> Vec<String> {
    let described = subject.elements("fmiModelDescription").next().is_some();
    if described && subject.elements("CoSimulation").next().is_none() {
        vec!["there is no <CoSimulation>: the unit is not for co-simulation".to_owned()]
    } else {
        Vec::new()
    }
}

fn readable(subject: &Subject) -> Vec<String> {
    if subject.document.is_none() || subject.description.is_some() {
        return Vec::new();
    }
    vec!["the description lacks what a run needs; see the other findings".to_owned()]
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
    subject.each_element("CoSimulation", |node| {
        let identifier = node.attribute("modelIdentifier")?;
        let mut letters = identifier.chars();
        let head = letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_');
        let sound = head && letters.all(|c| c.is_ascii_alphanumeric() || c == '_');
        (!sound).then(|| format!("has modelIdentifier=\"{identifier}\", which is no C identifier"))
    })
}

fn length(subject: &Subject) -> Vec<String> {
    subject.each_element("CoSimulation", |node| {
        let length = node.attribute("modelIdentifier")?.len();
        (length > LONGEST_IDENTIFIER).then(|| {
            format!("has a modelIdentifier of {length} characters, more than {LONGEST_IDENTIFIER}")
        })
    })
}

fn date(subject: &Subject) -> Vec<String> {
    let local = root(subject, "generationDateAndTime").filter(|date| !date.ends_with('Z'));
    local.map(|date| format!("generationDateAndTime=\"{date}\"")).into_iter().collect()
}

fn log_categories(subject: &Subject) -> Vec<String> {
    let names = subject.elements("Category").filter_map(|node| node.attribute("name"));
    doubled(names).iter().map(|name| format!("the log category \"{name}\" is twice")).collect()
}

/// A number of the default experiment.
fn experiment(subject: &Subject, attribute: &str) -> Option<f64> {
    subject.elements("DefaultExperiment").next()?.attribute(attribute)?.trim().parse().ok()
}

fn interval(subject: &Subject) -> Vec<String> {
    let start = experiment(subject, "startTime").unwrap_or(0.0);
    let stop = experiment(subject, "stopTime");
    let mut found = Vec::new();
    if stop.is_some_and(|stop| stop <= start) {
        let stop = stop.unwrap_or_default();
        found.push(format!("stopTime {stop} does not come after startTime {start}"));
    }
    if !start.is_finite() || stop.is_some_and(|stop| !stop.is_finite()) {
        found.push("startTime and stopTime must be finite".to_owned());
    }
    found
}

fn positive(subject: &Subject) -> Vec<String> {
    ["stepSize", "tolerance"]
        .into_iter()
        .filter_map(|name| Some((name, experiment(subject, name)?)))
        .filter(|(_, value)| !(*value > 0.0 && value.is_finite()))
        .map(|(name, value)| format!("{name} {value} is not positive"))
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
    let tools = subject.elements("Tool").filter(|node| {
        node.parent_element().is_some_and(|parent| parent.has_tag_name("VendorAnnotations"))
    });
    let names = tools.filter_map(|node| node.attribute("name"));
    doubled(names).iter().map(|name| format!("the tool \"{name}\" is listed twice")).collect()
}
