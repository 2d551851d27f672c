//! Builds the Python package: a wheel with the extension module, the command, the units and the scenarios.
//!
//! maturin packs everything beside the Python files of a package, so the package is laid out in `target/wheel/package`.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};

use crate::{
    licences,
    package::{self, Order},
    python,
    target::{self, Target},
    workspace,
};

/// Package from PyPI that builds the wheel.
const MATURIN: &str = "crates/xtask/maturin-requirements.txt";
/// The crate, with the Python files of the package.
const CRATE: &str = "crates/python";
/// Tests of the package, with the requirements that they need.
const TESTS: &str = "crates/python/tests";
/// The package, as Python imports it.
const PACKAGE: &str = "maglev_cosim";
/// The lists of the package's data, each a folder in the repository and in the package.
const DATA: [&str; 1] = ["scenarios"];

/// Builds the wheel into `target/wheel` and returns its path. `portable`: for any Linux with glibc 2.17 or later.
pub fn build(portable: bool) -> Result<PathBuf> {
    let wanted: Option<Target> =
        portable.then(|| target::PORTABLE.parse()).transpose().map_err(anyhow::Error::msg)?;
    let folder = workspace::target_dir().join("wheel");
    let stage = folder.join("package");
    if stage.exists() {
        fs::remove_dir_all(&stage).with_context(|| format!("removing {}", stage.display()))?;
    }
    let content = stage.join(PACKAGE);
    package::package(&Order {
        targets: wanted.iter().cloned().collect(),
        also: &[workspace::COMMAND],
        no_bundles: true,
        out: Some(content.join("units")),
        ..Order::default()
    })?;
    if let Some(target) = &wanted {
        target.build(&[workspace::COMMAND])?;
    }
    let program = wanted.as_ref().map_or_else(workspace::maglev, Target::maglev);
    let name = program.file_name().context("a program has a name")?;
    copy(&program, &content.join("bin").join(name))?;
    for data in DATA {
        data_files(&workspace::root().join(data), &content.join(data))?;
    }
    let source = workspace::root().join(CRATE);
    for file in files(&source.join(PACKAGE))? {
        copy(&file, &content.join(file.file_name().unwrap_or_default()))?;
    }
    copy(&source.join("README.md"), &stage.join("README.md"))?;
    for (name, text) in licences::files_of_program("python-package", &licences::dependencies()?)? {
        write(&stage.join("licenses").join(name), &text)?;
    }
    let project = read(&source.join("pyproject.toml"))?;
    let manifest = toml_text(&source.join("Cargo.toml"));
    let project =
        project.replace("manifest-path = \"Cargo.toml\"", &format!("manifest-path = {manifest}"));
    write(&stage.join("pyproject.toml"), project.as_bytes())?;
    maturin(&stage, &folder, wanted.is_some())
}

/// Installs a wheel into an environment with what the tests use, and runs them there.
pub fn test(wheel: &Path) -> Result<()> {
    let python =
        python::environment("python-package", Path::new(TESTS).join("requirements.txt").as_path())?;
    let file = wheel.to_string_lossy();
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-deps"];
    workspace::run(&python, &[&install[..], &["--force-reinstall", &*file]].concat())?;
    let tests = ["-m", "pytest", "-q", "-rA", "--tb=short", "--durations=10", TESTS];
    workspace::run_with(&python, &tests, &[("MAGLEV_WHEEL", wheel.as_os_str())])
}

/// Runs maturin on the package that is laid out in a folder.
fn maturin(stage: &Path, out: &Path, portable: bool) -> Result<PathBuf> {
    let python = python::environment("maturin", Path::new(MATURIN))?;
    let maturin = python.with_file_name(if cfg!(windows) { "maturin.exe" } else { "maturin" });
    for old in files(out)? {
        fs::remove_file(&old).with_context(|| format!("removing {}", old.display()))?;
    }
    let (out, interpreter) = (out.to_string_lossy(), python.to_string_lossy());
    let mut args = vec!["build", "--release", "--out", &out, "--interpreter", &interpreter];
    if portable {
        let target = "x86_64-unknown-linux-gnu";
        args.extend(["--zig", "--target", target, "--compatibility", "manylinux_2_17"]);
    }
    // maturin looks for pyproject.toml in its working directory, and for zig in the search path
    let path = if portable { target::with_zig()? } else { env::var_os("PATH").unwrap_or_default() };
    workspace::run_in(stage, maturin, &args, &[("PATH", path.as_os_str())])?;
    let wheels: Vec<PathBuf> = files(Path::new(&*out))?
        .into_iter()
        .filter(|file| file.extension().is_some_and(|end| end == "whl"))
        .collect();
    match wheels.as_slice() {
        [wheel] => Ok(wheel.clone()),
        _ => bail!("maturin made {} wheels instead of one", wheels.len()),
    }
}

/// Copies the files of a folder and of the folders in it. Paths of units are those in the package.
fn data_files(from: &Path, to: &Path) -> Result<()> {
    for file in files(from)? {
        let text = read(&file)?.replace("../target/fmu/", "../units/");
        write(&to.join(file.file_name().unwrap_or_default()), text.as_bytes())?;
    }
    for entry in fs::read_dir(from).with_context(|| format!("reading {}", from.display()))? {
        let entry = entry?;
        if entry.path().is_dir() {
            data_files(&entry.path(), &to.join(entry.file_name()))?;
        }
    }
    Ok(())
}

/// The files in a folder, sorted.
fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).with_context(|| format!("reading {}", folder.display()))? {
        let path = entry?.path();
        if path.is_file() {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// A path as a string of TOML.
fn toml_text(path: &Path) -> String {
    format!("'{}'", path.display())
}

fn read(file: &Path) -> Result<String> {
    fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))
}

fn write(file: &Path, content: &[u8]) -> Result<()> {
    let folder = file.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
    fs::write(file, content).with_context(|| format!("writing {}", file.display()))
}

fn copy(from: &Path, to: &Path) -> Result<()> {
    let folder = to.parent().unwrap_or(Path::new(""));
    fs::create_dir_all(folder).with_context(|| format!("creating {}", folder.display()))?;
    fs::copy(from, to).with_context(|| format!("copying {}", from.display()))?;
    Ok(())
}
