//! Peaks: frequency between bins, and damping of an oscillator that is known.

mod signals;

use analysis::spectrum::{PeakSearch, Welch, Window, amplitude, peaks, welch};
use signals::{noise, oscillator, sine};

/// The girder's first mode in the paper: 7.1 Hz, and its damping.
const FREQUENCY: f64 = 7.1;
const DAMPING: f64 = 0.0108;

#[test]
fn analytic_frequency_and_height_of_a_sine_between_bins() {
    // what the windows' lines, seen as parabolas, err by at most: fractions of a bin, and of the height
    let claims = [
        (Window::Rectangular, 0.17, 0.28),
        (Window::Hann, 0.02, 0.04),
        (Window::FlatTop, 0.14, 0.0012),
    ];
    for (window, bins, height) in claims {
        let (mut off, mut low) = (0.0_f64, 0.0_f64);
        for tenth in 0..10 {
            let frequency = 100.0 + 0.05 * f64::from(tenth);
            let spectrum = amplitude(&sine(2000, 1000.0, frequency, 1.0), 1000.0, window).unwrap();
            let peak = peaks(&spectrum, &PeakSearch { count: 1, ..PeakSearch::default() })[0];
            off = off.max((peak.frequency - frequency).abs() / spectrum.resolution);
            low = low.max((peak.value - 1.0).abs());
            assert_eq!(peak.damping, None, "a sine has none ({window:?}, {frequency} Hz)");
        }
        println!("{window:?}: {off:.4} bins, {:.3} %", 100.0 * low);
        assert!(off < bins && low < height, "{window:?}: {off} bins, {low}");
    }
}

#[test]
fn analytic_peaks_come_highest_first_and_without_ripples() {
    let parts = [(20.0, 1.0), (31.0, 3.0), (90.0, 0.1), (33.0, 0.5)];
    let mut signal = vec![0.0; 4000];
    for (frequency, size) in parts {
        let part = sine(signal.len(), 400.0, frequency, size);
        signal.iter_mut().zip(part).for_each(|(sum, x)| *sum += x);
    }
    let spectrum = amplitude(&signal, 400.0, Window::Hann).unwrap();
    let found = peaks(&spectrum, &PeakSearch::default());
    let frequencies: Vec<f64> = found.iter().map(|p| (p.frequency * 10.0).round() / 10.0).collect();
    assert_eq!(frequencies, [31.0, 20.0, 33.0, 90.0]);
    let band = PeakSearch { from: 32.0, to: 100.0, count: 1, ..PeakSearch::default() };
    assert!((peaks(&spectrum, &band)[0].frequency - 33.0).abs() < 1e-3);
    let high = PeakSearch { floor: 0.2, ..PeakSearch::default() };
    assert_eq!(peaks(&spectrum, &high).len(), 2);
}

#[test]
fn analytic_damping_from_the_impulse_response() {
    let mut force = vec![0.0; 40_000];
    force[0] = 1.0;
    let response = oscillator(&force, 1000.0, FREQUENCY, DAMPING);
    let spectrum = amplitude(&response, 1000.0, Window::Rectangular).unwrap();
    let peak = peaks(&spectrum, &PeakSearch { count: 1, ..PeakSearch::default() })[0];
    // the highest amplitude is at f₀√(1-2ζ²), 0.8 mHz lower; a tenth of a bin of 25 mHz is allowed
    assert!((peak.frequency - FREQUENCY).abs() < 2.5e-3, "{}", peak.frequency);
    // interpolation over six bins, and ζ² of the method: half a per cent
    let damping = peak.damping.unwrap();
    assert!((damping / DAMPING - 1.0).abs() < 0.005, "{damping}");
}

