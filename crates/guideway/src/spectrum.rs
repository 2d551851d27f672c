//! Power spectral densities of rails, and harmonics that realise them with a given coherency.

use std::f64::consts::TAU;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use crate::Error;
use crate::description::{CoherenceDescription, PsdDescription, PsdOf, RailProfileDescription};
use crate::harmonics::Harmonic;
use crate::pole::gauss_legendre;

/// Direction of an irregularity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Vertical,
    Lateral,
}

impl Direction {
    /// The random stream of a direction, so that both have phases of their own.
    fn stream(self) -> u64 {
        match self {
            Self::Vertical => 1,
            Self::Lateral => 2,
        }
    }
}

/// Corners of the German spectra (rad/m). Source: ERRI B 176, RP 1, *Bogies with steered or steering
/// wheelsets*, 1989; also Claus & Schiehlen, *Vehicle System Dynamics* 29 suppl. (1998) 104.
const GERMAN: [f64; 2] = [0.0206, 0.8246];

impl PsdDescription {
    /// S(Ω) in m²/(rad/m), one-sided, as given: of a rail, or of the mean of both.
    pub(crate) fn density(&self, wavenumber: f64, direction: Direction) -> f64 {
        let square = wavenumber * wavenumber;
        let german = |vertical: f64, lateral: f64| {
            let a = if direction == Direction::Vertical { vertical } else { lateral };
            let [r, c] = GERMAN.map(|corner| corner * corner);
            a * c / ((square + r) * (square + c))
        };
        match self {
            Self::InverseSquare { amplitude } => amplitude / square,
            Self::Rational { amplitude, poles, zeros } => {
                let product = |corners: &[f64]| -> f64 {
                    corners.iter().map(|corner| square + corner * corner).product()
                };
                amplitude * product(zeros) / product(poles)
            }
            Self::GermanLow {} => german(4.032e-7, 2.119e-7),
            Self::GermanHigh {} => german(1.080e-6, 6.125e-7),
            Self::SevenParameter { a, b, c, d, e, f, g } => {
                let n = wavenumber / TAU;
                a * (n * (n + b) + c) / (g + n * (f + n * (e + n * (d + n)))) / TAU
            }
        }
    }
}

impl CoherenceDescription {
    /// γ(Ω).
    pub(crate) fn coherency(&self, wavenumber: f64) -> f64 {
        let by = self.corner.map_or(1.0, |corner| 1.0 + (wavenumber / corner).powi(2));
        self.long_waves / by
    }
}

impl RailProfileDescription {
    /// S(Ω) of each rail in m²/(rad/m): with S of the mean, S·2/(1 + γ).
    pub(crate) fn rail_density(&self, wavenumber: f64, direction: Direction) -> f64 {
        let Some(psd) = &self.psd else { return 0.0 };
        let given = psd.density(wavenumber, direction);
        match self.psd_of {
            PsdOf::Rail => given,
            PsdOf::Mean => given * 2.0 / (1.0 + self.coherence.coherency(wavenumber)),
        }
    }
}

/// Harmonics of the left and of the right rail; `path` names the description in errors.
///
/// The band is divided as for the vertical irregularity of the track: bands of equal ratio, one harmonic
/// at the geometric mean of each, with the variance of its band (four Gauss points). Both rails have it
/// with the same amplitude, so that the spectrum of each is exactly S. Their phases are ϕ ± δ with
/// cos 2δ = γ: the product of both has the mean γ·S. The sign of δ is random for one harmonic and the
/// opposite for the next, so that every pair of neighbours has the coherency γ with no imaginary part,
/// not only a long record on average. The variance of the cross level is 2·(1 − γ)·S for every harmonic.
pub(crate) fn harmonics(
    given: &RailProfileDescription,
    direction: Direction,
    seed: u64,
    path: &str,
) -> Result<[Vec<Harmonic>; 2], Error> {
    if given.psd.is_none() {
        return Ok([Vec::new(), Vec::new()]);
    }
    check(given, path)?;
    let (low, high) = (TAU / given.longest_wave, TAU / given.shortest_wave);
    let ratio = libm::pow(high / low, 1.0 / given.lines as f64);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(direction.stream());
    let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
    let points = gauss_legendre(4);
    let (mut edge, mut sign) = (low, 1.0);
    let mut rails = [Vec::with_capacity(given.lines), Vec::with_capacity(given.lines)];
    for k in 1..=given.lines {
        let next = low * libm::pow(ratio, k as f64);
        let half = 0.5 * (next - edge);
        let density = |x: f64| given.rail_density(edge + half * (1.0 + x), direction);
        let variance: f64 = points.iter().map(|&(x, w)| half * w * density(x)).sum();
        if !(variance >= 0.0 && variance.is_finite()) {
            return Err(Error::invalid(
                format!("{path}.psd"),
                format!(
                    "a density of {:.3e} m²/(rad/m) at {edge:.4} rad/m",
                    variance / (next - edge)
                ),
                "give a spectrum that is finite and at least 0 between the longest and the shortest wave",
            ));
        }
        let wavenumber = (edge * next).sqrt();
        let phase = TAU * uniform();
        sign = if k % 2 == 0 {
            -sign
        } else if uniform() < 0.5 {
            1.0
        } else {
            -1.0
        };
        let shift = 0.5 * sign * libm::acos(given.coherence.coherency(wavenumber));
        let amplitude = (2.0 * variance).sqrt();
        let factors = [given.left_factor, given.right_factor];
        for ((rail, factor), phase) in
            rails.iter_mut().zip(factors).zip([phase + shift, phase - shift])
        {
            rail.push(Harmonic { amplitude: factor * amplitude, wavenumber, phase });
        }
        edge = next;
    }
    Ok(rails)
}

