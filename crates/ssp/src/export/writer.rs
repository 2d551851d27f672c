//! Writing XML.

use std::io;

use quick_xml::Writer;
use quick_xml::escape::{escape, partial_escape};
use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesDecl, BytesStart, BytesText, Event};
use quick_xml::name::QName;

/// Attributes in order; `None` is left out.
pub(super) type Attributes<'a> = &'a [(&'a str, Option<String>)];

/// A document that is written element by element.
pub(super) struct Printer {
    writer: Writer<Vec<u8>>,
}

impl Printer {
    pub(super) fn new() -> io::Result<Self> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        Ok(Self { writer })
    }

    pub(super) fn open(&mut self, name: &str, attributes: Attributes<'_>) -> io::Result<()> {
        self.writer.write_event(Event::Start(element(name, attributes)))
    }

    pub(super) fn empty(&mut self, name: &str, attributes: Attributes<'_>) -> io::Result<()> {
        self.writer.write_event(Event::Empty(element(name, attributes)))
    }

    pub(super) fn text(&mut self, text: &str) -> io::Result<()> {
        // quotes need no escape in a text, and JSON has many
        self.writer.write_event(Event::Text(BytesText::from_escaped(partial_escape(text))))
    }

    pub(super) fn close(&mut self, name: &str) -> io::Result<()> {
        self.writer.write_event(Event::End(BytesStart::new(name).to_end()))
    }

    pub(super) fn finish(self) -> io::Result<String> {
        let mut bytes = self.writer.into_inner();
        bytes.push(b'\n');
        String::from_utf8(bytes).map_err(io::Error::other)
    }
}

fn element<'a>(name: &'a str, attributes: Attributes<'_>) -> BytesStart<'a> {
    let mut element = BytesStart::new(name);
    for (key, value) in attributes {
        let Some(value) = value else { continue };
        // parsers replace white space in attributes by spaces, unless it is escaped
        let value = escape(value.as_str())
            .replace('\n', "&#10;")
            .replace('\r', "&#13;")
            .replace('\t', "&#9;");
        let attribute = Attribute { key: QName(key), value: value.into() };
        element.push_attribute(attribute);
    }
    element
}

/// An attribute.
#[expect(clippy::unnecessary_wraps, reason = "attributes are optional")]
pub(super) fn text(value: impl Into<String>) -> Option<String> {
    Some(value.into())
}

/// A number that reads back to the same bits.
#[expect(clippy::unnecessary_wraps, reason = "attributes are optional")]
pub(super) fn number(value: f64) -> Option<String> {
    Some(double(value))
}

/// A number that reads back to the same bits, as XML Schema writes it.
pub(super) fn double(value: f64) -> String {
    if value.is_nan() {
        "NaN".to_owned()
    } else if value.is_infinite() {
        if value > 0.0 { "INF" } else { "-INF" }.to_owned()
    } else if value != 0.0 && !(1e-4..1e15).contains(&value.abs()) {
        format!("{value:e}")
    } else {
        format!("{value:?}")
    }
}
