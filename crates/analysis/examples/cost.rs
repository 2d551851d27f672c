//! What the analysis of a run costs: 64 gaps of 36 001 samples (36 s at 1 kHz).
//!
//! `cargo run --release -p analysis --example cost`
#![expect(clippy::print_stdout, reason = "an example prints")]

use std::time::Instant;

use analysis::Error;
use analysis::ride::Weighting;
use analysis::spectrum::{PeakSearch, Scale, Welch, Window, amplitude, peaks, spectrogram, welch};

const RATE: f64 = 1000.0;

fn main() -> Result<(), Error> {
    let gaps: Vec<Vec<f64>> = (0..64).map(gap).collect();
    let seconds = |name: &str, work: &dyn Fn(&[f64]) -> Result<usize, Error>| {
        let begin = Instant::now();
        let values: Result<usize, Error> = gaps.iter().map(|gap| work(gap)).sum();
        let elapsed = begin.elapsed().as_secs_f64();
        println!("{name}: {:.1} ms, {} values", 1e3 * elapsed, values?);
        Ok::<(), Error>(())
    };
    let coarse = Welch::of_resolution(RATE, 0.25);
    seconds("amplitude spectra", &|gap| Ok(amplitude(gap, RATE, Window::Hann)?.values.len()))?;
    seconds("amplitude spectra with peaks", &|gap| {
        Ok(peaks(&amplitude(gap, RATE, Window::Hann)?, &PeakSearch::default()).len())
    })?;
    seconds("Welch densities, 0.25 Hz", &|gap| Ok(welch(gap, RATE, &coarse)?.values.len()))?;
    let quarter = Welch { overlap: 0.75, ..Welch::of_segment(2048) };
    seconds("spectrograms, 2048 samples, 3/4 overlap", &|gap| {
        let picture = spectrogram(gap, RATE, &quarter, Scale::Amplitude)?;
        Ok(picture.slices.iter().map(Vec::len).sum())
    })?;
    seconds("weighted by Wk", &|gap| Ok(Weighting::Wk.apply(gap, RATE)?.len()))
}

/// 8 mm, a growing oscillation and noise, none like another.
fn gap(k: u32) -> Vec<f64> {
    let mut noise = u64::from(k) + 1;
    let value = |i: u32| {
        noise = (1_103_515_245 * noise + 12_345) % (1 << 31);
        let t = f64::from(i) / RATE;
        let wave = (44.0 + f64::from(k)) * t;
        8e-3 + 1e-4 * t / 36.0 * wave.sin() + 1e-6 * (noise as f64 / f64::from(1_u32 << 30) - 1.0)
    };
    (0..36_001).map(value).collect()
}
