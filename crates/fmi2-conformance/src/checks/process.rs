//! Effects of an FMU on its process: output, global state, memory.

use std::ffi::{CStr, c_char, c_int};
use std::hint::black_box;
use std::time::{Duration, Instant};

use fmi2_sys::fmi2Status as Status;

use crate::harness::bench::Bench;
use crate::harness::drive::ReadList;
use crate::harness::raw::{Raw, ok};
use crate::harness::{CheckResult, Stop, fault, skip, table};

table! {
    "silent", "2.1.5", Warning, "the FMU writes nothing to standard output", silent;
    "process-state", "2.1.1", Error, "the FMU does not change working directory, rounding mode, denormal numbers or locale", state;
    "memory-instances", "2.1.5", Warning, "memory does not grow when instances are made and freed", instances;
    "memory-steps", "4.2.2", Warning, "memory does not grow with steps, get and set", steps;
    "memory-states", "2.1.8", Warning, "memory does not grow when states are saved and freed", states;
}

/// Provokes messages; the runner looks at the standard output of the process.
fn silent(bench: &Bench) -> CheckResult {
    let mut making = bench.making("unit");
    making.logging = true;
    let Ok(unit) = Raw::make(bench, &making) else {
        return fault("fmi2Instantiate returned null");
    };
    unit.initialize()?;
    unit.run(0, 4)?;
    unit.do_step(bench.time(4), -1.0);
    unit.get_real(&[u32::MAX], &mut [0.0]);
    Ok(())
}

/// Global state of the process that an FMU must not change.
#[derive(Debug, PartialEq)]
struct Process {
    folder: Option<std::path::PathBuf>,
    /// 1 + 2⁻⁵³ and -1 - 2⁻⁵³: 1 and -1 if rounding is to nearest.
    rounding: (f64, f64),
    /// Half of the smallest normal number: 0 if denormal numbers are flushed.
    denormal: f64,
    locale: Option<String>,
}

unsafe extern "C" {
    fn setlocale(category: c_int, locale: *const c_char) -> *mut c_char;
}

/// LC_NUMERIC, which determines the decimal separator.
const NUMERIC: c_int = if cfg!(target_os = "linux") { 1 } else { 4 };

impl Process {
    fn now() -> Self {
        let tiny = black_box(f64::EPSILON / 2.0);
        // SAFETY: null queries the locale without a change
        let locale = unsafe { setlocale(NUMERIC, std::ptr::null()) };
        Self {
            folder: std::env::current_dir().ok(),
            rounding: (black_box(1.0) + tiny, black_box(-1.0) - tiny),
            denormal: black_box(f64::MIN_POSITIVE) * black_box(0.5),
            locale: (!locale.is_null()).then(|| {
                // SAFETY: not null, a C string that lives until the next call
                unsafe { CStr::from_ptr(locale) }.to_string_lossy().into_owned()
            }),
        }
    }
}

fn state(bench: &Bench) -> CheckResult {
    let before = Process::now();
    let judge = |what: &str| {
        let now = Process::now();
        if now == before { Ok(()) } else { fault(format!("{what} changed {before:?} to {now:?}")) }
    };
    let unit = bench.instance("unit")?;
    judge("fmi2Instantiate")?;
    unit.initialize()?;
    judge("initialization")?;
    unit.run(0, 4)?;
    judge("fmi2DoStep")?;
    unit.read(&ReadList::all(bench))?;
    judge("fmi2GetXXX")?;
    unit.free();
    judge("fmi2FreeInstance")
}

/// Memory in use by the process, in bytes.
fn resident() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: u64 = text.split_ascii_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

/// Repeats a call in rounds. After the first, one of up to four rounds must need no more memory than 64 bytes per turn
/// and a quarter of a megabyte in total, which allow for rounding to pages. A leak grows in every round; an allocator
/// that takes a new arena, or a library that fills a cache, does so in one.
fn growth(bench: &Bench, what: &str, mut turn: impl FnMut() -> Result<(), Stop>) -> CheckResult {
    /// Number of turns of a round, unless they take longer than [`LIMIT`].
    const TURNS: u64 = 200;
    const ROUNDS: u64 = 5;
    const LIMIT: Duration = Duration::from_secs(1);
    if resident().is_none() {
        return skip("this system does not report the memory in use");
    }
    let mut round = || -> Result<(u64, u64), Stop> {
        let (begin, mut count) = (Instant::now(), 0);
        while count < TURNS && begin.elapsed() < LIMIT {
            turn()?;
            count += 1;
        }
        Ok((count, resident().unwrap_or_default()))
    };
    let text = format!("up to {} × ({what})", ROUNDS * TURNS);
    bench.trace().quietly(&text, || {
        let (_, mut before) = round()?;
        let mut each = 0;
        for _ in 1..ROUNDS {
            let (count, now) = round()?;
            let grown = now.saturating_sub(before);
            if grown <= (256 << 10) + 64 * count {
                return Ok(());
            }
            (before, each) = (now, grown / count.max(1));
        }
        fault(format!("memory grows by about {each} bytes with each {what}"))
    })
}

fn instances(bench: &Bench) -> CheckResult {
    growth(bench, "instance made, initialized, stepped and freed", || {
        let unit = bench.initialized("unit")?;
        unit.run(0, 1)
    })
}

fn steps(bench: &Bench) -> CheckResult {
    let unit = bench.initialized("unit")?;
    let all = ReadList::all(bench);
    let mut step = 0;
    let inputs = bench.inputs();
    growth(bench, "step with get and set", || {
        unit.move_inputs(&inputs, step)?;
        let status = unit.do_step(bench.time(step), bench.step());
        step += 1;
        if status == Status::fmi2Discard && unit.wants_end() {
            step = 0;
            ok(unit.reset(), "fmi2Reset")?;
            return unit.initialize();
        }
        ok(status, "fmi2DoStep")?;
        unit.read(&all).map(drop)
    })
}

fn states(bench: &Bench) -> CheckResult {
    if !bench.description().co_simulation.can_get_and_set_fmu_state {
        return skip("canGetAndSetFMUstate is false");
    }
    let unit = bench.initialized("unit")?;
    unit.run(0, 1)?;
    growth(bench, "state saved, restored and freed", || {
        let mut saved = std::ptr::null_mut();
        unit.get_state(&mut saved);
        unit.set_state(saved);
        unit.free_state(&mut saved);
        Ok(())
    })
}
