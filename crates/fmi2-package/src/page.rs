//! The page in a unit, `documentation/index.html`: made from its description, a text and pictures. It needs no network.

use std::fmt::Write as _;

use roxmltree::{Document, Node};

use crate::Error;

const STYLE: &str = include_str!("page.css");

/// Where the text of a page begins, and what follows it.
const TEXT: &str = "<h2 id=\"model\">What it computes</h2>\n";
const VARIABLES: &str = "<h2 id=\"variables\">Variables</h2>\n";

/// What a page shows in addition to the description, as HTML. An empty part is left out.
#[derive(Debug, Clone, Copy, Default)]
pub struct PageParts<'a> {
    /// File name of the unit without `.fmu`.
    pub name: &'a str,
    /// The unit's picture (SVG).
    pub picture: &'a str,
    /// What the unit computes.
    pub text: &'a str,
    /// Its reference results.
    pub results: &'a str,
}

/// The page: what the unit computes, its variables, its capabilities, and its reference results.
///
/// # Errors
/// The text is not the description of a co-simulation unit.
pub fn page(description: &str, parts: PageParts<'_>) -> Result<String, Error> {
    let document =
        Document::parse(description).map_err(|error| Error::Description(error.to_string()))?;
    let root = document.root_element();
    let mut html = head(&root, parts)?;
    if !parts.text.is_empty() {
        html.push_str(TEXT);
        html.push_str(parts.text);
    }
    html.push_str(VARIABLES);
    variables(&mut html, &root)?;
    html.push_str("<h2 id=\"capabilities\">Capabilities</h2>\n<table><tr><th>Attribute</th><th>Value</th></tr>\n");
    for capability in child(&root, "CoSimulation")?.attributes() {
        let (name, value) = (capability.name(), escape(capability.value()));
        // writing to a String cannot fail, also below
        let _ = writeln!(html, "<tr><td><code>{name}</code></td><td>{value}</td></tr>");
    }
    html.push_str("</table>\n");
    if !parts.results.is_empty() {
        html.push_str("<h2 id=\"reference\">Reference results</h2>\n");
        html.push_str(parts.results);
    }
    html.push_str("</body></html>\n");
    Ok(html)
}

/// The part `text` of a page that [`page`] made; `None` for other pages, and for a page without it.
#[must_use]
pub fn text_of_page(page: &str) -> Option<&str> {
    let (_, rest) = page.split_once(TEXT)?;
    Some(rest.split_once(VARIABLES)?.0)
}

fn head(root: &Node<'_, '_>, parts: PageParts<'_>) -> Result<String, Error> {
    let title = escape(attribute(root, "modelName"));
    let identifier = escape(attribute(&child(root, "CoSimulation")?, "modelIdentifier"));
    let link = |shown: &str, id: &str, title: &str| match shown {
        "" => String::new(),
        _ => format!("<a href=\"#{id}\">{title}</a> "),
    };
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <style>\n{STYLE}</style></head><body>\n<header>{picture}<div><h1>{title}</h1>\n<p>{what}</p>\n\
         <p class=\"facts\">Unit <code>{name}</code>, version {version}, {licence}. FMI 2.0 for \
         co-simulation, model identifier <code>{identifier}</code>, GUID <code>{guid}</code>.</p>\n\
         <nav>{model}<a href=\"#variables\">Variables</a> \
         <a href=\"#capabilities\">Capabilities</a> {reference}\
         <a href=\"licenses/license.txt\">Licences</a></nav></div></header>\n",
        picture = parts.picture,
        what = escape(attribute(root, "description")),
        name = parts.name,
        version = escape(attribute(root, "version")),
        licence = escape(attribute(root, "license")),
        guid = escape(attribute(root, "guid")),
        model = link(parts.text, "model", "What it computes"),
        reference = link(parts.results, "reference", "Reference results"),
    ))
}

fn variables(html: &mut String, root: &Node<'_, '_>) -> Result<(), Error> {
    let all = child(root, "ModelVariables")?;
    for (causality, title) in [
        ("input", "Inputs"),
        ("output", "Outputs"),
        ("parameter", "Parameters"),
        ("calculatedParameter", "Calculated parameters"),
        ("local", "Constants and local variables"),
    ] {
        let mut rows: Vec<Row> = Vec::new();
        let of_kind = |v: &Node<'_, '_>| v.is_element() && causality_of(v) == causality;
        for row in all.children().filter(of_kind).filter_map(|v| Row::of(&v)) {
            match rows.iter_mut().find(|other| other.joins(&row)) {
                Some(other) => other.last = Some(row.name),
                None => rows.push(row),
            }
        }
        if !rows.is_empty() {
            table(html, title, &rows)?;
        }
    }
    Ok(())
}

/// A line of the table of variables; one for all variables that differ in their number only.
struct Row {
    name: String,
    /// Name of the last one, where there are several.
    last: Option<String>,
    /// For a name that ends in a number: the name without it, and the description with *k* instead.
    shared: Option<(String, String)>,
    cells: [String; 5],
}

