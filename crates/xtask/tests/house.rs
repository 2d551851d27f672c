//! Guards the layout of the workspace: which crate may use which, and how large files may be.
//! ARCHITECTURE.md says what each crate is for.

#![allow(clippy::unwrap_used, reason = "a test program")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

use cargo_metadata::{DependencyKind, Metadata, MetadataCommand, Package};

/// Each package with those of our packages that it may depend on. Tests, benches and examples may use
/// others.
const PLAN: &[(&str, &[&str])] = &[
    // physics and analysis: no FMI
    ("magnet", &[]),
    ("guideway", &["strict-json"]),
    ("multibody", &["linear-motor", "patterns", "strict-json", "track-line"]),
    ("linear-motor", &["strict-json"]),
    ("track-line", &["strict-json"]),
    ("analysis", &[]),
    // small tools
    ("patterns", &[]),
    ("strict-json", &["patterns"]),
    ("figure", &[]),
    ("shared-features", &[]),
    ("criteria", &["patterns", "strict-json"]),
    // FMI, for any FMU
    ("fmi2-sys", &[]),
    ("fmi2-export", &["fmi2-sys"]),
    ("fmi2-package", &[]),
    ("fmi2-import", &["fmi2-sys"]),
    ("fmi2-conformance", &["fmi2-import", "fmi2-sys", "patterns"]),
    ("fmi2-derive", &["fmi2-import", "fmi2-package", "patterns", "strict-json"]),
    // the units
    ("controller-variables", &["fmi2-export", "magnet"]),
    ("fmu-controller", &["controller-variables", "fmi2-export", "magnet"]),
    ("fmu-ems", &["controller-variables", "fmi2-export", "magnet"]),
    ("fmu-guideway", &["fmi2-export", "guideway", "shared-features"]),
    ("fmu-vehicle", &["fmi2-export", "linear-motor", "magnet", "multibody", "track-line"]),
    ("state-feedback", &["fmi2-export"]),
    // a whole system as one unit
    ("bundle-table", &[]),
    (
        "bundle",
        &[
            "bundle-table",
            "fmi2-derive",
            "fmi2-import",
            "fmi2-package",
            "in-memory",
            "master",
            "patterns",
            "results",
            "scenario",
        ],
    ),
    (
        "fmu-bundle",
        &[
            "bundle-table",
            "coupling",
            "fmi2-export",
            "fmi2-import",
            "linear",
            "master",
            "scenario",
            "shared-features",
        ],
    ),
    // co-simulation
    ("scenario", &["criteria", "fmi2-derive", "fmi2-import", "patterns", "strict-json"]),
    ("results", &["criteria", "patterns"]),
    ("sources", &["patterns", "scenario"]),
    ("coupling", &["fmi2-import", "results", "scenario"]),
    (
        "master",
        &[
            "coupling",
            "fmi2-conformance",
            "fmi2-derive",
            "fmi2-import",
            "patterns",
            "results",
            "scenario",
            "sources",
        ],
    ),
    ("ssp", &["fmi2-derive", "fmi2-import", "master", "patterns", "results", "scenario"]),
    ("linear", &["coupling", "fmi2-import", "master", "patterns", "results"]),
    ("stability-map", &[]),
    (
        "maps",
        &[
            "figure",
            "fmi2-import",
            "linear",
            "master",
            "patterns",
            "results",
            "scenario",
            "stability-map",
        ],
    ),
    ("response", &["linear", "patterns", "results"]),
    (
        "tune",
        &[
            "figure",
            "fmi2-import",
            "linear",
            "maps",
            "master",
            "response",
            "results",
            "scenario",
            "stability-map",
            "strict-json",
        ],
    ),
    ("floquet", &["fmi2-import", "linear", "master", "patterns", "scenario"]),
    (
        "report",
        &[
            "analysis",
            "criteria",
            "figure",
            "fmi2-derive",
            "fmi2-import",
            "guideway",
            "multibody",
            "results",
            "track-line",
        ],
    ),
    (
        "measured",
        &[
            "analysis",
            "figure",
            "fmi2-import",
            "patterns",
            "report",
            "results",
            "scenario",
            "sources",
            "strict-json",
        ],
    ),
    (
        "in-memory",
        &[
            "analysis",
            "criteria",
            "fmi2-import",
            "master",
            "patterns",
            "report",
            "results",
            "scenario",
        ],
    ),
    (
        "fit",
        &[
            "fmi2-import",
            "in-memory",
            "master",
            "measured",
            "patterns",
            "report",
            "results",
            "scenario",
        ],
    ),
    ("study", &["criteria", "fmi2-derive", "in-memory", "master", "results", "scenario"]),
    ("study-report", &["report", "results"]),
    (
        "maglev-cli",
        &[
            "analysis",
            "bundle",
            "criteria",
            "figure",
            "fmi2-conformance",
            "fmi2-derive",
            "fmi2-import",
            "fmi2-package",
            "in-memory",
            "fit",
            "floquet",
            "linear",
            "maps",
            "master",
            "measured",
            "patterns",
            "report",
            "response",
            "results",
            "scenario",
            "shared-features",
            "ssp",
            "study",
            "study-report",
            "tune",
        ],
    ),
    (
        "python-package",
        &[
            "criteria",
            "fmi2-import",
            "in-memory",
            "linear",
            "maglev-cli",
            "master",
            "patterns",
            "report",
            "results",
            "scenario",
            "study",
        ],
    ),
    // tasks and tests
    ("xtask", &["figure", "fmi2-package", "fmi2-sys", "shared-features"]),
    ("paper", &["analysis", "figure", "results"]),
    ("reference", &["fmi2-conformance", "fmi2-import"]),
    ("unit-tests", &["fmi2-package", "fmi2-sys"]),
    ("system-tests", &["guideway", "magnet", "multibody", "track-line"]),
];

