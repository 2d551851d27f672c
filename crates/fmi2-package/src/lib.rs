//! Pack an FMI 2.0 unit made with `fmi2-export`.
#![doc = include_str!("../README.md")]

mod archive;
mod describe;
mod error;
mod page;

pub use archive::Archive;
pub use describe::describe;
pub use error::Error;
pub use page::{PageParts, page, text_of_page};

/// Name of the folder under `binaries/` for a system, given as in [`std::env::consts`].
///
/// FMI 2.0 (section 2.3.1) names systems by their word size only. Importers on 64-bit ARM (FMPy,
/// `maglev`) also look in these folders, so a library for ARM is stored there; on macOS one
/// universal file contains both processors.
#[must_use]
pub fn platform(os: &str, arch: &str) -> Option<&'static str> {
    match (os, arch) {
        ("linux", "x86_64" | "aarch64") => Some("linux64"),
        ("linux", "x86") => Some("linux32"),
        ("windows", "x86_64" | "aarch64") => Some("win64"),
        ("windows", "x86") => Some("win32"),
        ("macos", "x86_64" | "aarch64") => Some("darwin64"),
        _ => None,
    }
}

/// [`platform`] of the system that this program runs on.
///
/// # Errors
/// FMI has no name for it.
pub fn host() -> Result<&'static str, Error> {
    use std::env::consts::{ARCH, OS};
    platform(OS, ARCH).ok_or(Error::Platform { os: OS, arch: ARCH })
}
