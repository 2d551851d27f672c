//! The cache of unpacked archives, by the command: used again, damaged, not writable, full, by several processes at once,
//! switched off.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a test program")]
#![cfg(unix)]

mod support;

use std::fs;
use std::os::unix::fs::{MetadataExt as _, PermissionsExt as _};
use std::path::PathBuf;
use std::process::Command;

use support::{Bench, DESCRIPTION, Ran, ring};

/// The file in the unit's resources that makes it large enough for the cache.
const LARGE: &str = "resources/deep/data.bin";

fn large() -> Vec<u8> {
    (0..300_u32 << 10).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect()
}

/// Two units in a ring, from an archive with a large resource.
fn bench() -> Bench {
    let bench = Bench::new();
    let platform = fmi2_import::package::PLATFORM;
    let binary = format!("binaries/{platform}/unit.{}", fmi2_import::package::BINARY_EXTENSION);
    let (code, data) = (bench.compile(&[]), large());
    let description = ("modelDescription.xml", DESCRIPTION.as_bytes());
    bench.pack("unit.fmu", &[description, (&binary, &code), (LARGE, &data)]);
    bench.scenario(&ring());
    bench
}

/// Runs the scenario with a cache; the folder is relative to the bench.
fn run(bench: &Bench, cache: &str) -> Ran {
    bench.shell(&format!(
        "export HOME=$PWD/home MAGLEV_CACHE={cache}; unset XDG_CACHE_HOME; \
         maglev run scenario.json --out out --no-report --quiet"
    ))
}

/// The results of a run without a cache.
fn expected(bench: &Bench) -> String {
    run(bench, "off").succeeds();
    bench.result("results.csv")
}

#[track_caller]
fn runs(bench: &Bench, cache: &str, expected: &str) {
    let ran = run(bench, cache);
    ran.succeeds();
    assert_eq!(ran.stderr(), "");
    assert_eq!(bench.result("results.csv"), expected);
}

/// What is in the cache.
fn entries(bench: &Bench, cache: &str) -> Vec<PathBuf> {
    let found = fs::read_dir(bench.path(cache)).unwrap();
    found.map(|entry| entry.unwrap().path()).collect()
}

/// The only entry of the cache.
#[track_caller]
fn entry(bench: &Bench, cache: &str) -> PathBuf {
    let all = entries(bench, cache);
    assert_eq!(all.len(), 1, "{all:?}");
    all.into_iter().next().unwrap()
}

#[test]
fn invariant_the_second_run_takes_the_files_from_the_cache() {
    let bench = bench();
    let expected = expected(&bench);
    runs(&bench, "deep/cache", &expected);
    let kept = entry(&bench, "deep/cache");
    assert_eq!(fs::read(kept.join(LARGE)).unwrap(), large());
    assert_eq!(fs::metadata(bench.path("deep/cache")).unwrap().mode() & 0o777, 0o700);
    let number = fs::metadata(&kept).unwrap().ino();
    // a run that uses an entry makes it the youngest
    let touched = Command::new("touch").args(["-d", "2001-01-01"]).arg(&kept).status().unwrap();
    assert!(touched.success());
    runs(&bench, "deep/cache", &expected);
    let now = fs::metadata(entry(&bench, "deep/cache")).unwrap();
    assert_eq!(now.ino(), number);
    assert!(now.modified().unwrap().elapsed().unwrap().as_secs() < 600);
    // another archive has an entry of its own
    let mut archive = fs::read(bench.path("unit.fmu")).unwrap();
    // a comment at the end of the archive
    let end = archive.len();
    archive[end - 2] = 1;
    archive.push(b'x');
    fs::write(bench.path("unit.fmu"), archive).unwrap();
    runs(&bench, "deep/cache", &expected);
    assert_eq!(entries(&bench, "deep/cache").len(), 2);
}

