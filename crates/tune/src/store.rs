//! Evaluations of a tuning in progress, so that an interrupted one continues: searches take the same way again, and
//! find what they ask for.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use crate::error::TuneError;
use crate::figures::Figures;

#[derive(Serialize, Deserialize)]
struct Line {
    places: Vec<f64>,
    figures: Vec<Figures>,
}

type Known = HashMap<Vec<u64>, Vec<Figures>>;

/// What was computed before, and the file that it is in.
pub(crate) struct Store {
    known: Mutex<Known>,
    file: Option<(PathBuf, Mutex<File>)>,
}

fn key(places: &[f64]) -> Vec<u64> {
    places.iter().map(|it| it.to_bits()).collect()
}

impl Store {
    /// Opens or begins the file `tune-evaluations.jsonl` of a folder; `task` describes the tuning in one line. Without a
    /// folder nothing is kept on the disk.
    pub fn open(folder: Option<&Path>, task: &str) -> Result<Self, TuneError> {
        let mut known = Known::new();
        let Some(folder) = folder else { return Ok(Self { known: Mutex::new(known), file: None }) };
        let path = folder.join("tune-evaluations.jsonl");
        let failed = |source| TuneError::Write { path: path.clone(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
        let mut whole = 0;
        if let Ok(file) = File::open(&path) {
            let mut reader = BufReader::new(file);
            let mut line = String::new();
            while reader.read_line(&mut line).map_err(failed)? > 0 {
                // the last line of a killed process may be incomplete
                let Some(text) = line.strip_suffix('\n') else { break };
                if whole == 0 {
                    if text != task {
                        return Err(TuneError::Other { path });
                    }
                } else if let Ok(Line { places, figures }) = serde_json::from_str(text) {
                    known.insert(key(&places), figures);
                } else {
                    break;
                }
                whole += line.len() as u64;
                line.clear();
            }
        }
        let file = OpenOptions::new().create(true).append(true).open(&path).map_err(failed)?;
        file.set_len(whole).map_err(failed)?;
        let store = Self { known: Mutex::new(known), file: Some((path, Mutex::new(file))) };
        if whole == 0 {
            store.write(task)?;
        }
        Ok(store)
    }

    /// The figures of places, computed if they are not known.
    pub fn get(
        &self,
        places: &[f64],
        compute: impl FnOnce() -> Result<Vec<Figures>, TuneError>,
    ) -> Result<Vec<Figures>, TuneError> {
        let found = self.known.lock().ok().and_then(|known| known.get(&key(places)).cloned());
        if let Some(figures) = found {
            return Ok(figures);
        }
        let figures = compute()?;
        if self.file.is_some() {
            let line = Line { places: places.to_vec(), figures: figures.clone() };
            self.write(&serde_json::to_string(&line).unwrap_or_default())?;
        }
        if let Ok(mut known) = self.known.lock() {
            known.insert(key(places), figures.clone());
        }
        Ok(figures)
    }

    /// Number of different sets of values.
    pub fn len(&self) -> usize {
        self.known.lock().map_or(0, |known| known.len())
    }

    fn write(&self, text: &str) -> Result<(), TuneError> {
        let Some((path, file)) = &self.file else { return Ok(()) };
        let failed = |source| TuneError::Write { path: path.clone(), source };
        match file.lock() {
            Ok(mut file) => file.write_all(format!("{text}\n").as_bytes()).map_err(failed),
            Err(_) => Ok(()),
        }
    }

    /// Removes the file of a complete tuning.
    pub fn remove(self) {
        if let Some((path, _)) = self.file {
            // a file that stays does no harm
            let _ = std::fs::remove_file(path);
        }
    }
}
