//! `maglev modes --positions`: the least damping over where a train stands.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;
use std::str::FromStr;

use figure::{FigureLine, FigurePanel};
use indicatif::ProgressBar;
use linear::Linearised;
use linear::modes::Continuous;
use maglev::Error;
use master::Setup;
use results::modes::CoupledMode;
use scenario::{Override, Scenario};
use serde_json::{Value, json};

use super::modes::{carriers, write_files};
use super::table::table;
use super::unit_modes::{families, shown};

/// The parameter that says where a train stands.
const POSITION: &str = "initial_position";
/// Largest number of positions.
const MOST: f64 = 10_000.0;
/// A mode whose largest participant has more belongs to that unit alone.
const ALONE: f64 = 0.999;

/// Values of a parameter, from first to last.
#[derive(Debug, Clone, PartialEq)]
pub struct Positions {
    /// `instance.parameter`, if given.
    target: Option<String>,
    values: Vec<f64>,
}

impl FromStr for Positions {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (target, range) = match text.split_once('=') {
            Some((target, range)) => (Some(target.trim().to_owned()), range),
            None => (None, text),
        };
        let numbers: Vec<f64> = range
            .split(':')
            .map(|it| it.trim().parse::<f64>().ok().filter(|it| it.is_finite()))
            .collect::<Option<_>>()
            .ok_or_else(|| format!("\"{range}\" is not of the form first:last:step"))?;
        let [first, last, step] = numbers.as_slice() else {
            return Err(format!("\"{range}\" is not of the form first:last:step"));
        };
        if *step <= 0.0 || last < first {
            return Err(format!("\"{range}\" needs first ≤ last and a positive step"));
        }
        // the last value counts despite rounding
        let count = ((last - first) / step + 1e-9).floor();
        if count >= MOST {
            return Err(format!("\"{range}\" has more than {MOST} values"));
        }
        let values = (0..=count as u32).map(|k| first + f64::from(k) * step).collect();
        Ok(Self { target, values })
    }
}

/// What was found at one position.
struct Found {
    position: f64,
    /// The least damped mode of all.
    least: CoupledMode,
    /// The least damped mode in which several units move.
    coupled: Option<CoupledMode>,
    carriers: String,
}

