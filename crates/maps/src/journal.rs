//! Finished rows of a map in progress, so that an interrupted map continues.

use std::fs::{File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

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
    path: PathBuf,
    file: Mutex<File>,
    /// Rows of an earlier run: scene, row, cells.
    pub done: Vec<(usize, usize, Vec<MapCell>)>,
}

impl Journal {
    /// Opens or begins the journal of a map, which `task` describes in one line.
    ///
    /// # Errors
    /// The file cannot be written, or belongs to another map.
    pub fn open(folder: &Path, task: &str) -> Result<Self, Error> {
        let path = folder.join("map-rows.jsonl");
        let failed = |source| Error::Write { path: path.clone(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut done = Vec::new();
        let mut whole = 0;
        if let Ok(file) = File::open(&path) {
            let mut reader = BufReader::new(file);
            let mut line = String::new();
            while reader.read_line(&mut line).map_err(failed)? > 0 {
                // the last line of a killed run may be incomplete
                let Some(text) = line.strip_suffix('\n') else { break };
                if whole == 0 {
                    if text != task {
                        return Err(Error::Other { path });
                    }
                } else if let Ok(Line { scene, row, cells }) = serde_json::from_str(text) {
                    done.push((scene, row, cells));
                } else {
                    break;
                }
                whole += line.len() as u64;
                line.clear();
            }
        }
        let mut options = OpenOptions::new();
        let file = options.create(true).append(true).open(&path).map_err(failed)?;
        file.set_len(whole).map_err(failed)?;
        let journal = Self { path, file: Mutex::new(file), done };
        if whole == 0 {
            journal.write(task)?;
        }
        Ok(journal)
    }

    /// Adds a finished row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&self, scene: usize, row: usize, cells: &[MapCell]) -> Result<(), Error> {
        let line = Line { scene, row, cells: cells.to_vec() };
        self.write(&serde_json::to_string(&line).unwrap_or_default())
    }

    fn write(&self, text: &str) -> Result<(), Error> {
        let failed = |source| Error::Write { path: self.path.clone(), source };
        match self.file.lock() {
            Ok(mut file) => file.write_all(format!("{text}\n").as_bytes()).map_err(failed),
            Err(_) => Ok(()),
        }
    }

    /// Removes the journal of a complete map.
    pub fn remove(self) {
        // a file that stays does no harm
        let _ = std::fs::remove_file(&self.path);
    }
}
