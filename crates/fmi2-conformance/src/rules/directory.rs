//! The directory at the end of a zip archive, as it stands there.
//!
//! A reader of archives drops the first of two entries with one name, and hides what it can deal
//! with. The rules want to see everything.

use std::io::{self, Read, Seek, SeekFrom};

/// What the directory says.
#[derive(Default)]
pub struct ZipDirectory {
    /// Its entries, in order.
    pub entries: Vec<ZipEntry>,
    /// The archive is spread over several files.
    pub split: bool,
}

/// One entry.
pub struct ZipEntry {
    /// Name, as it is.
    pub name: String,
    /// Version of the zip format that a reader needs, times ten.
    pub version: u16,
    /// How it is packed: 0 stored, 8 Deflate.
    pub method: u16,
    /// It is encrypted.
    pub encrypted: bool,
    /// Its sizes follow after its content.
    pub descriptor: bool,
    /// It is a symbolic link.
    pub link: bool,
}

impl ZipEntry {
    /// It is a folder.
    #[must_use]
    pub fn is_folder(&self) -> bool {
        self.name.ends_with(['/', '\\'])
    }

    /// The name as importers mean it: with forward slashes and without `./` in front.
    #[must_use]
    pub fn path(&self) -> String {
        path(&self.name)
    }
}

/// A name with forward slashes and without `./` in front.
pub(super) fn path(name: &str) -> String {
    let name = name.replace('\\', "/");
    name.strip_prefix("./").unwrap_or(&name).to_owned()
}

/// End record, and the longest comment after it.
const LONGEST_END: u64 = 22 + 65_535;

/// Reads the directory of an archive; what cannot be read is left out.
pub fn read(file: &mut (impl Read + Seek)) -> io::Result<ZipDirectory> {
    let size = file.seek(SeekFrom::End(0))?;
    let from = size.saturating_sub(LONGEST_END);
    let tail = bytes(file, from, size - from)?;
    let Some(at) = tail.windows(4).rposition(|it| it == b"PK\x05\x06") else {
        return Ok(ZipDirectory::default());
    };
    let end = &tail[at..];
    let split = short(end, 4) != 0 || short(end, 6) != 0 || short(end, 8) != short(end, 10);
    let (mut count, mut length) = (u64::from(short(end, 10)), u64::from(long(end, 12)));
    let mut stop = from + at as u64;
    if let Some(large) = large_end(file, stop)? {
        (stop, count, length) = large;
    }
    let content = bytes(file, stop.saturating_sub(length), length.min(stop))?;
    Ok(ZipDirectory { entries: entries(&content, count), split })
}

/// Where the end record of a zip64 archive lies, and the count of entries and length in it.
fn large_end(file: &mut (impl Read + Seek), stop: u64) -> io::Result<Option<(u64, u64, u64)>> {
    let Some(from) = stop.checked_sub(20) else { return Ok(None) };
    let locator = bytes(file, from, 20)?;
    if !locator.starts_with(b"PK\x06\x07") {
        return Ok(None);
    }
    let at = wide(&locator, 8);
    let record = bytes(file, at, 56)?;
    let found = record.starts_with(b"PK\x06\x06");
    Ok(found.then(|| (at, wide(&record, 32), wide(&record, 40))))
}

fn entries(content: &[u8], count: u64) -> Vec<ZipEntry> {
    /// The part of an entry that all have.
    const FIXED: usize = 46;
    let mut entries = Vec::new();
    let mut rest = content;
    while rest.starts_with(b"PK\x01\x02") && rest.len() >= FIXED && (entries.len() as u64) < count {
        let name = usize::from(short(rest, 28));
        let whole = FIXED + name + usize::from(short(rest, 30)) + usize::from(short(rest, 32));
        let Some(bytes) = rest.get(FIXED..FIXED + name) else { break };
        let flags = short(rest, 8);
        let unix = short(rest, 4) >> 8 == 3;
        entries.push(ZipEntry {
            name: String::from_utf8_lossy(bytes).into_owned(),
            version: short(rest, 6) & 0xff,
            method: short(rest, 10),
            encrypted: flags & 1 != 0,
            descriptor: flags & 8 != 0,
            link: unix && (long(rest, 38) >> 16) & 0o170_000 == 0o120_000,
        });
        rest = rest.get(whole..).unwrap_or_default();
    }
    entries
}

fn bytes(file: &mut (impl Read + Seek), from: u64, length: u64) -> io::Result<Vec<u8>> {
    file.seek(SeekFrom::Start(from))?;
    let mut content = Vec::new();
    file.take(length).read_to_end(&mut content)?;
    Ok(content)
}

/// The little-endian number at an offset; 0 beyond the end.
fn short(bytes: &[u8], at: usize) -> u16 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |it| u16::from_le_bytes(*it))
}

fn long(bytes: &[u8], at: usize) -> u32 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |it| u32::from_le_bytes(*it))
}

fn wide(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..).and_then(<[u8]>::first_chunk).map_or(0, |it| u64::from_le_bytes(*it))
}
