//! Spectra of rails, estimated as from a measurement.

use std::f64::consts::{PI, TAU};

use guideway::Rails;

/// Fast Fourier transform in place, a power of two.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let mut j = 0;
    for i in 1..n {
        let mut bit = n >> 1;
        while j & bit != 0 {
            (j, bit) = (j ^ bit, bit >> 1);
        }
        j |= bit;
        if i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let mut len = 2;
    while len <= n {
        for start in (0..n).step_by(len) {
            for k in 0..len / 2 {
                let (s, c) = (-TAU * k as f64 / len as f64).sin_cos();
                let (a, b) = (start + k, start + k + len / 2);
                let (x, y) = (re[b] * c - im[b] * s, re[b] * s + im[b] * c);
                (re[b], im[b]) = (re[a] - x, im[a] - y);
                (re[a], im[a]) = (re[a] + x, im[a] + y);
            }
        }
        len *= 2;
    }
}

/// Harmonics of the random part.
pub const LINES: i32 = 512;

/// Spectra in bands of 30 harmonics, about a third of an octave: mean wavenumber, S of the left rail, of the right
/// rail, real part of the cross-spectrum, and the mean of the target.
pub fn spectra(
    rails: &Rails,
    direction: usize,
    from: f64,
    target: &dyn Fn(f64) -> [f64; 2],
) -> Vec<[f64; 6]> {
    let (n, d) = (1 << 17, 0.2);
    let record = |side: f64| {
        let window = |i: usize| (8.0f64 / 3.0).sqrt() * (PI * i as f64 / n as f64).sin().powi(2);
        let mut re: Vec<f64> = (0..n)
            .map(|i| window(i) * rails.irregularity(side, from + d * i as f64)[direction][0])
            .collect();
        let mut im = vec![0.0; n];
        transform(&mut re, &mut im);
        (re, im)
    };
    let (left, right) = (record(1.0), record(-1.0));
    let scale = 2.0 * d / (TAU * n as f64);
    let mut bands = Vec::new();
    let ratio = 50f64.powf(1.0 / f64::from(LINES));
    for band in 1..LINES / 30 {
        let edge = TAU / 50.0 * ratio.powi(30 * band);
        let next = edge * ratio.powi(30);
        let line = TAU / (d * n as f64);
        let range = (edge / line).ceil() as usize..(next / line).ceil() as usize;
        let count = range.len() as f64;
        let mut sums = [0.0; 6];
        for k in range {
            sums[0] += line * k as f64 / count;
            sums[1] += scale / count * (left.0[k].powi(2) + left.1[k].powi(2));
            sums[2] += scale / count * (right.0[k].powi(2) + right.1[k].powi(2));
            sums[3] += scale / count * (left.0[k] * right.0[k] + left.1[k] * right.1[k]);
            let [density, product] = target(line * k as f64);
            sums[4] += density / count;
            sums[5] += product / count;
        }
        bands.push(sums);
    }
    bands
}
