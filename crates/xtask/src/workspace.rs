//! Paths of the workspace, and how the tasks start other programs.

use std::{
    env,
    ffi::OsStr,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, Result, bail};

/// The workspace's root folder.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

/// The folder of the built units.
///
/// It is always `target/fmu`, even if cargo builds in another folder: scripts and scenarios name it.
pub fn unit_dir() -> PathBuf {
    root().join("target").join("fmu")
}

/// Cargo's target folder; `CARGO_TARGET_DIR` may move it.
pub fn target_dir() -> PathBuf {
    match env::var_os("CARGO_TARGET_DIR") {
        Some(dir) => root().join(dir),
        None => root().join("target"),
    }
}

/// Runs `program` in the workspace's root folder; an error if it fails.
pub fn run<S: AsRef<OsStr>>(program: impl AsRef<OsStr>, args: &[S]) -> Result<()> {
    run_with(program, args, &[])
}

/// Like [`run`], with additional environment variables.
pub fn run_with<S: AsRef<OsStr>>(
    program: impl AsRef<OsStr>,
    args: &[S],
    environment: &[(&str, &OsStr)],
) -> Result<()> {
    run_in(&root(), program, args, environment)
}

/// Like [`run_with`], in another folder.
pub fn run_in<S: AsRef<OsStr>>(
    folder: &Path,
    program: impl AsRef<OsStr>,
    args: &[S],
    environment: &[(&str, &OsStr)],
) -> Result<()> {
    let program = program.as_ref();
    let mut command = Command::new(program);
    command.args(args).current_dir(folder).envs(environment.iter().copied());
    let line = format!(
        "{} {}",
        program.to_string_lossy(),
        args.iter().map(|a| a.as_ref().to_string_lossy()).collect::<Vec<_>>().join(" ")
    );
    eprintln!("+ {line}");
    let status = command.status().with_context(|| format!("cannot start `{line}`"))?;
    if !status.success() {
        bail!("`{line}` ended with {status}");
    }
    Ok(())
}

/// The cargo that runs this task.
pub fn cargo() -> PathBuf {
    env::var_os("CARGO").map_or_else(|| PathBuf::from("cargo"), PathBuf::from)
}

/// Builds packages with the release profile, in one call of cargo, which shows what it compiles.
pub fn build(packages: &[&str]) -> Result<()> {
    let mut args = vec!["build", "--release"];
    for package in packages {
        args.extend(["--package", package]);
    }
    run(cargo(), &args)
}

/// Builds the program of one of our packages, and returns its path.
pub fn build_program(package: &str) -> Result<PathBuf> {
    build(&[package])?;
    Ok(release(package))
}

/// The command's package.
pub const COMMAND: &str = "maglev-cli";

/// The release build of the command `maglev`.
pub fn maglev() -> PathBuf {
    release("maglev")
}

fn release(program: &str) -> PathBuf {
    let file = format!("{program}{}", env::consts::EXE_SUFFIX);
    target_dir().join("release").join(file)
}

/// Runs a scenario with `maglev`, which must be built.
///
/// The exit status of `maglev` becomes ours, so that scripts can distinguish a failed run (1) from
/// invalid input (2).
pub fn run_maglev(scenario: &Path, options: &[String]) -> Result<()> {
    let maglev = maglev();
    let status = Command::new(&maglev)
        .arg("run")
        .arg(scenario)
        .args(options)
        .status()
        .with_context(|| format!("cannot start {}", maglev.display()))?;
    match status.code() {
        Some(0) => Ok(()),
        Some(code) => std::process::exit(code),
        None => bail!("maglev was ended by a signal: {status}"),
    }
}
