//! `maglev study`: points, rows with their status, and the same bytes after kills, for any number of workers.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test program")]

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use support::{Bench, Ran, ring, with_states};

/// A bench with a damped ring: a integrates b, b integrates -a.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    let mut scenario = ring();
    scenario["instances"]["a"]["start"] = json!({ "y": 1.0 });
    scenario["connections"][1]["factor"] = json!(-1.0);
    bench.scenario(&scenario);
    bench
}

/// A study of the ring: start values and gains.
fn study() -> Value {
    json!({
        "scenario": "scenario.json",
        "factors": {
            "start": { "target": "a.y", "range": { "from": 0.5, "to": 2, "count": 8 } },
            "gain": { "target": "a.gain", "values": [1, 2, 4] }
        },
        "objectives": {
            "last": { "signal": "a.y", "figure": "final" },
            "spread": { "signal": "b.y", "figure": "standard_deviation" }
        },
        "limits": { "top": { "signal": "a.y", "figure": "max_abs", "max": 1.5 } }
    })
}

fn write(bench: &Bench, name: &str, study: &Value) {
    fs::write(bench.path(name), study.to_string()).unwrap();
}

/// All that must be equal from run to run.
fn compared(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found =
        vec![(PathBuf::from("metrics.csv"), fs::read(folder.join("metrics.csv")).unwrap())];
    for part in ["dataset", "signals"] {
        let mut open = vec![folder.join(part)];
        while let Some(place) = open.pop() {
            for entry in fs::read_dir(&place).into_iter().flatten() {
                let path = entry.unwrap().path();
                match path.is_dir() {
                    true => open.push(path),
                    false => {
                        let name = path.strip_prefix(folder).unwrap().to_owned();
                        found.push((name, fs::read(&path).unwrap()));
                    }
                }
            }
        }
    }
    found.sort();
    assert!(found.len() > 1);
    found
}

/// The rows of metrics.csv by the names of its columns.
fn rows(bench: &Bench, folder: &str) -> Vec<Value> {
    let text = fs::read_to_string(bench.path(folder).join("metrics.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let header = lines.next().unwrap();
    lines
        .map(|line| header.iter().cloned().zip(line.into_iter().map(Value::from)).collect())
        .collect()
}

fn run(bench: &Bench, options: &[&str]) -> Ran {
    bench.maglev(&[&["study", "run", "study.json", "--quiet"], options].concat())
}

fn column<'a>(rows: &'a [Value], name: &str) -> Vec<&'a str> {
    rows.iter().map(|row| row[name].as_str().unwrap()).collect()
}

#[test]
fn invariant_the_dataset_is_the_same_for_any_number_of_workers() {
    let bench = bench();
    let mut study = study();
    study["keep"] = json!({ "signals": ["a.y"] });
    write(&bench, "study.json", &study);
    let mut all = ["1", "2", "5"].map(|workers| {
        let out = format!("out-{workers}");
        run(&bench, &["--workers", workers, "--out", &out]).succeeds();
        compared(&bench.path(&out))
    });
    assert_eq!(all[0].len(), 2 + 24);
    assert!(all[0] == all[1] && all[0] == all[2]);
    let rows = rows(&bench, "out-5");
    assert_eq!(
        (rows.len(), &rows[4]["start"], &rows[4]["gain"]),
        (24, &json!("0.7142857142857143"), &json!("2"))
    );
    assert!(rows.iter().all(|row| row["status"] == "finished"));
    assert_eq!(column(&rows, "limits").iter().filter(|it| **it == "failed").count(), 9);
    // what is there is not computed again
    let journal = fs::read(bench.path("out-1/journal/run.jsonl")).unwrap();
    run(&bench, &["--out", "out-1"]).succeeds();
    assert_eq!(fs::read(bench.path("out-1/journal/run.jsonl")).unwrap(), journal);
    all[0] = compared(&bench.path("out-1"));
    assert!(all[0] == all[1]);
}

