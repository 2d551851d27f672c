//! The raw directory at the end of a zip archive.
//!
//! The crate `zip` drops the first of two entries with the same name and hides details. The rules need all of them.

use std::io::{self, Read, Seek, SeekFrom};

/// The directory of a zip archive.
#[derive(Default)]
pub struct ZipDirectory {
    /// The entries in order, with duplicates.
    pub entries: Vec<ZipEntry>,
    /// The archive is split over several files.
    pub split: bool,
}

/// An entry of the directory.
pub struct ZipEntry {
    /// Raw name.
    pub name: String,
    /// Version of the zip format that is needed to unpack, times ten.
    pub version: u16,
    /// Compression method: 0 stored, 8 Deflate.
    pub method: u16,
    /// The content is encrypted.
    pub encrypted: bool,
    /// A data descriptor with the sizes follows after the content.
    pub descriptor: bool,
    /// It is a symbolic link.
    pub link: bool,
}

impl ZipEntry {
    /// Whether the entry is a folder.
    #[must_use]
    pub fn is_folder(&self) -> bool {
        self.name.ends_with(['/', '\\'])
    }

    /// The name with forward slashes and without a leading `./`, as importers use it.
    #[must_use]
    pub fn path(&self) -> String {
        path(&self.name)
    }
}

/// A name with forward slashes and without a leading `./`.
pub(super) fn path(name: &str) -> String {
    let name = name.replace('\\', "/");
    name.strip_prefix("./").unwrap_or(&name).to_owned()
}

/// Size of the end record with the longest comment after it.
const LONGEST_END: u64 = 22 + 65_535;

/// Reads the directory of an archive, as far as it is intact.
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

/// Position of the end record of a zip64 archive, and the number of entries and the length of the directory in it.
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
    /// Size of an entry without name, extra field and comment.
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
