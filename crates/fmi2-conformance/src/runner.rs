//! Runs each check in a separate process, and collects the results in a report.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::CheckError;
use crate::checks::checks;
use crate::harness::bench::Bench;
use crate::harness::trace::CallTrace;
use crate::harness::{Check, Observation, Stop};
use fmi2_import::description::Severity;
use fmi2_import::package::Package;
use fmi2_import::scratch::Scratch;

pub use crate::harness::resume::resume;

/// The hidden subcommand of `maglev` that runs [`child`].
const SUBCOMMAND: &str = "conformance-check";

/// How to run the checks.
#[derive(Debug, Clone)]
pub struct ConformanceOptions {
    /// The program with the hidden subcommands: `maglev`.
    pub program: PathBuf,
    /// Names of the checks to run; empty: all.
    pub only: Vec<String>,
    /// Time limit of a check.
    pub limit: Duration,
}

/// The result of one check.
#[derive(Debug, Clone, Serialize)]
pub struct CheckOutcome {
    /// Name of the check, as in [`Check::id`].
    pub check: &'static str,
    /// Section of the FMI 2.0.5 specification.
    pub section: &'static str,
    /// Why the check does not apply to the FMU.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skipped: Option<String>,
    /// Findings, empty if the FMU passes or the check was skipped.
    pub findings: Vec<Observation>,
    /// Wall time (s).
    pub seconds: f64,
}

/// The results of all checks that ran.
#[derive(Debug, Clone, Serialize)]
pub struct ConformanceReport {
    /// Path of the .fmu file, as it was given.
    pub unit: PathBuf,
    /// The results in the order of the checks.
    pub checks: Vec<CheckOutcome>,
}

impl ConformanceReport {
    /// Number of findings with a severity.
    #[must_use]
    pub fn count(&self, severity: Severity) -> usize {
        let all = self.checks.iter().flat_map(|outcome| &outcome.findings);
        all.filter(|finding| finding.severity == severity).count()
    }
}

/// What the process of a check writes for its parent.
#[derive(Serialize, Deserialize)]
struct Answer {
    skipped: Option<String>,
    findings: Vec<Observation>,
}

/// Runs the checks on an FMU, and passes each result to `report` when it is there. If the check `load` fails, the
/// others do not run.
///
/// # Errors
/// There is no check of a wanted name, the FMU cannot be opened, or there is no temporary folder.
pub fn run(
    unit: &Path,
    options: &ConformanceOptions,
    mut report: impl FnMut(&CheckOutcome),
) -> Result<ConformanceReport, CheckError> {
    if let Some(id) = options.only.iter().find(|id| checks().all(|check| check.id != **id)) {
        return Err(unknown(id));
    }
    // an FMU that cannot be opened is bad input, not a finding of each check
    drop(Package::open(unit)?);
    let folder = Scratch::new().map_err(|source| CheckError::Write {
        path: "the folder for temporary files".into(),
        source,
    })?;
    let wanted =
        |check: &&Check| options.only.is_empty() || options.only.iter().any(|id| id == check.id);
    let mut all = ConformanceReport { unit: unit.to_owned(), checks: Vec::new() };
    for check in checks().filter(wanted) {
        let place = Place::new(folder.path(), check.id);
        let begin = Instant::now();
        let (skipped, findings) = place.start(unit, check, options);
        let seconds = begin.elapsed().as_secs_f64();
        let (check, section) = (check.id, check.section);
        let outcome = CheckOutcome { check, section, skipped, findings, seconds };
        report(&outcome);
        let broken = outcome.check == "load" && !outcome.findings.is_empty();
        all.checks.push(outcome);
        if broken {
            break;
        }
    }
    Ok(all)
}

fn unknown(id: &str) -> CheckError {
    let suggestion = patterns::suggest(id, checks().map(|check| check.id));
    CheckError::Unknown { id: id.to_owned(), suggestion }
}

/// The files of one check.
struct Place {
    answer: PathBuf,
    trace: PathBuf,
    stdout: PathBuf,
    stderr: PathBuf,
}

impl Place {
    fn new(folder: &Path, id: &str) -> Self {
        let file = |ending: &str| folder.join(format!("{id}.{ending}"));
        Self {
            answer: file("json"),
            trace: file("trace"),
            stdout: file("stdout"),
            stderr: file("stderr"),
        }
    }

