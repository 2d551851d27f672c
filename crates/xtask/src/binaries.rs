//! `cargo xtask binaries`: what the libraries in an .fmu need from a system, and what they export.

use std::{collections::BTreeSet, fmt::Write as _, fs, path::Path};

use anyhow::{Context, Result, bail};
use fmi2_package::Archive;
use fmi2_sys::CO_SIMULATION_FUNCTIONS;
use object::{
    Endianness, File, Object as _,
    read::elf::{Dyn as _, ElfFile, FileHeader},
    read::macho::{FatArch as _, MachHeader, MachOFile},
    read::pe::{ImageNtHeaders, PeFile},
};

/// The symbols beyond the standard that units of this project export (ARCHITECTURE.md).
const EXTRAS: [&str; 2] = ["fmi2_export_describe", "fmi2_export_report"];

/// Libraries that are part of glibc 2.17 on every Linux.
const GLIBC: [&str; 5] =
    ["libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2"];

/// What one library needs and exports.
#[derive(Debug, PartialEq, Eq)]
struct Linkage {
    architecture: String,
    /// Libraries that the loader must find.
    needed: BTreeSet<String>,
    /// Versions of symbols that it must find there, such as `GLIBC_2.14`.
    versions: BTreeSet<String>,
    exported: BTreeSet<String>,
}

/// Prints the linkage of every library in the .fmu files; fails where a rule is broken.
///
/// Every library exports the functions of FMI 2.0 and the two extras, and nothing else. With `glibc`,
/// those for Linux need no newer version than that, and no library that is not part of glibc.
pub fn report(files: &[impl AsRef<Path>], glibc: Option<&str>) -> Result<()> {
    let mut broken = Vec::new();
    for file in files.iter().map(AsRef::as_ref) {
        let archive = Archive::open(file)?;
        let mut libraries = 0;
        for (name, content) in archive.files().filter(|(name, _)| name.starts_with("binaries/")) {
            let what = format!("{}: {name}", file.display());
            for linkage in read(content).with_context(|| what.clone())? {
                eprintln!("{what}\n{}", linkage.text());
                broken.extend(linkage.broken(glibc).into_iter().map(|why| format!("{what} {why}")));
                libraries += 1;
            }
        }
        if libraries == 0 {
            broken.push(format!("{} contains no library", file.display()));
        }
    }
    if !broken.is_empty() {
        bail!("{}", broken.join("\n"));
    }
    Ok(())
}

impl Linkage {
    fn text(&self) -> String {
        let list = |set: &BTreeSet<String>| set.iter().cloned().collect::<Vec<_>>().join(" ");
        let mut text = format!("  for {}, needs {}\n", self.architecture, list(&self.needed));
        if let Some(newest) = self.newest() {
            let _ = writeln!(text, "  newest symbol version {newest}, of {}", list(&self.versions));
        }
        let _ = write!(text, "  exports {} functions", self.exported.len());
        text
    }

    /// The newest version of glibc that is needed.
    fn newest(&self) -> Option<&str> {
        let glibc = self.versions.iter().filter(|name| name.starts_with("GLIBC_"));
        glibc.max_by_key(|name| version(name)).map(String::as_str)
    }

    /// The rules that it breaks.
    fn broken(&self, glibc: Option<&str>) -> Vec<String> {
        let mut found = Vec::new();
        let wanted: BTreeSet<&str> = CO_SIMULATION_FUNCTIONS.into_iter().chain(EXTRAS).collect();
        let exported: BTreeSet<&str> = self.exported.iter().map(String::as_str).collect();
        for name in wanted.difference(&exported) {
            found.push(format!("does not export {name}"));
        }
        for name in exported.difference(&wanted) {
            found.push(format!("exports {name}, which is not part of FMI 2.0"));
        }
        if self.needed.iter().any(|name| name.starts_with("libgcc_s")) && glibc.is_some() {
            found.push("needs libgcc_s, which not every system has".into());
        }
        let Some(limit) = glibc.filter(|_| self.architecture.starts_with("ELF")) else {
            return found;
        };
        for name in self.versions.iter().filter(|name| name.starts_with("GLIBC_")) {
            if version(name) > version(limit) {
                found.push(format!("needs {name}; at most GLIBC_{limit} is allowed"));
            }
        }
        let foreign = |name: &&String| !GLIBC.contains(&name.as_str()) && !name.contains("gcc_s");
        for name in self.needed.iter().filter(foreign) {
            found.push(format!("needs {name}, which is not part of glibc"));
        }
        found
    }
}

/// `GLIBC_2.17` or `2.17` as numbers, so that 2.4 comes before 2.17.
fn version(name: &str) -> Vec<u32> {
    let digits = name.rsplit('_').next().unwrap_or(name);
    digits.split('.').filter_map(|part| part.parse().ok()).collect()
}

/// Reads a library; a universal one for macOS contains several.
fn read(content: &[u8]) -> Result<Vec<Linkage>> {
    if let Ok(fat) = object::read::macho::MachOFatFile32::parse(content) {
        return fat.arches().iter().map(|arch| read_one(arch.data(content)?)).collect();
    }
    Ok(vec![read_one(content)?])
}

