//! Figures of one set of values under one condition: damping, margins, r.m.s. voltage.

use std::f64::consts::TAU;

use faer::Mat;
use faer::prelude::c64;
use serde::{Deserialize, Serialize};
use stability_map::damping;

use crate::closed::{Answer, At, Laws, answer, matrix};
use crate::core::Core;
use crate::counting::{Role, Rule};
use crate::error::TuneError;
use crate::file::SensorNoise;
use crate::noise::{Track, density};

/// Frequencies per decade, and the lowest one (Hz). Modes with little damping get more.
const PER_DECADE: f64 = 30.0;
const LOWEST: f64 = 0.05;
const HIGHEST: f64 = 300.0;
/// Modes with less damping than this, and at most that many, get frequencies of their own.
const NARROW: f64 = 0.3;
const FOLLOWED: usize = 16;
/// Their places in half widths.
const AROUND: [f64; 9] = [-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0];
/// Steps to the top of a peak: to a hundredth of the distance of two frequencies.
const SECTIONS: usize = 9;
/// Least damping ratios that are kept.
pub(crate) const LEAST: usize = 4;
/// Imaginary parts below this fraction are rounding errors.
const NEARLY_REAL: f64 = 1e-6;

/// What is known of a set of values under one condition.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// Least damping ratio −Re λ/|λ| of the modes that count.
    pub damping: f64,
    /// |λ|/2π of that mode (Hz).
    pub frequency_hz: f64,
    /// Slowest decay −Re λ of the modes that count (1/s).
    pub decay: f64,
    /// The least damping ratios, ascending.
    pub least: Vec<f64>,
    /// Least damping ratio of modes that are out of the band or left out: they must decay, but do not count otherwise.
    pub outside: f64,
    /// Modulus margin of one loop alone, the worst.
    pub modulus_one: f64,
    /// Modulus margin of the same change in all loops.
    pub modulus_all: f64,
    /// Delay margin (s) of one loop alone, the least.
    pub delay_one: f64,
    /// Delay margin (s) of the same delay in all loops.
    pub delay_all: f64,
    /// R.m.s. voltage (V) from the noise of the sensors, of the magnet with the most.
    pub voltage_noise: f64,
    /// R.m.s. voltage (V) from the irregularity, likewise.
    pub voltage_track: f64,
    /// R.m.s. voltage (V) from both.
    pub voltage: f64,
}

impl Figures {
    /// Whether all modes that count decay.
    #[must_use]
    pub fn stable(&self) -> bool {
        self.damping > 0.0 && self.outside > 0.0
    }

    /// The lesser modulus margin.
    #[must_use]
    pub fn modulus(&self) -> f64 {
        self.modulus_one.min(self.modulus_all)
    }

    /// The lesser delay margin (s).
    #[must_use]
    pub fn delay(&self) -> f64 {
        self.delay_one.min(self.delay_all)
    }
}

/// What figures are made of, besides the laws.
pub(crate) struct Scene<'a> {
    /// Of margins and voltage.
    pub core: &'a Core,
    /// Of the modes, without anything left out, and which of them count.
    pub whole: &'a Core,
    pub rule: &'a Rule,
    /// Noise of each channel, if any.
    pub noise: &'a [Option<SensorNoise>],
    pub track: Option<&'a Track>,
    /// Whether there is a signal at which loops can be broken.
    pub margins: bool,
}

/// Eigenvalues with Im ≥ 0 of all blocks.
pub(crate) fn eigenvalues(core: &Core, laws: &Laws) -> Result<Vec<c64>, TuneError> {
    let mut all = Vec::new();
    for block in &core.blocks {
        let values = linear::eigenvalues(&matrix(block, laws))?;
        all.extend(values.into_iter().filter(|it| it.im >= -NEARLY_REAL * it.norm()));
    }
    Ok(all)
}