    fn start(
        &self,
        unit: &Path,
        check: &Check,
        options: &ConformanceOptions,
    ) -> (Option<String>, Vec<Observation>) {
        let finding = |message: String| {
            let calls = CallTrace::tail(&fs::read_to_string(&self.trace).unwrap_or_default());
            (None, vec![Observation { severity: check.severity, message, calls }])
        };
        let ended = match self.wait(unit, check, options) {
            Ok(Some(status)) => status,
            Ok(None) => {
                return finding(format!(
                    "the check did not end within {} s",
                    options.limit.as_secs_f64()
                ));
            }
            Err(error) => return finding(format!("cannot start the check: {error}")),
        };
        let answer = fs::read(&self.answer).ok();
        let Some(answer) = answer.and_then(|text| serde_json::from_slice::<Answer>(&text).ok())
        else {
            return finding(format!("the FMU ended the process: {}{}", ended, self.said()));
        };
        let mut findings = answer.findings;
        if !ended.success() {
            findings.extend(finding(format!("the process crashed at its end: {ended}")).1);
        }
        if check.id == "silent" {
            let text = fs::read_to_string(&self.stdout).unwrap_or_default();
            if !text.is_empty() {
                let start: String = text.chars().take(60).collect();
                findings.extend(finding(format!("the FMU wrote to standard output: {start:?}")).1);
            }
        }
        (answer.skipped, findings)
    }

    /// The last line that a process wrote to standard error.
    fn said(&self) -> String {
        let text = fs::read_to_string(&self.stderr).unwrap_or_default();
        let last = text.lines().last().unwrap_or_default();
        if last.is_empty() { String::new() } else { format!("; its last message: {last}") }
    }

    /// Waits for the end of the process; `None` if it was killed at the time limit.
    fn wait(
        &self,
        unit: &Path,
        check: &Check,
        options: &ConformanceOptions,
    ) -> std::io::Result<Option<ExitStatus>> {
        let mut child = Command::new(&options.program)
            .arg(SUBCOMMAND)
            .args([unit, Path::new(check.id), &self.answer, &self.trace])
            // files that a crash leaves behind are removed with the parent's folder; Windows calls it TMP
            .envs(
                ["TMPDIR", "TMP"].map(|it| (it, self.answer.parent().unwrap_or(Path::new("/tmp")))),
            )
            .stdin(Stdio::null())
            .stdout(File::create(&self.stdout)?)
            .stderr(File::create(&self.stderr)?)
            .spawn()?;
        let begin = Instant::now();
        let mut pause = Duration::from_millis(1);
        loop {
            if let Some(status) = child.try_wait()? {
                return Ok(Some(status));
            }
            if begin.elapsed() > options.limit {
                child.kill()?;
                child.wait()?;
                return Ok(None);
            }
            std::thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(20));
        }
    }
}

/// Runs one check in this process. Writes its result to the file `answer`, and each call to `trace` before it is made.
///
/// # Errors
/// There is no such check, or a file cannot be written.
pub fn child(unit: &Path, id: &str, answer: &Path, trace: &Path) -> Result<(), CheckError> {
    let failed = |path: &Path, source| CheckError::Write { path: path.to_owned(), source };
    let check = checks().find(|check| check.id == id).ok_or_else(|| unknown(id))?;
    let file = File::create(trace).map_err(|source| failed(trace, source))?;
    let judged = match Bench::new(unit, check.severity, Some(file)) {
        Ok(bench) => judge(check, &bench),
        Err(error) => {
            let message = fmi2_import::causes(&error).join(": ");
            let severity = check.severity;
            let calls = Vec::new();
            Answer { skipped: None, findings: vec![Observation { severity, message, calls }] }
        }
    };
    let text = serde_json::to_vec(&judged).unwrap_or_default();
    fs::write(answer, text).map_err(|source| failed(answer, source))
}

fn judge(check: &Check, bench: &Bench) -> Answer {
    let skipped = match (check.run)(bench) {
        Ok(()) => None,
        Err(Stop::Skip(reason)) => Some(reason),
        Err(Stop::Fault(message)) => {
            bench.find(message);
            None
        }
    };
    Answer { skipped, findings: bench.take() }
}
