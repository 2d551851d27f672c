//! Runs the command for Windows under wine, on Linux.

use std::{
    ffi::{OsStr, OsString},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use crate::workspace;

/// Where wine for 64-bit programs is: Debian's package `wine64` puts it into no folder of the search path.
const PLACES: [&str; 3] = ["/usr/lib/wine/wine64", "/usr/bin/wine64", "/usr/bin/wine"];

/// wine before version 9 lacks a library that Rust programs take random numbers from.
const STAND_IN: &str = "crates/xtask/bcryptprimitives.c";

/// Begin of the names of the folders that units are unpacked to.
const UNPACKED: &str = "maglev-unit-";

/// wine, if it is installed.
pub fn program() -> Option<PathBuf> {
    PLACES.iter().map(PathBuf::from).find(|path| path.is_file())
}

/// A program for Windows, with a Windows folder of its own (`prefix`).
pub struct Wine {
    wine: PathBuf,
    program: PathBuf,
    folder: PathBuf,
}

impl Wine {
    /// Prepares to run a program. `linker` is a C compiler for Windows.
    pub fn new(program: PathBuf, linker: &str, folder: &Path) -> Result<Self> {
        let Some(wine) = self::program() else {
            bail!("wine is missing: looked for {}", PLACES.join(", "));
        };
        fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
        let library = folder.join("bcryptprimitives.dll");
        let args = ["-O2", "-shared", "-o"].map(OsStr::new);
        let rest = [library.as_os_str(), STAND_IN.as_ref(), "-ladvapi32".as_ref()];
        workspace::run(linker, &[args, rest].concat())?;
        Ok(Self { wine, program, folder: folder.to_owned() })
    }

    /// Runs the program; an error if it fails.
    pub fn run(&self, args: &[OsString]) -> Result<()> {
        let mut all = vec![self.program.clone().into_os_string()];
        all.extend_from_slice(args);
        let prefix = self.prefix();
        let variables: [(&str, &OsStr); 4] = [
            ("WINEPREFIX", prefix.as_os_str()),
            ("WINEPATH", self.folder.as_os_str()),
            ("WINEDEBUG", "-all".as_ref()),
            // nothing of ours needs .NET or a browser, which wine would offer to download
            ("WINEDLLOVERRIDES", "mscoree,mshtml=".as_ref()),
        ];
        workspace::run_with(&self.wine, &all, &variables)
    }

    fn prefix(&self) -> PathBuf {
        self.folder.join("prefix")
    }

    /// Folders of unpacked units that were not removed.
    pub fn left_behind(&self) -> Vec<PathBuf> {
        let mut found = Vec::new();
        collect(&self.prefix().join("drive_c/users"), &mut found);
        found
    }
}

impl Drop for Wine {
    /// Ends the server of this Windows folder, which would wait for other programs for a while.
    fn drop(&mut self) {
        let server = self.wine.with_file_name("wineserver");
        // if there is none, it ends by itself
        let _ = Command::new(server).arg("-k").env("WINEPREFIX", self.prefix()).status();
    }
}

/// The folders of unpacked units in a folder, which may link to others.
fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|it| it.is_dir());
        if is_folder && entry.file_name().to_string_lossy().starts_with(UNPACKED) {
            found.push(entry.path());
        } else if is_folder {
            collect(&entry.path(), found);
        }
    }
}
