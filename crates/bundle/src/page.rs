//! The page about a bundle in its archive.

use std::fmt::Write as _;

use bundle_table::{Limits, Table};
use indexmap::IndexMap;
use master::Setup;
use results::summary::AccuracyReport;

use crate::contents::Inner;

/// The part of the page that says what is inside, as HTML.
pub(crate) fn text(
    setup: &Setup,
    units: &IndexMap<String, Inner>,
    table: &Table,
    chosen: Option<&AccuracyReport>,
) -> String {
    let (system, scenario) = (setup.system(), setup.scenario());
    let mut html = String::new();
    // writing to a String cannot fail, also below
    let _ = write!(
        html,
        "<p>{}</p>\n<p>This unit contains {} instances of {} units with {} connections, and the master that steps them: \
         algorithm <code>{}</code>, communication step {} s. Steps of the importer may be any multiple of it{}.</p>\n",
        escape(&scenario.description),
        system.instances.len(),
        units.len(),
        system.links.len(),
        scenario.algorithm.name.as_str(),
        table.step,
        match table.limits.variable_step {
            None => ", and other steps too: the last step inside is then shorter",
            Some(_) => "",
        }
    );
    if let Some(chosen) = chosen {
        let _ = writeln!(
            html,
            "<p>The scenario asks for an accuracy of {:e}. {}</p>",
            chosen.wanted,
            escape(&accuracy(chosen))
        );
    }
    html.push_str(
        "<table><tr><th>Unit</th><th>Instances</th><th>Version</th><th>Licence</th><th>Documentation</th></tr>\n",
    );
    for (key, unit) in units {
        let members: Vec<&str> = (system.instances.iter())
            .filter(|it| it.unit == *key)
            .map(|it| it.name.as_str())
            .collect();
        let Some(first) = system.instances.iter().find(|it| it.unit == *key) else { continue };
        let description = first.description();
        let names = match members[..] {
            [first, .., last] if members.len() > 3 => {
                format!("{first} … {last} ({})", members.len())
            }
            _ => members.join(", "),
        };
        let page = "documentation/index.html";
        let link = match unit.files.contains_key(page) {
            true => format!("<a href=\"units/{}/index.html\">page</a>", unit.folder),
            false => String::new(),
        };
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{link}</td></tr>",
            escape(&description.model_name),
            escape(&names),
            escape(description.version.as_deref().unwrap_or_default()),
            escape(description.license.as_deref().unwrap_or_default()),
        );
    }
    html.push_str("</table>\n");
    let limits = sentences(&table.limits);
    if !limits.is_empty() {
        html.push_str("<p>What it cannot do, and why:</p>\n<ul>\n");
        for limit in limits {
            let _ = writeln!(html, "<li>{}</li>", escape(&limit));
        }
        html.push_str("</ul>\n");
    }
    html
}

/// How the step inside was chosen, and what the user of a bundle must know about it.
pub(crate) fn accuracy(chosen: &AccuracyReport) -> String {
    format!(
        "{} It was chosen when the unit was packed, from the scenario's recorded signals, with its parameters and with \
         inputs at their start values: other values may need a smaller step.",
        chosen.explanation
    )
}

/// Missing capabilities in words.
pub(crate) fn sentences(limits: &Limits) -> Vec<String> {
    [
        (&limits.variable_step, "its steps must be multiples of the step inside"),
        (&limits.states, "its state cannot be saved"),
        (&limits.instances, "a process can have one instance only"),
        (&limits.alone, "it needs another program"),
    ]
    .into_iter()
    .filter_map(|(why, what)| why.as_ref().map(|why| format!("{what}: {why}")))
    .collect()
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
