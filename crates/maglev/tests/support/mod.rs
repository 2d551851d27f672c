//! Builds small units from C source and runs the `maglev` command on scenarios made of them.

#![allow(dead_code, reason = "each test program uses a part")]

use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use serde_json::{Value, json};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// The description of `unit.c`.
pub const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="integrator" guid="test-unit" generationTool="hand">
  <CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true"
    canInterpolateInputs="true" maxOutputDerivativeOrder="1"/>
  <UnitDefinitions>
    <Unit name="m"><BaseUnit m="1"/></Unit>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
    <Unit name="s"><BaseUnit s="1"/></Unit>
  </UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="u" valueReference="0" causality="input" variability="continuous">
      <Real start="0" unit="m"/></ScalarVariable>
    <ScalarVariable name="y" valueReference="1" causality="output" initial="calculated">
      <Real unit="m"/></ScalarVariable>
    <ScalarVariable name="z" valueReference="2" causality="output" initial="calculated">
      <Real unit="m"/></ScalarVariable>
    <ScalarVariable name="fail_time" valueReference="3" causality="parameter" variability="fixed">
      <Real start="1e300" unit="s"/></ScalarVariable>
    <ScalarVariable name="gain" valueReference="4" causality="parameter" variability="tunable">
      <Real start="1" min="-10" max="10"/></ScalarVariable>
    <ScalarVariable name="fault" valueReference="0" causality="parameter" variability="fixed">
      <Integer start="0"/></ScalarVariable>
    <ScalarVariable name="n" valueReference="1" causality="input" variability="discrete">
      <Integer start="0"/></ScalarVariable>
    <ScalarVariable name="m" valueReference="2" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
    <ScalarVariable name="b" valueReference="0" causality="input" variability="discrete">
      <Boolean start="false"/></ScalarVariable>
    <ScalarVariable name="c" valueReference="1" causality="output" variability="discrete">
      <Boolean/></ScalarVariable>
    <ScalarVariable name="s" valueReference="0" causality="input" variability="discrete">
      <String start=""/></ScalarVariable>
    <ScalarVariable name="t" valueReference="1" causality="output" variability="discrete">
      <String/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="2" dependencies=""/>
      <Unknown index="3" dependencies="1"/>
      <Unknown index="8" dependencies="7"/>
      <Unknown index="10" dependencies="9"/>
      <Unknown index="12" dependencies="11"/>
    </Outputs>
    <InitialUnknowns>
      <Unknown index="2" dependencies=""/>
      <Unknown index="3" dependencies="1 5"/>
      <Unknown index="8" dependencies="7"/>
      <Unknown index="10" dependencies="9"/>
      <Unknown index="12" dependencies="11"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"#;

/// The same of a unit whose state can be saved and serialized, and whose y can be given at the start.
pub fn with_states() -> String {
    let states = "canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"";
    let exact = "name=\"y\" valueReference=\"1\" causality=\"output\" initial=\"exact\">\n      <Real start=\"0\"";
    let changed = DESCRIPTION
        .replace("canInterpolateInputs", &format!("{states} canInterpolateInputs"))
        .replace(&exact.replace("exact", "calculated").replace(" start=\"0\"", ""), exact);
    assert!(changed.contains(exact));
    changed
}

