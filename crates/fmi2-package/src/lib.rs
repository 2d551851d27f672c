//! Pack an FMI 2.0 unit made with `fmi2-export`.
#![doc = include_str!("../README.md")]

mod archive;
mod describe;
mod error;

pub use archive::Archive;
pub use describe::describe;
pub use error::Error;

/// Name of the folder under `binaries/` for a system, in the words of [`std::env::consts`].
///
/// FMI 2.0 names `linux64`, `win64` and `darwin64` (section 2.3.1); for the 64-bit ARM systems, which
/// it does not name, these are FMI 3.0's names, which tools look for.
#[must_use]
pub fn platform(os: &str, arch: &str) -> Option<&'static str> {
    match (os, arch) {
        ("linux", "x86_64") => Some("linux64"),
        ("windows", "x86_64") => Some("win64"),
        ("macos", "x86_64") => Some("darwin64"),
        ("linux", "aarch64") => Some("aarch64-linux"),
        ("macos", "aarch64") => Some("aarch64-darwin"),
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
