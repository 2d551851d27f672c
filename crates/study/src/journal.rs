//! Rows of finished points, line by line, so that nothing that is computed is lost.
//!
//! A line is the CRC-32 of its JSON in eight hexadecimal digits, a blank, and the JSON. Lines are only appended. What a
//! killed process or a full disk leaves of a line is cut off when the journal is opened to append; a line with a wrong
//! checksum is left out when it is read. Several processes can compute points of a study at the same time: each has a
//! journal of its own in the folder `journal`, and readers take all of them.

use std::collections::HashMap;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::{Row, Status};

/// Longest time between a row and the moment when it is safe from a crash of the machine.
const SYNC: Duration = Duration::from_secs(1);

/// A line of a journal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Entry {
    pub(crate) row: Row,
    /// wall time of the point (s)
    pub(crate) seconds: f64,
}

/// A journal that this process appends to. No other process can open it meanwhile.
pub(crate) struct Journal {
    file: File,
    /// length of the whole lines
    length: u64,
    synced: Instant,
    dirty: bool,
}

/// Why a journal cannot be opened.
pub(crate) enum JournalError {
    /// Another process appends to it.
    Busy,
    Io(io::Error),
}

impl From<io::Error> for JournalError {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

impl Journal {
    /// Opens the journal and cuts off an incomplete last line.
    pub(crate) fn open(path: &Path) -> Result<Self, JournalError> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Err(JournalError::Busy),
            // the file system has no locks
            Err(TryLockError::Error(_)) | Ok(()) => {}
        }
        let length = whole(&mut file)?;
        file.set_len(length)?;
        Ok(Self { file, length, synced: Instant::now(), dirty: false })
    }

    /// Appends entries. After an error the journal is as before.
    pub(crate) fn append(&mut self, entries: &[Entry]) -> io::Result<()> {
        let mut text = String::new();
        for entry in entries {
            let json = serde_json::to_string(entry)?;
            text += &format!("{:08x} {json}\n", crc32fast::hash(json.as_bytes()));
        }
        if let Err(error) = self.file.write_all(text.as_bytes()) {
            // if this fails as well, the next one who opens it does it
            let _ = self.file.set_len(self.length);
            return Err(error);
        }
        self.length += text.len() as u64;
        self.dirty = true;
        if self.synced.elapsed() > SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// Waits until everything is on the disk.
    pub(crate) fn sync(&mut self) -> io::Result<()> {
        if std::mem::take(&mut self.dirty) {
            self.file.sync_data()?;
        }
        self.synced = Instant::now();
        Ok(())
    }
}

/// Length of a file up to the end of its last line.
fn whole(file: &mut File) -> io::Result<u64> {
    let length = file.seek(SeekFrom::End(0))?;
    let mut end = length;
    let mut buffer = vec![0; 1 << 12];
    while end > 0 {
        let begin = end.saturating_sub(buffer.len() as u64);
        // fits, since it is at most the buffer's length
        let part = &mut buffer[..usize::try_from(end - begin).unwrap_or(0)];
        file.seek(SeekFrom::Start(begin))?;
        file.read_exact(part)?;
        if let Some(place) = part.iter().rposition(|byte| *byte == b'\n') {
            return Ok(begin + place as u64 + 1);
        }
        end = begin;
    }
    Ok(0)
}

/// The entry of a line, if its checksum is right.
fn entry(line: &str) -> Option<Entry> {
    let (sum, json) = line.trim_end_matches('\n').split_once(' ')?;
    let sum = u32::from_str_radix(sum, 16).ok()?;
    if sum != crc32fast::hash(json.as_bytes()) {
        return None;
    }
    serde_json::from_str(json).ok()
}

/// Where the row of a point is.
#[derive(Debug, Clone, Copy)]
struct Place {
    file: u32,
    length: u32,
    begin: u64,
    status: Status,
}

/// All rows of a study's journals, by the names of their points. The rows themselves stay on the disk.
#[derive(Default)]
pub(crate) struct Rows {
    files: Vec<File>,
    places: HashMap<String, Place>,
    /// wall time of all points (s)
    seconds: f64,
}