fn check(given: &RailProfileDescription, path: &str) -> Result<(), Error> {
    let fail = |name: &str, found: String, remedy: &str| {
        Err(Error::invalid(format!("{path}.{name}"), found, remedy))
    };
    let waves = (given.shortest_wave, given.longest_wave);
    if !(waves.0 > 0.0 && waves.0 < waves.1 && waves.1.is_finite()) {
        let found = format!("waves from {} m to {} m", waves.0, waves.1);
        return fail("shortest_wave", found, "give 0 < shortest < longest");
    }
    if !(1..=100_000).contains(&given.lines) {
        return fail("lines", format!("{} harmonics", given.lines), "give 1 to 100000");
    }
    let coherence = &given.coherence;
    let lowest = if given.psd_of == PsdOf::Mean { -0.999 } else { -1.0 };
    if !(lowest..=1.0).contains(&coherence.long_waves) {
        return fail(
            "coherence.long_waves",
            format!("{}", coherence.long_waves),
            "give a coherency from -1 to 1; above -1 if `psd` is that of the mean",
        );
    }
    if coherence.corner.is_some_and(|corner| !(corner > 0.0 && corner.is_finite())) {
        let found = format!("{} rad/m", coherence.corner.unwrap_or(f64::NAN));
        return fail(
            "coherence.corner",
            found,
            "give a positive finite wavenumber, or leave it out",
        );
    }
    for (name, factor) in [("left_factor", given.left_factor), ("right_factor", given.right_factor)]
    {
        if !factor.is_finite() {
            return fail(name, format!("{factor}"), "give a finite factor");
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn given(text: &str) -> RailProfileDescription {
        serde_json::from_str(text).unwrap()
    }

    #[test]
    fn analytic_forms_agree_with_each_other() {
        let of = |text: &str, k: f64, direction| {
            serde_json::from_str::<PsdDescription>(text).unwrap().density(k, direction)
        };
        for k in [0.05, 0.7, 9.0] {
            let low = of(r#"{"form": "german-low"}"#, k, Direction::Vertical);
            let a = 4.032e-7 * 0.8246f64.powi(2);
            let rational = format!(
                r#"{{"form": "rational", "amplitude": {a:e}, "poles": [0.0206, 0.8246, 3], "zeros": [3]}}"#
            );
            let rational = of(&rational, k, Direction::Vertical);
            assert!((low / rational - 1.0).abs() < 1e-14, "{k}: {low} {rational}");
            let high = of(r#"{"form": "german-high"}"#, k, Direction::Lateral);
            assert!((high / low - 6.125 / 4.032).abs() < 1e-12);
            // A(n²)/n⁴ over the frequency n = Ω/2π is (2π·A)/Ω² over Ω
            let seven = r#"{"form": "seven-parameter", "a": 1e-7, "b": 0, "c": 0, "d": 0, "e": 0, "f": 0, "g": 0}"#;
            let seven = of(seven, k, Direction::Vertical);
            assert!((seven / (TAU * 1e-7 / (k * k)) - 1.0).abs() < 1e-14, "{k}: {seven}");
        }
    }

    /// The variance of the lines is that of the spectrum, and every pair of neighbours has the coherency.
    #[test]
    fn analytic_harmonics_have_the_spectrum_and_the_coherency_exactly() {
        for gamma in [1.0, 0.6, 0.0, -0.8] {
            let text = format!(
                r#"{{"psd": {{"form": "inverse-square", "amplitude": 7e-7}}, "lines": 400,
                    "coherence": {{"long_waves": {gamma}}}}}"#
            );
            let [left, right] = harmonics(&given(&text), Direction::Vertical, 3, "rails").unwrap();
            let variance =
                |all: &[Harmonic]| all.iter().map(|h| 0.5 * h.amplitude.powi(2)).sum::<f64>();
            // ∫A/Ω² between both waves; four Gauss points per band leave 1e-16 of it
            let exact = 7e-7 * (50.0 - 0.5) / TAU;
            assert!((variance(&left) / exact - 1.0).abs() < 1e-13);
            assert_eq!(variance(&left).to_bits(), variance(&right).to_bits());
            let mut signs = [0, 0];
            for (l, r) in left.chunks(2).zip(right.chunks(2)) {
                let turn = |k: usize| libm::sincos(l[k].phase - r[k].phase);
                let ((s0, c0), (s1, c1)) = (turn(0), turn(1));
                assert!((c0 - gamma).abs() < 1e-14 && (c1 - gamma).abs() < 1e-14);
                assert!((s0 + s1).abs() < 1e-14, "{s0} {s1}");
                signs[usize::from(s0 > 0.0)] += 1;
            }
            assert!(gamma == 1.0 || signs[0] > 60 && signs[1] > 60, "{signs:?}");
        }
    }

    /// The railways' cross level: Ω²/(Ω² + Ω_s²) of the mean's spectrum in half the difference.
    #[test]
    fn analytic_cross_level_of_the_railways() {
        let corner = 0.438;
        let text = format!(
            r#"{{"psd": {{"form": "german-low"}}, "psd_of": "mean", "coherence": {{"corner": {}}}}}"#,
            corner / 2f64.sqrt()
        );
        let given = given(&text);
        for k in [0.1, 0.5, 4.0] {
            let mean = given.psd.as_ref().unwrap().density(k, Direction::Vertical);
            let rail = given.rail_density(k, Direction::Vertical);
            let gamma = given.coherence.coherency(k);
            let half_difference = 0.5 * (1.0 - gamma) * rail;
            let exact = mean * k * k / (k * k + corner * corner);
            assert!((half_difference / exact - 1.0).abs() < 1e-13, "{k}");
            assert!((0.5 * (1.0 + gamma) * rail / mean - 1.0).abs() < 1e-14, "{k}");
        }
    }
}
