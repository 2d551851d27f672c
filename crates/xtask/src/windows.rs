//! `cargo xtask windows`: units, bundles and command for 64-bit Windows, run under wine beside those for Linux.
//!
//! On Debian and its relatives the distribution has all that it takes: a Rust compiler with the sources of its
//! standard library, a linker (mingw) and wine. Elsewhere `rustup target add x86_64-pc-windows-gnu` gives the
//! standard library.

use std::{
    ffi::{OsStr, OsString},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

use crate::{
    agreement::{self, Agreement},
    binaries, bundles, merge,
    package::{self, Order},
    target::Target,
    wine::{self, Wine},
    workspace,
};

/// The system that is built for.
pub const TRIPLE: &str = "x86_64-pc-windows-gnu";

/// Debian's packages of a compiler with the sources of its standard library, and what is used of them.
const COMPILER: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];
const CARGO: &str = "/usr/bin/cargo";
const RUSTC: &str = "/usr/bin/rustc";
/// Debian's package of the linker.
const MINGW: &str = "gcc-mingw-w64-x86-64-win32";
const LINKER: &str = "/usr/bin/x86_64-w64-mingw32-gcc";
/// Debian's package of wine for 64-bit programs.
const WINE: &str = "wine64";

/// Scenarios whose results are compared, with the largest difference allowed, relative to the largest value of a
/// signal: functions of the C library, such as the sine, differ in their last bits between systems.
const SCENARIOS: [(&str, f64); 2] = [("one-magnet", 1e-12), ("one-bogie", 1e-9)];
/// A bundle whose results are compared, how long it runs (s), and the largest difference allowed.
const BUNDLE: (&str, &str, f64) = ("magnet-on-girder", "10", 1e-12);
/// The unit that is only checked without running it: its dynamic checks take minutes.
const STATIC_ONLY: &str = "train.fmu";

/// How cargo is called with Debian's compiler, which builds the standard library from its sources.
pub struct Toolchain {
    /// Its cargo.
    pub cargo: PathBuf,
    /// Arguments of `cargo build`.
    pub arguments: [&'static str; 1],
    /// Environment variables.
    pub variables: [(&'static str, &'static OsStr); 2],
}

/// Debian's compiler, if the one that runs this task has no standard library for Windows.
pub fn toolchain() -> Option<Toolchain> {
    (!has_library() && has_sources()).then(|| Toolchain {
        cargo: CARGO.into(),
        arguments: ["-Zbuild-std=std,panic_unwind"],
        variables: [("RUSTC", OsStr::new(RUSTC)), ("RUSTC_BOOTSTRAP", OsStr::new("1"))],
    })
}

/// Whether the compiler that runs this task has a standard library for Windows.
fn has_library() -> bool {
    printed("rustc", &["target-libdir", "--target", TRIPLE]).is_some_and(|it| it.is_dir())
}

/// Whether Debian's compiler is there with the sources of its standard library.
fn has_sources() -> bool {
    let sources =
        printed(RUSTC, &["sysroot"]).map(|it| it.join("lib/rustlib/src/rust/library/std"));
    sources.is_some_and(|it| it.is_dir()) && Path::new(CARGO).is_file()
}

/// A path that a compiler prints.
fn printed(rustc: &str, what: &[&str]) -> Option<PathBuf> {
    let output = Command::new(rustc).arg("--print").args(what).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    output.status.success().then(|| text.trim().into())
}

/// Builds units, bundles and command for Linux and Windows, merges them, runs those for Windows and compares.
pub fn run() -> Result<()> {
    install()?;
    let folder = workspace::target_dir().join("windows");
    let windows: Target = TRIPLE.parse().map_err(anyhow::Error::msg)?;
    let parts = ["linux64", "win64"].map(|name| folder.join(name));
    let units = folder.join("fmu");
    for old in parts.iter().chain([&units]).filter(|path| path.exists()) {
        fs::remove_dir_all(old).with_context(|| format!("removing {}", old.display()))?;
    }
    for (part, target) in parts.iter().zip([Target::host(), windows.clone()]) {
        package::package(&Order {
            targets: vec![target],
            maglev: true,
            out: Some(part.clone()),
            ..Order::default()
        })?;
    }
    let wine = Wine::new(windows.maglev(), LINKER, &folder)?;
    // a run that was killed has left its own
    wine.left_behind().iter().try_for_each(fs::remove_dir_all).context("removing old folders")?;
    // as the release workflow does it: bundles are packed on each system, and then merged
    bundles::pack(None, &parts[1], &|args| wine.run(args))?;
    merge::merge(&units, &parts)?;
    let files = archives(&units)?;
    binaries::report(&files, None)?;
    files.iter().try_for_each(|file| check(&wine, file))?;
    let mut lines = Vec::new();
    for (name, allowed) in SCENARIOS {
        let scenario = bundles::scenario(name, &units)?;
        lines.push(compare(&wine, &folder, name, &[scenario.into()], allowed)?);
    }
    let (name, stop, allowed) = BUNDLE;
    let bundle = units.join(format!("{name}.fmu"));
    let what = [bundle.into(), "--stop".into(), stop.into()];
    lines.push(compare(&wine, &folder, name, &what, allowed)?);
    println!("Units, bundles and command for Windows work under wine. Beside those for Linux:");
    lines.iter().for_each(|line| println!("  {line}"));
    println!("The units for both systems are in {}.", units.display());
    let left = wine.left_behind();
    if let Some(first) = left.first() {
        println!(
            "{} folders of unpacked units were not removed, such as {}",
            left.len(),
            first.display()
        );
    }
    Ok(())
}

/// The .fmu files in a folder.
fn archives(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        files.push(entry?.path());
    }
    files.retain(|path| path.extension().is_some_and(|end| end == "fmu"));
    files.sort();
    Ok(files)
}