/// A folder of its own with units and scenarios.
pub struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    /// An empty bench with `unit.fmu` on it.
    pub fn new() -> Self {
        let bench = Self { folder: tempfile::tempdir().unwrap() };
        bench.unit("unit.fmu", DESCRIPTION, &[]);
        bench
    }

    /// Path on the bench.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Compiles unit.c, or hostile.c around it, with the defines and returns the binary.
    pub fn compile(&self, defines: &[&str]) -> Vec<u8> {
        let file = if defines.contains(&"-DHOSTILE") { "hostile.c" } else { "unit.c" };
        let order = if defines.iter().any(|define| define.contains("MAX_INPUT_ORDER")) {
            None
        } else {
            Some("-DMAX_INPUT_ORDER=3")
        };
        let defines: Vec<&str> = defines.iter().copied().chain(order).collect();
        self.compile_source(file, &defines)
    }

    fn compile_source(&self, source: &str, defines: &[&str]) -> Vec<u8> {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/support").join(source);
        let binary = self.path("binary.so");
        let result = Command::new("cc")
            .args(["-shared", "-fPIC", "-O1", "-w"])
            .args(defines)
            .args([Path::new("-o"), &binary, &source, Path::new("-lm")])
            .output()
            .unwrap();
        assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
        fs::read(binary).unwrap()
    }

    /// Packs a unit with that description and a binary compiled with the defines.
    pub fn unit(&self, name: &str, description: &str, defines: &[&str]) {
        self.binary(name, description, &self.compile(defines));
    }

    /// Packs a unit with that description, compiled from another source beside unit.c.
    pub fn source(&self, name: &str, source: &str, description: &str, defines: &[&str]) {
        self.binary(name, description, &self.compile_source(source, defines));
    }

    fn binary(&self, name: &str, description: &str, binary: &[u8]) {
        let platform = fmi2_import::package::PLATFORM;
        let place = format!("binaries/{platform}/unit.{}", fmi2_import::package::BINARY_EXTENSION);
        self.pack(name, &[("modelDescription.xml", description.as_bytes()), (&place, binary)]);
    }

    /// Packs any files; a name that ends with a slash is that of a folder.
    pub fn pack(&self, name: &str, files: &[(&str, &[u8])]) {
        let mut writer = ZipWriter::new(fs::File::create(self.path(name)).unwrap());
        for (name, bytes) in files {
            if name.ends_with('/') {
                writer.add_directory(*name, SimpleFileOptions::default()).unwrap();
                continue;
            }
            writer.start_file(*name, SimpleFileOptions::default()).unwrap();
            writer.write_all(bytes).unwrap();
        }
        writer.finish().unwrap();
    }

    /// Writes `scenario.json`.
    pub fn scenario(&self, scenario: &Value) {
        fs::write(self.path("scenario.json"), scenario.to_string()).unwrap();
    }

    /// Runs `maglev run scenario.json --out out` with further arguments.
    pub fn run(&self, arguments: &[&str]) -> Ran {
        let mut all = vec!["run", "scenario.json", "--out", "out"];
        all.extend(arguments);
        self.maglev(&all)
    }

    /// Runs `maglev run` with units that do the mischief of hostile.c.
    pub fn hostile(&self, mischief: &str, arguments: &[&str]) -> Ran {
        let output = Command::new(env!("CARGO_BIN_EXE_maglev"))
            .args(["run", "scenario.json", "--out", "out"])
            .args(arguments)
            .env("HOSTILE", mischief)
            .env("HOSTILE_LOG", self.path("calls.log"))
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        Ran(output)
    }

    /// Runs `maglev run` with units that write down their calls (fragile.c).
    pub fn recorded(&self, arguments: &[&str]) -> Ran {
        let file = self.path("calls.txt");
        fs::write(&file, "").unwrap();
        let output = Command::new(env!("CARGO_BIN_EXE_maglev"))
            .args(["run", "scenario.json", "--out", "out"])
            .args(arguments)
            .env("CALLS", file)
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        Ran(output)
    }

    /// The calls of the last such run, one a line: instance, function, variables.
    pub fn calls(&self) -> String {
        fs::read_to_string(self.path("calls.txt")).unwrap()
    }

    /// Runs `maglev` on the bench.
    pub fn maglev(&self, arguments: &[&str]) -> Ran {
        let output = Command::new(env!("CARGO_BIN_EXE_maglev"))
            .args(arguments)
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        Ran(output)
    }

    /// Starts `maglev` on the bench and lets it run.
    pub fn start(&self, arguments: &[&str]) -> Child {
        Command::new(env!("CARGO_BIN_EXE_maglev"))
            .args(arguments)
            .current_dir(self.folder.path())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Runs a shell command on the bench, in which `maglev` is this program.
    pub fn shell(&self, command: &str) -> Ran {
        let program = concat!("maglev() { ", env!("CARGO_BIN_EXE_maglev"), " \"$@\"; }; ");
        let output = Command::new("bash")
            .args(["-c", &format!("{program}{command}")])
            .current_dir(self.folder.path())
            .output()
            .unwrap();
        Ran(output)
    }

    /// A file in the results.
    pub fn result(&self, name: &str) -> String {
        fs::read_to_string(self.path("out").join(name)).unwrap()
    }

    /// summary.json.
    pub fn summary(&self) -> Value {
        serde_json::from_str(&self.result("summary.json")).unwrap()
    }

    /// Columns of results.csv without the header, time first.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        self.result("results.csv")
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|field| field.parse().unwrap()).collect())
            .collect()
    }
}

