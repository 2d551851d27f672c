//! Finished rows of a map in progress, so that an interrupted map continues.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::result::MapCell;

/// One line: the rows of a scene.
#[derive(Serialize, Deserialize)]
struct Line {
    scene: usize,
    row: usize,
    cells: Vec<MapCell>,
}

/// The file `map-rows.jsonl` of a folder.
pub(crate) struct Journal {
    file: results::Journal,
    /// Rows of an earlier run: scene, row, cells.
    pub done: Vec<(usize, usize, Vec<MapCell>)>,
}

impl Journal {
    /// Opens or begins the journal of a map, which `task` describes in one line.
    ///
    /// # Errors
    /// The file cannot be written, or belongs to another map.
    pub fn open(folder: &Path, task: &str) -> Result<Self, Error> {
        let (file, lines) = results::Journal::open::<Line>(folder, "map-rows.jsonl", "map", task)?;
        let done = lines.into_iter().map(|it| (it.scene, it.row, it.cells)).collect();
        Ok(Self { file, done })
    }

    /// Adds a finished row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&self, scene: usize, row: usize, cells: &[MapCell]) -> Result<(), Error> {
        Ok(self.file.add(&Line { scene, row, cells: cells.to_vec() })?)
    }

    /// Removes the journal of a complete map.
    pub fn remove(self) {
        self.file.remove();
    }
}
