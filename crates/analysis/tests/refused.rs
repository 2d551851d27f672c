//! Signals that have no spectrum are refused, and the error says why.

use analysis::Error;
use analysis::series::rate;
use analysis::spectrum::{Welch, Window, amplitude, welch};

fn axis() -> Vec<f64> {
    (0..1001).map(|i| 100.0 + f64::from(i) * 0.001).collect()
}

#[test]
fn analytic_rate_of_an_even_axis() {
    assert!((rate(&axis()).unwrap() - 1000.0).abs() < 1e-6);
}

#[test]
fn invariant_an_uneven_axis_is_refused_where_it_is_uneven() {
    let mut times = axis();
    times[500] += 1e-4;
    match rate(&times) {
        Err(Error::Uneven { index: 500, time, expected, interval }) => {
            assert!((time - 100.5001).abs() < 1e-9 && (expected - 100.5).abs() < 1e-9);
            assert!((interval - 0.001).abs() < 1e-12);
        }
        other => panic!("{other:?}"),
    }
    // a gap shifts all that follows it; a repeated time and one that runs backwards are no axis either
    let mut gap = axis();
    gap.drain(300..310);
    assert!(matches!(rate(&gap), Err(Error::Uneven { .. })));
    assert!(matches!(rate(&[1.0; 20]), Err(Error::Uneven { .. })));
    let backwards: Vec<f64> = axis().into_iter().rev().collect();
    assert!(matches!(rate(&backwards), Err(Error::Uneven { .. })));
    times[3] = f64::NAN;
    assert!(matches!(rate(&times), Err(Error::NotFinite { index: 3, .. })));
    let message = rate(&gap).unwrap_err().to_string();
    assert!(message.contains("sample") && message.contains("constant interval"), "{message}");
}

#[test]
fn invariant_samples_that_are_no_numbers_are_refused() {
    for wrong in [f64::NAN, f64::INFINITY] {
        let mut values = vec![1.0; 100];
        values[42] = wrong;
        for result in
            [amplitude(&values, 10.0, Window::Hann), welch(&values, 10.0, &Welch::of_segment(50))]
        {
            assert!(matches!(result, Err(Error::NotFinite { index: 42, .. })), "{result:?}");
        }
    }
}

#[test]
fn invariant_too_short_signals_and_wrong_settings_are_refused() {
    let short = Err(Error::TooShort { samples: 7, needed: 8 });
    assert_eq!(amplitude(&[1.0; 7], 10.0, Window::Hann), short);
    let needs = Err(Error::TooShort { samples: 99, needed: 100 });
    assert_eq!(welch(&[1.0; 99], 10.0, &Welch::of_segment(100)), needs);
    for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let result = amplitude(&[1.0; 100], wrong, Window::Hann);
        assert!(matches!(result, Err(Error::Setting { .. })), "{result:?}");
    }
    for overlap in [1.0, -0.1, f64::NAN] {
        let settings = Welch { overlap, ..Welch::of_segment(50) };
        assert!(matches!(welch(&[1.0; 100], 1.0, &settings), Err(Error::Setting { .. })));
    }
    let none = welch(&[1.0; 100], 1.0, &Welch::of_segment(0));
    assert!(matches!(none, Err(Error::Setting { .. })));
}
