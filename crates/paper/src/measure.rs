//! What is measured on recorded signals.

use std::{f64::consts::TAU, ops::Range};

use analysis::{
    peaks::{PeakSearch, peaks},
    series,
    spectrum::{Scale, Spectrum, Welch, amplitude, welch},
    window::Window,
};
use anyhow::{Context, Result, ensure};
use results::Table;

/// Magnets of the train.
const MAGNETS: usize = 64;

/// A signal's values.
pub fn signal<'a>(table: &'a Table, name: &str) -> Result<&'a [f64]> {
    table.column(name).with_context(|| format!("{name} is not recorded"))
}

/// All air gaps, less what they are at the start: at rest that is the static gap on the bent girder.
pub fn gaps(table: &Table) -> Result<Vec<Vec<f64>>> {
    (1..=MAGNETS).map(|k| deviation(table, &format!("vehicle.gap_{k:02}"))).collect()
}

/// A signal less what it is at the start.
pub fn deviation(table: &Table, name: &str) -> Result<Vec<f64>> {
    let values = signal(table, name)?;
    let first = values.first().with_context(|| format!("{name} is empty"))?;
    Ok(values.iter().map(|value| value - first).collect())
}

/// Largest size of any of the signals within a span of time, and when it is reached (s).
pub fn largest(table: &Table, signals: &[Vec<f64>], span: &Range<f64>) -> (f64, f64) {
    let mut found = (0.0, span.start);
    for signal in signals {
        for (&time, value) in table.time.iter().zip(signal) {
            if span.contains(&time) && value.abs() > found.0 {
                found = (value.abs(), time);
            }
        }
    }
    found
}

/// Mean of the signals' power spectral densities (m²/Hz), with a resolution in Hz, in a span of time.
pub fn density(
    table: &Table,
    signals: &[Vec<f64>],
    resolution: f64,
    span: &Range<f64>,
) -> Result<Spectrum> {
    let rate = series::rate(&table.time)?;
    let inside = |time: &f64| span.contains(time);
    let first = table.time.iter().position(inside).context("no time in the span")?;
    let count = table.time[first..].iter().take_while(|time| inside(time)).count();
    let settings = Welch::of_resolution(rate, resolution);
    let spectra = signals
        .iter()
        .map(|signal| welch(&signal[first..first + count], rate, &settings))
        .collect::<Result<Vec<_>, _>>()?;
    let mut mean = spectra.first().cloned().context("no signals")?;
    for (k, value) in mean.values.iter_mut().enumerate() {
        *value = spectra.iter().map(|it| it.values[k]).sum::<f64>() / spectra.len() as f64;
    }
    Ok(mean)
}

/// Root mean square of the signals' amplitude spectra over the whole record, smoothed to 0.2 Hz.
///
/// A chirp has the same amplitude at all of its frequencies, so this is the frequency response in shape.
/// (Welch's pieces would show their own overlap: in each the chirp passes other frequencies.)
pub fn response(table: &Table, signals: &[Vec<f64>]) -> Result<Spectrum> {
    let rate = series::rate(&table.time)?;
    let mut squares: Option<Spectrum> = None;
    for signal in signals {
        let one = amplitude(signal, rate, Window::Rectangular)?;
        match &mut squares {
            None => {
                let values = one.values.iter().map(|x| x * x).collect();
                squares = Some(Spectrum { values, ..one });
            }
            Some(sum) => sum.values.iter_mut().zip(&one.values).for_each(|(sum, x)| *sum += x * x),
        }
    }
    let mut spectrum = squares.context("no signals")?;
    let half = (0.1 / spectrum.resolution).round() as usize;
    let sums = std::mem::take(&mut spectrum.values);
    let around = |k: usize| &sums[k.saturating_sub(half)..(k + half + 1).min(sums.len())];
    let mean = |part: &[f64]| part.iter().sum::<f64>() / (part.len() * signals.len()) as f64;
    spectrum.values = (0..sums.len()).map(|k| mean(around(k)).sqrt()).collect();
    Ok(spectrum)
}

/// How many times higher a density is around a frequency than on both sides of it: the mean within
/// `half` over the geometric mean of those in the bands beside, so that a slope is no hump.
pub fn hump(density: &Spectrum, frequency: f64, half: f64) -> f64 {
    let mean = |from: f64| density.mean_square(from, from + 2.0 * half);
    let (below, above) = (frequency - 3.0 * half, frequency + half);
    mean(frequency - half) / (mean(below) * mean(above)).sqrt()
}

/// Natural frequency (Hz) and damping ratio of a mode near a frequency in a free vibration.
///
/// From one window of T seconds to the next, the Fourier coefficient of x₀·exp(λt) changes by exp(λT) exactly. The
/// windows are Hann's, so that other modes leak little; the first begins 0.1 s after the largest value.
pub fn free_mode(table: &Table, signal: &[f64], near: f64, window: f64) -> Result<(f64, f64)> {
    let rate = series::rate(&table.time)?;
    let size = (window * rate).round() as usize;
    let by_size = |a: &(usize, &f64), b: &(usize, &f64)| a.1.abs().total_cmp(&b.1.abs());
    let largest = signal.iter().enumerate().max_by(by_size).context("no values")?.0;
    let begin = largest + (0.1 * rate).round() as usize;
    ensure!(begin + 2 * size <= signal.len(), "two windows of {window} s do not fit");
    let coefficient = |first: usize| {
        let mut sum = [0.0; 2];
        for (k, value) in signal[first..first + size].iter().enumerate() {
            let hann = 1.0 - (TAU * k as f64 / size as f64).cos();
            let phase = TAU * near * k as f64 / rate;
            sum[0] += value * hann * phase.cos();
            sum[1] -= value * hann * phase.sin();
        }
        sum
    };
    let ([a, b], [c, d]) = (coefficient(begin), coefficient(begin + size));
    // (c + id)/(a + ib) = exp(λT)
    let square = a * a + b * b;
    let (real, imaginary) = ((c * a + d * b) / square, (d * a - c * b) / square);
    let span = size as f64 / rate;
    let decay = real.hypot(imaginary).ln() / span;
    let turns = (near * span - imaginary.atan2(real) / TAU).round();
    let omega = (TAU * turns + imaginary.atan2(real)) / span;
    Ok((omega.hypot(decay) / TAU, -decay / omega.hypot(decay)))
}

