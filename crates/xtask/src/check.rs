//! `cargo xtask test` and `cargo xtask codegen`: what must hold on the branch main.

use std::{ffi::OsStr, fs, path::Path, time::Instant};

use anyhow::{Context, Result, bail};

use crate::{
    package::{self, Order},
    python, reference, wheel, workspace,
};

/// A step with its name.
type Step = (&'static str, fn() -> Result<()>);

/// Packages whose tests take long or need packed units.
const SLOW: [&str; 3] = [workspace::COMMAND, "system-tests", "unit-tests"];

/// Runs every check.
pub fn all(with_python: bool) -> Result<()> {
    let mut steps: Vec<Step> = vec![
        ("format", format),
        ("package the units", || {
            package::package(&Order { check: true, ..Order::default() }).map(drop)
        }),
        ("lints", || {
            cargo(&["clippy", "--release", "--workspace", "--all-targets", "--", "-D", "warnings"])
        }),
        ("Rust tests", || {
            workspace::build(&[workspace::COMMAND])?;
            cargo(&["test", "--release", "--workspace"])
        }),
        ("documentation", || {
            workspace::run_with(
                workspace::cargo(),
                &["doc", "--release", "--workspace", "--no-deps", "--quiet"],
                &[("RUSTDOCFLAGS", OsStr::new("-D warnings"))],
            )
        }),
        ("publishable crates", || {
            // The files as they are count, whether or not they are committed.
            cargo(&["publish", "--workspace", "--dry-run", "--allow-dirty"])
        }),
        ("generated files", || codegen(true)),
    ];
    if with_python {
        steps.push(("guide", guide));
        steps.push(("Python tests", python_tests));
        steps.push(("Python package", || wheel::test(&wheel::build(false)?)));
    }
    run(steps)
}

/// Runs the checks that take little time, with the dev profile.
pub fn quick() -> Result<()> {
    run(vec![
        ("format", format),
        ("lints", || cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"])),
        ("unit tests", || cargo(&["test", "--workspace", "--lib", "--bins"])),
        ("integration tests", || {
            let fast = SLOW.map(|package| format!("--exclude={package}"));
            let fast: Vec<&str> = fast.iter().map(String::as_str).collect();
            // a test of fmi2-export loads its example
            cargo(&[&["build", "--workspace", "--examples"], &fast[..]].concat())?;
            cargo(&[&["test", "--workspace", "--test", "*"], &fast[..]].concat())
        }),
    ])
}

/// Runs all steps and reports all failures, not only the first.
fn run(steps: Vec<Step>) -> Result<()> {
    let mut report = Vec::new();
    let mut failed = 0;
    for (name, step) in steps {
        eprintln!("\n=== {name}");
        let start = Instant::now();
        let outcome = step();
        let seconds = start.elapsed().as_secs_f64();
        match outcome {
            Ok(()) => report.push(format!("ok      {name} ({seconds:.1} s)")),
            Err(error) => {
                failed += 1;
                eprintln!("error: {error:#}");
                report.push(format!("FAILED  {name} ({seconds:.1} s): {error:#}"));
            }
        }
    }
    println!("\n{}", report.join("\n"));
    println!("{} passed, {failed} failed", report.len() - failed);
    if failed > 0 {
        bail!("{failed} of {} checks failed", report.len());
    }
    Ok(())
}

fn format() -> Result<()> {
    cargo(&["fmt", "--all", "--check"])
}

fn cargo(args: &[&str]) -> Result<()> {
    workspace::run(workspace::cargo(), args)
}

fn python_tests() -> Result<()> {
    let python = python::environment("python", Path::new(python::TESTS))?;
    workspace::run(python, &["-m", "pytest", "-q", "-rA", "--tb=short", "tests/python"])
}

/// Builds the guide in `docs/` and checks its links; the book is `target/docs/html`.
pub fn guide() -> Result<()> {
    let python = python::environment("docs/python", Path::new(python::GUIDE))?;
    workspace::run(python, &["docs/build.py", "target/docs"])
}

/// Writes, or with `check` compares, every generated file that is committed.
pub fn codegen(check: bool) -> Result<()> {
    bindings(check)?;
    package::build()?;
    for unit in package::units()? {
        generated(&package::description_file(&unit), &package::describe(&unit)?, check)?;
    }
    layout_schemas(check)?;
    workspace::build(&[workspace::COMMAND])?;
    let maglev = workspace::maglev();
    let published = [
        ("scenario", "scenarios"),
        ("criteria", "criteria"),
        ("study", "examples/studies"),
        ("tuning", "examples/tuning"),
    ];
    for (kind, folder) in published {
        let output = std::process::Command::new(&maglev)
            .args(["schema", kind])
            .output()
            .with_context(|| format!("cannot start {}", maglev.display()))?;
        let schema = String::from_utf8(output.stdout)?;
        generated(&workspace::root().join(folder).join("schema.json"), &schema, check)?;
    }
    // these pages are made from the schema and the descriptions
    let pages = ["docs/_guide/reference.py", "--check"];
    workspace::run(python::SYSTEM, if check { &pages } else { &pages[..1] })?;
    reference::codegen(check)
}

/// Writes, or with `check` compares, the schemas of the layouts. Tests do that, since the code that makes the schemas is
/// compiled for tests only.
fn layout_schemas(check: bool) -> Result<()> {
    let crates = ["-p", "guideway", "-p", "linear-motor", "-p", "multibody", "-p", "track-line"];
    let test = [&["test", "--quiet"], &crates[..], &["--test", "schema", "golden_"]].concat();
    let write: &[(&str, &OsStr)] = if check { &[] } else { &[("WRITE_SCHEMA", OsStr::new("1"))] };
    workspace::run_with(workspace::cargo(), &test, write)
}

/// Generates the FMI bindings, in a separate program, so that only that needs bindgen.
fn bindings(check: bool) -> Result<()> {
    let mut args = vec!["run", "--release", "--package", "xtask"];
    args.extend(["--features", "codegen", "--bin", "bindings", "--"]);
    args.extend(check.then_some("--check"));
    cargo(&args)
}

/// Writes `content` to `file` where it differs; with `check` that is an error.
pub fn generated(file: &Path, content: &str, check: bool) -> Result<()> {
    if fs::read_to_string(file).is_ok_and(|text| text == content) {
        return Ok(());
    }
    if check {
        bail!("{} is stale: run `cargo xtask codegen` and commit", file.display());
    }
    fs::write(file, content).with_context(|| format!("writing {}", file.display()))?;
    eprintln!("wrote {}", file.display());
    Ok(())
}
