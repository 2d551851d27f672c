//! Responses from inputs to outputs of the closed system.

use std::f64::consts::TAU;

use faer::prelude::c64;
use linear::StateSpace;
use results::response::{Curve, ResponseCurve};

use crate::error::ResponseError;
use crate::evaluate::{Evaluator, Scratch, for_all};
use crate::grid;
use crate::model::{Domain, Model};
use crate::search::minimum;

/// All responses of a system, over `range` (Hz) with `per_decade` frequencies a decade and more around its
/// resonances.
///
/// # Errors
/// The eigenvalues do not converge.
pub fn responses(
    system: &StateSpace,
    range: (f64, f64),
    per_decade: usize,
) -> Result<Vec<ResponseCurve>, ResponseError> {
    let model = Model::from(system);
    let poles = model.reduced().poles()?;
    let range = (TAU * range.0, TAU * range.1);
    let frequencies = grid::around(&poles, Domain::Continuous, range, per_decade);
    let evaluator = Evaluator::new(&model);
    let values = for_all(&frequencies, |omega, scratch| evaluator.at(omega, scratch));
    let mut scratch = Scratch::default();
    let mut found = Vec::new();
    for (j, input) in system.inputs.iter().enumerate() {
        for (i, output) in system.outputs.iter().enumerate() {
            let curve: Vec<c64> = values.iter().map(|value| value[(i, j)]).collect();
            let exact = |omega: f64| evaluator.entry((i, j), omega, &mut scratch);
            let unit = |it: &Option<String>| it.clone().unwrap_or_else(|| "1".to_owned());
            found.push(ResponseCurve {
                from: input.name.clone(),
                to: output.name.clone(),
                unit: format!("{}/{}", unit(&output.unit), unit(&input.unit)),
                peak: peak(&frequencies, &curve, exact),
                curve: Curve {
                    frequency_hz: frequencies.iter().map(|omega| omega / TAU).collect(),
                    real: curve.iter().map(|it| it.re).collect(),
                    imaginary: curve.iter().map(|it| it.im).collect(),
                },
            });
        }
    }
    Ok(found)
}

/// The largest amplitude and its frequency (Hz).
fn peak(frequencies: &[f64], curve: &[c64], mut exact: impl FnMut(f64) -> c64) -> (f64, f64) {
    let largest = curve.iter().enumerate().max_by(|a, b| a.1.norm().total_cmp(&b.1.norm()));
    let Some((k, value)) = largest else { return (0.0, 0.0) };
    let (before, after) = (k.saturating_sub(1), (k + 1).min(curve.len() - 1));
    let (x, y) = minimum(
        |x| -exact(x.exp()).norm(),
        (frequencies[before].ln(), frequencies[after].ln()),
        (frequencies[k].ln(), -value.norm()),
        1e-8,
    );
    if -y >= value.norm() { (-y, x.exp() / TAU) } else { (value.norm(), frequencies[k] / TAU) }
}
