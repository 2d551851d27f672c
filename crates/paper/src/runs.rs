//! The scenarios of the paper's figures: run anew, read back.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Stdio},
    sync::Mutex,
    thread,
    time::Instant,
};

use anyhow::{Context, Result, anyhow, bail};
use results::Table;
use serde_json::Value;

/// Scenarios that run at once: they share the processor with little else, and each needs one core.
const WORKERS: usize = 2;

/// First frequencies of the girders of figure 14 (Hz).
pub const FREQUENCIES: [u32; 4] = [5, 6, 7, 8];
/// What changes them.
pub const MEANS: [&str; 2] = ["stiffness", "mass"];

/// 5 km/h over a track with waves down to 5 cm.
pub const SHORT_WAVES: &str = "low-speed-short-waves";
/// The same over girders without their second mode: what that mode does is the difference.
pub const ONE_MODE: &str = "low-speed-short-waves-one-mode";

/// The same where magnets feel the track at their centres.
pub const AT_CENTRES: &str = "low-speed-short-waves-at-centres";

/// The bare girder after an impulse.
pub const IMPULSE: &str = "girder-impulse";
/// The resonance of train and girder, limited by stops and skids.
pub const LIMITED: &str = "resonance-limited";

/// Name of the scenario of a girder of figure 14.
pub fn girder(frequency: u32, means: &str) -> String {
    format!("standstill-{frequency}hz-{means}")
}

/// The runs: scenarios in `scenarios/` without `.json`, and variants of [`SHORT_WAVES`]; the longest first, so
/// that the workers end together.
pub fn scenarios() -> Vec<String> {
    let long = [
        "standstill",
        "standstill-quarter",
        "low-speed",
        SHORT_WAVES,
        ONE_MODE,
        AT_CENTRES,
        LIMITED,
        IMPULSE,
    ];
    let girders = MEANS.iter().flat_map(|means| FREQUENCIES.map(|f| girder(f, means)));
    long.map(str::to_owned).into_iter().chain(girders).collect()
}

/// Where the results of a scenario are.
pub fn folder(name: &str) -> PathBuf {
    crate::target_dir().join("paper").join(name)
}

fn scenario(name: &str) -> PathBuf {
    crate::root().join("scenarios").join(name).with_extension("json")
}

/// Runs all scenarios into fresh folders and reports each that is finished.
pub fn run_all() -> Result<()> {
    let names = scenarios();
    let waiting = Mutex::new(names.iter());
    let start = Instant::now();
    let worker = || -> Result<()> {
        loop {
            // the lock is held for the one statement only
            let next = waiting.lock().map_err(|_| anyhow!("another run panicked"))?.next();
            let Some(name) = next else { return Ok(()) };
            let begin = Instant::now();
            run(name)?;
            let (own, all) = (begin.elapsed().as_secs_f64(), start.elapsed().as_secs_f64());
            eprintln!("{name}: {own:.0} s ({all:.0} s since the start)");
        }
    };
    thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().try_for_each(|it| it.join().map_err(|_| anyhow!("a run panicked"))?)
    })
}

fn run(name: &str) -> Result<()> {
    let folder = folder(name);
    // results of an earlier run must not pass for those of this one
    if folder.exists() {
        fs::remove_dir_all(&folder).with_context(|| format!("removing {}", folder.display()))?;
    }
    let (file, setting) = match name {
        ONE_MODE => (SHORT_WAVES, Some("guideway.modes=1")),
        AT_CENTRES => (SHORT_WAVES, Some("guideway.irregularity_averaged=false")),
        _ => (name, None),
    };
    let mut command = maglev();
    command.arg("run").arg(scenario(file));
    command.args(setting.into_iter().flat_map(|it| ["--set", it]));
    command.args(["--quiet", "--no-report", "--out"]).arg(&folder);
    let status = command.status().context("starting maglev")?;
    if !status.success() {
        bail!("the run {name} ended with {status}");
    }
    Ok(())
}

/// The command `maglev`.
pub fn maglev() -> Command {
    let mut command = Command::new(crate::target_dir().join("release").join("maglev"));
    command.current_dir(crate::root());
    command
}

/// The signals of a scenario that has run.
pub fn table(name: &str) -> Result<Table> {
    let folder = folder(name);
    Table::read(&folder)?.with_context(|| format!("no results in {}", folder.display()))
}

/// What a signal did at all communication points: a value of the statistics in summary.json.
pub fn statistic(name: &str, signal: &str, what: &str) -> Result<f64> {
    let file = folder(name).join(results::SUMMARY);
    let text = fs::read(&file).with_context(|| format!("reading {}", file.display()))?;
    let summary: Value = serde_json::from_slice(&text)?;
    summary["signals"][signal][what]
        .as_f64()
        .with_context(|| format!("{}: no {what} of {signal}", file.display()))
}

/// A mode in which girders take part.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Mode {
    /// Natural frequency |λ|/2π (Hz).
    pub frequency: f64,
    /// Damping ratio −Re λ/|λ|.
    pub damping: f64,
    /// Share of the guideway.
    pub girder: f64,
}

/// The coupled modes of a scenario at its start that oscillate and of which magnets, vehicle *and*
/// girder are part, by frequency: at least a hundredth of the girder's, for its own modes on spans
/// that carry nothing are of it alone.
pub fn modes(name: &str) -> Result<Vec<Mode>> {
    modes_with(name, &[])
}

/// The same with further options.
pub fn modes_with(name: &str, options: &[String]) -> Result<Vec<Mode>> {
    let output = maglev()
        .args(["modes", "--json"])
        .arg(scenario(name))
        .args(options)
        .stderr(Stdio::inherit())
        .output()
        .context("starting maglev modes")?;
    let all: Value = serde_json::from_slice(&output.stdout)
        .with_context(|| format!("maglev modes of {name} ended with {}", output.status))?;
    let list = all["modes"]["modes"].as_array().context("no modes in the answer")?;
    let mut modes: Vec<Mode> = list.iter().filter_map(mode).collect();
    modes.sort_by(|a, b| a.frequency.total_cmp(&b.frequency));
    Ok(modes)
}

fn mode(value: &Value) -> Option<Mode> {
    let girder = value["participation"]["guideway"].as_f64()?;
    let frequency = value["continuous"]["frequency_hz"].as_f64()?;
    let damping = value["continuous"]["damping_ratio"].as_f64()?;
    let coupled = (0.1..0.999_999).contains(&girder) && damping < 0.99;
    coupled.then_some(Mode { frequency, damping, girder })
}