/// Validates a unit under wine, and repeats its reference results; bundles have none.
fn check(wine: &Wine, file: &Path) -> Result<()> {
    let mut args: Vec<OsString> = vec!["validate".into(), file.into()];
    if !file.ends_with(STATIC_ONLY) {
        args.push("--dynamic".into());
    }
    wine.run(&args)?;
    if bundles::names().any(|name| file.file_stem() == Some(OsStr::new(name))) {
        return Ok(());
    }
    wine.run(&["reference".into(), file.into()])
}

/// Runs a scenario or a unit on both systems, and compares the results; a line about them.
fn compare(
    wine: &Wine,
    folder: &Path,
    name: &str,
    what: &[OsString],
    allowed: f64,
) -> Result<String> {
    let [linux, windows] =
        ["linux", "windows"].map(|system| folder.join(format!("{name}-{system}")));
    let arguments = |out: &Path| {
        let mut args: Vec<OsString> = vec!["run".into()];
        args.extend_from_slice(what);
        args.extend(["--no-report".into(), "--out".into(), out.into()]);
        args
    };
    workspace::run(workspace::maglev(), &arguments(&linux))?;
    wine.run(&arguments(&windows))?;
    let [linux, windows] = [linux, windows].map(|it| it.join("results.csv"));
    let read = |path: &Path| {
        fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))
    };
    let found: Agreement = agreement::of(&read(&linux)?, &read(&windows)?)
        .with_context(|| format!("comparing {} with {}", windows.display(), linux.display()))?;
    let line = format!("{name}: {found}");
    if found.largest > allowed {
        bail!("{line}; at most {allowed:.0e} is allowed");
    }
    Ok(line)
}

/// Installs what is missing.
fn install() -> Result<()> {
    let missing = missing(
        has_library() || has_sources(),
        Path::new(LINKER).is_file(),
        wine::program().is_some(),
    );
    if missing.is_empty() {
        return Ok(());
    }
    if !Path::new("/usr/bin/apt-get").is_file() {
        bail!(
            "this task needs a Rust compiler for {TRIPLE}, its linker and wine: on Debian the packages {}",
            missing.join(", ")
        );
    }
    let install = ["apt-get", "install", "-y", "--no-install-recommends"];
    let args = [&install[..], &missing].concat();
    let user = Command::new("id").arg("-u").output().context("cannot start `id -u`")?;
    match user.stdout.trim_ascii() {
        b"0" => workspace::run(args[0], &args[1..]),
        _ => workspace::run("sudo", &args),
    }
    .context("if a package is not found, run `apt-get update` first")
}

/// Debian's packages that are missing.
fn missing(compiler: bool, linker: bool, wine: bool) -> Vec<&'static str> {
    let mut packages = Vec::new();
    packages.extend(COMPILER.into_iter().filter(|_| !compiler));
    packages.extend((!linker).then_some(MINGW));
    packages.extend((!wine).then_some(WINE));
    packages
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn issue_21_only_missing_packages_are_installed() {
        assert!(missing(true, true, true).is_empty());
        assert_eq!(missing(true, false, true), [MINGW]);
        assert_eq!(missing(false, true, true), COMPILER);
        assert_eq!(missing(false, false, false).len(), 5);
    }
}
