//! Frequencies at which a transfer function is evaluated: dense enough for every resonance.

use faer::prelude::c64;

use crate::model::Domain;

/// Frequencies around a resonance, in units of its half width |Re λ|.
const AROUND: [f64; 19] = [
    -8.0, -4.0, -2.8, -2.0, -1.5, -1.0, -0.7, -0.4, -0.2, 0.0, 0.2, 0.4, 0.7, 1.0, 1.5, 2.0, 2.8,
    4.0, 8.0,
];
/// Frequencies nearer than this fraction of the half width to the one before are left out.
const NEAR: f64 = 0.15;
/// The resonance of a pole with more damping than this is wider than the distances of the grid.
const DAMPED: f64 = 0.1;
/// How far below the slowest and above the fastest pole the grid reaches.
const BEYOND: f64 = 30.0;
/// Slower poles (1/s) do not make the grid reach further down.
const SLOWEST: f64 = 1e-2;

/// `count` frequencies from `first` to `last` (rad/s) with equal ratios.
#[must_use]
pub fn logarithmic(first: f64, last: f64, count: usize) -> Vec<f64> {
    let (from, to) = (first.ln(), last.ln());
    let place = |k: usize| k as f64 / (count.max(2) - 1) as f64;
    (0..count.max(2)).map(|k| (from + place(k) * (to - from)).exp()).collect()
}

/// Angular frequencies from `range` (rad/s), `per_decade` of them a decade, with more around the
/// resonances of the poles.
#[must_use]
pub fn around(poles: &[c64], domain: Domain, range: (f64, f64), per_decade: usize) -> Vec<f64> {
    let (first, last) = (range.0, range.1.min(domain.highest()));
    let decades = (last / first).log10().max(0.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a small number")]
    let count = (decades * per_decade as f64).ceil() as usize + 2;
    let mut all: Vec<(f64, f64)> =
        logarithmic(first, last, count).into_iter().map(|it| (it, 0.0)).collect();
    for pole in poles {
        let rate = domain.rate(*pole);
        let width = rate.re.abs();
        if width > DAMPED * rate.norm() {
            continue;
        }
        // a pole on the axis has no width, and the function no value there
        let on_axis = width < 1e-7 * rate.norm();
        let width = width.max(1e-4 * rate.norm());
        let places = AROUND.iter().filter(|by| !on_axis || **by != 0.0);
        let places = places.map(|by| (rate.im.abs() + by * width, width));
        all.extend(places.filter(|(it, _)| (first..=last).contains(it)));
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<f64> = Vec::new();
    for (omega, width) in all {
        if kept.last().is_none_or(|before| omega - before > (NEAR * width).max(1e-9 * omega)) {
            kept.push(omega);
        }
    }
    // the ends are kept whatever is near to them
    if let Some(end) = kept.last_mut() {
        *end = last;
    }
    kept
}

/// The range of frequencies (rad/s) outside which nothing happens.
#[must_use]
pub fn whole(poles: &[c64], domain: Domain) -> (f64, f64) {
    let sizes = poles.iter().map(|pole| domain.rate(*pole).norm());
    let known = sizes.filter(|size| size.is_finite() && *size >= SLOWEST);
    let (low, high) =
        known.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), it| (low.min(it), high.max(it)));
    let (low, high) = if high > 0.0 { (low, high) } else { (1.0, 1.0) };
    let last = (high * BEYOND).min(domain.highest());
    ((low / BEYOND).min(0.1 * last), last)
}
