//! Margins of one loop: crossings of the unit circle and of the negative real axis, and the distance to
//! −1, each found between samples and then refined.

use std::cmp::Ordering;
use std::f64::consts::{PI, TAU};

use faer::prelude::c64;
use results::response::{
    DelayMargin, Direction, GainMargin, LoopMargins, ModulusMargin, PhaseMargin,
};

use crate::search::{minimum, root};

/// Crossings and minima are found to within this fraction of the frequency.
const EXACT: f64 = 1e-12;
const NEAR: f64 = 1e-8;
/// A value with a smaller imaginary part, relative to its size, is real.
const REAL: f64 = 1e-9;
/// Crossings of the negative real axis nearer to 0 than this are left out: no gain rises ten thousand
/// times, and loci that are zero but for rounding cross it anywhere.
const LEAST: f64 = 1e-4;
/// Local minima of |1 + L| within this factor of the least are refined.
const RIVAL: f64 = 1.1;

/// Samples of a curve L(jω): angular frequency (rad/s) and value.
pub type Samples<'a> = &'a [(f64, c64)];

/// Where a curve meets the unit circle or the negative real axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// rad/s.
    pub omega: f64,
    /// L there.
    pub value: c64,
}

impl Crossing {
    fn distance(&self) -> f64 {
        (1.0 + self.value).norm()
    }

    fn nearer(&self, other: &Self) -> Ordering {
        self.distance().total_cmp(&other.distance())
    }

    /// The factor on the gain with which L would be −1.
    fn factor(self) -> f64 {
        1.0 / self.value.norm()
    }

    /// arg(−L) in degrees: the lag, or if negative the lead, with which L would be −1.
    fn phase(self) -> f64 {
        (-self.value).arg().to_degrees()
    }

    /// The delay (s) with which L would be −1.
    fn delay(self) -> f64 {
        (-self.value).arg().rem_euclid(TAU) / self.omega
    }
}

/// A curve with everything that margins are made of.
#[derive(Debug, Clone, Default)]
pub struct Crossings {
    /// Of the unit circle.
    pub unit: Vec<Crossing>,
    /// Of the negative real axis.
    pub negative: Vec<Crossing>,
    /// The least |1 + L|.
    pub nearest: Option<Crossing>,
}

/// Whether the samples bracket a crossing.
fn changes(a: f64, b: f64) -> bool {
    (a < 0.0) != (b < 0.0)
}

/// Finds all crossings of a curve. `exact` is the curve between the samples, `resting` its value at ω = 0.
pub fn crossings(
    samples: Samples<'_>,
    resting: Option<c64>,
    mut exact: impl FnMut(f64) -> c64,
) -> Crossings {
    let mut found = Crossings::default();
    let size = |value: c64| value.norm().ln();
    for pair in samples.windows(2) {
        let [(a, la), (b, lb)] = [pair[0], pair[1]];
        let (from, to) = (a.ln(), b.ln());
        let mut refined = |of: &dyn Fn(c64) -> f64| {
            let at = |x: f64| of(exact(x.exp()));
            let omega = root(at, (from, of(la)), (to, of(lb)), EXACT).exp();
            Crossing { omega, value: exact(omega) }
        };
        if changes(size(la), size(lb)) {
            found.unit.push(refined(&size));
        }
        let far = la.norm().max(lb.norm()) > LEAST;
        if far && changes(la.im, lb.im) && la.re.min(lb.re) < 0.0 {
            let crossing = refined(&|value| value.im);
            // a jump from one end of the axis to the other is no crossing
            if crossing.value.re < -LEAST && crossing.value.im.abs() < 1e-3 * crossing.value.norm()
            {
                found.negative.push(crossing);
            }
        }
    }
    let resting = resting.map(|value| (0.0, value));
    for (omega, value) in resting.into_iter().chain(samples.last().copied()) {
        if value.re < -LEAST && value.im.abs() <= REAL * value.norm() {
            found.negative.push(Crossing { omega, value });
        }
    }
    let resting = resting.map(|(omega, value)| Crossing { omega, value });
    found.nearest = nearest(samples, exact).into_iter().chain(resting).min_by(Crossing::nearer);
    found
}