#[test]
fn crosstool_figures_are_those_of_maglev_run() {
    let bench = bench();
    write(&bench, "study.json", &study());
    run(&bench, &["--out", "out"]).succeeds();
    let mut scenario: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("scenario.json")).unwrap()).unwrap();
    for key in ["objectives", "limits"] {
        scenario[key] = study()[key].clone();
    }
    bench.scenario(&scenario);
    for row in rows(&bench, "out").iter().step_by(5) {
        let set =
            |target: &str, factor: &str| format!("{target}={}", row[factor].as_str().unwrap());
        let (start, gain) = (set("a.y", "start"), set("a.gain", "gain"));
        let options = [
            "run",
            "scenario.json",
            "--out",
            "single",
            "--set",
            &start,
            "--set",
            &gain,
            "--no-report",
        ];
        bench.maglev(&options).succeeds();
        let text = fs::read_to_string(bench.path("single/metrics.json")).unwrap();
        let metrics: Value = serde_json::from_str(&text).unwrap();
        for name in ["last", "spread", "top"] {
            let found: f64 = row[name].as_str().unwrap().parse().unwrap();
            assert_eq!(found.to_bits(), metrics[name].as_f64().unwrap().to_bits(), "{name}");
        }
    }
}

/// `fmi2Reset` of unit.c does nothing, so its instances must be made anew. This test would find old states otherwise:
/// the start value of b is that of the end of the point before.
#[test]
fn invariant_a_reset_that_resets_nothing_is_found() {
    let bench = bench();
    let mut study = study();
    // the first and the last point differ in nothing that would be set again
    study["factors"] = json!({ "gain": { "target": "a.gain", "values": [1, 1.5, 2, 2.5] } });
    write(&bench, "study.json", &study);
    run(&bench, &["--workers", "1", "--out", "out"]).succeeds();
    let rows = rows(&bench, "out");
    // the gain acts on an output that is not connected
    assert!(column(&rows, "last").windows(2).all(|pair| pair[0] == pair[1]), "{rows:?}");
}

/// One point fails, one crashes, one hangs; the others are not affected.
#[test]
fn issue_a_point_that_fails_is_a_row_with_its_status() {
    let bench = bench();
    let mut study = study();
    // see unit.c
    study["factors"] = json!({
        "fault": { "target": "b.fault", "values": [0, 4, CRASH, HANG, 0.5] },
    });
    study["set"] = json!({ "b.fail_time": 0.35 });
    study["timeout"] = json!(0.5);
    study["tries"] = json!(2);
    study["keep"] = json!({ "runs": "failures" });
    write(&bench, "study.json", &study);
    run(&bench, &["--workers", "2", "--out", "out"]).succeeds();
    let rows = rows(&bench, "out");
    let expected = ["finished", "failed", "crashed", "timed-out", "failed"];
    assert_eq!(column(&rows, "status"), expected);
    assert_eq!(column(&rows, "last")[1..], [""; 4]);
    let failures = fs::read_to_string(bench.path("out/failures.csv")).unwrap();
    for part in ["fmi2Error", "in each of 2 tries, last by signal", "longer than the 0.5 s", "0.5"]
    {
        assert!(failures.contains(part), "{part}: {failures}");
    }
    let kept = bench.path("out/runs").join(rows[1]["run"].as_str().unwrap());
    assert!(kept.join("report.html").exists());
    assert_eq!(fs::read_dir(bench.path("out/runs")).unwrap().count(), 1);
}

const CRASH: i32 = 10;
const HANG: i32 = 11;