impl Rows {
    /// Reads the journals of the folder in the order of their names. A missing folder has none.
    pub(crate) fn read(folder: &Path) -> io::Result<Self> {
        let mut rows = Self::default();
        let mut paths: Vec<PathBuf> = match fs::read_dir(folder) {
            Ok(entries) => entries
                .map(|it| it.map(|it| it.path()))
                .collect::<io::Result<Vec<PathBuf>>>()?
                .into_iter()
                .filter(|path| path.extension().is_some_and(|end| end == "jsonl"))
                .collect(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(error),
        };
        paths.sort();
        for path in paths {
            rows.add(&path)?;
        }
        Ok(rows)
    }

    fn add(&mut self, path: &Path) -> io::Result<()> {
        let mut reader = BufReader::new(File::open(path)?);
        let file = u32::try_from(self.files.len()).unwrap_or(u32::MAX);
        let (mut begin, mut line) = (0, Vec::new());
        while reader.read_until(b'\n', &mut line)? > 0 {
            let length = line.len();
            // an incomplete last line has no end
            let text = line.ends_with(b"\n").then(|| std::str::from_utf8(&line).ok()).flatten();
            if let Some(entry) = text.and_then(entry) {
                let status = entry.row.status;
                let length = u32::try_from(length).unwrap_or(u32::MAX);
                self.seconds += entry.seconds;
                let place = Place { file, length, begin, status };
                self.take(entry.row.run, place);
            }
            begin += length as u64;
            line.clear();
        }
        self.files.push(reader.into_inner());
        Ok(())
    }

    /// Of several rows of a point, a regular one counts, then one that failed by itself, and of equals the first.
    fn take(&mut self, name: String, place: Place) {
        let rank = |status: Status| match status {
            it if it.is_regular() => 0,
            Status::Failed => 1,
            Status::TimedOut => 2,
            _ => 3,
        };
        match self.places.get_mut(&name) {
            Some(known) if rank(known.status) <= rank(place.status) => {}
            Some(known) => *known = place,
            None => {
                self.places.insert(name, place);
            }
        }
    }

    /// The status of a point, if it has a row.
    pub(crate) fn status(&self, name: &str) -> Option<Status> {
        self.places.get(name).map(|place| place.status)
    }

    /// The row of a point, if it has one.
    pub(crate) fn row(&mut self, name: &str) -> io::Result<Option<Row>> {
        let Some(place) = self.places.get(name) else { return Ok(None) };
        let mut line = vec![0; place.length as usize];
        let file = &mut self.files[place.file as usize];
        file.seek(SeekFrom::Start(place.begin))?;
        file.read_exact(&mut line)?;
        // it was readable when it was found
        Ok(std::str::from_utf8(&line).ok().and_then(entry).map(|it| it.row))
    }
}

/// Appends all rows of other journals that this one does not have.
pub(crate) fn adopt(from: &Path, into: &mut Journal, known: &Rows) -> io::Result<u64> {
    let mut others = Rows::read(from)?;
    let mut names: Vec<String> = others.places.keys().cloned().collect();
    names.sort_unstable();
    let mut count = 0;
    for name in names {
        if known.status(&name).is_some_and(|it| it.is_regular() || it == Status::Failed) {
            continue;
        }
        if let Some(row) = others.row(&name)? {
            into.append(&[Entry { row, seconds: 0.0 }])?;
            count += 1;
        }
    }
    into.sync()?;
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, status: Status) -> Entry {
        let mut row = Row::without_figures(name.to_owned(), status, String::new());
        row.metrics = vec![Some(0.1 + 0.2), None];
        Entry { row, seconds: 1.5 }
    }

    #[test]
    fn invariant_a_torn_line_is_cut_off_and_the_rest_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.jsonl");
        let entries = [written("a", Status::Finished), written("b", Status::Failed)];
        Journal::open(&path).map_err(|_| ()).unwrap().append(&entries).unwrap();
        let whole = fs::read(&path).unwrap();
        let first = whole.iter().position(|byte| *byte == b'\n').unwrap() + 1;
        for length in 0..=whole.len() {
            fs::write(&path, &whole[..length]).unwrap();
            let expected = [0, first, whole.len()].into_iter().rfind(|it| *it <= length).unwrap();
            let mut rows = Rows::read(folder.path()).unwrap();
            assert_eq!(rows.status("a").is_some(), expected >= first);
            assert_eq!(
                rows.row("b").unwrap(),
                (length == whole.len()).then(|| entries[1].row.clone())
            );
            let mut journal = Journal::open(&path).map_err(|_| ()).unwrap();
            assert_eq!(fs::metadata(&path).unwrap().len(), expected as u64);
            journal.append(&entries[..1]).unwrap();
            drop(journal);
            assert!(Rows::read(folder.path()).unwrap().status("a").is_some());
        }
    }

    #[test]
    fn invariant_a_line_with_a_wrong_checksum_is_left_out() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.jsonl");
        let entries = ["a", "b", "c"].map(|name| written(name, Status::Finished));
        Journal::open(&path).map_err(|_| ()).unwrap().append(&entries).unwrap();
        let text = fs::read_to_string(&path).unwrap().replace("\"b\"", "\"x\"");
        fs::write(&path, text).unwrap();
        let mut rows = Rows::read(folder.path()).unwrap();
        let found = ["a", "b", "c", "x"].map(|name| rows.row(name).unwrap().is_some());
        assert_eq!(found, [true, false, true, false]);
    }

    #[test]
    fn invariant_of_several_rows_a_regular_one_counts() {
        let folder = tempfile::tempdir().unwrap();
        let statuses = [Status::Crashed, Status::Finished, Status::TimedOut];
        for (name, status) in ["1", "2", "3"].into_iter().zip(statuses) {
            let path = folder.path().join(format!("{name}.jsonl"));
            Journal::open(&path).map_err(|_| ()).unwrap().append(&[written("a", status)]).unwrap();
        }
        assert_eq!(Rows::read(folder.path()).unwrap().status("a"), Some(Status::Finished));
    }

    #[test]
    fn refusal_a_journal_has_one_writer() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.jsonl");
        let _first = Journal::open(&path).map_err(|_| ()).unwrap();
        assert!(matches!(Journal::open(&path), Err(JournalError::Busy)));
    }
}