#[test]
fn analytic_damping_from_the_random_response() {
    // an hour at 100 Hz; pieces of 40 s resolve the width of 0.153 Hz with four of Hann's own widths
    let response = oscillator(&noise(360_000, 3), 100.0, FREQUENCY, DAMPING);
    let spectrum = welch(&response, 100.0, &Welch::of_segment(4000)).unwrap();
    let peak = peaks(&spectrum, &PeakSearch { count: 1, ..PeakSearch::default() })[0];
    // 180 half overlapping pieces: of 40 such hours, two of three dampings were within 3 %; three times that
    let damping = peak.damping.unwrap();
    println!("{:.4} Hz, damping {damping:.5}", peak.frequency);
    assert!((damping / DAMPING - 1.0).abs() < 0.09, "{damping}");
    // a quarter of the width
    assert!((peak.frequency - FREQUENCY).abs() < 0.04, "{}", peak.frequency);
}

#[test]
fn analytic_damping_through_each_window_without_noise() {
    // A stationary response's expected density through a window: the transform of its correlation
    // e^(-πΔ|τ|) times the window's own. Here by means of many random phases it would take hours, so it is
    // made directly, and only its peak is tried.
    for (window, claim) in
        [(Window::Rectangular, 0.02), (Window::Hann, 0.02), (Window::FlatTop, 0.02)]
    {
        for width in [2.5, 4.0, 8.0] {
            // in half-power widths of the window, hence so many bins
            let bins = width * window.half_power_width();
            let spectrum = signals::expected_line(window, bins, 200.3, 512);
            let peak = peaks(&spectrum, &PeakSearch { count: 1, ..PeakSearch::default() })[0];
            let damping = peak.damping.unwrap();
            let expected = bins / (2.0 * 200.3);
            println!("{window:?} {width}: {:.2} %", 100.0 * (damping / expected - 1.0));
            assert!(
                (damping / expected - 1.0).abs() < claim,
                "{window:?} {width} {damping} {expected}"
            );
        }
    }
}

#[test]
fn analytic_no_damping_is_told_where_the_window_makes_the_width() {
    for window in [Window::Rectangular, Window::Hann, Window::FlatTop] {
        let narrow = signals::expected_line(window, 0.5 * window.half_power_width(), 200.3, 512);
        let peak = peaks(&narrow, &PeakSearch { count: 1, ..PeakSearch::default() })[0];
        assert_eq!(peak.damping, None, "{window:?}");
    }
    // a decay seen through a window that cuts its beginning off
    let mut force = vec![0.0; 40_000];
    force[0] = 1.0;
    let response = oscillator(&force, 1000.0, FREQUENCY, DAMPING);
    let spectrum = amplitude(&response, 1000.0, Window::Hann).unwrap();
    assert!(peaks(&spectrum, &PeakSearch::default()).iter().all(|peak| peak.damping.is_none()));
}

#[test]
fn analytic_no_damping_where_a_flank_has_no_half_power_point() {
    // a peak on a plateau: the power never falls to half of it above
    let mut force = vec![0.0; 8192];
    force[0] = 1.0;
    let response = oscillator(&force, 20.0, 0.4, 0.5);
    let spectrum = amplitude(&response, 20.0, Window::Rectangular).unwrap();
    assert!(
        peaks(&spectrum, &PeakSearch { prominence: 1.01, ..PeakSearch::default() })
            .iter()
            .all(|peak| peak.damping.is_none())
    );
}

/// Seven pieces are few: many runs show what their dampings are worth. Taking the first bins below half power
/// instead of fitting the line had the median at 0.71.
#[test]
fn analytic_damping_from_few_pieces_is_not_far_off() {
    let mut found = Vec::new();
    for seed in 0..300 {
        let response = oscillator(&noise(4600, 1000 + seed), 100.0, FREQUENCY, 0.05);
        let spectrum = welch(&response[1000..], 100.0, &Welch::of_segment(900)).unwrap();
        let search = PeakSearch { from: 0.3, count: 1, ..PeakSearch::default() };
        found.extend(peaks(&spectrum, &search).first().and_then(|peak| peak.damping));
    }
    found.sort_by(f64::total_cmp);
    let part = |share: f64| found[(share * found.len() as f64) as usize] / 0.05;
    println!("{} of 300: {:.3} ({:.3} to {:.3})", found.len(), part(0.5), part(0.16), part(0.84));
    assert!(found.len() > 200);
    assert!((part(0.5) - 1.0).abs() < 0.2 && part(0.16) > 0.5 && part(0.84) < 1.4);
}
