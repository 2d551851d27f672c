//! Scaling of spectra against what is known of the signals.

mod signals;

use std::f64::consts::TAU;

use analysis::spectrum::{Detrend, Scale, Welch, Window, amplitude, spectrogram, welch};
use signals::{congruence, noise, sine};

const WINDOWS: [Window; 3] = [Window::Rectangular, Window::Hann, Window::FlatTop];

/// Rounding of a sum of a thousand terms of order one.
const ROUNDING: f64 = 1e-12;

#[test]
fn analytic_a_sine_of_amplitude_one_reads_one() {
    for window in WINDOWS {
        let spectrum = amplitude(&sine(1000, 1000.0, 50.0, 1.0), 1000.0, window).unwrap();
        assert!((spectrum.values[50] - 1.0).abs() < ROUNDING, "{window:?} {}", spectrum.values[50]);
        assert_eq!(spectrum.frequency(50), 50.0);
        // nothing outside of the window's own bins
        let elsewhere = spectrum.values.iter().enumerate().filter(|(k, _)| k.abs_diff(50) > 4);
        assert!(elsewhere.map(|(_, a)| *a).fold(0.0, f64::max) < ROUNDING, "{window:?}");
    }
}

#[test]
fn analytic_a_constant_reads_itself_and_does_not_leak() {
    for window in WINDOWS {
        let spectrum = amplitude(&[-3.0; 101], 10.0, window).unwrap();
        assert!((spectrum.values[0] - 3.0).abs() < ROUNDING, "{window:?}");
        assert!(spectrum.values[1..].iter().all(|a| *a < ROUNDING), "{window:?}");
    }
}

#[test]
fn analytic_a_wave_at_nyquist_reads_one() {
    let wave: Vec<f64> = (0..64).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
    for window in WINDOWS {
        let spectrum = amplitude(&wave, 2.0, window).unwrap();
        assert_eq!(spectrum.values.len(), 33);
        assert_eq!(spectrum.frequency(32), 1.0);
        assert!((spectrum.values[32] - 1.0).abs() < ROUNDING, "{window:?}");
    }
}

#[test]
fn analytic_two_sines_of_different_size_on_an_offset() {
    let (large, small) = (sine(2000, 1000.0, 12.0, 2.0), sine(2000, 1000.0, 300.5, 1e-3));
    let signal: Vec<f64> = large.iter().zip(&small).map(|(a, b)| 8.0 + a + b).collect();
    let spectrum = amplitude(&signal, 1000.0, Window::Hann).unwrap();
    assert!((spectrum.values[0] - 8.0).abs() < 1e-11);
    assert!((spectrum.values[24] - 2.0).abs() < 1e-11);
    assert!((spectrum.values[601] - 1e-3).abs() < 1e-11);
}

#[test]
fn analytic_what_a_sine_between_two_bins_reads() {
    // the windows' scalloping losses: sinc(1/2), of Hann sinc(1/2) / (1 - 1/4), of flat top almost none
    let (rectangular, hann) = (2.0 / std::f64::consts::PI, 8.0 / (3.0 * std::f64::consts::PI));
    for (window, expected) in [(WINDOWS[0], rectangular), (WINDOWS[1], hann), (WINDOWS[2], 1.0)] {
        let spectrum = amplitude(&sine(4000, 1000.0, 100.125, 1.0), 1000.0, window).unwrap();
        // the line's image at negative frequencies, and the flat top's ripple of 0.12 %
        assert!(
            (spectrum.values[400] - expected).abs() < 1.2e-3,
            "{window:?} {}",
            spectrum.values[400]
        );
    }
}

#[test]
fn analytic_density_of_noise_integrates_to_its_variance() {
    let signal = noise(65_536, 1);
    let mean = signal.iter().sum::<f64>() / signal.len() as f64;
    let variance = signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / signal.len() as f64;
    // Parseval: one rectangular piece has exactly this, whatever the signal
    let whole = Welch { window: Window::Rectangular, ..Welch::of_segment(signal.len()) };
    let spectrum = welch(&signal, 500.0, &whole).unwrap();
    assert!((spectrum.mean_square(0.0, 250.0) / variance - 1.0).abs() < 1e-10);
    // 511 half overlapping pieces of white noise: about 2 variance / rate everywhere; over the whole band
    // the uncertainty is that of a mean square of 65536 samples, √(2/65536) = 0.6 %, and three times that
    let spectrum = welch(&signal, 500.0, &Welch::of_segment(256)).unwrap();
    assert!((spectrum.mean_square(0.0, 250.0) / variance - 1.0).abs() < 0.017);
    // a tenth of the band: 1.9 %, three times
    let share = spectrum.mean_square(100.0, 125.0) / variance / (13.0 / 128.0);
    assert!((share - 1.0).abs() < 0.06, "{share}");
}

#[test]
fn analytic_density_of_a_sine_integrates_to_half_its_square() {
    for window in WINDOWS {
        let settings = Welch { window, ..Welch::of_segment(500) };
        let spectrum = welch(&sine(4000, 1000.0, 60.0, 2.0), 1000.0, &settings).unwrap();
        assert!((spectrum.mean_square(0.0, 500.0) - 2.0).abs() < 1e-9, "{window:?}");
        let only_there = spectrum.mean_square(50.0, 70.0);
        assert!((only_there - 2.0).abs() < 1e-9, "{window:?}");
    }
}

