//! The weightings against the tables of the standards, and the measures against known signals.

mod signals;

use std::f64::consts::{PI, SQRT_2};

use analysis::Error;
use analysis::ride::SETTLING;
use analysis::ride::iso2631::{Exposure, LOWEST_RATE, Weighting, comfort, total};
use analysis::ride::sperling::{self, Direction};
use signals::sine;

/// Table 3 of ISO 2631-1:1997: nominal frequency in Hz, Wk and Wd in thousandths, each with one unit of its
/// last printed digit. (At 10 Hz the table prints 212 for Wd and -13.91 dB, which is 201.6: a misprint.)
const TABLE_3: [[f64; 5]; 37] = [
    [0.1, 31.2, 0.1, 62.4, 0.1],
    [0.125, 48.6, 0.1, 97.3, 0.1],
    [0.16, 79.0, 0.1, 158.0, 1.0],
    [0.2, 121.0, 1.0, 243.0, 1.0],
    [0.25, 182.0, 1.0, 365.0, 1.0],
    [0.315, 263.0, 1.0, 530.0, 1.0],
    [0.4, 352.0, 1.0, 713.0, 1.0],
    [0.5, 418.0, 1.0, 853.0, 1.0],
    [0.63, 459.0, 1.0, 944.0, 1.0],
    [0.8, 477.0, 1.0, 992.0, 1.0],
    [1.0, 482.0, 1.0, 1011.0, 1.0],
    [1.25, 484.0, 1.0, 1008.0, 1.0],
    [1.6, 494.0, 1.0, 968.0, 1.0],
    [2.0, 531.0, 1.0, 890.0, 1.0],
    [2.5, 631.0, 1.0, 776.0, 1.0],
    [3.15, 804.0, 1.0, 642.0, 1.0],
    [4.0, 967.0, 1.0, 512.0, 1.0],
    [5.0, 1039.0, 1.0, 409.0, 1.0],
    [6.3, 1054.0, 1.0, 323.0, 1.0],
    [8.0, 1036.0, 1.0, 253.0, 1.0],
    [10.0, 988.0, 1.0, 202.0, 1.0],
    [12.5, 902.0, 1.0, 161.0, 1.0],
    [16.0, 768.0, 1.0, 125.0, 1.0],
    [20.0, 636.0, 1.0, 100.0, 1.0],
    [25.0, 513.0, 1.0, 80.0, 0.1],
    [31.5, 405.0, 1.0, 63.2, 0.1],
    [40.0, 314.0, 1.0, 49.4, 0.1],
    [50.0, 246.0, 1.0, 38.8, 0.1],
    [63.0, 186.0, 1.0, 29.5, 0.1],
    [80.0, 132.0, 1.0, 21.1, 0.1],
    [100.0, 88.7, 0.1, 14.1, 0.1],
    [125.0, 54.0, 0.1, 8.63, 0.01],
    [160.0, 28.5, 0.1, 4.55, 0.01],
    [200.0, 15.2, 0.1, 2.43, 0.01],
    [250.0, 7.90, 0.01, 1.26, 0.01],
    [315.0, 3.98, 0.01, 0.64, 0.01],
    [400.0, 1.95, 0.01, 0.31, 0.01],
];

