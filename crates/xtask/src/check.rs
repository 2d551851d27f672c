//! `cargo xtask test` and `cargo xtask codegen`: what must hold on main.

use std::{ffi::OsStr, fs, path::Path, time::Instant};

use anyhow::{Context, Result, bail};

use crate::{
    package::{self, Order},
    python, reference, workspace,
};

/// A named step of the whole check.
type Step = (&'static str, fn() -> Result<()>);

/// Runs every check and reports all of them, not only the first failure.
pub fn all(with_python: bool) -> Result<()> {
    let mut steps: Vec<Step> = vec![
        ("format", || cargo(&["fmt", "--all", "--check"])),
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
        ("generated files", || codegen(true)),
    ];
    if with_python {
        steps.push(("guide", guide));
        steps.push(("Python tests", python_tests));
    }
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
    workspace::build(&[workspace::COMMAND])?;
    let maglev = workspace::maglev();
    let output = std::process::Command::new(&maglev)
        .arg("schema")
        .output()
        .with_context(|| format!("cannot start {}", maglev.display()))?;
    let schema = String::from_utf8(output.stdout)?;
    generated(&workspace::root().join("scenarios").join("schema.json"), &schema, check)?;
    // made of the schema and the descriptions, so after them
    let pages = ["docs/_guide/reference.py", "--check"];
    workspace::run(python::SYSTEM, if check { &pages } else { &pages[..1] })?;
    reference::codegen(check)
}

/// Generates the FMI bindings, in a program of its own: only that needs bindgen.
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