#[test]
fn analytic_linear_trend_is_taken_out() {
    let signal: Vec<f64> = (0..1024).map(|i| 5.0 + 0.3 * f64::from(i)).collect();
    let settings = Welch { detrend: Detrend::Linear, ..Welch::of_segment(256) };
    let spectrum = welch(&signal, 1.0, &settings).unwrap();
    assert!(spectrum.values.iter().all(|p| *p < 1e-20));
    let settings = Welch { detrend: Detrend::Constant, ..settings };
    assert!(welch(&signal, 1.0, &settings).unwrap().values[1] > 1.0);
}

#[test]
fn analytic_spatial_density_of_a_profile() {
    // 3 mm with a wave length of 5 m on samples 0.1 m apart: half its square, at 0.2 / m
    let profile: Vec<f64> =
        (0..5000).map(|i| 3e-3 * (TAU * 0.1 * f64::from(i) / 5.0).sin()).collect();
    let spectrum = welch(&profile, 10.0, &Welch::of_resolution(10.0, 0.01)).unwrap();
    assert!((spectrum.mean_square(0.17, 0.23) - 4.5e-6).abs() < 1e-15);
}

#[test]
fn analytic_spectrogram_shows_when() {
    // 1 s at 50 Hz, then 1 s at 200 Hz
    let signal: Vec<f64> =
        sine(1000, 1000.0, 50.0, 1.0).into_iter().chain(sine(1000, 1000.0, 200.0, 0.5)).collect();
    let settings = Welch { overlap: 0.75, ..Welch::of_segment(200) };
    let picture = spectrogram(&signal, 1000.0, &settings, Scale::Amplitude).unwrap();
    assert_eq!(picture.slices.len(), 37);
    assert_eq!((picture.start, picture.step), (0.0995, 0.05));
    for (i, slice) in picture.slices.iter().enumerate() {
        let time = picture.time(i);
        if time < 0.9 {
            assert!((slice[10] - 1.0).abs() < ROUNDING && slice[40] < ROUNDING);
        } else if time > 1.1 {
            assert!((slice[40] - 0.5).abs() < ROUNDING && slice[10] < ROUNDING);
        }
    }
}

#[test]
fn invariant_welch_is_the_mean_of_the_spectrogram() {
    let signal = noise(5000, 2);
    let settings = Welch::of_segment(512);
    let mean = welch(&signal, 100.0, &settings).unwrap();
    let picture = spectrogram(&signal, 100.0, &settings, Scale::Density).unwrap();
    for (k, value) in mean.values.iter().enumerate() {
        let sum: f64 = picture.slices.iter().map(|slice| slice[k]).sum();
        assert!((sum / picture.slices.len() as f64 - value).abs() < 1e-14 * value);
    }
}

/// Numbers of scipy 1.17.1:
///
/// ```python
/// import numpy as np, scipy.signal as s
/// x, v = 1, []
/// for _ in range(3000):
///     x = (1103515245 * x + 12345) % 2**31
///     v.append(x / 2**30 - 1)
/// v = np.array(v)
/// for window, detrend in [("boxcar", False), ("hann", "constant"), ("flattop", "linear")]:
///     f, p = s.welch(v, 250.0, window, nperseg=500, noverlap=333, detrend=detrend)
///     print(*(repr(float(p[k])) for k in (0, 1, 100, 249, 250)))
/// f, t, q = s.spectrogram(v, 250.0, "hann", nperseg=501, noverlap=100, detrend="constant")
/// print(q.shape, *(repr(float(q[k, i])) for k, i in ((0, 0), (3, 2), (250, 5))), t[1] - t[0])
/// ```
#[test]
fn golden_densities_are_those_of_scipy() {
    let signal = congruence(3000);
    let golden = [
        (
            Window::Rectangular,
            Detrend::None,
            [
                0.001288709556167482,
                0.002717510587787987,
                0.0018800234676353727,
                0.0035475436348970006,
                0.0016594890050932946,
            ],
        ),
        (
            Window::Hann,
            Detrend::Constant,
            [
                0.0002676139371033204,
                0.002184383860942514,
                0.0020306123832067426,
                0.0032809068902226986,
                0.001610462911744926,
            ],
        ),
        (
            Window::FlatTop,
            Detrend::Linear,
            [
                0.0007157843582276114,
                0.00155450224191525,
                0.001970136247113207,
                0.002601696695116749,
                0.0014849372915544852,
            ],
        ),
    ];
    for (window, detrend, expected) in golden {
        let settings = Welch { segment: 500, overlap: 0.666, window, detrend };
        assert_eq!(settings.step(), 500 - 333);
        let spectrum = welch(&signal, 250.0, &settings).unwrap();
        for (k, value) in [0, 1, 100, 249, 250].into_iter().zip(expected) {
            // rounding of sums of 500 terms
            let error = spectrum.values[k] / value - 1.0;
            assert!(error.abs() < 1e-11, "{window:?} bin {k}: {error}");
        }
    }
    let settings = Welch { overlap: 0.2, ..Welch::of_segment(501) };
    let picture = spectrogram(&signal, 250.0, &settings, Scale::Density).unwrap();
    assert_eq!((picture.slices.len(), picture.slices[0].len()), (7, 251));
    assert!((picture.step - 1.604).abs() < 1e-12);
    for (k, i, value) in [
        (0, 0, 0.0014341626196573752),
        (3, 2, 0.004782468635796843),
        (250, 5, 0.002829633909661153),
    ] {
        assert!((picture.slices[i][k] / value - 1.0).abs() < 1e-11, "bin {k} of slice {i}");
    }
}