/// Tables B.8, B.1 and B.3 of ISO 8041-1:2017: factors Wk, Wb and Wd at 10^(n/10) Hz, n = -10 … 26.
const ANNEX_B: [[f64; 3]; 37] = [
    [0.03121, 0.02494, 0.06242],
    [0.04931, 0.03941, 0.09867],
    [0.07756, 0.06198, 0.1553],
    [0.1207, 0.09645, 0.242],
    [0.1832, 0.1464, 0.3682],
    [0.2644, 0.2113, 0.533],
    [0.3504, 0.28, 0.7097],
    [0.4188, 0.3347, 0.854],
    [0.4588, 0.3666, 0.9443],
    [0.4767, 0.3808, 0.9914],
    [0.4825, 0.3853, 1.011],
    [0.4846, 0.3864, 1.007],
    [0.4935, 0.3916, 0.9707],
    [0.5308, 0.4168, 0.8913],
    [0.6335, 0.496, 0.7733],
    [0.8071, 0.6653, 0.6398],
    [0.9648, 0.885, 0.5143],
    [1.039, 1.026, 0.4081],
    [1.054, 1.054, 0.3226],
    [1.037, 1.026, 0.255],
    [0.9884, 0.9745, 0.2017],
    [0.8989, 0.9042, 0.1597],
    [0.7743, 0.8144, 0.1266],
    [0.6373, 0.7088, 0.1004],
    [0.5103, 0.5973, 0.07958],
    [0.4031, 0.4906, 0.06299],
    [0.316, 0.395, 0.04965],
    [0.2451, 0.3118, 0.03872],
    [0.1857, 0.2389, 0.02946],
    [0.1339, 0.1734, 0.0213],
    [0.08873, 0.1154, 0.01414],
    [0.05311, 0.06929, 0.008478],
    [0.02922, 0.03818, 0.004668],
    [0.01528, 0.01999, 0.002442],
    [0.007795, 0.0102, 0.001246],
    [0.003935, 0.005154, 0.0006293],
    [0.001978, 0.002591, 0.0003164],
];

const WEIGHTINGS: [Weighting; 3] = [Weighting::Wk, Weighting::Wb, Weighting::Wd];

#[test]
fn golden_weightings_are_those_of_iso_2631_1_table_3() {
    for [frequency, wk, digit_k, wd, digit_d] in TABLE_3 {
        // one unit of the last printed digit: the table rounds, and once cuts
        for (weighting, printed, digit) in
            [(Weighting::Wk, wk, digit_k), (Weighting::Wd, wd, digit_d)]
        {
            let factor = 1000.0 * weighting.factor(frequency);
            assert!(
                (factor - printed).abs() < digit,
                "{weighting:?} at {frequency} Hz: {factor} instead of {printed}"
            );
        }
    }
}

#[test]
fn golden_weightings_are_those_of_iso_8041_annex_b() {
    let mut worst = [0.0_f64; 3];
    for (n, row) in (-10..).zip(ANNEX_B) {
        let frequency = 10.0_f64.powf(f64::from(n) / 10.0);
        let mut line = format!("| {frequency:.4} |");
        for ((weighting, printed), worst) in WEIGHTINGS.iter().zip(row).zip(&mut worst) {
            let factor = weighting.factor(frequency);
            line += &format!(" {printed} | {factor:.6} |");
            *worst = worst.max((factor / printed - 1.0).abs());
        }
        println!("{line}");
    }
    println!("largest deviations of Wk, Wb, Wd: {worst:.6?}");
    // four digits are printed: half a unit in 1000 units. The standard allows instruments +12 % and -11 %
    // from 0.63 to 63 Hz.
    assert!(worst.iter().all(|deviation| *deviation < 5.1e-4), "{worst:?}");
}

/// Steady sines leave the filter with the factor, also at 80 Hz of 200.
#[test]
fn analytic_the_filter_has_the_factor_at_any_rate() {
    for rate in [200.0, 1000.0] {
        for frequency in [0.6, 1.0, 6.3, 20.0, 80.0] {
            // 20 s: whole periods of all
            let count = (40.0 * rate) as usize;
            let signal = sine(count, rate, frequency, SQRT_2);
            for weighting in WEIGHTINGS {
                let weighted = weighting.apply(&signal, rate).unwrap();
                let exposure = Exposure::of(&weighted[count / 2..], rate).unwrap();
                let error = exposure.rms / weighting.factor(frequency) - 1.0;
                // exact below half the rate and cut off above it, which rings after the start of a sine
                // that is near it: at 80 Hz of 200 by 3e-5, else by less than 1e-6
                assert!(error.abs() < 1e-4, "{weighting:?} {frequency} of {rate} Hz: {error}");
                assert!((exposure.crest_factor() - SQRT_2).abs() < 0.08);
            }
            let weighted = Direction::Vertical.apply(&signal, rate).unwrap();
            let rms = Exposure::of(&weighted[count / 2..], rate).unwrap().rms;
            let counted =
                if frequency < 30.0 { Direction::Vertical.factor(frequency) } else { 0.0 };
            // the sharp ends of Sperling's range ring after the start of the sine
            assert!((rms - counted).abs() < 5e-3, "{frequency} Hz: {rms} {counted}");
        }
    }
}