#[test]
fn invariant_seeds_and_names_depend_on_content_only() {
    let bench = bench();
    let mut study = study();
    study["factors"]["seed"] = json!({ "target": "a.n", "seeds": 3 });
    write(&bench, "study.json", &study);
    let points = |name: &str| {
        let text = bench.maglev(&["study", "points", name]).stdout();
        let line = |line: &str| line.split_once(',').unwrap().1.to_owned();
        text.lines().skip(1).map(line).collect::<Vec<_>>()
    };
    let before = points("study.json");
    assert_eq!(before.len(), 72);
    let mut distinct: Vec<&str> = before.iter().map(|it| it.split(',').nth(2).unwrap()).collect();
    distinct.sort_unstable();
    distinct.dedup();
    assert_eq!(distinct.len(), 72, "each combination has its own seeds");
    study["factors"]["gain"]["values"] = json!([8, 1, 2, 4]);
    study["factors"]["seed"]["seeds"] = json!(4);
    write(&bench, "more.json", &study);
    let after = points("more.json");
    assert_eq!(after.len(), 8 * 4 * 4);
    assert!(before.iter().all(|point| after.contains(point)));
    // the same seeds for all combinations
    study["factors"]["seed"]["common"] = json!(true);
    write(&bench, "common.json", &study);
    let seeds: Vec<String> =
        points("common.json").iter().map(|it| it.split(',').nth(2).unwrap().to_owned()).collect();
    assert!(seeds.chunks(4).all(|four| four == &seeds[..4]));
    study["seed"] = json!(1);
    write(&bench, "other.json", &study);
    assert!(points("other.json").iter().all(|point| !after.contains(point)));
}

#[test]
fn invariant_points_computed_apart_merge_to_the_same_dataset() {
    let bench = bench();
    write(&bench, "study.json", &study());
    run(&bench, &["--out", "whole"]).succeeds();
    for span in ["1..9", "10..20"] {
        run(&bench, &["--points", span, "--out", "out"]).succeeds();
    }
    let merge = bench.maglev(&["study", "merge", "out"]);
    assert_eq!(merge.status(), 75, "{}", merge.stderr());
    assert!(merge.stdout().contains("20 of 24 points"), "{}", merge.stdout());
    run(&bench, &["--points", "21..23", "--out", "other"]).succeeds();
    run(&bench, &["--point", "24", "--out", "third"]).succeeds();
    // without the scenario and the units, as on another machine
    fs::remove_file(bench.path("scenario.json")).unwrap();
    bench.maglev(&["study", "merge", "out", "other", "third"]).succeeds();
    assert!(compared(&bench.path("out")) == compared(&bench.path("whole")));
}

#[test]
fn refusal_the_same_points_are_computed_by_one_process_at_a_time() {
    let bench = bench();
    write(&bench, "study.json", &study());
    run(&bench, &["--out", "out"]).succeeds();
    let journal = bench.path("out/journal/run.jsonl");
    let file = fs::File::options().append(true).open(journal).unwrap();
    file.lock().unwrap();
    run(&bench, &["--out", "out"]).fails(75, &["another process", "run.jsonl", "help: wait"]);
    file.unlock().unwrap();
    run(&bench, &["--out", "out"]).succeeds();
}

/// A limit on the size of files stands for a full disk.
#[test]
fn issue_a_full_disk_ends_the_study_and_it_continues() {
    let bench = bench();
    let mut study = study();
    study["factors"]["start"]["range"]["count"] = json!(300);
    write(&bench, "study.json", &study);
    run(&bench, &["--out", "whole"]).succeeds();
    let order = "maglev study run study.json --quiet --out out";
    let ran = bench.shell(&format!("trap '' XFSZ; ulimit -f 100; {order}"));
    ran.fails(
        75,
        &["cannot write the results of the study to out", "File too large", "help: free"],
    );
    let journal = fs::read_to_string(bench.path("out/journal/run.jsonl")).unwrap();
    assert!(journal.ends_with('\n') && journal.lines().count() > 10);
    run(&bench, &["--out", "out"]).succeeds();
    assert!(compared(&bench.path("out")) == compared(&bench.path("whole")));
}