/// An amplitude or the root of a density.
pub fn size(spectrum: &Spectrum, k: usize) -> f64 {
    match spectrum.scale {
        Scale::Amplitude => spectrum.values[k],
        Scale::Density => spectrum.values[k].sqrt(),
    }
}

/// Frequencies (Hz) of the peaks that stand out of a spectrum by a factor of 1.2 in the span, lowest
/// first.
pub fn peak_frequencies(spectrum: &Spectrum, span: &Range<f64>) -> Vec<f64> {
    let search = PeakSearch {
        from: span.start,
        to: span.end,
        prominence: 1.2,
        floor: 1e-6,
        ..PeakSearch::default()
    };
    let mut found: Vec<f64> = peaks(spectrum, &search).iter().map(|it| it.frequency).collect();
    found.sort_by(f64::total_cmp);
    found
}

/// RMS of a signal in windows of so many seconds: the largest, and the middle of its window (s).
pub fn largest_rms(table: &Table, signal: &[f64], window: f64) -> Result<(f64, f64)> {
    let rate = series::rate(&table.time)?;
    let size = (window * rate).round() as usize;
    ensure!(size > 0 && size <= signal.len(), "a window of {window} s does not fit");
    let rms = |part: &[f64]| {
        let mean = part.iter().sum::<f64>() / size as f64;
        (part.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / size as f64).sqrt()
    };
    let parts = signal.windows(size).enumerate().step_by((size / 20).max(1));
    let (k, value) = parts
        .map(|(k, part)| (k, rms(part)))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .context("no values")?;
    Ok((value, table.time[k + size / 2]))
}

/// A number with six significant digits: what is committed is legible, and the same whatever the last
/// bits.
pub fn six(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// 100 values a second of 2 sin(2π·7 t) that swells until 8 s.
    fn table() -> Table {
        let time: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
        let wave = |t: &f64| 2.0 * (2.0 * PI * 7.0 * t).sin() * (1.0 - (t - 8.0).abs() / 10.0);
        let values = time.iter().map(wave).collect();
        Table { names: vec!["y".to_owned()], time, columns: vec![values] }
    }

    #[test]
    fn analytic_a_swelling_sine() {
        let table = table();
        let y = vec![deviation(&table, "y").unwrap()];
        let (size, time) = largest(&table, &y, &(0.0..10.0));
        // a sample is up to 5 ms from a crest, 1 - cos(2π·7·0.005) = 2.4 % of it, for which the factor
        // makes up within 0.24 s
        assert!((1.95..=2.0).contains(&size) && (time - 8.0).abs() < 0.25, "{size} at {time} s");
        let (rms, time) = largest_rms(&table, &y[0], 1.0).unwrap();
        // within the window the factor falls from 1 to 0.95 on both sides
        assert!((rms - 2.0_f64.sqrt()).abs() < 0.05 && (time - 8.0).abs() < 0.1, "{rms}");
        let spectrum = density(&table, &y, 0.5, &(0.0..10.0)).unwrap();
        let found = peak_frequencies(&spectrum, &(1.0..40.0));
        assert!(found.len() == 1 && (found[0] - 7.0).abs() < 0.02, "{found:?}");
        assert!(hump(&spectrum, 7.0, 1.0) > 100.0);
        let whole = response(&table, &y).unwrap();
        let found = peak_frequencies(&whole, &(5.0..9.0));
        assert!(found.iter().any(|f| (f - 7.0).abs() < 0.1), "{found:?}");
        assert!(signal(&table, "z").is_err());
    }

    /// Two decaying modes: each is found in spite of the other.
    #[test]
    fn analytic_a_free_vibration_of_two_modes() {
        let time: Vec<f64> = (0..5000).map(|k| f64::from(k) * 0.002).collect();
        let mode = |t: f64, f: f64, zeta: f64| {
            let omega = 2.0 * PI * f;
            (-zeta * omega * t).exp() * ((1.0 - zeta * zeta).sqrt() * omega * t).sin()
        };
        let values =
            time.iter().map(|&t| mode(t, 7.2, 0.011) + 3.0 * mode(t, 25.0, 0.024)).collect();
        let table = Table { names: vec!["y".to_owned()], time, columns: vec![values] };
        for (near, window, frequency, damping) in [(7.1, 2.0, 7.2, 0.011), (24.9, 0.4, 25.0, 0.024)]
        {
            let (f, zeta) = free_mode(&table, &table.columns[0], near, window).unwrap();
            assert!(
                (f - frequency).abs() < 0.01 && (zeta - damping).abs() < 2e-4,
                "{f} Hz, {zeta}"
            );
        }
    }

    #[test]
    fn analytic_six_digits() {
        assert_eq!(six(1.234_567_89), 1.234_57);
        assert_eq!(six(-0.000_123_456_78), -0.000_123_457);
    }
}
