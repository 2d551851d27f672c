//! NaN and infinity: what is only recorded is recorded, with a warning; what feeds another unit ends the
//! run.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use serde_json::{Value, json};
use support::{Bench, DESCRIPTION};

/// y, made a local variable, is NaN from 0.3 s on; z feeds b.
fn scenario() -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": {
            "a": { "unit": "unit", "parameters": { "fault": 1, "fail_time": 0.29 }, "start": { "u": 2.0 } },
            "b": { "unit": "unit" }
        },
        "connections": [ { "from": "a.z", "to": "b.u" } ],
        "experiment": { "stop": 1.0, "step": 0.1 },
        "record": { "signals": ["a.y", "b.y"], "format": ["csv", "parquet"] },
        "plots": [ { "file": "y.svg", "panels": [ { "ylabel": "y", "signals": ["a.y", "b.y"] } ] } ]
    })
}

fn bench() -> Bench {
    let bench = Bench::new();
    let local = DESCRIPTION
        .replace(
            "name=\"y\" valueReference=\"1\" causality=\"output\" initial",
            "name=\"y\" valueReference=\"1\" causality=\"local\" initial",
        )
        .replace("<Unknown index=\"2\" dependencies=\"\"/>", "");
    assert!(local.contains("causality=\"local\""));
    bench.unit("unit.fmu", &local, &[]);
    bench
}

#[test]
fn issue_a_recorded_local_may_be_nan() {
    let bench = bench();
    bench.scenario(&scenario());
    for arguments in [&[][..], &["--isolate"], &["--threads", "2"]] {
        if arguments == ["--isolate"] && cfg!(not(target_os = "linux")) {
            continue;
        }
        let ran = bench.run(arguments);
        ran.succeeds();
        let report = ran.stderr();
        let told = report.lines().filter(|line| line.contains("a.y is NaN")).count();
        assert_eq!(told, 1, "{report}");
        assert!(!report.contains("cannot make the report"), "{report}");
        let rows = bench.rows();
        assert_eq!(rows.len(), 11);
        for (n, row) in rows.iter().enumerate() {
            assert_eq!(row[1].is_nan(), n >= 3, "{row:?}");
            // the integral of 2
            assert!((row[2] - 0.2 * n as f64).abs() < 1e-12, "{row:?}");
        }
        let summary = bench.summary();
        let (y, good) = (&summary["signals"]["a.y"], &summary["signals"]["b.y"]);
        assert_eq!((&y["points"], &y["not_finite"]), (&json!(3), &json!(8)));
        assert!((y["max"].as_f64().unwrap() - 0.4).abs() < 1e-12);
        assert_eq!((&good["points"], good.get("not_finite")), (&json!(11), None));
        assert_eq!(summary["events"]["warning"], 1);
        let events = bench.result("events.csv");
        assert_eq!(events.matches("y is NaN; it is recorded unchanged").count(), 1, "{events}");
        assert!(bench.result("y.svg").contains("polyline"));
    }
    bench.maglev(&["report", "out", "--format", "html,svg"]).succeeds();
    std::fs::remove_file(bench.path("out/results.csv")).unwrap();
    bench.maglev(&["report", "out"]).succeeds();
}

/// Nothing but NaN: no statistics, and their number.
#[test]
fn issue_a_recorded_local_may_be_nan_from_the_start() {
    let bench = bench();
    let mut scenario = scenario();
    scenario["instances"]["a"]["parameters"]["fail_time"] = json!(0.0);
    bench.scenario(&scenario);
    let ran = bench.run(&[]);
    ran.succeeds();
    assert!(ran.stderr().contains("at 0 s a.y is NaN"), "{}", ran.stderr());
    let summary = bench.summary();
    let y = &summary["signals"]["a.y"];
    assert_eq!((y.get("max"), &y["not_finite"]), (None, &json!(11)));
    bench.maglev(&["report", "out"]).succeeds();
}

/// A checkpoint keeps what is known of such values.
#[test]
fn issue_nan_goes_through_a_checkpoint() {
    let bench = Bench::new();
    bench.unit("unit.fmu", &support::with_states(), &[]);
    bench.scenario(&scenario());
    bench.run(&["--checkpoint-every", "0.5"]).succeeds();
    let (whole, events) = (bench.result("results.csv"), bench.summary()["signals"].clone());
    bench.shell("maglev run scenario.json --out out --checkpoint-every 0.5 --stop 0.6").succeeds();
    bench.run(&["--checkpoint-every", "0.5"]).succeeds();
    assert_eq!((bench.result("results.csv"), bench.summary()["signals"].clone()), (whole, events));
}

#[test]
fn issue_nan_in_what_feeds_another_unit_ends_the_run() {
    let bench = Bench::new();
    let mut scenario = scenario();
    scenario["connections"] = json!([ { "from": "a.y", "to": "b.u" } ]);
    bench.scenario(&scenario);
    bench.run(&[]).fails(1, &["unit a: y is NaN at 0.3"]);
    assert_eq!(bench.rows().len(), 3);
}