fn start(bench: &Bench) -> Child {
    Command::new(env!("CARGO_BIN_EXE_maglev"))
        .args(["study", "run", "study.json", "--quiet", "--workers", "3", "--out", "out"])
        .current_dir(bench.path("."))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// The processes that a process has started.
fn children(of: u32) -> Vec<u32> {
    let path = format!("/proc/{of}/task");
    let tasks = fs::read_dir(path).into_iter().flatten().flatten();
    tasks
        .filter_map(|task| fs::read_to_string(task.path().join("children")).ok())
        .flat_map(|text| text.split_whitespace().map(|id| id.parse().unwrap()).collect::<Vec<_>>())
        .collect()
}

/// Kills workers and the whole study at random times, `kills` times, and compares the dataset with that of a study
/// without kills.
fn kill_at_random(points: u64, kills: u32) {
    let bench = bench();
    let mut study = study();
    study["factors"]["start"]["range"]["count"] = json!(points / 3);
    // some milliseconds a point
    let mut scenario: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("scenario.json")).unwrap()).unwrap();
    scenario["experiment"] = json!({ "stop": 4.0, "step": 0.001 });
    bench.scenario(&scenario);
    write(&bench, "study.json", &study);
    run(&bench, &["--out", "whole", "--workers", "1"]).succeeds();
    let whole = compared(&bench.path("whole"));
    let mut random = 12345_u64;
    let mut next = |below: u64| {
        random =
            random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) % below
    };
    let mut done = 0;
    let mut child = start(&bench);
    let begin = Instant::now();
    while done < kills {
        assert!(begin.elapsed() < Duration::from_secs(600));
        std::thread::sleep(Duration::from_millis(10 + next(150)));
        if child.try_wait().unwrap().is_some() {
            // it was too fast: from the beginning, so that every kill meets work
            fs::remove_dir_all(bench.path("out")).unwrap();
            child = start(&bench);
            continue;
        }
        let workers = children(child.id());
        if next(3) == 0 || workers.is_empty() {
            child.kill().unwrap();
            child.wait().unwrap();
            child = start(&bench);
        } else {
            let victim = workers[next(workers.len() as u64) as usize];
            let _ = Command::new("kill").args(["-9", &victim.to_string()]).status();
        }
        done += 1;
    }
    assert!(child.wait().unwrap().success());
    run(&bench, &["--out", "out"]).succeeds();
    assert!(compared(&bench.path("out")) == whole);
}

#[cfg(target_os = "linux")]
#[test]
fn invariant_kills_leave_the_same_dataset() {
    kill_at_random(300, 8);
}

/// `cargo test --release -p maglev-cli --test study -- --ignored`
#[cfg(target_os = "linux")]
#[test]
#[ignore = "takes minutes"]
fn invariant_100_kills_leave_the_same_dataset() {
    kill_at_random(3000, 100);
}

#[test]
fn issue_ctrl_c_leaves_a_study_that_continues() {
    let bench = bench();
    let mut study = study();
    study["factors"]["start"]["range"]["count"] = json!(400);
    write(&bench, "study.json", &study);
    run(&bench, &["--out", "whole"]).succeeds();
    let mut child = start(&bench);
    let journal = bench.path("out/journal/run.jsonl");
    let begin = Instant::now();
    while fs::metadata(&journal).map_or(0, |it| it.len()) == 0 {
        assert!(begin.elapsed() < Duration::from_secs(60));
        std::thread::sleep(Duration::from_millis(1));
    }
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(75));
    // what is there can be looked at
    let part = rows(&bench, "out");
    assert!(!part.is_empty() && part.len() < 1200, "{}", part.len());
    run(&bench, &["--out", "out"]).succeeds();
    assert!(compared(&bench.path("out")) == compared(&bench.path("whole")));
}

