//! Two signals beside each other: coherence, and the lag at which they agree best.

use crate::error::{Error, require};
use crate::fourier::{Transform, correlation_sums};
use crate::series::{FEWEST, check_rate, enough};
use crate::spectrum::Welch;

/// Magnitude-squared coherence of two signals: `values[k]` belongs to the frequency k · `resolution`.
#[derive(Debug, Clone, PartialEq)]
pub struct Coherence {
    /// Distance of two bins, in Hz.
    pub resolution: f64,
    /// From 0 (unrelated) to 1 (one is a linear filter of the other), one per bin. 0 where a signal has no power.
    pub values: Vec<f64>,
    /// Pieces that the means are taken over. Of unrelated signals the coherence is about 1/pieces, not 0.
    pub pieces: usize,
}

/// γ² = |S_xy|² / (S_xx S_yy), with the spectra as means over overlapping pieces, as [`welch`](crate::spectrum::welch)
/// takes them. The numbers are those of `scipy.signal.coherence`.
///
/// # Errors
/// Signals of different length, an invalid setting, a sample that is not finite, or room for fewer than two pieces: of one
/// piece the coherence is 1 whatever the signals are.
pub fn coherence(x: &[f64], y: &[f64], rate: f64, settings: &Welch) -> Result<Coherence, Error> {
    check_rate(rate)?;
    let segment = settings.segment;
    require(segment >= FEWEST, "the length of a piece", segment as f64, "8 or more samples")?;
    let overlap = settings.overlap;
    require((0.0..1.0).contains(&overlap), "the overlap", overlap, "0 or more and below 1")?;
    require(
        x.len() == y.len(),
        "the length of the second signal",
        y.len() as f64,
        "that of the first",
    )?;
    let step = settings.step();
    enough(x, segment + step)?;
    enough(y, segment + step)?;
    let weights = settings.window.samples(segment);
    let bins = segment / 2 + 1;
    let (mut xx, mut yy) = (vec![0.0; bins], vec![0.0; bins]);
    let mut xy = vec![(0.0, 0.0); bins];
    let mut transforms = [Transform::new(segment), Transform::new(segment)];
    let mut pieces = 0;
    for at in (0..=x.len() - segment).step_by(step) {
        let [first, second] = &mut transforms;
        for (transform, signal) in [(&mut *first, x), (&mut *second, y)] {
            transform.input.copy_from_slice(&signal[at..at + segment]);
            settings.detrend.remove(&mut transform.input);
            transform.input.iter_mut().zip(&weights).for_each(|(it, weight)| *it *= weight);
        }
        for (k, (a, b)) in first.run()?.iter().zip(second.run()?).enumerate() {
            xx[k] += a.norm_sqr();
            yy[k] += b.norm_sqr();
            let product = a * b.conj();
            xy[k] = (xy[k].0 + product.re, xy[k].1 + product.im);
        }
        pieces += 1;
    }
    let value = |k: usize| {
        let power = xx[k] * yy[k];
        let (re, im) = xy[k];
        if power > 0.0 { ((re * re + im * im) / power).min(1.0) } else { 0.0 }
    };
    Ok(Coherence {
        resolution: rate / segment as f64,
        values: (0..bins).map(value).collect(),
        pieces,
    })
}

/// The lag at which two signals agree best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    /// Samples by which the second signal must be moved to later times; with a fraction, by a parabola through the
    /// highest correlation and its neighbours.
    pub samples: f64,
    /// Correlation coefficient there, from -1 to 1: the mean over all pairs.
    pub correlation: f64,
    /// The next highest maximum of the correlation: lag in samples, and coefficient. A periodic signal has one that is
    /// nearly as high.
    pub runner_up: Option<(f64, f64)>,
}

