//! What the master adds to each step of each unit: rings of small units, and a star.
//!
//! `cargo bench -p maglev-cli --bench stepping` prints µs per communication step and unit: a bare loop
//! over the C functions, the master without recording, and with four signals recorded as CSV.
//! `-- --start UNIT.fmu…` prints instead how long the start takes: opening a unit, and each instance.
//! `-- --units DIR` also leaves the units there, for `others.py`, which measures other masters on
//! the same systems.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program for developers")]

use std::ffi::c_void;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use libloading::Library;
use maglev::run::{Job, Unobserved};
use master::Setup;
use scenario::Scenario;
use serde_json::json;

/// Ports of the hub, and units around it.
const PORTS: usize = 64;
/// Steps of all units together in one measurement.
const UNIT_STEPS: u64 = 2_000_000;
/// A communication step that adds up without rounding, so that all steps are equal: the units keep what
/// they have computed for the last size, and what is measured is the master.
const STEP: f64 = 1.0 / 1024.0;
/// Measurements, of which the median counts.
const REPEATS: usize = 5;

fn main() {
    let units: Vec<PathBuf> = std::env::args()
        .skip_while(|it| it != "--start")
        .skip(1)
        // cargo adds an option of its own
        .filter(|it| !it.starts_with("--"))
        .map(PathBuf::from)
        .collect();
    if !units.is_empty() {
        return units.iter().for_each(|unit| started(unit));
    }
    let kept = std::env::args().skip_while(|it| it != "--units").nth(1).map(PathBuf::from);
    let temporary = tempfile::tempdir().unwrap();
    let folder = kept.unwrap_or_else(|| temporary.path().to_owned());
    fs::create_dir_all(&folder).unwrap();
    for (name, ports) in [("lag", 1), ("hub", PORTS)] {
        build(&folder, name, ports);
    }
    println!("us per step and unit   bare loop   master   with 4 signals as CSV");
    for count in [2, 16, 64] {
        report(&folder, &format!("ring of {count}"), &ring(count), bare_ring(&folder, count));
    }
    report(&folder, "star of 1 + 64", &star(), bare_star(&folder));
}

/// Prints what one unit and each instance of it cost before the first step, in ms.
fn started(unit: &Path) {
    let measure = |count: usize| {
        let text = json!({
            "units": { "unit": unit },
            "instances": { format!("a_[1..{count}]"): { "unit": "unit" } },
            "experiment": { "stop": 1.0, "step": 1.0 },
        });
        let scenario = Scenario::parse(&text.to_string(), Path::new("bench")).unwrap();
        let opened = median(|| {
            let begin = Instant::now();
            Setup::new(&scenario).unwrap();
            begin.elapsed().as_secs_f64() * 1e3
        });
        let setup = Setup::new(&scenario).unwrap();
        let ready = median(|| {
            let begin = Instant::now();
            let simulation = setup.start().unwrap();
            let seconds = begin.elapsed().as_secs_f64();
            drop(simulation);
            seconds * 1e3
        });
        (opened, ready)
    };
    let ((opened, one), (_, nine)) = (measure(1), measure(9));
    let each = (nine - one) / 8.0;
    let name = unit.file_stem().unwrap_or_default().to_string_lossy();
    println!(
        "{name:<24} open {opened:.2} ms, first instance {one:.2} ms, each further {each:.2} ms"
    );
}

fn report(folder: &Path, name: &str, system: &serde_json::Value, bare: f64) {
    let plain = stepped(folder, system);
    let recorded = recorded(folder, system);
    println!("{name:<20}{bare:>12.3}{plain:>9.3}{recorded:>12.3}");
}

