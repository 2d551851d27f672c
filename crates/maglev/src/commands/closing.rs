//! What a run prints at its end: how fast it was, and its files.

use std::path::Path;

use results::summary::{Summary, WallTime};

/// Runs shorter than this (s) do not show how their time divides: the units' time is extrapolated
/// from every seventh step, and the first steps are slower than others.
const MEASURABLE: f64 = 0.1;

/// The speed of the run, then the path of every file.
pub fn text(summary: &Summary, folder: &Path, report: Option<&Path>) -> String {
    let mut text = speed(summary) + "\n";
    if let Some(real_time) = &summary.real_time {
        text += &format!(
            "{} of {} steps were late for {} times real time, by at most {}\n",
            real_time.overruns,
            real_time.steps,
            real_time.factor,
            seconds(real_time.worst_seconds)
        );
    }
    if !summary.metrics.is_empty() {
        text += &super::verdicts::text(&summary.metrics);
    }
    let metrics = (!summary.metrics.is_empty()).then_some(results::METRICS);
    let files = summary.tables.iter().chain(&summary.pictures).map(String::as_str);
    for name in files.chain([results::EVENTS, results::SUMMARY]).chain(metrics) {
        text += &format!("{}\n", folder.join(name).display());
    }
    if let Some(report) = report {
        text += &format!("{}\n", report.display());
    }
    text
}

fn speed(summary: &Summary) -> String {
    let Summary { steps, step, wall_time, real_time_factor, .. } = summary;
    if *steps == 0 {
        return "no steps".to_owned();
    }
    let run = seconds(wall_time.run_seconds);
    let factor = digits(*real_time_factor);
    let shares = shares(wall_time, *steps, summary.algorithm.coupling.threads);
    format!("{steps} steps of {step} s in {run} ({factor} times real time; {shares})")
}

/// How the wall time divides between units and master, as far as that was measured.
fn shares(wall: &WallTime, steps: u64, threads: usize) -> String {
    if wall.run_seconds < MEASURABLE {
        return "too short to measure the units' share".to_owned();
    }
    let Some(master) = wall.master_seconds else {
        return match threads {
            0 | 1 => "nearly all of it in the units".to_owned(),
            _ => format!("units {} on {threads} threads", seconds(wall.units_seconds)),
        };
    };
    #[expect(clippy::cast_precision_loss, reason = "a count of steps")]
    let per_step = master / steps as f64;
    let units = 100.0 * wall.units_seconds / wall.run_seconds;
    format!("{units:.0} % in the units, {} per step in the master", seconds(per_step))
}

/// A time in the unit that suits it, with three digits.
fn seconds(time: f64) -> String {
    let (factor, unit) = match time {
        _ if time >= 1.0 => (1.0, "s"),
        _ if time >= 1e-3 => (1e3, "ms"),
        _ => (1e6, "µs"),
    };
    format!("{} {unit}", digits(factor * time))
}

/// A number, not negative, with three digits, or all those before the decimal point.
fn digits(number: f64) -> String {
    if number == 0.0 {
        return "0".to_owned();
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 5")]
    let places = (2.0 - number.log10().floor()).clamp(0.0, 5.0) as usize;
    format!("{number:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(run_seconds: f64, units_seconds: f64, master_seconds: Option<f64>) -> WallTime {
        WallTime { run_seconds, units_seconds, master_seconds, ..WallTime::default() }
    }

    #[test]
    fn analytic_three_digits_in_a_unit_that_suits() {
        for (time, text) in [
            (0.0, "0 µs"),
            (4.2e-7, "0.420 µs"),
            (0.000_999, "999 µs"),
            (0.012_34, "12.3 ms"),
            (1.0, "1.00 s"),
            (12.34, "12.3 s"),
            (12_345.6, "12346 s"),
        ] {
            assert_eq!(seconds(time), text);
        }
    }

    #[test]
    fn issue_shares_that_were_not_measured_are_not_stated() {
        assert_eq!(
            shares(&wall(2.0, 1.5, Some(0.5)), 1000, 1),
            "75 % in the units, 500 µs per step in the master"
        );
        assert_eq!(
            shares(&wall(0.01, 0.035, None), 10, 1),
            "too short to measure the units' share"
        );
        assert_eq!(shares(&wall(1.0, 1.02, None), 10, 1), "nearly all of it in the units");
        assert_eq!(shares(&wall(1.0, 3.5, None), 10, 4), "units 3.50 s on 4 threads");
    }
}
