//! Finds the commit that the command is built from. Without git, or outside of the project's
//! repository as in a packed source, the version is all that it knows.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = commit().map(|commit| format!(" (commit {commit})")).unwrap_or_default();
    println!("cargo::rustc-env=MAGLEV_VERSION={}{commit}", env!("CARGO_PKG_VERSION"));
}

/// Commit and date, such as `1234abc, 2026-11-27`.
fn commit() -> Option<String> {
    // a packed source may lie in the repository of another project
    let root = Path::new(&git(&["rev-parse", "--show-toplevel"])?).canonicalize().ok()?;
    if root != Path::new("../..").canonicalize().ok()? {
        return None;
    }
    // a new commit changes the branch's file, a checkout changes HEAD; in a worktree they are elsewhere
    let branch = git(&["symbolic-ref", "--quiet", "HEAD"]);
    for name in ["HEAD", "packed-refs"].into_iter().chain(branch.as_deref()) {
        let path = git(&["rev-parse", "--git-path", name])?;
        // cargo runs the script every time if a file is missing
        if Path::new(&path).exists() {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    git(&["log", "-1", "--abbrev=7", "--format=%h, %cs"])
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?;
    (output.status.success() && !text.trim().is_empty()).then(|| text.trim().to_owned())
}
