//! Messages of units: whatever they hand to the logger, every message arrives, at the right instance
//! where that can be known; and the first of a flood are kept.

#![allow(clippy::unwrap_used, reason = "a test program")]

mod support;

use std::collections::HashMap;

use support::{Bench, DESCRIPTION, ring};

/// Instance by the text of each event that is a message.
fn messages(bench: &Bench) -> HashMap<String, String> {
    let text = bench.result("events.csv");
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader
        .records()
        .map(Result::unwrap)
        .filter(|it| ["message", "warning"].contains(&&it[1]))
        .map(|it| (it[3].to_owned(), it[2].to_owned()))
        .collect()
}

fn chatty(defines: &[&str]) -> Bench {
    let bench = Bench::new();
    let defines: Vec<&str> = defines.iter().copied().chain(["-DMAX_INPUT_ORDER=3"]).collect();
    bench.source("unit.fmu", "chatty.c", DESCRIPTION, &defines);
    bench.scenario(&ring());
    bench
}

const ENVIRONMENTS: [&str; 5] = ["own", "other", "one", "two", "null"];
const NAMES: [&str; 3] = ["right", "none", "wrong"];

/// In a call, the instance is known whatever is passed; in a thread, by its environment or its name. A
/// thread that passes neither is of an unknown instance, and is heard all the same.
#[test]
fn issue_foreign_environments_are_never_followed_and_every_message_arrives() {
    let bench = chatty(&[]);
    let ran = bench.run(&[]);
    ran.succeeds();
    let found = messages(&bench);
    for (me, other) in [("a", "b"), ("b", "a")] {
        for environment in ENVIRONMENTS {
            for name in NAMES {
                let of =
                    |place: &str| &found[&format!("[fmi2OK] {place} {environment} {name} {me}")];
                assert_eq!(of("call"), me, "{environment} {name}");
                let expected = match (environment, name) {
                    (_, "right") | ("own", _) => me,
                    ("other", _) => other,
                    (_, "none") => "unknown instance",
                    _ => "unknown instance \"nobody\"",
                };
                assert_eq!(of("thread"), expected, "{environment} {name}");
            }
        }
    }
    let summary = bench.summary();
    let count = |path: &str| summary.pointer(path).unwrap().as_u64().unwrap();
    // 2·2·5·3, of which 2·3·2 are of nobody
    let known = count("/instances/a/messages") + count("/instances/b/messages");
    assert_eq!((known, count("/omitted_messages")), (60 - 12, 0));
    assert_eq!(summary["messages"].as_array().unwrap().len(), 60);
}

/// A worker has one instance, whose every message is.
#[test]
#[cfg(target_os = "linux")]
fn issue_messages_with_a_foreign_environment_arrive_from_workers() {
    let bench = chatty(&[]);
    bench.run(&["--isolate"]).succeeds();
    let found = messages(&bench);
    for me in ["a", "b"] {
        for place in ["call", "thread"] {
            for environment in ENVIRONMENTS {
                for name in NAMES {
                    let text = format!("[fmi2OK] {place} {environment} {name} {me}");
                    assert_eq!(found[&text], me, "{text}");
                }
            }
        }
    }
    assert_eq!(found.len(), 2 * 2 * 5 * 3);
}

/// What is said before there is an instance.
#[test]
fn issue_a_refusal_with_a_foreign_environment_is_quoted() {
    let bench = chatty(&["-DREFUSE"]);
    let refusal = ["unit a refused to be instantiated", "it logged: a has no licence"];
    bench.run(&[]).fails(2, &refusal);
    if cfg!(target_os = "linux") {
        bench.run(&["--isolate"]).fails(2, &refusal);
    }
}

/// The first messages of a flood say its cause; the others are counted, and leave room for those of
/// other instances.
#[test]
fn issue_the_first_of_a_flood_are_kept_and_the_others_counted() {
    for arguments in [&[][..], &["--isolate"]] {
        if !arguments.is_empty() && cfg!(not(target_os = "linux")) {
            continue;
        }
        let bench = chatty(&["-DFLOOD=10000"]);
        bench.run(arguments).succeeds();
        let found = messages(&bench);
        assert!(found.contains_key("[fmi2Warning] message 0"));
        assert!(found.contains_key("[fmi2Warning] message 99"));
        assert!(!found.contains_key("[fmi2Warning] message 9999"));
        let dropped = found.keys().find(|text| text.contains("more messages dropped")).unwrap();
        let words: Vec<&str> = dropped.split(' ').collect();
        let kept = found.keys().filter(|text| text.contains("] message ")).count();
        assert_eq!(words[1].parse::<usize>().unwrap() + kept, 10_000, "{dropped}");
        let summary = bench.summary();
        for instance in ["a", "b"] {
            assert_eq!(summary["instances"][instance]["messages"], 10_000);
        }
        let told = summary["messages"].as_array().unwrap();
        let of = |instance: &str| told.iter().filter(|it| it["instance"] == instance).count();
        assert_eq!((of("a"), of("b")), (100, 100));
        assert_eq!(summary["omitted_messages"], 20_000 - 200);
        assert_eq!(told[0]["text"], "message 0");
    }
}

/// An error quotes the first of the gravest messages: later ones are mostly its consequences.
#[test]
fn issue_an_error_quotes_the_first_messages() {
    let bench = chatty(&["-DFLOOD=50"]);
    let ran = bench.run(&["--set", "a.fault=4", "--set", "a.fail_time=0.05"]);
    ran.fails(1, &["unit a: fmi2DoStep returned fmi2Error", "it logged: the model broke"]);
    let bench = chatty(&["-DFLOOD=50", "-DFLOOD_STATUS=ERROR"]);
    let ran = bench.run(&["--set", "a.fault=4", "--set", "a.fail_time=0.05"]);
    ran.fails(1, &["it logged: message 0; message 1; message 2; and 48 more like these"]);
}
