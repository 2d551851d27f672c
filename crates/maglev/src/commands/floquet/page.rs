//! The stability of a moving train as text.

use std::fmt::Write as _;

use floquet::MovingTrain;

use super::{Arguments, LEAST_GROWTH, Point, Report, YAxis};
use crate::commands::table::table;

pub(super) fn page(report: &Report, trains: &[MovingTrain], arguments: &Arguments) -> String {
    let mut text = String::new();
    let first = &trains[0];
    let reduced = match (report.reduced_states, report.reduction_error) {
        (Some(states), Some(error)) => {
            format!(", reduced to {states} (error of its response up to {:.2} %)", 100.0 * error)
        }
        _ => String::new(),
    };
    let _ = writeln!(
        text,
        "train            {} magnets over {:.2} m, {} states{reduced}",
        report.magnets,
        first.train.length(),
        report.states
    );
    let row = &first.row;
    let spans =
        if row.spans == 1 { "each span".to_owned() } else { format!("every {} spans", row.spans) };
    let whole = if row.spans == row.of && row.of > 1 { ", the whole layout" } else { "" };
    let _ = writeln!(
        text,
        "row              endless and smooth; repeats after {spans}, {} m{whole}; {} modes",
        row.period,
        row.modes()
    );
    if let Some([growth, hz]) = report.on_rigid_track {
        let _ = writeln!(
            text,
            "on a rigid track {growth:.4} 1/s at {hz:.4} Hz is the least stable mode",
        );
    }
    if let Some(rate) = report.growth_of_left_out.filter(|&rate| rate > LEAST_GROWTH) {
        let _ = writeln!(
            text,
            "apart            UNSTABLE: a mode that does not act on the girders grows by {rate:.4} 1/s"
        );
    }
    if report.above_hz > 0.0 {
        let _ = writeln!(text, "judged           motions of at least {} Hz", report.above_hz);
    }
    if let Some(it) = &report.check {
        let _ = writeln!(
            text,
            "with all states  {:.4} 1/s instead of {:.4} 1/s at the least stable point, {}{} m/s",
            it.growth,
            it.growth_reduced,
            report
                .y
                .as_ref()
                .zip(it.y)
                .map(|(y, at)| format!("{} = {at}, ", y.parameter))
                .unwrap_or_default(),
            it.speed
        );
    }
    text.push('\n');
    text += &match &report.y {
        Some(axis) => by_value(report, axis),
        None if report.speeds.len() == 1 => motions(&report.points[0][0], arguments.above),
        None => by_speed(&report.points[0]),
    };
    let failed: Vec<&str> =
        report.points.iter().flatten().filter_map(|it| it.failed.as_deref()).collect();
    if let Some(reason) = failed.first() {
        let _ = writeln!(text, "\n{} points could not be computed: {reason}", failed.len());
    }
    text
}

fn verdict(point: &Point) -> &'static str {
    match point.growth {
        Some(rate) if rate > 0.0 => "GROWS",
        Some(_) => "decays",
        None if point.failed.is_some() => "not computed",
        None => "decays faster",
    }
}

fn shown(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |it| format!("{it:.4}"))
}

/// Every resolved motion at one speed.
fn motions(point: &Point, above: f64) -> String {
    let head = ["growth 1/s", "Hz", "damping", "|multiplier|"].map(str::to_owned).to_vec();
    let rows = point.multipliers.iter().filter(|it| it[3] >= above).map(|it| {
        let [re, im, growth, hz] = *it;
        let damping = -growth / growth.hypot(std::f64::consts::TAU * hz);
        let size = re.hypot(im);
        let size = if size > 1e-3 { format!("{size:.5}") } else { format!("{size:.2e}") };
        vec![format!("{growth:.4}"), format!("{hz:.4}"), format!("{damping:.4}"), size]
    });
    let mut text = table(std::iter::once(head).chain(rows), &[0, 1, 2, 3]);
    if let Some(floor) = point.floor {
        let _ = writeln!(
            text,
            "\nMotions with a growth rate below {floor:.2} 1/s are lost in rounding and not shown."
        );
    }
    text
}

/// The critical motion at each speed.
fn by_speed(points: &[Point]) -> String {
    let head = ["m/s", "km/h", "growth 1/s", "Hz", "damping", ""].map(str::to_owned).to_vec();
    let rows = points.iter().map(|it| {
        vec![
            format!("{:.3}", it.speed),
            format!("{:.1}", 3.6 * it.speed),
            it.growth.or(it.floor).map_or_else(
                || "-".to_owned(),
                |rate| {
                    let below = if it.growth.is_none() { "< " } else { "" };
                    format!("{below}{rate:.4}")
                },
            ),
            shown(it.frequency_hz),
            shown(it.damping_ratio),
            verdict(it).to_owned(),
        ]
    });
    table(std::iter::once(head).chain(rows), &[0, 1, 2, 3, 4])
}

/// For each value of the parameter, the speeds at which a motion grows, and the worst one.
fn by_value(report: &Report, axis: &YAxis) -> String {
    let head =
        [axis.parameter.as_str(), "grows at m/s", "worst at m/s", "growth 1/s", "Hz", "damping"];
    let rows = axis.values.iter().zip(&report.points).map(|(value, row)| {
        let worst = row
            .iter()
            .filter(|it| it.growth.is_some())
            .max_by(|a, b| a.growth.unwrap_or(f64::MIN).total_cmp(&b.growth.unwrap_or(f64::MIN)));
        vec![
            format!("{value:.4}"),
            ranges(row),
            worst.map_or_else(|| "-".to_owned(), |it| format!("{:.3}", it.speed)),
            shown(worst.and_then(|it| it.growth)),
            shown(worst.and_then(|it| it.frequency_hz)),
            shown(worst.and_then(|it| it.damping_ratio)),
        ]
    });
    table(std::iter::once(head.map(str::to_owned).to_vec()).chain(rows), &[0, 2, 3, 4, 5])
}

/// Runs of neighbouring speeds at which a motion grows.
fn ranges(row: &[Point]) -> String {
    let grows = |it: &Point| it.growth.is_some_and(|rate| rate > 0.0);
    let runs: Vec<String> = row
        .chunk_by(|a, b| grows(a) == grows(b))
        .filter(|run| grows(&run[0]))
        .map(|run| match run {
            [one] => format!("{:.3}", one.speed),
            [first, .., last] => format!("{:.3} … {:.3}", first.speed, last.speed),
            [] => String::new(),
        })
        .collect();
    if runs.is_empty() { "none".to_owned() } else { runs.join(", ") }
}