#[test]
fn issue_a_damaged_entry_is_replaced() {
    let bench = bench();
    let expected = expected(&bench);
    runs(&bench, "cache", &expected);
    let kept = entry(&bench, "cache");
    let file = kept.join(LARGE);
    let mut wrong = large();
    wrong[1000] ^= 1;
    let damages: [&dyn Fn(); 5] = [
        &|| fs::write(&file, &wrong).unwrap(),
        &|| fs::write(&file, &large()[..1000]).unwrap(),
        &|| fs::remove_file(&file).unwrap(),
        &|| fs::remove_dir_all(kept.join("binaries")).unwrap(),
        &|| {
            fs::remove_dir_all(&kept).unwrap();
            fs::write(&kept, "not a folder").unwrap();
        },
    ];
    for (number, damage) in damages.into_iter().enumerate() {
        if file.exists() {
            fs::set_permissions(&file, fs::Permissions::from_mode(0o700)).unwrap();
        }
        damage();
        runs(&bench, "cache", &expected);
        assert_eq!(entry(&bench, "cache"), kept, "damage {number}");
        assert_eq!(fs::read(&file).unwrap(), large(), "damage {number}");
    }
}

#[test]
fn issue_a_cache_that_cannot_be_written_does_not_matter() {
    let bench = bench();
    let expected = expected(&bench);
    // no folder can be made there, by anyone
    runs(&bench, "/proc/maglev", &expected);
    fs::write(bench.path("file"), "").unwrap();
    runs(&bench, "file", &expected);
    assert_eq!(fs::read(bench.path("file")).unwrap(), b"");
    // others could put libraries there
    fs::create_dir(bench.path("open")).unwrap();
    fs::set_permissions(bench.path("open"), fs::Permissions::from_mode(0o777)).unwrap();
    runs(&bench, "open", &expected);
    assert!(entries(&bench, "open").is_empty());
    // an entry in a folder that is read-only since then; root may write to it all the same
    runs(&bench, "cache", &expected);
    let kept = entry(&bench, "cache");
    fs::set_permissions(bench.path("cache"), fs::Permissions::from_mode(0o500)).unwrap();
    runs(&bench, "cache", &expected);
    assert_eq!(entry(&bench, "cache"), kept);
    // and one that is damaged there
    let file = kept.join(LARGE);
    fs::set_permissions(&file, fs::Permissions::from_mode(0o700)).unwrap();
    fs::write(&file, "damaged").unwrap();
    runs(&bench, "cache", &expected);
    fs::set_permissions(bench.path("cache"), fs::Permissions::from_mode(0o700)).unwrap();
}

/// A file system of 100 kB, where this user may mount one.
#[test]
fn issue_a_full_cache_does_not_matter() {
    let bench = bench();
    let expected = expected(&bench);
    fs::create_dir(bench.path("small")).unwrap();
    let mount = "mount -t tmpfs -o size=100k,mode=700 none small";
    let within = |rest: &str| {
        let program = env!("CARGO_BIN_EXE_maglev");
        bench.shell(&format!(
            "unshare -rm bash -c '{mount} && {}'",
            rest.replace("maglev ", &format!("{program} "))
        ))
    };
    if within("true").status() != 0 {
        println!("skipped: this user cannot mount a file system");
        return;
    }
    let ran = within(
        "MAGLEV_CACHE=small maglev run scenario.json --out out --no-report --quiet && ls -A small | wc -l",
    );
    ran.succeeds();
    assert_eq!((ran.stdout().trim(), ran.stderr().as_str()), ("0", ""));
    assert_eq!(bench.result("results.csv"), expected);
}

#[test]
fn invariant_processes_that_start_at_once_share_one_entry() {
    let bench = bench();
    let expected = expected(&bench);
    let one = |k: u32| {
        format!("MAGLEV_CACHE=cache maglev run scenario.json --out out{k} --no-report --quiet & ")
    };
    for _ in 0..3 {
        let all: String = (0..4).map(one).collect();
        let ran =
            bench.shell(&format!("{all} for job in $(jobs -p); do wait $job || exit 9; done"));
        ran.succeeds();
        assert_eq!(ran.stderr(), "");
        for k in 0..4 {
            let found = fs::read_to_string(bench.path(&format!("out{k}/results.csv"))).unwrap();
            assert_eq!(found, expected);
        }
        // also where each of them finds a damaged entry and removes it
        let file = entry(&bench, "cache").join(LARGE);
        assert_eq!(fs::read(&file).unwrap(), large());
        fs::set_permissions(&file, fs::Permissions::from_mode(0o700)).unwrap();
        fs::write(&file, "damaged").unwrap();
    }
}

#[test]
fn issue_the_cache_can_be_switched_off() {
    let bench = bench();
    let expected = expected(&bench);
    assert!(!bench.path("home").exists() && !bench.path("off").exists());
    // an empty variable is none
    runs(&bench, "", &expected);
    entry(&bench, "home/.cache/maglev");
}