impl Scene<'_> {
    /// All figures.
    pub fn figures(&self, laws: &Laws) -> Result<Figures, TuneError> {
        let all = self.rule.modes(self.whole, laws)?;
        let of = |wanted: &dyn Fn(Role) -> bool| -> Vec<c64> {
            all.iter().filter(|it| wanted(it.role)).map(|it| it.value).collect()
        };
        let values = of(&|it| it == Role::Counts);
        let mut figures = Figures {
            modulus_one: 1.0,
            modulus_all: 1.0,
            damping: 1.0,
            outside: self.rule.outside(&all),
            ..Figures::default()
        };
        if let Some(first) = values.first() {
            figures.damping = damping(*first);
            figures.frequency_hz = first.norm() / TAU;
        }
        figures.decay = values.iter().map(|it| -it.re).fold(1e3, f64::min);
        figures.least = values.iter().take(LEAST).map(|it| damping(*it)).collect();
        if self.margins {
            self.at_frequencies(laws, &of(&|it| it != Role::LeftOut), &mut figures);
        }
        Ok(figures)
    }

    fn frequencies(&self, values: &[c64]) -> Vec<f64> {
        let bandwidth =
            self.noise.iter().flatten().map(|it| 3.0 * it.bandwidth).fold(HIGHEST, f64::max);
        let (mut first, mut last) = (LOWEST, bandwidth);
        // nearly at rest, for margins there
        let mut all = vec![1e-3 * LOWEST];
        if let Some(track) = self.track {
            let (low, high) = track.band();
            for edge in [low, high] {
                all.extend([edge * (1.0 - 1e-9), edge, edge * (1.0 + 1e-9)]);
            }
            (first, last) = (first.min(0.9 * low), last.max(1.1 * high));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a small number"
        )]
        let count = ((last / first).log10() * PER_DECADE).ceil() as usize + 1;
        all.extend((0..=count).map(|k| first * (last / first).powf(k as f64 / count as f64)));
        let narrow = values.iter().filter(|it| it.im > 0.0 && damping(**it).abs() < NARROW);
        for value in narrow.take(FOLLOWED) {
            let width = value.re.abs().max(1e-3 * value.norm());
            all.extend(
                AROUND
                    .iter()
                    .map(|by| (value.im + by * width) / TAU)
                    .filter(|it| *it > first && *it < last),
            );
        }
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    fn at_frequencies(&self, laws: &Laws, values: &[c64], figures: &mut Figures) {
        let core = self.core;
        let equal = matches!(laws, Laws::Equal(_));
        let frequencies = self.frequencies(values);
        let mut loci: Vec<Follower> = core.blocks.iter().map(|_| Follower::default()).collect();
        let mut single = vec![Follower::default(); core.loops];
        let mut sums = [vec![0.0; core.loops], vec![0.0; core.loops]];
        let mut before: Option<(f64, [Vec<f64>; 2])> = None;
        let (mut most_one, mut most_all) = ((1.0_f64, 0), (1.0_f64, 0));
        for (k, &hz) in frequencies.iter().enumerate() {
            let s = c64::new(0.0, TAU * hz);
            let at = |port: usize| At::new(laws.of(port), s);
            let answers: Vec<Answer> =
                core.blocks.iter().map(|it| answer(it, &at, s, equal)).collect();
            for ((answer, block), follower) in answers.iter().zip(&core.blocks).zip(&mut loci) {
                let shares = spectrum(&answer.sensitivity);
                let size = shares.iter().map(|it| it.norm()).fold(0.0, f64::max);
                if size > most_all.0 {
                    most_all = (size, k);
                }
                follower.take(s.im, shares.iter().map(|it| it.inv() - 1.0).collect());
                debug_assert_eq!(shares.len(), block.ports.ncols());
            }
            let alone = self.alone(&answers);
            let size = alone.iter().map(|it| it.norm()).fold(0.0, f64::max);
            if size > most_one.0 {
                most_one = (size, k);
            }
            for (follower, it) in single.iter_mut().zip(&alone) {
                follower.take(s.im, vec![it.inv() - 1.0]);
            }
            let power = self.power(laws, &at, &answers, hz, equal);
            if let Some((hz_before, power_before)) = &before {
                for (sum, (a, b)) in sums.iter_mut().zip(power_before.iter().zip(&power)) {
                    for (sum, (a, b)) in sum.iter_mut().zip(a.iter().zip(b)) {
                        *sum += 0.5 * (a + b) * (hz - hz_before);
                    }
                }
            } else {
                // constant below the lowest frequency
                sums[0].iter_mut().zip(&power[0]).for_each(|(sum, it)| *sum += it * hz);
            }
            before = Some((hz, power));
        }
        let least = |all: &[Follower]| all.iter().map(|it| it.delay).fold(f64::INFINITY, f64::min);
        // the peaks between the frequencies
        let peak = |(value, k): (f64, usize), all: bool| -> f64 {
            let (Some(&low), Some(&high)) =
                (frequencies.get(k.saturating_sub(1)), frequencies.get(k + 1))
            else {
                return value;
            };
            let size = |hz: f64| {
                let s = c64::new(0.0, TAU * hz);
                let at = |port: usize| At::new(laws.of(port), s);
                let answers: Vec<Answer> =
                    core.blocks.iter().map(|it| answer(it, &at, s, equal)).collect();
                let norms = |list: Vec<c64>| list.iter().map(|it| it.norm()).fold(0.0, f64::max);
                if all {
                    answers.iter().map(|it| norms(spectrum(&it.sensitivity))).fold(0.0, f64::max)
                } else {
                    norms(self.alone(&answers))
                }
            };
            highest(size, (low, high)).max(value)
        };
        let (one, all) = (peak(most_one, false), peak(most_all, true));
        (figures.modulus_one, figures.modulus_all) = (one.recip(), all.recip());
        (figures.delay_one, figures.delay_all) = (least(&single).min(10.0), least(&loci).min(10.0));
        let largest =
            |of: &dyn Fn(usize) -> f64| (0..core.loops).map(of).fold(0.0, f64::max).sqrt();
        figures.voltage_noise = largest(&|k| sums[0][k]);
        figures.voltage_track = largest(&|k| sums[1][k]);
        figures.voltage = largest(&|k| sums[0][k] + sums[1][k]);
    }

    /// The sensitivity of each loop while the others are closed.
    fn alone(&self, answers: &[Answer]) -> Vec<c64> {
        let mut all = vec![c64::new(1.0, 0.0); self.core.loops];
        for (answer, block) in answers.iter().zip(&self.core.blocks) {
            let (p, q) = (block.ports.ncols(), &block.ports);
            for (k, sum) in all.iter_mut().enumerate() {
                for i in (0..p).filter(|&i| q[(k, i)] != 0.0) {
                    for j in 0..p {
                        let own = if i == j { 1.0 } else { 0.0 };
                        *sum += (answer.sensitivity[(i, j)] - own) * (q[(k, i)] * q[(k, j)]);
                    }
                }
            }
        }
        all
    }

    /// Density (V²/Hz) of every magnet's voltage from noise and from the irregularity.
    fn power(
        &self,
        laws: &Laws,
        at: &dyn Fn(usize) -> At,
        answers: &[Answer],
        hz: f64,
        equal: bool,
    ) -> [Vec<f64>; 2] {
        let core = self.core;
        let mut power = [vec![0.0; core.loops], vec![0.0; core.loops]];
        let densities: Vec<f64> =
            self.noise.iter().map(|it| it.as_ref().map_or(0.0, |it| density(it, hz))).collect();
        let wave = self.track.filter(|it| it.density(hz) > 0.0);
        if densities.iter().all(|it| *it == 0.0) && wave.is_none() {
            return power;
        }
        let count = if equal { 1 } else { core.loops };
        let ats: Vec<At> = (0..count).map(at).collect();
        let law = |port: usize| &ats[if equal { 0 } else { port }];
        for (channel, density) in densities.iter().enumerate().filter(|it| *it.1 > 0.0) {
            for k in 0..core.loops {
                // forces without effect: the controller alone answers
                let mut rest = 1.0;
                let mut sum = 0.0;
                for (answer, block) in answers.iter().zip(&core.blocks) {
                    let (p, q) = (block.ports.ncols(), &block.ports);
                    for j in 0..p {
                        rest -= q[(k, j)] * q[(k, j)];
                        let by: c64 = (0..p).map(|i| answer.by_force[(i, j)] * q[(k, i)]).sum();
                        let own = law(j).signal[channel] * q[(k, j)];
                        sum += (own + by * law(j).force_read[channel]).norm_sqr();
                    }
                }
                let own = law(if equal { 0 } else { k }).signal[channel].norm_sqr();
                power[0][k] += density * (sum + rest.max(0.0) * own);
            }
        }
        if let Some(track) = wave {
            let seen = core.disturbed(c64::new(0.0, TAU * hz), &track.wave(hz));
            let of = |channel: usize, k: usize| seen[channel * core.loops + k];
            let mut voltage: Vec<c64> = (0..core.loops)
                .map(|k| {
                    let law = law(if equal { 0 } else { k });
                    (0..core.channels).map(|i| law.signal[i] * of(i, k)).sum()
                })
                .collect();
            for (answer, block) in answers.iter().zip(&core.blocks) {
                let (p, q) = (block.ports.ncols(), &block.ports);
                let force: Vec<c64> = (0..p)
                    .map(|j| {
                        let port =
                            |i: usize| (0..core.loops).map(|k| of(i, k) * q[(k, j)]).sum::<c64>();
                        (0..core.channels).map(|i| law(j).force[i] * port(i)).sum()
                    })
                    .collect();
                for i in 0..p {
                    let by: c64 = (0..p).map(|j| answer.by_force[(i, j)] * force[j]).sum();
                    voltage.iter_mut().enumerate().for_each(|(k, v)| *v += by * q[(k, i)]);
                }
            }
            let density = track.density(hz);
            power[1].iter_mut().zip(&voltage).for_each(|(sum, v)| *sum += density * v.norm_sqr());
        }
        debug_assert!(matches!(laws, Laws::Equal(_)) == equal);
        power
    }
}

