//! Any bytes as a .fmu file: opened, its description and all files read.
#![no_main]

use std::io::Cursor;

use libfuzzer_sys::fuzz_target;
use fmi2_import::archive::FmuArchive;

fuzz_target!(|bytes: &[u8]| {
    let Ok(mut archive) = FmuArchive::new(Cursor::new(bytes)) else { return };
    let names: Vec<String> = archive.files().map(str::to_owned).collect();
    assert!(names.iter().all(|name| !name.starts_with('/') && !name.split('/').any(|it| it == "..")));
    let _ = archive.description();
    for name in names {
        let _ = archive.read(&name);
    }
});
