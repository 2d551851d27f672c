//! Sections of a report that other crates fill: notes, tables and pictures.

use serde::Serialize;

/// A section after the time histories and spectra.
#[derive(Debug, Clone, Serialize)]
pub struct Section {
    /// Identifier of the section in the page.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// Its name in the list of sections.
    pub short: &'static str,
    /// Sentences above the tables.
    pub notes: Vec<Note>,
    /// Tables.
    pub tables: Vec<SectionTable>,
    /// Pictures.
    pub figures: Vec<SectionFigure>,
}

/// A sentence.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Note {
    /// The sentence.
    pub text: String,
    /// Whether it limits what the results mean.
    pub warning: bool,
}

impl Note {
    /// Something to know.
    #[must_use]
    pub fn plain(text: String) -> Self {
        Self { text, warning: false }
    }

    /// Something that limits what the results mean.
    #[must_use]
    pub fn warning(text: String) -> Self {
        Self { text, warning: true }
    }
}

/// A table that sorts by its columns.
#[derive(Debug, Clone, Serialize)]
pub struct SectionTable {
    /// Caption.
    pub caption: String,
    /// Headings, and whether the column has numbers.
    pub columns: Vec<(String, bool)>,
    /// Cells in the order of the columns.
    pub rows: Vec<Vec<Cell>>,
}

impl SectionTable {
    /// A table of given columns: headings, and whether they have numbers.
    #[must_use]
    pub fn new(caption: &str, columns: &[(&str, bool)], rows: Vec<Vec<Cell>>) -> Self {
        let columns = columns.iter().map(|(text, number)| ((*text).to_owned(), *number)).collect();
        Self { caption: caption.to_owned(), columns, rows }
    }
}

/// What a cell shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cell {
    /// A dash.
    None,
    /// A text.
    Text(String),
    /// A number without unit.
    Number(f64),
    /// A number in a unit of measure, shown with a prefix that suits.
    Quantity {
        /// The value.
        value: f64,
        /// Its unit.
        unit: String,
    },
}

/// A picture.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct SectionFigure {
    /// The picture.
    pub svg: String,
    /// Text below it.
    pub caption: String,
}