/// An event's time and value, and keys of the scenario.
#[test]
fn analytic_targets_change_what_they_name() {
    let bench = bench();
    let mut scenario: Value =
        serde_json::from_str(&fs::read_to_string(bench.path("scenario.json")).unwrap()).unwrap();
    scenario["instances"] = json!({ "a": { "unit": "unit" } });
    scenario["connections"] = json!([]);
    scenario["record"]["signals"] = json!(["a.y"]);
    scenario["events"] = json!([{ "name": "push", "at": 0.5, "set": { "a.u": 1.0 } }]);
    bench.scenario(&scenario);
    // y integrates u, which is 0 before the push
    let study = json!({
        "scenario": "scenario.json",
        "factors": {
            "time": { "target": { "event": "push" }, "values": [0.2, 0.7] },
            "push": { "target": { "event": "push", "sets": "a.u" }, "values": [1, 3], "scale": 0.5 },
            "stop": { "target": { "key": "experiment.stop" }, "values": [1, 2] }
        },
        "objectives": { "last": { "signal": "a.y", "figure": "final" } }
    });
    write(&bench, "study.json", &study);
    run(&bench, &["--out", "out"]).succeeds();
    for row in rows(&bench, "out") {
        let of = |name: &str| row[name].as_str().unwrap().parse::<f64>().unwrap();
        let expected = 0.5 * of("push") * (of("stop") - of("time"));
        assert!((of("last") - expected).abs() < 1e-5, "{row}: {expected}");
        assert_eq!(of("reached"), of("stop"));
    }
}

#[test]
fn refusal_bad_studies_name_the_place() {
    let bench = bench();
    let mut checked = 0;
    for (path, value, parts) in [
        (
            "/scenario",
            json!("none.json"),
            vec!["cannot use the scenario of the study", "none.json"],
        ),
        ("/factors", json!({}), vec!["at factors: empty"]),
        ("/factors/gain/target", json!("a.gian"), vec!["a.gian", "did you mean"]),
        (
            "/factors/gain/target",
            json!({ "event": "x" }),
            vec!["factors.gain.target", "no event named \"x\""],
        ),
        (
            "/factors/gain/target",
            json!({ "unit": "x", "file": "f.json", "key": "k" }),
            vec!["no unit \"x\"; it has unit"],
        ),
        (
            "/factors/gain/target",
            json!({ "key": "experiment.stopp" }),
            vec!["factors.gain.target", "stopp"],
        ),
        ("/factors/gain/target", json!(3), vec!["factors.gain.target", "line 1"]),
        ("/factors/gain/values", json!([]), vec!["at factors.gain.values: empty"]),
        ("/factors/gain/valeus", json!([1]), vec!["at factors.gain", "valeus"]),
        ("/factors/gain/seeds", json!(2), vec!["factors.gain.seeds", "together with \"values\""]),
        (
            "/factors/status",
            json!({ "target": "a.gain", "values": [1] }),
            vec!["factors.status", "a column"],
        ),
        (
            "/factors/last",
            json!({ "target": "a.gain", "values": [1] }),
            vec!["factors.last", "a figure has the same name"],
        ),
        (
            "/factors/start",
            json!({ "target": "a.y", "distribution": { "normal": { "mean": 1, "sd": 2 } } }),
            vec!["factors.start.distribution.normal", "sd"],
        ),
        (
            "/factors/start",
            json!({ "target": "a.y", "distribution": {} }),
            vec!["factors.start.distribution", "give one of"],
        ),
        (
            "/factors/start",
            json!({ "target": "a.y", "distribution": { "uniform": { "min": 1, "max": 2 } } }),
            vec!["factors.start.distribution", "a grid needs"],
        ),
        ("/factors/gain/scale", json!(0), vec!["factors.gain.scale"]),
        ("/design", json!({ "kind": "sobol" }), vec!["at design", "points"]),
        (
            "/design",
            json!({ "kind": "sobol", "points": 70000 }),
            vec!["design.points", "at most 65536"],
        ),
        (
            "/design",
            json!({ "kind": "table", "file": "t.csv" }),
            vec!["factors.start.range", "leave it out"],
        ),
        ("/objectives/last/figure", json!("finale"), vec!["objectives.last.figure", "finale"]),
        ("/timeout", json!(-1), vec!["timeout", "-1"]),
        ("/tries", json!(0), vec!["tries", "1 or more"]),
        ("/keep", json!({ "runs": "some" }), vec!["keep.runs", "some"]),
    ] {
        let mut study = study();
        let (parent, key) = path.rsplit_once('/').unwrap();
        study.pointer_mut(parent).unwrap()[key] = value;
        write(&bench, "study.json", &study);
        let parts: Vec<&str> = parts;
        run(&bench, &["--out", "out"]).fails(2, &parts);
        checked += 1;
    }
    assert_eq!(checked, 23);
    assert!(!bench.path("out/metrics.csv").exists());
    run(&bench, &["--points", "0..4"]).fails(2, &["1 or more"]);
    write(&bench, "study.json", &study());
    run(&bench, &["--point", "25", "--out", "out"]).fails(2, &["there is no point 25", "1 to 24"]);
    bench
        .maglev(&["study", "merge", "nothing"])
        .fails(2, &["cannot read the study nothing/study.json"]);
}