/// Crates in which the compiler must refuse `unsafe`.
const SAFE: [&str; 4] = ["analysis", "guideway", "magnet", "multibody"];

/// Lines that a source file may have.
const LONGEST: usize = 600;

/// Longer files, and why they are not split.
const LONGER: &[(&str, &str)] =
    &[("crates/fmi2-export/src/ffi.rs", "one function for each of the C interface")];

/// Lines that `master/src` may have: the master algorithm stays small.
const MASTER: usize = 7_000;

fn workspace() -> Metadata {
    let manifest = root().join("Cargo.toml");
    MetadataCommand::new().manifest_path(manifest).no_deps().exec().unwrap()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_path_buf()
}

/// Our packages among the dependencies of `package` that are compiled into it.
fn used<'a>(package: &'a Package, ours: &BTreeSet<&str>) -> BTreeSet<&'a str> {
    let compiled = package.dependencies.iter().filter(|it| it.kind != DependencyKind::Development);
    compiled.map(|it| it.name.as_str()).filter(|name| ours.contains(name)).collect()
}

/// Every Rust source of the workspace: its path from the root, and its lines.
fn sources() -> Vec<(String, usize)> {
    let root = root();
    let mut folders: Vec<PathBuf> = workspace()
        .workspace_packages()
        .iter()
        .map(|package| package.manifest_path.parent().unwrap().as_std_path().to_path_buf())
        .collect();
    let mut found = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() && !path.ends_with("target") {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let lines = fs::read_to_string(&path).unwrap().lines().count();
                let name = path.strip_prefix(&root).unwrap().to_string_lossy().replace('\\', "/");
                found.push((name, lines));
            }
        }
    }
    found
}

#[test]
fn issue_13_packages_depend_only_on_those_in_the_plan() {
    let metadata = workspace();
    let packages = metadata.workspace_packages();
    let ours: BTreeSet<&str> = packages.iter().map(|package| package.name.as_str()).collect();
    let planned: BTreeSet<&str> = PLAN.iter().map(|(name, _)| *name).collect();
    assert_eq!(planned, ours, "the plan names other packages (left) than the workspace (right)");
    let mut wrong = Vec::new();
    for package in &packages {
        let (_, allowed) = PLAN.iter().find(|(name, _)| *name == package.name.as_str()).unwrap();
        for name in used(package, &ours).difference(&allowed.iter().copied().collect()) {
            wrong.push(format!("{} must not depend on {name}", package.name));
        }
        for name in allowed.iter().filter(|name| !ours.contains(*name)) {
            wrong.push(format!("the plan lets {} use {name}, which does not exist", package.name));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn issue_13_physics_is_without_unsafe_code() {
    for name in SAFE {
        let file = root().join("crates").join(name).join("src/lib.rs");
        let text = fs::read_to_string(&file).unwrap();
        assert!(text.contains("#![forbid(unsafe_code)]"), "{}", file.display());
    }
}

#[test]
fn issue_13_source_files_stay_short() {
    let sources = sources();
    assert!(sources.len() > 200, "only {} source files were found", sources.len());
    let exempt = |name: &str| LONGER.iter().any(|(longer, _)| *longer == name);
    let long: Vec<_> =
        sources.iter().filter(|(name, lines)| *lines > LONGEST && !exempt(name)).collect();
    assert!(long.is_empty(), "split these files, which have over {LONGEST} lines: {long:#?}");
    for (name, why) in LONGER {
        let lines = sources.iter().find(|(source, _)| source == name).map(|(_, lines)| *lines);
        assert!(
            lines.is_some_and(|lines| lines > LONGEST),
            "remove {name} ({why}) from the list of long files: it has {lines:?} lines"
        );
    }
}

#[test]
fn issue_13_the_master_stays_small() {
    let lines: usize = sources()
        .iter()
        .filter(|(name, _)| name.starts_with("master/src/"))
        .map(|(_, lines)| lines)
        .sum();
    assert!(
        (1..MASTER).contains(&lines),
        "master/src has {lines} lines; below {MASTER} are allowed"
    );
}
