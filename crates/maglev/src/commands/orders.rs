//! `maglev modes --orders`: the order in which units step decides how exact Gauss-Seidel is, and costs nothing.

use std::fmt::Write as _;
use std::process::ExitCode;

use indexmap::IndexMap;
use indicatif::ProgressBar;
use linear::Linearised;
use maglev::Error;
use master::Setup;
use results::modes::CoupledModes;
use scenario::{AlgorithmName, Scenario};
use serde_json::{Value, json};

use super::modes::shorten;
use super::table::table;

/// More kinds of units have too many orders: six have 720.
const MOST_KINDS: usize = 5;
/// Degrees of extrapolation that are compared, unless one is given.
const DEGREES: [u8; 3] = [1, 2, 3];
/// Modes up to this frequency (Hz) count, unless one is given: girders and levitation.
const BELOW: f64 = 30.0;

/// One order with one degree.
struct Compared {
    /// Kinds of units, by their keys in `units`.
    order: Vec<String>,
    degree: u8,
    modes: CoupledModes,
    /// Largest relative error of a frequency, and of a damping ratio.
    errors: [f64; 2],
}

/// Computes the modes as stepped for all orders of the kinds of units, and prints them, the most exact first.
pub fn run(
    scenario: &mut Scenario,
    degree: Option<u8>,
    below: Option<f64>,
    as_json: bool,
) -> Result<ExitCode, Error> {
    shorten(scenario, 1)?;
    let mut kinds: IndexMap<String, Vec<String>> = IndexMap::new();
    for instance in &Setup::new(scenario)?.system().instances {
        kinds.entry(instance.unit.clone()).or_default().push(instance.name.clone());
    }
    if kinds.len() > MOST_KINDS || !scenario.algorithm.groups.is_empty() {
        let groups = if scenario.algorithm.groups.is_empty() { "" } else { " and groups" };
        return Err(Error::NoOrders { kinds: kinds.len(), most: MOST_KINDS, groups });
    }
    scenario.algorithm.name = AlgorithmName::GaussSeidel;
    let below = below.unwrap_or(BELOW);
    let degrees = degree.map_or(DEGREES.to_vec(), |degree| vec![degree]);
    let orders = permutations(kinds.len());
    let progress = ProgressBar::new((orders.len() * degrees.len()) as u64);
    let mut all = Vec::new();
    for order in &orders {
        let order: Vec<(&String, &Vec<String>)> =
            order.iter().filter_map(|&kind| kinds.get_index(kind)).collect();
        scenario.algorithm.order = order.iter().flat_map(|(_, names)| (*names).clone()).collect();
        for &degree in &degrees {
            scenario.algorithm.extrapolation = Some(degree);
            let setup = Setup::new(scenario)?;
            let modes = super::at_home(|| linear::modes::of(&Linearised::at_start(&setup)?))?;
            let errors = errors(&modes, below);
            let order = order.iter().map(|(kind, _)| (*kind).clone()).collect();
            all.push(Compared { order, degree, modes, errors });
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    // growing ones last; a sum counts a tenth of a percent of frequency like a percent of damping
    let rank = |it: &Compared| (!it.modes.stepped_stable, 10.0 * it.errors[0] + it.errors[1]);
    all.sort_by(|a, b| {
        let ((a, error), (b, other)) = (rank(a), rank(b));
        a.cmp(&b).then(error.total_cmp(&other))
    });
    let text = if as_json { to_json(&all, below) } else { page(&all, below) };
    super::print(&text)?;
    Ok(ExitCode::SUCCESS)
}

/// All orders of so many things, the first one as they are.
fn permutations(count: usize) -> Vec<Vec<usize>> {
    if count == 0 {
        return vec![Vec::new()];
    }
    let shorter = permutations(count - 1);
    let places = (0..count).rev();
    places
        .flat_map(|place| {
            shorter.iter().map(move |order| {
                let mut order = order.clone();
                order.insert(place, count - 1);
                order
            })
        })
        .collect()
}

/// The largest relative errors of frequency and damping ratio as stepped, of vibrations up to a frequency.
/// Infinite for a mode that no multiplier belongs to.
fn errors(modes: &CoupledModes, below: f64) -> [f64; 2] {
    let vibrations = modes.modes.iter().filter(|mode| {
        let it = mode.continuous;
        it.imaginary > 0.0 && it.frequency_hz <= below && it.damping_ratio != 0.0
    });
    vibrations.fold([0.0, 0.0], |[frequency, damping], mode| {
        let (exact, Some(stepped)) = (mode.continuous, mode.stepped) else {
            return [f64::INFINITY; 2];
        };
        let apart = |a: f64, b: f64| (a / b - 1.0).abs();
        [
            frequency.max(apart(stepped.frequency_hz, exact.frequency_hz)),
            damping.max(apart(stepped.damping_ratio, exact.damping_ratio)),
        ]
    })
}

fn to_json(all: &[Compared], below: f64) -> String {
    let one = |it: &Compared| -> Value {
        json!({
            "order": it.order,
            "extrapolation": it.degree,
            "stable": it.modes.stepped_stable,
            "frequency_error": it.errors[0],
            "damping_error": it.errors[1],
            "coupling_multiplier": it.modes.coupling_multiplier,
        })
    };
    let step = all.first().map(|it| it.modes.step);
    let orders: Vec<Value> = all.iter().map(one).collect();
    let file = json!({ "step": step, "below": below, "orders": orders });
    // plain data, which always prints
    serde_json::to_string_pretty(&file).unwrap_or_default() + "\n"
}

// writing to a String cannot fail, so the result of writeln! is dropped
fn page(all: &[Compared], below: f64) -> String {
    let mut text = String::new();
    let step = all.first().map_or(f64::NAN, |it| it.modes.step);
    let _ = writeln!(
        text,
        "Gauss-Seidel in steps of {step} s: largest errors of the vibrations up to {below} Hz at the start of the \
         scenario\n"
    );
    let head =
        ["order of the units", "extrapolation", "frequency", "damping", "coupling itself", ""];
    let percent = |value: f64| format!("{:.2e} %", 100.0 * value);
    let rows = all.iter().map(|it| {
        vec![
            it.order.join(", "),
            it.degree.to_string(),
            percent(it.errors[0]),
            percent(it.errors[1]),
            format!("{:.3}", it.modes.coupling_multiplier),
            if it.modes.stepped_stable { "" } else { "UNSTABLE" }.to_owned(),
        ]
    });
    let head = head.map(str::to_owned).to_vec();
    text += &table(std::iter::once(head).chain(rows), &[1, 2, 3, 4]);
    text + "\nThis holds for small smooth motions. Kinks, such as rough joints, samples and limits, are not in it.\n"
}

#[cfg(test)]
mod tests {
    use super::permutations;

    #[test]
    fn analytic_all_orders_occur_once_and_the_given_one_first() {
        let all = permutations(4);
        assert_eq!(all[0], [0, 1, 2, 3]);
        let different: std::collections::HashSet<_> = all.iter().collect();
        assert_eq!((all.len(), different.len()), (24, 24));
    }
}
