//! Where the master's files are: units that change the working directory, folders that allow no
//! execution.

#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::process::Command;

use support::{Bench, ring, with_states};

/// A unit leaves the working directory while it is made, or while it steps: all files are where they
/// were asked for.
#[test]
fn issue_paths_stay_valid_if_a_unit_changes_the_working_directory() {
    for call in ["fmi2Instantiate", "fmi2DoStep", "fmi2Terminate"] {
        let bench = Bench::new();
        bench.unit("unit.fmu", &with_states(), &["-DHOSTILE"]);
        let mut scenario = ring();
        scenario["plots"] = serde_json::json!(
            [{ "file": "y.svg", "panels": [{ "ylabel": "y", "signals": ["a.y"] }] }]
        );
        bench.scenario(&scenario);
        let arguments = ["--checkpoint-every", "0.3", "--format", "csv,parquet"];
        let ran = bench.hostile(&format!("a {call} chdir -1e300"), &arguments);
        ran.succeeds();
        let report = ran.stderr() + &ran.stdout();
        assert!(!report.contains("cannot make the report"), "{report}");
        for file in [
            "results.csv",
            "results.parquet",
            "events.csv",
            "summary.json",
            "scenario-as-run.json",
            "y.svg",
            "report.html",
        ] {
            assert!(bench.path("out").join(file).is_file(), "{call}: {file}");
        }
        assert!(!bench.path("out/checkpoint.bin").exists());
        assert!(report.contains("out/report.html") && !report.contains("/out/"), "{report}");
    }
}

/// A run that fails after the change keeps its results, and goes on from its checkpoint.
#[test]
fn issue_a_failed_run_resumes_after_a_unit_changed_the_working_directory() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &["-DHOSTILE"]);
    bench.scenario(&ring());
    let mischief = "a fmi2DoStep chdir 0.1";
    let arguments =
        ["--checkpoint-every", "0.2", "--set", "b.fault=4", "--set", "b.fail_time=0.65"];
    bench.hostile(mischief, &arguments).fails(1, &["unit b", "the model broke"]);
    assert_eq!(bench.rows().len(), 7);
    assert!(bench.path("out/checkpoint.bin").is_file());
    let first = bench.rows();
    bench.maglev(&["resume", "out"]).fails(1, &["unit b", "the model broke"]);
    assert_eq!(bench.rows(), first);
}

/// A folder for temporary files that allows no execution is named. Where this test may not mount one,
/// library.rs still tests what the loader's complaint is taken for.
#[test]
fn issue_a_temporary_folder_without_execution_is_named_with_help() {
    let bench = Bench::new();
    bench.scenario(&ring());
    let folder = bench.path("no exec");
    std::fs::create_dir(&folder).unwrap();
    let mount = Command::new("mount")
        .args(["-t", "tmpfs", "-o", "noexec,size=8m", "none"])
        .arg(&folder)
        .output();
    if !mount.is_ok_and(|it| it.status.success()) {
        return;
    }
    let plain = bench.shell("TMPDIR='no exec' maglev run scenario.json --out out");
    let isolated = bench.shell("TMPDIR='no exec' maglev run scenario.json --out out --isolate");
    let unmounted = Command::new("umount").arg(&folder).status().unwrap();
    for ran in [plain, isolated] {
        ran.fails(
            2,
            &["no exec", "is mounted noexec: set TMPDIR to a folder that allows execution"],
        );
    }
    assert!(unmounted.success());
}