/// The median of several measurements.
fn median(mut measure: impl FnMut() -> f64) -> f64 {
    let mut values: Vec<f64> = (0..REPEATS).map(|_| measure()).collect();
    values.sort_by(f64::total_cmp);
    values[REPEATS / 2]
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn per_step_and_unit(seconds: f64, steps: u64, units: usize) -> f64 {
    seconds * 1e6 / (steps as f64 * units as f64)
}

fn steps(units: usize) -> u64 {
    UNIT_STEPS / units as u64
}

/// The system as a scenario of enough steps.
fn scenario(folder: &Path, system: &serde_json::Value, record: &[&str]) -> Scenario {
    let units = system["instances"].as_object().unwrap().len();
    let mut text = system.clone();
    let stop = steps(units) as f64 * STEP;
    text["units"] = json!({ "lag": folder.join("lag.fmu"), "hub": folder.join("hub.fmu") });
    text["experiment"] = json!({ "stop": stop, "step": STEP });
    text["algorithm"] = json!({ "name": "jacobi", "extrapolation": 0 });
    text["record"] = json!({ "signals": record });
    Scenario::parse(&text.to_string(), Path::new("bench")).unwrap()
}

/// The master's steps alone.
fn stepped(folder: &Path, system: &serde_json::Value) -> f64 {
    let setup = Setup::new(&scenario(folder, system, &[])).unwrap();
    let units = setup.system().instances.len();
    median(|| {
        let mut simulation = setup.start().unwrap();
        let count = simulation.remaining();
        let begin = Instant::now();
        while simulation.remaining() > 0 {
            simulation.step().unwrap();
        }
        per_step_and_unit(begin.elapsed().as_secs_f64(), count, units)
    })
}

/// A whole run with results.
fn recorded(folder: &Path, system: &serde_json::Value) -> f64 {
    let all: Vec<&String> = system["instances"].as_object().unwrap().keys().collect();
    let names: Vec<String> = match all.len() {
        2 => ["y_0", "u_0"]
            .iter()
            .flat_map(|v| all.iter().map(move |i| format!("{i}.{v}")))
            .collect(),
        _ => all.iter().filter(|it| **it != "hub").take(4).map(|it| format!("{it}.y_0")).collect(),
    };
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let scenario = scenario(folder, system, &names);
    let out = folder.join("out");
    median(|| {
        let job = Job { scenario: &scenario, name: "bench", folder: &out };
        let summary = job.run(&mut Unobserved).unwrap();
        per_step_and_unit(summary.wall_time.run_seconds, summary.steps, all.len())
    })
}

fn ring(count: usize) -> serde_json::Value {
    let name = |k: usize| format!("u{:02}", k % count);
    let instances: serde_json::Map<_, _> =
        (0..count).map(|k| (name(k), json!({ "unit": "lag" }))).collect();
    let connections: Vec<_> = (0..count)
        .map(|k| json!({ "from": name(k) + ".y_0", "to": name(k + 1) + ".u_0" }))
        .collect();
    json!({ "instances": instances, "connections": connections })
}

fn star() -> serde_json::Value {
    let mut instances: serde_json::Map<_, _> =
        (0..PORTS).map(|k| (format!("u{k:02}"), json!({ "unit": "lag" }))).collect();
    instances.insert("hub".to_owned(), json!({ "unit": "hub" }));
    let connections: Vec<_> = (0..PORTS)
        .flat_map(|k| {
            [
                json!({ "from": format!("u{k:02}.y_0"), "to": format!("hub.u_{k}") }),
                json!({ "from": format!("hub.y_{k}"), "to": format!("u{k:02}.u_0") }),
            ]
        })
        .collect();
    json!({ "instances": instances, "connections": connections })
}

/// Compiles unit.c and packs it with its description.
fn build(folder: &Path, name: &str, ports: usize) {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/unit.c");
    let binary = folder.join(format!("{name}.so"));
    let built = Command::new("cc")
        .args(["-shared", "-fPIC", "-O2", "-w", &format!("-DPORTS={ports}")])
        .args([Path::new("-o"), &binary, &source, Path::new("-lm")])
        .status()
        .unwrap();
    assert!(built.success());
    let variable = |name: String, reference: usize, what: &str, start: &str| {
        format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{reference}\" {what}\
             variability=\"continuous\"><Real{start}/></ScalarVariable>\n"
        )
    };
    let unknowns: String = (0..ports)
        .map(|k| format!("<Unknown index=\"{}\" dependencies=\"\"/>", ports + k + 1))
        .collect();
    let variables: String = (0..ports)
        .map(|k| variable(format!("u_{k}"), k, "causality=\"input\" ", " start=\"0\""))
        .chain((0..ports).map(|k| {
            variable(
                format!("y_{k}"),
                ports + k,
                "causality=\"output\" initial=\"calculated\" ",
                "",
            )
        }))
        .collect();
    let description = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{name}\">\n\
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"true\"/>\n\
         <ModelVariables>\n{variables}</ModelVariables>\n<ModelStructure><Outputs>{unknowns}</Outputs>\
         <InitialUnknowns>{unknowns}</InitialUnknowns></ModelStructure>\n</fmiModelDescription>\n"
    );
    let mut writer =
        zip::ZipWriter::new(fs::File::create(folder.join(format!("{name}.fmu"))).unwrap());
    let platform = fmi2_import::package::PLATFORM;
    for (file, bytes) in [
        ("modelDescription.xml".to_owned(), description.into_bytes()),
        (format!("binaries/{platform}/{name}.so"), fs::read(&binary).unwrap()),
    ] {
        writer.start_file(file, zip::write::SimpleFileOptions::default()).unwrap();
        writer.write_all(&bytes).unwrap();
    }
    writer.finish().unwrap();
}

