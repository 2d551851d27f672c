//! The page in each unit, `documentation/index.html`: made from its description, a text with
//! equations (`fmu-*/documentation/text.md`) and its reference results.

use std::{fmt::Write as _, fs, path::Path};

use anyhow::{Context, Result, anyhow};
use fmi2_package::PageParts;
use pulldown_cmark::{Event, Options, Parser, Tag, TagEnd, html};
use pulldown_latex::{RenderConfig, Storage, config::DisplayMode, mathml::push_mathml};

/// What a page shows in addition to the description.
pub struct Parts<'a> {
    /// File name of the unit without `.fmu`.
    pub name: &'a str,
    /// Folder with `text.md` and the figures that it names.
    pub folder: &'a Path,
    /// The unit's picture (SVG).
    pub picture: &'a str,
    /// Its reference results over time (SVG), if it has any. The picture is empty until they are computed.
    pub results: Option<&'a str>,
}

/// The page: what the unit computes, its variables, its capabilities, and its reference results.
pub fn page(xml: &str, parts: &Parts<'_>) -> Result<String> {
    let text = text(&parts.folder.join("text.md"))?;
    let Parts { name, picture, results, .. } = *parts;
    let results = results.map(|picture| self::results(name, picture)).unwrap_or_default();
    Ok(fmi2_package::page(xml, PageParts { name, picture, text: &text, results: &results })?)
}

/// A Markdown file as HTML: `$…$` becomes MathML, and figures that are SVG files become part of it.
fn text(file: &Path) -> Result<String> {
    let markdown =
        fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))?;
    let options = Options::ENABLE_MATH | Options::ENABLE_TABLES;
    let mut events = Vec::new();
    for event in Parser::new_ext(&markdown, options) {
        events.push(match event {
            Event::InlineMath(latex) => {
                Event::InlineHtml(math(&latex, DisplayMode::Inline)?.into())
            }
            Event::DisplayMath(latex) => {
                Event::InlineHtml(math(&latex, DisplayMode::Block)?.into())
            }
            Event::Start(Tag::Image { dest_url, .. }) => {
                let figure = file.with_file_name(dest_url.as_ref());
                let svg = fs::read_to_string(&figure)
                    .with_context(|| format!("reading {}", figure.display()))?;
                Event::InlineHtml(format!("<span class=\"figure\">{svg}<small>").into())
            }
            Event::End(TagEnd::Image) => Event::InlineHtml("</small></span>".into()),
            other => other,
        });
    }
    let mut page = String::new();
    html::push_html(&mut page, events.into_iter());
    Ok(page)
}

/// LaTeX as MathML, which browsers show without scripts.
fn math(latex: &str, display_mode: DisplayMode) -> Result<String> {
    let storage = Storage::new();
    let events: Result<Vec<_>, _> = pulldown_latex::Parser::new(latex, &storage).collect();
    let events = events.map_err(|error| anyhow!("the equation {latex}: {error}"))?;
    let mut mathml = String::new();
    let config = RenderConfig { display_mode, ..RenderConfig::default() };
    let events = events.into_iter().map(Ok::<_, std::convert::Infallible>);
    push_mathml(&mut mathml, events, config)?;
    Ok(mathml)
}

fn results(name: &str, picture: &str) -> String {
    let mut html = format!(
        "<p>The unit carries an experiment with its results in \
         <code>extra/org.fmi-standard.fmi-ls-ref/</code>: inputs <code>{name}_in.csv</code>, outputs \
         <code>{name}_ref.csv</code> and settings <code>{name}_ref.opt</code> as in the FMI cross-check, \
         named by a manifest of the layered standard FMI-LS-REF. Inputs jump at communication points and \
         keep their values between them, and all times are exact in binary, so importers that hold inputs \
         and importers that interpolate them must get the same.</p>\n\
         <pre><code>maglev reference {name}.fmu</code></pre>\n"
    );
    if !picture.is_empty() {
        // writing to a String cannot fail
        let _ = writeln!(
            html,
            "<p><span class=\"figure\">{picture}<small>Outputs of the reference experiment</small></span></p>"
        );
    }
    html
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_become_mathml_and_a_wrong_one_is_named() {
        let found = math(r"\frac{a}{b} + \dot{x}", DisplayMode::Block).unwrap();
        assert!(found.starts_with("<math") && found.contains("<mfrac>"), "{found}");
        let error = math(r"\frac{a", DisplayMode::Inline).unwrap_err().to_string();
        assert!(error.contains(r"\frac{a"), "{error}");
    }
}
