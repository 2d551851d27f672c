//! A first build compiles each dependency once, although cargo is called for xtask, for the units, for
//! the command and for the Python package. So do the checks, which call it for the whole workspace.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::{
    collections::{BTreeMap, BTreeSet},
    process::Command,
};

/// What cargo is called for, as arguments of `cargo tree`.
const CALLS: [&[&str]; 5] = [
    &["--edges=normal,build", "--package=xtask"],
    &[
        "--edges=normal,build",
        "--package=fmu-controller",
        "--package=fmu-ems",
        "--package=fmu-guideway",
        "--package=fmu-vehicle",
    ],
    &["--edges=normal,build", "--package=maglev-cli"],
    &["--edges=normal,build", "--package=python-package"],
    &["--edges=normal,build,dev", "--workspace"],
];

/// The features of every dependency in one call; a package that is compiled for macros and for programs
/// may have two sets.
fn features(call: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let mut command = Command::new(env!("CARGO"));
    command.args(["tree", "--prefix=none", "--format={p}|{f}"]).args(call);
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for line in String::from_utf8(output.stdout).unwrap().lines() {
        let line = line.trim_end_matches(" (*)");
        let Some((package, features)) = line.split_once('|') else { continue };
        // our own packages have no features that matter
        if !package.contains(" (/") {
            found.entry(package.to_owned()).or_default().insert(features.to_owned());
        }
    }
    assert!(found.len() > 30, "cargo tree lists {found:?}");
    found
}

#[test]
fn issue_13_calls_of_cargo_share_their_dependencies() {
    let calls = CALLS.map(|call| (call, features(call)));
    let mut wrong = Vec::new();
    for (k, (call, one)) in calls.iter().enumerate() {
        for (other_call, other) in &calls[..k] {
            for (package, sets) in one {
                let Some(theirs) = other.get(package) else { continue };
                if !sets.is_subset(theirs) && !theirs.is_subset(sets) {
                    wrong.push(format!(
                        "{package}: {sets:?} for {call:?}, but {theirs:?} for {other_call:?}"
                    ));
                }
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "cargo compiles these dependencies several times; name the features that are missing in \
         crates/shared-features/Cargo.toml:\n{}",
        wrong.join("\n")
    );
}
