//! Faults of an archive: one for every rule on it.

use std::fs;
use std::io::Write as _;

use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use crate::support::{Bench, DESCRIPTION};

pub const BINARY: &str = "binaries/linux64/unit.so";
pub const PAGE: &str = "documentation/index.html";

/// Packs `bad.fmu` from the sound unit with more files.
pub fn pack_with(bench: &Bench, binary: &[u8], extra: &[(&str, &[u8])]) {
    let xml = DESCRIPTION.as_bytes();
    let mut files = vec![("modelDescription.xml", xml), (BINARY, binary), (PAGE, b"".as_slice())];
    files.extend(extra);
    bench.pack("bad.fmu", &files);
}

/// Where the records of an entry and of the archive's end begin.
pub struct Records {
    pub local: usize,
    pub central: usize,
    pub end: usize,
}

/// Changes the bytes of `bad.fmu`, given where the records of one of its entries are.
pub fn patch(bench: &Bench, name: &str, change: impl FnOnce(&mut [u8], Records)) {
    let path = bench.path("bad.fmu");
    let mut bytes = fs::read(&path).unwrap();
    let named = |signature: [u8; 4], header: usize| {
        let at = |window: &&[u8]| window[..4] == signature && &window[header..] == name.as_bytes();
        let windows = bytes.windows(header + name.len());
        windows.enumerate().find(|(_, window)| at(window)).unwrap().0
    };
    let local = named(*b"PK\x03\x04", 30);
    let central = named(*b"PK\x01\x02", 46);
    let end = bytes.windows(4).rposition(|it| it == b"PK\x05\x06").unwrap();
    change(&mut bytes, Records { local, central, end });
    fs::write(path, bytes).unwrap();
}

/// Changes the checksum of an entry in both of its records.
pub fn damage(bench: &Bench, name: &str) {
    patch(bench, name, |bytes, at| {
        bytes[at.local + 14] ^= 0xff;
        bytes[at.central + 16] ^= 0xff;
    });
}

/// Marks an entry as encrypted in both of its records.
pub fn encrypt(bench: &Bench, name: &str) {
    patch(bench, name, |bytes, at| {
        bytes[at.local + 6] |= 1;
        bytes[at.central + 8] |= 1;
    });
}

fn write(bench: &Bench, fill: impl FnOnce(&mut ZipWriter<fs::File>)) {
    let mut writer = ZipWriter::new(fs::File::create(bench.path("bad.fmu")).unwrap());
    writer.start_file("modelDescription.xml", SimpleFileOptions::default()).unwrap();
    writer.write_all(DESCRIPTION.as_bytes()).unwrap();
    fill(&mut writer);
    writer.finish().unwrap();
}

/// Packs `bad.fmu` with a fault of its archive; `false` if the rule is not on archives.
pub fn archives(rule: &str, bench: &Bench, binary: &[u8]) -> bool {
    let xml = DESCRIPTION.as_bytes();
    let sound = |extra: &[(&str, &[u8])]| pack_with(bench, binary, extra);
    match rule {
        "archive-zip" => fs::write(bench.path("bad.fmu"), "no archive").unwrap(),
        "archive-backslash" => sound(&[("resources\\a", b"")]),
        "archive-escape" => sound(&[("resources/../../a", b"")]),
        "archive-dot" => sound(&[("./resources/a", b"")]),
        "archive-case" => sound(&[("resources/a", b""), ("resources/A", b"")]),
        "archive-duplicate" => sound(&[("resources/a", b""), ("./resources/a", b"")]),
        "archive-ascii" => sound(&[("resources/ä", b"")]),
        "archive-control" => sound(&[("resources/a\tb", b"")]),
        "archive-top-level" => sound(&[("notes.txt", b"")]),
        "icon" => sound(&[("model.png", b"GIF89a")]),
        "archive-refused" => sound(&[("resources/zeros", &vec![0; 64 << 20])]),
        "archive-link" => write(bench, |writer| {
            let options = SimpleFileOptions::default();
            writer.add_symlink("resources/link", "/etc/passwd", options).unwrap();
        }),
        "description-missing" => bench.pack("bad.fmu", &[("x/modelDescription.xml", xml)]),
        "description-text" => bench.pack("bad.fmu", &[("modelDescription.xml", b"<x \xff/>")]),
        "documentation" => {
            bench.pack("bad.fmu", &[("modelDescription.xml", xml), (BINARY, binary)]);
        }
        "code-missing" => bench.pack("bad.fmu", &[("modelDescription.xml", xml)]),
        "platform" => bench.pack("bad.fmu", &[("modelDescription.xml", xml), ("sources/a.c", b"")]),
        "binary-name" => bench.pack(
            "bad.fmu",
            &[("modelDescription.xml", xml), ("binaries/linux64/libunit.so", binary)],
        ),
        "binary-folder" => sound(&[("binaries/linux-x64/unit.so", binary)]),
        "binary-format" => sound(&[("binaries/win64/unit.dll", binary)]),
        "symbols" => bench.unit("bad.fmu", DESCRIPTION, &["-DWITHOUT_RESET"]),
        _ => return records(rule, bench, binary),
    }
    true
}

