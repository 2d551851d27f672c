//! `cargo xtask sanitize`: random calls on the units under the address and leak sanitizers.
//!
//! The sanitizers are in every toolchain, but behind an unstable flag: `RUSTC_BOOTSTRAP` lets the
//! stable compiler accept it. Everything is built into a separate folder.

use std::{ffi::OsStr, path::Path};

use anyhow::{Result, bail};

use crate::workspace;

/// The libraries ask the test program for the sanitizer's functions, hence `-rdynamic`.
const FLAGS: &str = "-Zsanitizer=address -Clink-arg=-rdynamic";

/// Stops at the first error or leak and prints where it occurred.
const OPTIONS: &str = "detect_leaks=1:detect_stack_use_after_return=1:strict_string_checks=1";

/// Builds all with the sanitizers and makes about `calls` calls on each unit and on the kit's own
/// test model; fails at the first finding.
pub fn run(calls: u64) -> Result<()> {
    let (os, arch) = (std::env::consts::OS, std::env::consts::ARCH);
    if (os, arch) != ("linux", "x86_64") {
        bail!("the sanitizers are set up for Linux on x86_64, not {os} on {arch}");
    }
    let folder = workspace::target_dir().join("sanitize");
    let calls = calls.to_string();
    let environment = [
        ("RUSTC_BOOTSTRAP", OsStr::new("1")),
        ("RUSTFLAGS", OsStr::new(FLAGS)),
        ("ASAN_OPTIONS", OsStr::new(OPTIONS)),
        ("RANDOM_CALLS", OsStr::new(&calls)),
        // The kit's test model panics on purpose, thousands of times.
        ("RUST_BACKTRACE", OsStr::new("0")),
    ];
    let cargo = |what: &[&str]| {
        let mut args = cargo_args(&folder, what);
        args.extend(["--".into(), "--nocapture".into()].into_iter().filter(|_| what[0] == "test"));
        workspace::run_with(workspace::cargo(), &args, &environment)
    };
    cargo(&[
        "build",
        "--package=fmu-controller",
        "--package=fmu-ems",
        "--package=fmu-guideway",
        "--package=fmu-vehicle",
    ])?;
    // One of the kit's tests loads its example, which `--tests` leaves out.
    cargo(&["build", "--package=fmi2-export", "--examples"])?;
    cargo(&["test", "--package=fmi2-export", "--tests"])?;
    cargo(&["test", "--package=unit-tests", "--tests"])
}

/// A target by name keeps build scripts and macros out of it.
fn cargo_args(folder: &Path, what: &[&str]) -> Vec<String> {
    let mut args: Vec<String> = what.iter().map(|&word| word.to_owned()).collect();
    args.extend(["--release".into(), "--target=x86_64-unknown-linux-gnu".into()]);
    args.push(format!("--target-dir={}", folder.display()));
    args
}
