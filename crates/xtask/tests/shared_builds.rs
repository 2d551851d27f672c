//! A first build compiles each dependency once, although cargo is called for xtask, for the units and for
//! the command.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::{
    collections::{BTreeMap, BTreeSet},
    process::Command,
};

/// What cargo is called for: the packages of each call.
const CALLS: [&[&str]; 3] =
    [&["xtask"], &["fmu-ems", "fmu-guideway", "fmu-vehicle"], &["maglev-cli"]];

/// The features of every dependency in one call; a package that is compiled for macros and for programs
/// may have two sets.
fn features(packages: &[&str]) -> BTreeMap<String, BTreeSet<String>> {
    let mut command = Command::new(env!("CARGO"));
    command.args(["tree", "--edges", "normal,build", "--prefix", "none", "--format", "{p}|{f}"]);
    for package in packages {
        command.args(["--package", package]);
    }
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
    let calls = CALLS.map(|packages| (packages, features(packages)));
    let mut wrong = Vec::new();
    for (k, (packages, one)) in calls.iter().enumerate() {
        for (others, other) in &calls[..k] {
            for (package, sets) in one {
                let Some(theirs) = other.get(package) else { continue };
                if !sets.is_subset(theirs) && !theirs.is_subset(sets) {
                    wrong.push(format!(
                        "{package}: {sets:?} for {packages:?}, but {theirs:?} for {others:?}"
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