/// A steady acceleration is not felt; what its beginning leaves is a thousandth after five seconds.
#[test]
fn analytic_the_start_of_a_run_fades() {
    for weighting in WEIGHTINGS {
        let weighted = weighting.apply(&[1.0; 4000], 200.0).unwrap();
        let later = (SETTLING * 200.0) as usize;
        let left = weighted[later..3900].iter().fold(0.0_f64, |most, a| most.max(a.abs()));
        println!("{weighting:?} {left:.1e}");
        assert!(left < 1e-3, "{weighting:?}: {left}");
        assert!(weighted[..later].iter().any(|a| *a > 0.1));
    }
}

/// The whole-body test signal of ISO 8041-1:2017, table 6: in 60 s, six bursts of a saw tooth of amplitude
/// 1 m/s² at 100 rad/s, the first after 1 s.
fn bursts(cycles: u32, rate: f64) -> Vec<f64> {
    let frequency = 100.0 / (2.0 * PI);
    let value = |i: u32| {
        let since = (f64::from(i) / rate - 1.0).rem_euclid(10.0) * frequency;
        let inside = f64::from(i) >= rate && since < f64::from(cycles);
        // rises, falls at half of its period
        if inside { 2.0 * ((since + 0.5).fract() - 0.5) } else { 0.0 }
    };
    (0..(60.0 * rate) as u32).map(value).collect()
}

#[test]
fn golden_bursts_have_the_values_of_iso_8041_table_8() {
    // r.m.s., VDV and MTVV (linear)
    let printed = [
        (Weighting::Wk, 1, [0.0299, 0.323, 0.0944]),
        (Weighting::Wb, 1, [0.0314, 0.342, 0.0991]),
        (Weighting::Wb, 16, [0.123, 0.685, 0.387]),
        (Weighting::Wd, 1, [0.00669, 0.0779, 0.0212]),
        (Weighting::Wd, 2, [0.00906, 0.0852, 0.0286]),
        (Weighting::Wd, 4, [0.0116, 0.0923, 0.0366]),
        (Weighting::Wd, 8, [0.0148, 0.101, 0.0469]),
        (Weighting::Wb, 2, [0.0435, 0.403, 0.137]),
        (Weighting::Wb, 4, [0.0614, 0.482, 0.194]),
        (Weighting::Wb, 8, [0.0867, 0.575, 0.274]),
        (Weighting::Wd, 16, [0.0197, 0.115, 0.0611]),
    ];
    let rate = 4000.0;
    for (weighting, cycles, expected) in printed {
        let weighted = weighting.apply(&bursts(cycles, rate), rate).unwrap();
        let Exposure { rms, transient, dose, .. } = Exposure::of(&weighted, rate).unwrap();
        println!("{weighting:?} {cycles}: {rms:.5} {dose:.4} {transient:.5}");
        for (value, expected) in [rms, dose, transient].into_iter().zip(expected) {
            // printed with three digits; the rows of Wd are 1 to 1.6 % from ours, the others 0.5 %. The
            // standard allows instruments 10 % (VDV 12 %).
            let deviation = value / expected - 1.0;
            assert!(deviation.abs() < 0.02, "{weighting:?} {cycles} cycles: {value}, {expected}");
        }
    }
}

#[test]
fn analytic_measures_of_a_burst() {
    // one second of a square wave of 2 m/s² in ten seconds
    let mut signal = vec![0.0; 2000];
    (700..900).for_each(|i| signal[i] = if i % 2 == 0 { 2.0 } else { -2.0 });
    let exposure = Exposure::of(&signal, 200.0).unwrap();
    assert!((exposure.rms - (0.4_f64).sqrt()).abs() < 1e-12);
    assert!((exposure.transient - 2.0).abs() < 1e-12);
    assert!((exposure.dose - 2.0).abs() < 1e-12);
    assert_eq!(exposure.peak, 2.0);
    assert!((exposure.crest_factor() - 2.0 / (0.4_f64).sqrt()).abs() < 1e-12);
    assert_eq!(Exposure::of(&[0.0; 2000], 200.0).unwrap().crest_factor(), 0.0);
    let short = Exposure::of(&[0.0; 199], 200.0);
    assert_eq!(short, Err(Error::TooShort { samples: 199, needed: 200 }));
}