/// Computes the continuous modes at all positions.
pub fn run(
    scenario: &mut Scenario,
    positions: &Positions,
    folder: Option<&Path>,
    as_json: bool,
) -> Result<ExitCode, Error> {
    let setup = Setup::new(scenario)?;
    let target = match &positions.target {
        Some(target) => target.clone(),
        None => standing(&setup)?,
    };
    let measured = measured(&setup, &target);
    let overrides = scenario.overrides.clone();
    let progress = ProgressBar::new(positions.values.len() as u64);
    let mut all = Vec::new();
    for &position in &positions.values {
        scenario.overrides.clone_from(&overrides);
        scenario.overrides.push(Override { target: target.clone(), value: position.to_string() });
        let setup = Setup::new(scenario)?;
        let modes = super::at_home(|| linear::modes::continuous(&Linearised::at_start(&setup)?))?;
        all.extend(found(position, modes));
        progress.inc(1);
    }
    progress.finish_and_clear();
    let text = serde_json::to_string_pretty(&to_json(&target, &all)).unwrap_or_default() + "\n";
    if let Some(folder) = folder {
        let picture = picture(&measured, &all)?;
        write_files(folder, &[("positions.json", text.clone()), ("positions.svg", picture)])?;
    }
    super::print(&if as_json { text } else { page(&target, &all) })?;
    let grows = all.iter().any(|it| it.least.continuous.real >= 0.0);
    Ok(if grows { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

/// The parameter of the one unit that has a position at the start.
fn standing(setup: &Setup) -> Result<String, Error> {
    let instances = setup.system().instances.iter();
    let with: Vec<&str> = instances
        .filter(|it| it.package.description().variables.iter().any(|v| v.name == POSITION))
        .map(|it| it.name.as_str())
        .collect();
    match with.as_slice() {
        [one] => Ok(format!("{one}.{POSITION}")),
        [] => Err(Error::NoPosition { found: "no unit has".to_owned() }),
        all => Err(Error::NoPosition { found: format!("{} have", all.join(", ")) }),
    }
}

/// The name of a parameter with its unit of measure, if it has one.
fn measured(setup: &Setup, target: &str) -> String {
    let unit = setup.system().instances.iter().find_map(|it| {
        let variable = target.strip_prefix(it.name.as_str())?.strip_prefix('.')?;
        let all = &it.package.description().variables;
        all.iter().find(|known| known.name == variable)?.unit.clone()
    });
    unit.map_or_else(|| target.to_owned(), |unit| format!("{target} ({unit})"))
}

fn found(position: f64, Continuous { modes, parts }: Continuous) -> Option<Found> {
    let alone = |it: &CoupledMode| it.participation.values().any(|share| *share > ALONE);
    let coupled = modes.iter().find(|it| !alone(it)).cloned();
    let carriers = parts.iter().map(carriers).collect::<Vec<_>>().join("; ");
    Some(Found { position, least: modes.into_iter().next()?, coupled, carriers })
}

/// The position with the least damping, of modes in which several units move if there are any.
fn worst(all: &[Found]) -> Option<(&Found, &CoupledMode)> {
    let modes = all.iter().filter_map(|it| Some((it, it.coupled.as_ref()?)));
    let damping = |it: &(&Found, &CoupledMode)| it.1.continuous.damping_ratio;
    modes.min_by(|a, b| damping(a).total_cmp(&damping(b)))
}

// writing to a String cannot fail, so the results of writeln! are dropped
fn page(target: &str, all: &[Found]) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "{} values of {target}; continuous modes at each", all.len());
    if let Some((found, mode)) = worst(all) {
        let value = mode.continuous;
        let _ = writeln!(
            text,
            "worst            damping {:.4} at {:.4} Hz, where {target} = {} ({})",
            value.damping_ratio, value.frequency_hz, found.position, found.carriers
        );
    }
    let growing = all.iter().filter(|it| it.least.continuous.real >= 0.0).count();
    let _ = writeln!(
        text,
        "{}",
        match growing {
            0 => "stable           at all of these positions".to_owned(),
            some => format!("UNSTABLE         at {some} of these positions"),
        }
    );
    let _ = writeln!(
        text,
        "\"least\" is over all modes, \"coupled\" over those in which several units move.\n"
    );
    let head = ["position", "least", "Hz", "coupled", "Hz", "participation", "coupled parts"];
    let rows = all.iter().map(|it| {
        let number = |value: f64| format!("{value:.4}");
        let pair = |mode: Option<&CoupledMode>| match mode.map(|it| it.continuous) {
            Some(value) => [number(value.damping_ratio), number(value.frequency_hz)],
            None => ["-".to_owned(), "-".to_owned()],
        };
        let [least, least_hz] = pair(Some(&it.least));
        let [coupled, coupled_hz] = pair(it.coupled.as_ref());
        let parts = it.coupled.iter().flat_map(|it| &it.participation);
        let parts = shown(families(parts.map(|(name, share)| (name.as_str(), *share))));
        let position = it.position.to_string();
        vec![position, least, least_hz, coupled, coupled_hz, parts, it.carriers.clone()]
    });
    let head = head.map(str::to_owned).to_vec();
    text + &table(std::iter::once(head).chain(rows), &[0, 1, 2, 3, 4])
}

fn to_json(target: &str, all: &[Found]) -> Value {
    let position = |it: &Found| json!({"position": it.position, "least": it.least, "coupled": it.coupled, "parts": it.carriers});
    json!({
        "parameter": target,
        "worst": worst(all).map(|(found, _)| found.position),
        "positions": all.iter().map(position).collect::<Vec<_>>(),
    })
}

/// The curve of damping over position.
fn picture(measured: &str, all: &[Found]) -> Result<String, Error> {
    let curve = |label: &str, value: &dyn Fn(&Found) -> Option<f64>| FigureLine {
        label: label.to_owned(),
        points: all.iter().filter_map(|it| Some((it.position, value(it)?))).collect(),
    };
    let damping = FigurePanel {
        ylabel: "damping ratio".to_owned(),
        lines: vec![
            curve("least of the modes in which several units move", &|it| {
                Some(it.coupled.as_ref()?.continuous.damping_ratio)
            }),
            curve("least of all modes", &|it| Some(it.least.continuous.damping_ratio)),
        ],
    };
    let frequency = FigurePanel {
        ylabel: "frequency (Hz)".to_owned(),
        lines: vec![curve("of the least damped mode in which several units move", &|it| {
            Some(it.coupled.as_ref()?.continuous.frequency_hz)
        })],
    };
    let title = "Least damping over position";
    figure::draw_over(title, measured, &[damping, frequency])
        .map_err(|source| Error::Plot { file: "positions.svg".to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_ranges_include_both_ends() {
        let found: Positions = "0:75:0.5".parse().unwrap();
        assert_eq!((found.values.len(), found.values.last()), (151, Some(&75.0)));
        let found: Positions = "train.place = 0:0.3:0.1".parse().unwrap();
        assert_eq!((found.target.as_deref(), found.values.len()), (Some("train.place"), 4));
    }

    #[test]
    fn refusal_ranges_that_are_none_are_named() {
        for (text, wanted) in [
            ("0:75", "not of the form"),
            ("0:a:1", "not of the form"),
            ("0:inf:1", "not of the form"),
            ("0:75:0", "positive step"),
            ("75:0:1", "first ≤ last"),
            ("0:1e9:1e-9", "more than"),
        ] {
            let error = text.parse::<Positions>().unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }
}