#[test]
fn invariant_tables_and_files_that_extend_others() {
    let bench = bench();
    let mut study = study();
    study["factors"] = json!({ "start": { "target": "a.y" }, "gain": { "target": "a.gain" } });
    study["design"] = json!({ "kind": "table", "file": "points.csv" });
    fs::create_dir(bench.path("sub")).unwrap();
    fs::write(bench.path("sub/points.csv"), "gain,start\n1,0.5\n2,0.25\n").unwrap();
    study["scenario"] = json!("../scenario.json");
    write(&bench, "sub/base.json", &study);
    write(
        &bench,
        "study.json",
        &json!({ "extends": "sub/base.json", "limits": { "top": null }, "title": "t" }),
    );
    run(&bench, &["--out", "out"]).succeeds();
    let rows = rows(&bench, "out");
    assert_eq!(column(&rows, "start"), ["0.5", "0.25"]);
    assert!(rows[0].get("top").is_none());
    // the folder can be merged without the table
    fs::remove_dir_all(bench.path("sub")).unwrap();
    bench.maglev(&["study", "merge", "out"]).succeeds();
}

#[test]
fn golden_the_schema_accepts_what_the_command_accepts() {
    let bench = bench();
    let schema: Value = serde_json::from_str(&bench.maglev(&["schema", "study"]).stdout()).unwrap();
    let members = schema["properties"].as_object().unwrap();
    for key in study()
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .chain(["extends", "$comment", "keep"])
    {
        assert!(members.contains_key(key), "{key}");
    }
    assert!(!members.contains_key("as_run"));
}

/// Samples of all kinds, with distributions.
#[test]
fn analytic_samples_have_their_distributions() {
    let bench = bench();
    for (kind, points, expected) in [
        ("latin-hypercube", 64, 64),
        ("sobol", 64, 64),
        ("random", 400, 400),
        ("saltelli", 64, 256),
    ] {
        let mut study = study();
        study["factors"] = json!({
            "start": { "target": "a.y", "distribution": { "uniform": { "min": 1, "max": 3 } } },
            "gain": { "target": "a.gain", "distribution": { "lognormal": { "median": 2, "sigma": 0.1 } } }
        });
        study["design"] = json!({ "kind": kind, "points": points });
        write(&bench, "study.json", &study);
        let text = bench.maglev(&["study", "points", "study.json"]).stdout();
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(1)
            .map(|line| line.split(',').take(3).map(|it| it.parse().unwrap()).collect())
            .collect();
        assert_eq!(rows.len(), expected, "{kind}");
        let mean = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64;
        // four standard errors of a random sample of 400
        assert!((mean(1) - 2.0).abs() < 4.0 * 0.577 / 20.0, "{kind}: {}", mean(1));
        assert!((mean(2) - 2.0 * 0.005_f64.exp()).abs() < 4.0 * 0.2 / 20.0, "{kind}: {}", mean(2));
        assert!(rows.iter().all(|row| (1.0..3.0).contains(&row[1])));
    }
}
