//! The result of a tuning as text.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use tune::{ConditionResult, Figures, Objective, TuneResult};

use super::Arguments;
use super::confirm::Confirmation;
use crate::commands::table::table;

/// Ignored modes that are shown of a condition.
const IGNORED: usize = 5;

// writing to a String cannot fail, so the results of writeln! are dropped
/// The page.
pub fn page(result: &TuneResult, confirmed: &[Confirmation], arguments: &Arguments) -> String {
    let mut text = String::new();
    let [before, after] = result.worst();
    let _ = writeln!(text, "{}", result.title);
    let _ = writeln!(
        text,
        "worst of {} conditions: least damping ratio {:.4} before, {:.4} after; modulus margin {:.3} before, {:.3} after",
        result.conditions.len(),
        before.damping,
        after.damping,
        before.modulus,
        after.modulus
    );
    if result.objective != Objective::Damping {
        let _ = writeln!(text, "objective: {}", result.objective.as_str());
    }
    let _ = writeln!(text, "limits: {}\n", if result.kept { "all kept" } else { "NOT all kept" });
    let head = ["parameter", "before", "after", "bounds", "unit"].map(str::to_owned).to_vec();
    let rows = result.parameters.iter().map(|it| {
        vec![
            it.target.clone(),
            it.before.to_string(),
            it.after.to_string(),
            format!("{} to {}", it.bounds.0, it.bounds.1),
            it.unit.clone().unwrap_or_default(),
        ]
    });
    text += &table(std::iter::once(head).chain(rows), &[1, 2]);
    text.push('\n');
    let voltage = result.conditions.iter().any(|it| it.before.voltage > 0.0);
    let mut head = vec![
        "condition",
        "",
        "damping",
        "Hz",
        "decay 1/s",
        "modulus: one",
        "all",
        "delay ms: one",
        "all",
    ];
    if voltage {
        head.push("r.m.s. V");
    }
    let row = |name: &str, when: &str, it: &Figures| {
        let margin = |value: f64| if it.stable() { format!("{value:.3}") } else { "-".to_owned() };
        let mut cells = vec![
            name.to_owned(),
            when.to_owned(),
            format!("{:.4}", it.damping),
            format!("{:.3}", it.frequency_hz),
            format!("{:.3}", it.decay),
            margin(it.modulus_one),
            margin(it.modulus_all),
            margin(1e3 * it.delay_one),
            margin(1e3 * it.delay_all),
        ];
        if voltage {
            cells.push(margin(it.voltage));
        }
        cells
    };
    let rows = result
        .conditions
        .iter()
        .flat_map(|it| [row(&it.name, "before", &it.before), row("", "after", &it.after)]);
    let head = head.into_iter().map(str::to_owned).collect();
    text += &table(std::iter::once(head).chain(rows), &[2, 3, 4, 5, 6, 7, 8, 9]);
    text.push('\n');
    for it in &result.active {
        let _ = match it.gain_per_percent {
            Some(gain) if gain.abs() > 0.0 => {
                writeln!(
                    text,
                    "active: {} (1 % more gains {gain:.2e} of {})",
                    it.what,
                    result.objective.as_str()
                )
            }
            _ => writeln!(text, "active: {}", it.what),
        };
    }
    conditions(&mut text, result);
    for it in confirmed {
        let when = if it.tuned { "after" } else { "before" };
        let shown = |(real, imaginary): (f64, f64)| {
            let size = real.hypot(imaginary);
            format!("{:.4} Hz, damping {:.4}, rate {real:.4}/s", size / TAU, -real / size)
        };
        let _ = match (&it.failure, it.run, it.predicted) {
            (None, Some(run), Some(predicted)) => writeln!(
                text,
                "run, {}, {when}: {} ({:.0} % of the motion); predicted {}",
                it.condition,
                shown(run),
                100.0 * it.share,
                shown(predicted)
            ),
            (failure, ..) => {
                let why = failure.as_deref().unwrap_or("nothing to compare");
                writeln!(text, "run, {}, {when}: {why}", it.condition)
            }
        };
    }
    for note in &result.notes {
        let _ = writeln!(text, "note: {note}");
    }
    let _ = writeln!(text, "{} sets of values in {:.1} s", result.evaluations, result.seconds);
    let _ = writeln!(
        text,
        "\nmaglev run {}{}",
        arguments.scenario.display(),
        settings(result, arguments)
    );
    if let Some(folder) = &arguments.out {
        let front = if result.front.is_empty() { "" } else { ", front.svg, front.png" };
        let _ = writeln!(text, "files: tune.json, tuned.json{front} in {}", folder.display());
    }
    text
}

/// How each condition was computed and checked.
fn conditions(text: &mut String, result: &TuneResult) {
    let mut methods: Vec<&str> = result.conditions.iter().map(|it| it.method.as_str()).collect();
    methods.dedup();
    for method in methods {
        let _ = writeln!(text, "computed: {method}");
    }
    for it in &result.conditions {
        let mut line = format!(
            "started anew, {}: least damping ratio {:.4}, distance to all eigenvalues {:.1e}",
            it.name, it.verified.damping, it.verified.distance
        );
        if let Some([one, delay_one, all, delay_all]) = it.verified.margins {
            let _ = write!(
                line,
                "; modulus margin {one:.3} and {all:.3}, delay margin {:.2} and {:.2} ms",
                1e3 * delay_one,
                1e3 * delay_all
            );
        }
        let _ = writeln!(text, "{line}");
    }
    for it in &result.conditions {
        left_out(text, result, it);
        let untouched = &it.verified.untouched;
        if !untouched.is_empty() {
            let shown = list(&mut untouched.iter().copied());
            let more = if untouched.len() > IGNORED { ", …" } else { "" };
            let _ = writeln!(text, "not reached by the varied units, {}: {shown}{more}", it.name);
        }
    }
}

/// Frequencies and damping ratios.
fn list(modes: &mut dyn Iterator<Item = (f64, f64)>) -> String {
    let shown = modes.take(IGNORED).map(|(hz, ratio)| format!("{hz:.3} Hz {ratio:.4}"));
    shown.collect::<Vec<_>>().join(", ")
}

/// Which modes of a condition do not count, and why.
fn left_out(text: &mut String, result: &TuneResult, it: &ConditionResult) {
    let all = it.ignored.len();
    if all == 0 {
        return;
    }
    let inside = it.ignored.iter().filter(|it| it.in_band).count();
    let band = match result.band {
        Some([low, high]) => format!("{inside} of them from {low} to {high} Hz; "),
        None => String::new(),
    };
    let before = list(&mut it.ignored.iter().map(|it| (it.frequency_hz, it.damping)));
    let after = list(&mut it.ignored_after.iter().copied());
    let more = if all > IGNORED { ", …" } else { "" };
    let _ = writeln!(
        text,
        "left out, {}: {all} modes whose damping ratio no parameter changes by {:.0} % ({band}the least damped): \
         before {before}{more}; after {after}{more}",
        it.name,
        100.0 * result.influence
    );
}

/// The values found as options.
fn settings(result: &TuneResult, arguments: &Arguments) -> String {
    let own = arguments.set.iter().map(ToString::to_string);
    let found = result.patch().into_iter().map(|(target, value)| format!("{target}={value}"));
    own.chain(found).map(|it| format!(" --set '{it}'")).collect()
}