fn nearest(samples: Samples<'_>, mut exact: impl FnMut(f64) -> c64) -> Option<Crossing> {
    let distance = |value: c64| (1.0 + value).norm();
    let least = samples.iter().map(|it| distance(it.1)).fold(f64::INFINITY, f64::min);
    let last = samples.len().checked_sub(1)?;
    let mut best: Option<Crossing> = None;
    for (k, &(omega, value)) in samples.iter().enumerate() {
        let here = distance(value);
        let (before, after) = (&samples[k.saturating_sub(1)], &samples[(k + 1).min(last)]);
        if here > RIVAL * least || here > distance(before.1) || here > distance(after.1) {
            continue;
        }
        let (x, _) = minimum(
            |x| distance(exact(x.exp())),
            (before.0.ln(), after.0.ln()),
            (omega.ln(), here),
            NEAR,
        );
        let refined = Crossing { omega: x.exp(), value: exact(x.exp()) };
        for candidate in [Crossing { omega, value }, refined] {
            if best.is_none_or(|best| distance(candidate.value) < distance(best.value)) {
                best = Some(candidate);
            }
        }
    }
    best
}

impl Crossings {
    /// All crossings of several curves together.
    pub fn join(all: impl IntoIterator<Item = Self>) -> Self {
        let mut joined = Self::default();
        for one in all {
            joined.unit.extend(one.unit);
            joined.negative.extend(one.negative);
            let nearest = joined.nearest.into_iter().chain(one.nearest);
            joined.nearest = nearest.min_by(Crossing::nearer);
        }
        joined
    }

    /// The margins of a stable closed loop.
    #[must_use]
    pub fn margins(&self) -> LoopMargins {
        let hertz = |crossing: &Crossing| crossing.omega / TAU;
        let gain = |it: &Crossing| GainMargin { factor: it.factor(), frequency_hz: hertz(it) };
        let by_factor = |a: &&Crossing, b: &&Crossing| a.factor().total_cmp(&b.factor());
        let larger = self.negative.iter().filter(|it| it.factor() > 1.0).min_by(by_factor);
        let smaller = self.negative.iter().filter(|it| it.factor() <= 1.0).max_by(by_factor);
        let phase = self.unit.iter().min_by(|a, b| a.phase().abs().total_cmp(&b.phase().abs()));
        let delay = self.unit.iter().min_by(|a, b| a.delay().total_cmp(&b.delay()));
        // far beyond the last sample L is nearly nothing
        let modulus = self.nearest.filter(|it| it.distance() < 1.0);
        LoopMargins {
            gain_up: larger.map(gain),
            gain_down: smaller.map(gain),
            phase: phase.map(|it| PhaseMargin {
                degrees: it.phase().abs(),
                direction: if it.phase() < 0.0 { Direction::Lead } else { Direction::Lag },
                frequency_hz: hertz(it),
            }),
            delay: delay.map(|it| DelayMargin { seconds: it.delay(), frequency_hz: hertz(it) }),
            modulus: match &modulus {
                Some(it) => ModulusMargin { value: it.distance(), frequency_hz: Some(hertz(it)) },
                None => ModulusMargin { value: 1.0, frequency_hz: None },
            },
        }
    }
}

/// Phases without jumps, in degrees.
#[must_use]
pub fn unwrapped(values: impl IntoIterator<Item = c64>) -> Vec<f64> {
    let mut phases: Vec<f64> = Vec::new();
    for value in values {
        let phase = value.arg();
        let phase = match phases.last() {
            Some(before) => phase + TAU * ((before - phase) / TAU).round(),
            None => phase,
        };
        phases.push(phase);
    }
    phases.iter_mut().for_each(|phase| *phase = phase.to_degrees());
    phases
}

/// Turns of a curve around 0, counterclockwise, while ω runs from its first to its last sample; and the
/// largest turn between two samples, which must be well below half a turn for the count to hold.
#[must_use]
pub fn turns(values: impl IntoIterator<Item = c64>) -> (f64, f64) {
    let (mut sum, mut largest, mut before) = (0.0, 0.0_f64, None::<c64>);
    for value in values {
        if let Some(before) = before {
            let turn = (value / before).arg();
            sum += turn;
            largest = largest.max(turn.abs());
        }
        before = Some(value);
    }
    (sum / TAU, largest / PI)
}
