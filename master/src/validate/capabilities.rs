//! Rules on the capability flags (FMI 2.0.5, section 4.3.1).

use super::{Subject, table};
use crate::description::CoSimulation;

table! {
    "serialize", "4.3.1", Error, "serialization needs get and set of states", serialize;
    "execution-tool", "4.3.1", Note, "the unit runs without another program", execution_tool;
    "once-per-process", "4.3.1", Note, "the unit can have several instances in a process", once;
    "asynchronous", "4.3.1", Note, "steps end before fmi2DoStep returns", asynchronous;
    "multiple-set", "2.2.7", Error, "canHandleMultipleSetPerTimeInstant is for model exchange only", multiple_set;
    "reinit", "2.2.7", Error, "reinit is for states in model exchange only", reinit;
}

fn flag(subject: &Subject, raised: impl Fn(&CoSimulation) -> bool, text: &str) -> Vec<String> {
    let raised = subject.description.is_some_and(|description| raised(&description.co_simulation));
    if raised { vec![text.to_owned()] } else { Vec::new() }
}

fn serialize(subject: &Subject) -> Vec<String> {
    flag(
        subject,
        |it| it.can_serialize_fmu_state && !it.can_get_and_set_fmu_state,
        "canSerializeFMUstate without canGetAndSetFMUstate",
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

fn multiple_set(subject: &Subject) -> Vec<String> {
    if !only_co_simulation(subject) {
        return Vec::new();
    }
    subject.each_element("ScalarVariable", |node| {
        node.attribute("canHandleMultipleSetPerTimeInstant")
            .map(|_| "has canHandleMultipleSetPerTimeInstant".to_owned())
    })
}

fn reinit(subject: &Subject) -> Vec<String> {
    if !only_co_simulation(subject) {
        return Vec::new();
    }
    subject.each_element("Real", |node| {
        (node.attribute("reinit") == Some("true")).then(|| "has reinit".to_owned())
    })
}