/// Faults that no writer of archives makes: changed in the bytes.
fn records(rule: &str, bench: &Bench, binary: &[u8]) -> bool {
    const NAME: &str = "resources/a";
    pack_with(bench, binary, &[(NAME, b"some content to pack, to pack, to pack")]);
    match rule {
        "archive-compression" => patch(bench, NAME, |bytes, at| {
            bytes[at.local + 8] = 12;
            bytes[at.central + 10] = 12;
        }),
        "archive-descriptor" => {
            write(bench, |writer| {
                let stored = zip::CompressionMethod::Stored;
                let options = SimpleFileOptions::default().compression_method(stored);
                writer.start_file(NAME, options).unwrap();
                writer.write_all(b"content").unwrap();
            });
            patch(bench, NAME, |bytes, at| {
                bytes[at.local + 6] |= 8;
                bytes[at.central + 8] |= 8;
            });
        }
        "archive-version" => patch(bench, NAME, |bytes, at| {
            bytes[at.local + 4] = 45;
            bytes[at.central + 6] = 45;
        }),
        "archive-split" => patch(bench, NAME, |bytes, at| bytes[at.end + 4] = 1),
        "archive-encrypted" => encrypt(bench, NAME),
        "archive-damaged" => damage(bench, NAME),
        _ => return false,
    }
    true
}

/// A library of macOS for a processor that does nothing but export these functions.
pub fn mach_o(processor: u32, symbols: &[&str]) -> Vec<u8> {
    let (header, symtab, dysymtab, entry) = (32, 24, 80, 16);
    let table_at = header + symtab + dysymtab;
    let strings = table_at + entry * symbols.len();
    let mut names = vec![0_u8];
    let mut table = Vec::new();
    for symbol in symbols {
        table.extend((names.len() as u32).to_le_bytes());
        // external, in section 1
        table.extend([0x0f, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        names.extend(format!("_{symbol}\0").as_bytes());
    }
    // a dynamic library with two commands
    let mut words = vec![0xfeed_facf, processor, 0, 6, 2, (symtab + dysymtab) as u32, 0, 0];
    let places = [2, symtab, table_at, symbols.len(), strings, names.len()];
    words.extend(places.map(|word| word as u32));
    // all symbols are defined and external
    words.extend([0xb, dysymtab as u32, 0, 0, 0, symbols.len() as u32]);
    words.resize((header + symtab + dysymtab) / 4, 0);
    let mut bytes: Vec<u8> = words.into_iter().flat_map(u32::to_le_bytes).collect();
    bytes.extend(table);
    bytes.extend(names);
    bytes
}

/// Processors in macOS's libraries.
pub const X86_64: u32 = 0x0100_0007;
pub const ARM64: u32 = 0x0100_000c;

/// A universal library of macOS made of others.
pub fn universal(parts: &[(u32, Vec<u8>)]) -> Vec<u8> {
    let mut bytes: Vec<u8> = 0xcafe_babe_u32.to_be_bytes().to_vec();
    bytes.extend((parts.len() as u32).to_be_bytes());
    let mut content = Vec::<u8>::new();
    for (processor, part) in parts {
        let offset = 8 + 20 * parts.len() + content.len();
        for word in [*processor, 0, offset as u32, part.len() as u32, 0] {
            bytes.extend(word.to_be_bytes());
        }
        content.extend(part);
    }
    bytes.extend(content);
    bytes
}