/// Finds the lag of the highest correlation coefficient, computed from the samples that overlap alone. Each pair
/// holds a signal and another one that may begin at another time; all pairs have the same two lengths and share the lag.
/// At least `least` samples must overlap.
///
/// # Errors
/// No pair, signals of different lengths, fewer than `least` samples, a sample that is not finite, or signals that do not vary.
pub fn best_lag(pairs: &[(&[f64], &[f64])], least: usize) -> Result<Lag, Error> {
    let least = least.max(FEWEST);
    let (n, m) = pairs.first().map_or((0, 0), |(x, y)| (x.len(), y.len()));
    require(!pairs.is_empty(), "the number of pairs", 0.0, "1 or more")?;
    let count = (n + m + 1).saturating_sub(2 * least);
    let mut sum = vec![0.0; count];
    for (x, y) in pairs {
        require(
            x.len() == n && y.len() == m,
            "the length of a signal",
            x.len() as f64,
            "that of all others",
        )?;
        enough(x, least)?;
        enough(y, least)?;
        for (to, it) in sum.iter_mut().zip(coefficients(x, y, least)?) {
            *to += it / pairs.len() as f64;
        }
    }
    // entry k belongs to the lag k + least - m
    let lag = |k: usize| k as f64 + least as f64 - m as f64;
    let best = (0..count).max_by(|&a, &b| sum[a].total_cmp(&sum[b])).unwrap_or(0);
    require(sum.iter().any(|it| *it != 0.0), "the variance of a signal", 0.0, "above zero")?;
    let peak = |k: usize| {
        if k == 0 || k + 1 == count {
            return (lag(k), sum[k]);
        }
        let (a, b, c) = (sum[k - 1], sum[k], sum[k + 1]);
        let bend = a - 2.0 * b + c;
        let shift = if bend < 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
        (lag(k) + shift, b - 0.25 * (a - c) * shift)
    };
    let is_top = |k: &usize| sum[k - 1] < sum[*k] && sum[*k] >= sum[k + 1];
    let others = (1..count.saturating_sub(1)).filter(|k| *k != best).filter(is_top);
    let runner_up = others.max_by(|&a, &b| sum[a].total_cmp(&sum[b])).map(peak);
    let (samples, correlation) = peak(best);
    Ok(Lag { samples, correlation, runner_up })
}

/// Pearson's coefficient of the overlap at each lag, from that at which `least` samples of the end of `y` overlap.
fn coefficients(x: &[f64], y: &[f64], least: usize) -> Result<Vec<f64>, Error> {
    let (n, m) = (x.len(), y.len());
    // a mean of its own keeps the sums of squares from cancelling
    let centred = |it: &[f64]| {
        let mean = it.iter().sum::<f64>() / it.len() as f64;
        it.iter().map(|value| value - mean).collect::<Vec<f64>>()
    };
    let (x, y) = (centred(x), centred(y));
    let sums = |it: &[f64], power: i32| {
        let mut total = 0.0;
        let running = it.iter().map(|value| {
            total += value.powi(power);
            total
        });
        std::iter::once(0.0).chain(running).collect::<Vec<f64>>()
    };
    let [sx, sxx] = [1, 2].map(|power| sums(&x, power));
    let [sy, syy] = [1, 2].map(|power| sums(&y, power));
    // products[s mod length] = Σ y_k x_(k+s)
    let products = correlation_sums(&x, &y)?;
    let length = products.len();
    let noise = 1e-13 * sxx[n].max(f64::MIN_POSITIVE) * syy[m].max(f64::MIN_POSITIVE);
    Ok((0..(n + m + 1).saturating_sub(2 * least))
        .map(|k| {
            // the overlap: from a to b of x, from a - lag of y, with lag = k + least - m
            let (a, b) = ((k + least).saturating_sub(m), (k + least).min(n));
            let from = (m + a) - (k + least);
            let (end, count) = (from + b - a, (b - a) as f64);
            let at = if k + least >= m { k + least - m } else { length + k + least - m };
            let (x1, y1) = (sx[b] - sx[a], sy[end] - sy[from]);
            let (x2, y2) =
                (sxx[b] - sxx[a] - x1 * x1 / count, syy[end] - syy[from] - y1 * y1 / count);
            let covariance = products[at] - x1 * y1 / count;
            let power = x2.max(0.0) * y2.max(0.0);
            if power > noise { (covariance / power.sqrt()).clamp(-1.0, 1.0) } else { 0.0 }
        })
        .collect())
}
