//! Evaluations of a tuning in progress, so that an interrupted one continues: searches take the same way again, and
//! find what they ask for.

use std::collections::HashMap;
use std::path::Path;
use std::sync::Mutex;

use results::Journal;
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
    journal: Option<Journal>,
}

fn key(places: &[f64]) -> Vec<u64> {
    places.iter().map(|it| it.to_bits()).collect()
}

impl Store {
    /// Opens or begins the file `tune-evaluations.jsonl` of a folder; `task` describes the tuning in one line. Without a
    /// folder nothing is kept on the disk.
    pub fn open(folder: Option<&Path>, task: &str) -> Result<Self, TuneError> {
        let mut known = Known::new();
        let mut journal = None;
        if let Some(folder) = folder {
            let name = "tune-evaluations.jsonl";
            let (opened, lines) = Journal::open::<Line>(folder, name, "tuning", task)?;
            known.extend(lines.into_iter().map(|it| (key(&it.places), it.figures)));
            journal = Some(opened);
        }
        Ok(Self { known: Mutex::new(known), journal })
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
        if let Some(journal) = &self.journal {
            journal.add(&Line { places: places.to_vec(), figures: figures.clone() })?;
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

    /// Removes the file of a complete tuning.
    pub fn remove(self) {
        if let Some(journal) = self.journal {
            journal.remove();
        }
    }
}