fn read_one(content: &[u8]) -> Result<Linkage> {
    let file = File::parse(content)?;
    let mut linkage = Linkage {
        architecture: format!("{:?} {:?}", file.format(), file.architecture()).to_uppercase(),
        needed: BTreeSet::new(),
        versions: BTreeSet::new(),
        exported: BTreeSet::new(),
    };
    for export in file.exports()? {
        let name = String::from_utf8_lossy(export.name()).into_owned();
        // Apple's names of C functions begin with an underscore.
        let plain = name.strip_prefix('_').filter(|_| matches!(file, File::MachO64(_)));
        linkage.exported.insert(plain.map_or(name.clone(), str::to_owned));
    }
    match &file {
        File::Elf64(elf) => elf_needs(elf, &mut linkage)?,
        File::Elf32(elf) => elf_needs(elf, &mut linkage)?,
        File::Pe64(pe) => pe_needs(pe, &mut linkage)?,
        File::Pe32(pe) => pe_needs(pe, &mut linkage)?,
        File::MachO64(macho) => macho_needs(macho, &mut linkage)?,
        other => bail!("unsupported library format {:?}", other.format()),
    }
    Ok(linkage)
}

fn elf_needs<Elf: FileHeader<Endian = Endianness>>(
    elf: &ElfFile<'_, Elf>,
    linkage: &mut Linkage,
) -> Result<()> {
    let (endian, data, sections) = (elf.endian(), elf.data(), elf.elf_section_table());
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    if let Some((entries, link)) = sections.dynamic(endian, data)? {
        let strings = sections.strings(endian, data, link)?;
        for entry in entries.iter().filter(|e| e.tag32(endian) == Some(object::elf::DT_NEEDED)) {
            linkage.needed.insert(text(entry.string(endian, strings)?));
        }
    }
    if let Some((needs, link)) = sections.gnu_verneed(endian, data)? {
        let strings = sections.strings(endian, data, link)?;
        for need in needs {
            for version in need?.1 {
                linkage.versions.insert(text(version?.name(endian, strings)?));
            }
        }
    }
    Ok(())
}

fn pe_needs<Pe: ImageNtHeaders>(pe: &PeFile<'_, Pe>, linkage: &mut Linkage) -> Result<()> {
    if let Some(table) = pe.import_table()? {
        let mut descriptors = table.descriptors()?;
        while let Some(descriptor) = descriptors.next()? {
            let name = table.name(descriptor.name.get(object::LittleEndian))?;
            linkage.needed.insert(String::from_utf8_lossy(name).into_owned());
        }
    }
    Ok(())
}

fn macho_needs<Mach: MachHeader<Endian = Endianness>>(
    macho: &MachOFile<'_, Mach>,
    linkage: &mut Linkage,
) -> Result<()> {
    let endian = macho.endian();
    let mut commands = macho.macho_load_commands()?;
    while let Some(command) = commands.next()? {
        if let Some(dylib) = command.dylib()? {
            let name = command.string(endian, dylib.dylib.name)?;
            linkage.needed.insert(String::from_utf8_lossy(name).into_owned());
        }
    }
    Ok(())
}

/// Joins the libraries of several processors into Apple's universal one.
pub fn universal(files: &[impl AsRef<Path>], joined: &Path) -> Result<()> {
    let mut writer = fat_macho::FatWriter::new();
    for file in files.iter().map(AsRef::as_ref) {
        let content = fs::read(file).with_context(|| format!("reading {}", file.display()))?;
        writer.add(content).with_context(|| format!("joining {}", file.display()))?;
    }
    if let Some(folder) = joined.parent() {
        fs::create_dir_all(folder)?;
    }
    writer.write_to_file(joined).with_context(|| format!("writing {}", joined.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linkage(needed: &[&str], versions: &[&str], exported: &[&str]) -> Linkage {
        let set = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        Linkage {
            architecture: "ELF X86_64".into(),
            needed: set(needed),
            versions: set(versions),
            exported: set(exported),
        }
    }

    fn all() -> Vec<&'static str> {
        CO_SIMULATION_FUNCTIONS.into_iter().chain(EXTRAS).collect()
    }

    #[test]
    fn issue_each_rule_of_a_portable_library_can_fail() {
        let broken = |l: Linkage| l.broken(Some("2.17")).join("\n");
        let libc = ["libc.so.6"];
        assert_eq!(broken(linkage(&libc, &["GLIBC_2.2.5", "GLIBC_2.17"], &all())), "");
        // newest by number, not by letter
        assert!(broken(linkage(&libc, &["GLIBC_2.18"], &all())).contains("GLIBC_2.18"));
        assert_eq!(broken(linkage(&libc, &["GLIBC_2.4"], &all())), "");
        assert!(broken(linkage(&["libgcc_s.so.1"], &[], &all())).contains("libgcc_s"));
        assert!(broken(linkage(&["libz.so.1"], &[], &all())).contains("libz.so.1"));
        let more: Vec<_> = all().into_iter().chain(["rust_eh_personality"]).collect();
        assert!(broken(linkage(&libc, &[], &more)).contains("exports rust_eh_personality"));
        assert!(broken(linkage(&libc, &[], &all()[1..])).contains(all()[0]));
    }

    #[test]
    fn the_newest_version_is_the_largest_number() {
        let found = linkage(&[], &["GLIBC_2.4", "GLIBC_2.14", "GLIBC_2.2.5", "GCC_3.0"], &[]);
        assert_eq!(found.newest(), Some("GLIBC_2.14"));
    }
}