/// The highest value of a function with one peak between two places, by golden section.
fn highest(f: impl Fn(f64) -> f64, (mut low, mut high): (f64, f64)) -> f64 {
    let section = 0.5 * (5.0_f64.sqrt() - 1.0);
    let at = |low: f64, high: f64, share: f64| low + share * (high - low);
    let (mut a, mut b) = (at(low, high, 1.0 - section), at(low, high, section));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..SECTIONS {
        if fa > fb {
            (high, b, fb) = (b, a, fa);
            a = at(low, high, 1.0 - section);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = at(low, high, section);
            fb = f(b);
        }
    }
    fa.max(fb)
}

/// Eigenvalues of a small complex matrix.
fn spectrum(matrix: &Mat<c64>) -> Vec<c64> {
    if matrix.nrows() == 1 {
        return vec![matrix[(0, 0)]];
    }
    // a matrix without eigenvalues has entries that are not finite: a pole on the axis
    matrix.eigenvalues().unwrap_or_else(|_| vec![c64::new(f64::INFINITY, 0.0); matrix.nrows()])
}

/// Follows values of L over frequency and keeps the least delay with which one is −1.
#[derive(Debug, Clone)]
struct Follower {
    last: Option<(f64, Vec<c64>)>,
    delay: f64,
}

impl Default for Follower {
    fn default() -> Self {
        Self { last: None, delay: f64::INFINITY }
    }
}

impl Follower {
    fn take(&mut self, omega: f64, mut values: Vec<c64>) {
        if let Some((before, old)) = &self.last {
            let mut free: Vec<c64> = values.clone();
            let mut next = Vec::with_capacity(values.len());
            for one in old {
                let distance = |it: &c64| (it - one).norm() / (1.0 + it.norm());
                let nearest = (0..free.len())
                    .min_by(|&a, &b| distance(&free[a]).total_cmp(&distance(&free[b])));
                let Some(k) = nearest else { continue };
                let value = free.swap_remove(k);
                let (a, b) = (one.norm().ln(), value.norm().ln());
                if (a < 0.0) != (b < 0.0) && (a - b).is_finite() {
                    let share = a / (a - b);
                    let at = before + share * (omega - before);
                    let l = one + (value - one) * share;
                    self.delay = self.delay.min((-l).arg().rem_euclid(TAU) / at);
                }
                next.push(value);
            }
            values = next;
        }
        self.last = Some((omega, values));
    }
}
