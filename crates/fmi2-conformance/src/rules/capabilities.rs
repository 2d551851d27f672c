//! Rules on the capability flags (FMI 2.0.5, section 4.3.1).

use roxmltree::Node;

use super::subject::{Subject, several, table};
use fmi2_import::description::CoSimulation;
use fmi2_import::xml::Plain as _;

table! {
    "serialize", "4.3.1", Error, "canSerializeFMUstate requires canGetAndSetFMUstate", serialize;
    "execution-tool", "4.3.1", Note, "the FMU runs without another program", execution_tool;
    "once-per-process", "4.3.1", Note, "the FMU can have several instances in a process", once;
    "asynchronous", "4.3.1", Note, "a step is complete when fmi2DoStep returns", asynchronous;
    "multiple-set", "2.2.7", Error, "canHandleMultipleSetPerTimeInstant is for model exchange only", multiple_set;
    "reinit", "2.2.7", Error, "reinit is for model exchange only", reinit;
}

fn flag(subject: &Subject, is_set: impl Fn(&CoSimulation) -> bool, text: &str) -> Vec<String> {
    let found = subject.description.is_some_and(|description| is_set(&description.co_simulation));
    if found { vec![text.to_owned()] } else { Vec::new() }
}

fn serialize(subject: &Subject) -> Vec<String> {
    flag(
        subject,
        |it| it.can_serialize_fmu_state && !it.can_get_and_set_fmu_state,
        "canSerializeFMUstate is true, but canGetAndSetFMUstate is not",
    )
}

fn execution_tool(subject: &Subject) -> Vec<String> {
    flag(subject, |it| it.needs_execution_tool, "needsExecutionTool is true")
}

fn once(subject: &Subject) -> Vec<String> {
    let text = "canBeInstantiatedOnlyOncePerProcess is true";
    flag(subject, |it| it.can_be_instantiated_only_once_per_process, text)
}

fn asynchronous(subject: &Subject) -> Vec<String> {
    flag(subject, |it| it.can_run_asynchronuously, "canRunAsynchronuously is true")
}

fn only_co_simulation(subject: &Subject) -> bool {
    subject.elements("ModelExchange").next().is_none()
}

/// One message for all variables with an attribute that is for model exchange only.
fn present(subject: &Subject, attribute: &str, has: impl Fn(Node) -> bool) -> Vec<String> {
    if !only_co_simulation(subject) {
        return Vec::new();
    }
    let variables = subject.elements("ScalarVariable").filter(|node| has(*node));
    let names: Vec<&str> = variables.filter_map(|node| node.attr("name")).collect();
    if names.is_empty() {
        return Vec::new();
    }
    vec![format!("{attribute} is for model exchange only, but given for {}", several(&names))]
}

fn multiple_set(subject: &Subject) -> Vec<String> {
    let name = "canHandleMultipleSetPerTimeInstant";
    present(subject, name, |node| node.attr(name).is_some())
}

fn reinit(subject: &Subject) -> Vec<String> {
    present(subject, "reinit", |node| {
        node.children().any(|child| child.is("Real") && child.attr("reinit").is_some())
    })
}