type Set = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const f64) -> i32;
type Get = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut f64) -> i32;
type Step = unsafe extern "C" fn(*mut c_void, f64, f64, i32) -> i32;
type Instantiate = unsafe extern "C" fn(
    *const u8,
    i32,
    *const u8,
    *const u8,
    *const c_void,
    i32,
    i32,
) -> *mut c_void;

/// The functions of one unit, called without any master.
struct Bare {
    component: *mut c_void,
    set: Set,
    get: Get,
    step: Step,
    inputs: Vec<u32>,
    outputs: Vec<u32>,
    values: Vec<f64>,
}

impl Bare {
    fn new(library: &Library, ports: usize) -> Self {
        let count = u32::try_from(ports).unwrap();
        // SAFETY: unit.c defines these functions with these types
        unsafe {
            let instantiate = *library.get::<Instantiate>(b"fmi2Instantiate\0").unwrap();
            Self {
                component: instantiate(
                    c"a".as_ptr().cast(),
                    1,
                    c"".as_ptr().cast(),
                    c"".as_ptr().cast(),
                    std::ptr::null(),
                    0,
                    0,
                ),
                set: *library.get(b"fmi2SetReal\0").unwrap(),
                get: *library.get(b"fmi2GetReal\0").unwrap(),
                step: *library.get(b"fmi2DoStep\0").unwrap(),
                inputs: (0..count).collect(),
                outputs: (count..2 * count).collect(),
                values: vec![0.0; ports],
            }
        }
    }

    fn send(&mut self) {
        let n = self.inputs.len();
        // SAFETY: a live component and vectors of n entries
        let status =
            unsafe { (self.set)(self.component, self.inputs.as_ptr(), n, self.values.as_ptr()) };
        assert_eq!(status, 0);
    }

    fn step(&self, time: f64) {
        // SAFETY: a live component
        assert_eq!(unsafe { (self.step)(self.component, time, STEP, 1) }, 0);
    }

    fn receive(&mut self, into: &mut [f64]) {
        let n = self.outputs.len();
        // SAFETY: a live component and n places
        let status =
            unsafe { (self.get)(self.component, self.outputs.as_ptr(), n, into.as_mut_ptr()) };
        assert_eq!(status, 0);
    }
}

fn library(folder: &Path, name: &str) -> Library {
    // SAFETY: the library has no initialisers
    unsafe { Library::new(folder.join(format!("{name}.so"))) }.unwrap()
}

/// `wiring[k]` is the output, of all units' in a row, that feeds input k of all units' in a row.
fn bare(mut units: Vec<Bare>, wiring: &[usize]) -> f64 {
    let count = steps(units.len());
    let mut signals = vec![0.0; wiring.len()];
    median(|| {
        let begin = Instant::now();
        for n in 0..count {
            let mut at = 0;
            for unit in &mut units {
                for value in &mut unit.values {
                    *value = signals[wiring[at]];
                    at += 1;
                }
                unit.send();
            }
            #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
            units.iter().for_each(|unit| unit.step(n as f64 * STEP));
            let mut rest = &mut signals[..];
            for unit in &mut units {
                let (mine, others) = rest.split_at_mut(unit.outputs.len());
                unit.receive(mine);
                rest = others;
            }
        }
        per_step_and_unit(begin.elapsed().as_secs_f64(), count, units.len())
    })
}

fn bare_ring(folder: &Path, count: usize) -> f64 {
    let lag = library(folder, "lag");
    let wiring: Vec<usize> = (0..count).map(|k| (k + count - 1) % count).collect();
    bare((0..count).map(|_| Bare::new(&lag, 1)).collect(), &wiring)
}

fn bare_star(folder: &Path) -> f64 {
    let (lag, hub) = (library(folder, "lag"), library(folder, "hub"));
    let mut units: Vec<Bare> = (0..PORTS).map(|_| Bare::new(&lag, 1)).collect();
    units.push(Bare::new(&hub, PORTS));
    let wiring: Vec<usize> = (PORTS..2 * PORTS).chain(0..PORTS).collect();
    bare(units, &wiring)
}