/// A finished command.
pub struct Ran(Output);

impl Ran {
    /// Exit status.
    pub fn status(&self) -> i32 {
        self.0.status.code().unwrap()
    }

    /// The signal that ended it.
    #[cfg(unix)]
    pub fn signal(&self) -> Option<i32> {
        use std::os::unix::process::ExitStatusExt as _;
        self.0.status.signal()
    }

    /// What it printed.
    pub fn stdout(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).unwrap()
    }

    /// What it complained about.
    pub fn stderr(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).unwrap()
    }

    /// Asserts an error with that status whose report holds all the texts and shows no internals.
    #[track_caller]
    pub fn fails(&self, status: i32, texts: &[&str]) {
        let report = self.stderr();
        assert_eq!(self.status(), status, "{report}");
        for text in texts {
            assert!(report.contains(text), "\"{text}\" is missing in:\n{report}");
        }
        assert!(!report.contains("panicked") && !report.contains("Error {"), "{report}");
    }

    /// Asserts success.
    #[track_caller]
    pub fn succeeds(&self) {
        assert_eq!(self.status(), 0, "{}{}", self.stdout(), self.stderr());
    }
}

/// An oscillator of two integrators a and b, y'' = gain · y with gain −1 of `c`, that starts at y = 1; d is an integrator
/// alone.
pub fn oscillator(step: f64) -> Value {
    let mut scenario = ring();
    scenario["instances"] = json!({
        "a": { "unit": "unit", "start": { "y": 1.0 } },
        "b": { "unit": "unit" },
        "c": { "unit": "unit", "parameters": { "gain": -1.0 } },
        "d": { "unit": "unit" },
    });
    scenario["connections"] = json!([
        { "from": "b.y", "to": "c.u" },
        { "from": "c.z", "to": "a.u" },
        { "from": "a.y", "to": "b.u" },
    ]);
    scenario["experiment"] = json!({ "stop": 2.0, "step": step });
    scenario["record"] = json!({ "signals": ["a.y", "b.y", "d.y", "d.z"] });
    scenario
}

/// A bench with a scenario of units whose states can be saved.
pub fn bench_of(scenario: &Value) -> Bench {
    let bench = Bench::new();
    bench.unit("unit.fmu", &with_states(), &[]);
    bench.scenario(scenario);
    bench
}

/// The last row of the results.
pub fn last(bench: &Bench) -> Vec<f64> {
    bench.rows().last().unwrap().clone()
}

/// Two units in a ring: a.y -> b.u, b.y -> a.u; an oscillator when the signs differ.
pub fn ring() -> Value {
    json!({
        "units": { "unit": "unit.fmu" },
        "instances": { "a": { "unit": "unit" }, "b": { "unit": "unit" } },
        "connections": [ { "from": "a.y", "to": "b.u" }, { "from": "b.y", "to": "a.u" } ],
        "experiment": { "stop": 1.0, "step": 0.1 },
        "record": { "signals": ["a.y", "b.y"] }
    })
}
