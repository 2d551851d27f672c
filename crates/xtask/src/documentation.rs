//! The page that each unit carries: `documentation/index.html`, made from its description.

use std::fmt::Write;

use anyhow::{Context, Result};
use roxmltree::{Document, Node};

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:75em;padding:0 1em}\
table{border-collapse:collapse;width:100%}th,td{border-bottom:1px solid #ccc;padding:.25em .5em;\
text-align:left;vertical-align:top}td:nth-child(3),td:nth-child(5){white-space:nowrap}\
code{font-family:ui-monospace,monospace}";

/// The page: what the unit is, what it can do, and every variable.
pub fn page(xml: &str) -> Result<String> {
    let document = Document::parse(xml)?;
    let root = document.root_element();
    let name = attribute(&root, "modelName");
    let co_simulation = child(&root, "CoSimulation")?;
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\
         <style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n<p>{1}</p>\n<p>Version {2}, {3}. \
         FMI 2.0 co-simulation, model identifier <code>{4}</code>, GUID <code>{5}</code>.</p>\n",
        escape(name),
        escape(attribute(&root, "description")),
        escape(attribute(&root, "version")),
        escape(attribute(&root, "license")),
        escape(attribute(&co_simulation, "modelIdentifier")),
        escape(attribute(&root, "guid")),
    );
    html.push_str("<h2>Capabilities</h2>\n<table><tr><th>Attribute</th><th>Value</th></tr>\n");
    for capability in co_simulation.attributes().filter(|a| a.name() != "modelIdentifier") {
        writeln!(
            html,
            "<tr><td><code>{}</code></td><td>{}</td></tr>",
            capability.name(),
            escape(capability.value())
        )?;
    }
    html.push_str("</table>\n");
    let variables = child(&root, "ModelVariables")?;
    for (causality, title) in [
        ("input", "Inputs"),
        ("output", "Outputs"),
        ("parameter", "Parameters"),
        ("calculatedParameter", "Calculated parameters"),
        ("local", "Constants and local variables"),
    ] {
        let rows: Vec<_> = variables
            .children()
            .filter(|v| v.is_element() && causality_of(v) == causality)
            .collect();
        if !rows.is_empty() {
            table(&mut html, title, &rows)?;
        }
    }
    html.push_str("</body></html>\n");
    Ok(html)
}

fn table(html: &mut String, title: &str, rows: &[Node]) -> Result<()> {
    writeln!(
        html,
        "<h2>{title}</h2>\n<table><tr><th>Name</th><th>Type</th><th>Start</th><th>Unit</th>\
         <th>Range</th><th>Description</th></tr>"
    )?;
    for row in rows {
        let Some(kind) = row.children().find(Node::is_element) else { continue };
        let range = match (kind.attribute("min"), kind.attribute("max")) {
            (None, None) => String::new(),
            (min, max) => format!("{} … {}", min.unwrap_or("−∞"), max.unwrap_or("∞")),
        };
        writeln!(
            html,
            "<tr><td><code>{}</code></td><td>{}{}</td><td>{}</td><td>{}</td><td>{range}</td>\
             <td>{}</td></tr>",
            escape(attribute(row, "name")),
            kind.tag_name().name(),
            if row.attribute("variability") == Some("tunable") { ", tunable" } else { "" },
            escape(attribute(&kind, "start")),
            escape(attribute(&kind, "unit")),
            escape(attribute(row, "description")),
        )?;
    }
    html.push_str("</table>\n");
    Ok(())
}

fn child<'a, 'd>(node: &Node<'a, 'd>, name: &str) -> Result<Node<'a, 'd>> {
    node.children()
        .find(|c| c.has_tag_name(name))
        .with_context(|| format!("the description has no {name}"))
}

fn attribute<'a>(node: &Node<'a, '_>, name: &str) -> &'a str {
    node.attribute(name).unwrap_or("")
}

/// FMI 2.0's default causality is local.
fn causality_of<'a>(variable: &Node<'a, '_>) -> &'a str {
    variable.attribute("causality").unwrap_or("local")
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
