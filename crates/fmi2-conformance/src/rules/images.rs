//! Formats and exported symbols of binaries.

use std::collections::HashSet;

use object::read::macho::{FatArch as _, MachOFatFile32, MachOFatFile64};
use object::{FileKind, Object as _, ObjectSymbol as _};

use fmi2_import::library::SYMBOLS;

/// The binaries in a file: one, or several for different processors in a universal binary of macOS.
///
/// # Errors
/// The file has no known format.
pub fn images(file: &[u8]) -> Result<Vec<object::File<'_>>, object::Error> {
    let slices: Vec<&[u8]> = match FileKind::parse(file)? {
        FileKind::MachOFat32 => {
            let fat = MachOFatFile32::parse(file)?;
            fat.arches().iter().map(|it| it.data(file)).collect::<Result<_, _>>()?
        }
        FileKind::MachOFat64 => {
            let fat = MachOFatFile64::parse(file)?;
            fat.arches().iter().map(|it| it.data(file)).collect::<Result<_, _>>()?
        }
        _ => vec![file],
    };
    slices.into_iter().map(object::File::parse).collect()
}

/// The functions of FMI 2.0 for co-simulation that a file does not export. The file is not loaded.
///
/// # Errors
/// The file has no known format.
pub fn missing_symbols(file: &[u8]) -> Result<Vec<&'static str>, object::Error> {
    let images: Vec<HashSet<String>> = images(file)?.iter().map(exported).collect();
    let in_all = |name: &str| images.iter().all(|image| image.contains(name));
    Ok(SYMBOLS.iter().copied().filter(|name| !in_all(name)).collect())
}

/// Names that a binary exports, without the leading underscore of some platforms.
fn exported(file: &object::File) -> HashSet<String> {
    let names: Vec<String> = match file.exports() {
        Ok(exports) if !exports.is_empty() => exports
            .iter()
            .map(|export| String::from_utf8_lossy(export.name()).into_owned())
            .collect(),
        _ => file
            .dynamic_symbols()
            .filter(|symbol| symbol.is_definition())
            .filter_map(|symbol| symbol.name().ok().map(str::to_owned))
            .collect(),
    };
    names.into_iter().map(|name| name.strip_prefix('_').unwrap_or(&name).to_owned()).collect()
}