impl Row {
    fn of(variable: &Node<'_, '_>) -> Option<Self> {
        let kind = variable.children().find(Node::is_element)?;
        let name = attribute(variable, "name").to_owned();
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let number = name[stem.len()..].parse::<u32>().ok().filter(|_| stem.ends_with('_'));
        let description = escape(attribute(variable, "description"));
        let shared = number.map(|number| (stem.to_owned(), numbered(&description, number)));
        let range = match (kind.attribute("min"), kind.attribute("max")) {
            (None, None) => String::new(),
            (min, max) => format!("{} … {}", min.unwrap_or("−∞"), max.unwrap_or("∞")),
        };
        let tunable =
            if variable.attribute("variability") == Some("tunable") { ", tunable" } else { "" };
        let cells = [
            format!("{}{tunable}", kind.tag_name().name()),
            escape(attribute(&kind, "start")),
            escape(attribute(&kind, "unit")),
            range,
            description,
        ];
        Some(Self { last: None, shared, cells, name })
    }

    fn joins(&self, other: &Self) -> bool {
        self.shared.is_some() && self.shared == other.shared && self.cells[..4] == other.cells[..4]
    }
}

/// A description with its first mention of `number` as a word replaced by *k*.
fn numbered(description: &str, number: u32) -> String {
    let word = number.to_string();
    let is_word = |&(at, _): &(usize, &str)| {
        let beside = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "._".contains(c));
        !beside(description[..at].chars().next_back())
            && !beside(description[at + word.len()..].chars().next().filter(|c| *c != '.'))
    };
    match description.match_indices(&word).find(is_word) {
        Some((at, _)) => {
            format!("{}<i>k</i>{}", &description[..at], &description[at + word.len()..])
        }
        None => description.to_owned(),
    }
}

fn table(html: &mut String, title: &str, rows: &[Row]) -> Result<(), Error> {
    let _ = writeln!(
        html,
        "<h3>{title}</h3>\n<table class=\"variables\"><tr><th>Name</th><th>Type</th><th>Start</th>\
         <th>Unit</th><th>Range</th><th>Description</th></tr>"
    );
    for Row { name, last, shared, cells: [cells @ .., description] } in rows {
        let _ = write!(html, "<tr><td><code>{}</code>", escape(name));
        let mut description = description;
        if let (Some(last), Some((_, of_all))) = (last, shared) {
            let _ = write!(html, " … <code>{}</code>", escape(last));
            description = of_all;
        }
        for cell in cells {
            let _ = write!(html, "</td><td>{}", unit_exponents(cell));
        }
        let _ = writeln!(html, "</td><td>{description}</td></tr>");
    }
    html.push_str("</table>\n");
    Ok(())
}

/// A unit of measure with its exponent as superscript.
fn unit_exponents(cell: &str) -> String {
    match cell {
        "m2" | "m/s2" | "s2" | "kg.m2" | "m3" => {
            let (base, exponent) = cell.split_at(cell.len() - 1);
            format!("{}<sup>{exponent}</sup>", base.replace('.', "·"))
        }
        other => other.to_owned(),
    }
}

fn child<'a, 'd>(node: &Node<'a, 'd>, name: &str) -> Result<Node<'a, 'd>, Error> {
    node.children()
        .find(|c| c.has_tag_name(name))
        .ok_or_else(|| Error::Description(format!("it has no {name}")))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invariant_the_text_of_a_page_is_found_again() {
        let xml = r#"<fmiModelDescription modelName="m"><CoSimulation modelIdentifier="m"/><ModelVariables/></fmiModelDescription>"#;
        let whole =
            page(xml, PageParts { name: "u", text: "<p>x</p>\n", ..PageParts::default() }).unwrap();
        assert_eq!(text_of_page(&whole), Some("<p>x</p>\n"));
        assert!(!whole.contains("#reference"), "{whole}");
        assert_eq!(text_of_page("<h1>another page</h1>"), None);
    }

    #[test]
    fn analytic_variables_that_differ_in_their_number_share_a_row() {
        let xml = r#"<fmiModelDescription modelName="m"><CoSimulation modelIdentifier="m"/><ModelVariables>
            <ScalarVariable name="gap_01" causality="input" description="Gap of magnet 1, 0.1 m at most"><Real unit="m"/></ScalarVariable>
            <ScalarVariable name="gap_02" causality="input" description="Gap of magnet 2, 0.1 m at most"><Real unit="m"/></ScalarVariable>
            <ScalarVariable name="gap_03" causality="input" description="Gap of magnet 3, 0.1 m at most"><Real unit="mm"/></ScalarVariable>
            <ScalarVariable name="car_1_roll_01" causality="input" description="car_1: roll at point 1"><Real unit="rad"/></ScalarVariable>
            <ScalarVariable name="car_1_roll_02" causality="input" description="car_1: roll at point 2"><Real unit="rad"/></ScalarVariable>
            <ScalarVariable name="speed" causality="input" description="a &lt; b"><Real unit="m/s2"/></ScalarVariable>
            </ModelVariables></fmiModelDescription>"#;
        let document = Document::parse(xml).unwrap();
        let mut html = String::new();
        variables(&mut html, &document.root_element()).unwrap();
        assert!(html.contains("<code>gap_01</code> … <code>gap_02</code>"), "{html}");
        assert!(html.contains("Gap of magnet <i>k</i>, 0.1 m at most"), "{html}");
        assert!(html.contains("<tr><td><code>gap_03</code></td>"), "{html}");
        assert!(html.contains("Gap of magnet 3, 0.1 m at most"), "{html}");
        assert!(html.contains("car_1: roll at point <i>k</i>"), "{html}");
        assert!(html.contains("a &lt; b") && html.contains("m/s<sup>2</sup>"), "{html}");
    }
}