#[test]
fn golden_words_of_annex_c() {
    assert_eq!(comfort(0.0), ["not uncomfortable"]);
    assert_eq!(comfort(0.4), ["a little uncomfortable"]);
    assert_eq!(comfort(0.55), ["a little uncomfortable", "fairly uncomfortable"]);
    assert_eq!(comfort(0.9), ["fairly uncomfortable", "uncomfortable"]);
    assert_eq!(comfort(1.3), ["uncomfortable", "very uncomfortable"]);
    assert_eq!(comfort(2.2), ["very uncomfortable", "extremely uncomfortable"]);
    assert_eq!(comfort(9.0), ["extremely uncomfortable"]);
    assert_eq!(total([0.3, 0.4]), 0.5);
}

/// F(f) of Sperling's first formula, W_z = 0.896 (a³ F(f)/f)^0.1 with a in cm/s², gives B = (0.896^10 F/f)^(1/3).
#[test]
fn crosstool_sperlings_first_formula_has_the_same_curve() {
    let vertical = |f: f64| if f < 5.9 { 0.325 * f * f } else { 400.0 / (f * f) };
    let lateral = |f: f64| if f < 5.4 { 0.8 * f * f } else { 650.0 / (f * f) };
    let mut worst = 0.0_f64;
    for frequency in [0.6, 1.0, 2.0, 3.0, 5.0, 8.0, 10.0, 15.0, 18.0] {
        let old = |f: f64| (0.896_f64.powi(10) * f / frequency).cbrt();
        let (v, l) = (old(vertical(frequency)), old(lateral(frequency)));
        // it is the index that people compare: powers of 0.3
        let error = |new: f64, old: f64| (new / old).powf(0.3) - 1.0;
        for deviation in [
            error(Direction::Vertical.factor(frequency), v),
            error(Direction::Horizontal.factor(frequency), l),
        ] {
            worst = worst.max(deviation.abs());
        }
    }
    println!("Sperling's index by both formulas: within {:.1} %", 100.0 * worst);
    assert!(worst < 0.1, "{worst}");
}

#[test]
fn analytic_sperlings_index_of_a_sine() {
    // (a B)^0.3 with a in cm/s²
    let signal = sine(20_000, 500.0, 6.0, 0.2);
    let weighted = Direction::Horizontal.apply(&signal, 500.0).unwrap();
    let expected = (20.0 * Direction::Horizontal.factor(6.0)).powf(0.3);
    let index = sperling::index(&weighted[5000..]);
    // 4.42 is rounded: 0.1 %
    assert!((index / expected - 1.0).abs() < 2e-3, "{index} {expected}");
    assert_eq!(sperling::comfort(index), "clearly noticeable");
    assert_eq!(sperling::comfort(0.2), "not noticeable");
    assert_eq!(sperling::comfort(7.0), "extremely unpleasant, harmful if prolonged");
    assert_eq!(sperling::index(&[0.0; 100]), 0.0);
}

#[test]
fn invariant_too_coarse_sampling_is_refused() {
    assert!(Weighting::Wk.apply(&[0.0; 1000], LOWEST_RATE).is_ok());
    let coarse = Weighting::Wd.apply(&[0.0; 1000], 100.0);
    assert!(matches!(coarse, Err(Error::Setting { .. })), "{coarse:?}");
    assert!(coarse.unwrap_err().to_string().contains("80 Hz"));
    assert!(Direction::Vertical.apply(&[0.0; 1000], 50.0).is_err());
    let mut broken = vec![0.0; 1000];
    broken[3] = f64::NAN;
    assert!(matches!(Weighting::Wk.apply(&broken, 200.0), Err(Error::NotFinite { index: 3, .. })));
}
