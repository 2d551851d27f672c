//! Irregularity of two rails: realised spectra against their targets, periodic parts, measured profiles.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use std::f64::consts::TAU;

use guideway::{Guideway, GuidewayDescription, Rails};

#[path = "support/spectra.rs"]
mod spectra;
use spectra::spectra;

fn rails(irregularity: &str) -> Rails {
    described(irregularity, &[]).rails().unwrap().clone()
}

fn described(irregularity: &str, files: &[(&str, &str)]) -> Guideway {
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": 25, "mass_per_length": 1, "frequencies": [6], "damping": [0]}}}},
            "spans": [{{"girder": "g"}}], "magnets": 8, "start": 5,
            "rails": {{"irregularity": {{"on": true, {irregularity}}}}} }}"#
    );
    let mut description = GuidewayDescription::from_json(&text).unwrap();
    let named = description.rail_files();
    assert_eq!(named.len(), files.len());
    for (file, text) in files {
        description.set_rail_file(file, text).unwrap();
    }
    Guideway::new(&description, None).unwrap()
}

/// What magnets meet has the spectrum and the coherency that were asked for, estimated as from a
/// measurement: 26 km, Hann's window, bands of a third of an octave.
#[test]
fn analytic_realised_spectra_are_those_of_the_target() {
    let rails = rails(
        r#""start": 0, "end": 26300, "fade_length": 1, "averaged": false, "seed": 5,
           "vertical": {"psd": {"form": "german-low"}, "coherence": {"corner": 0.6}, "shortest_wave": 1, "lines": 512},
           "lateral": {"psd": {"form": "rational", "amplitude": 2e-7, "poles": [0.3, 1], "zeros": [4]},
                       "coherence": {"long_waves": 0.4}, "shortest_wave": 1, "lines": 512}"#,
    );
    let german = |k: f64| {
        4.032e-7 * 0.8246f64.powi(2) / ((k * k + 0.0206f64.powi(2)) * (k * k + 0.8246f64.powi(2)))
    };
    let rational = |k: f64| 2e-7 * (k * k + 16.0) / ((k * k + 0.09) * (k * k + 1.0));
    type Form<'a> = &'a dyn Fn(f64) -> f64;
    let targets: [(Form<'_>, Form<'_>); 2] =
        [(&german, &|k| 1.0 / (1.0 + (k / 0.6).powi(2))), (&rational, &|_| 0.4)];
    for (direction, (density, coherency)) in targets.into_iter().enumerate() {
        let target = |k: f64| [density(k), density(k) * coherency(k)];
        for [k, left, right, cross, exact, product] in spectra(&rails, direction, 20.0, &target) {
            // the record resolves the harmonics; what is left is the window's reach across the bands' edges
            for found in [left, right] {
                assert!((found / exact - 1.0).abs() < 5e-3, "{direction} {k}: {found:e} {exact:e}");
            }
            assert!(
                (cross - product).abs() < 5e-3 * exact,
                "{direction} {k}: {cross:e} {product:e}"
            );
        }
    }
}

#[test]
fn analytic_periodic_and_measured_parts_are_added_rail_by_rail() {
    let window = r#""start": -10, "end": 60, "fade_length": 5, "averaged": false"#;
    let csv = "x;z\n0;0.001\n10;0.002\n20;0.001\n40;0.003\n";
    let g = described(
        &format!(
            r#"{window}, "vertical": {{"periodic": [
                {{"wavelength": 25, "amplitudes": [0.002, 0.0005], "phases": [0.3]}},
                {{"wavelength": 0.7, "amplitudes": [0.0001], "rail": "left"}}],
                "right": {{"file": "right.csv"}}}}"#
        ),
        &[("right.csv", csv)],
    );
    let rails = g.rails().unwrap();
    let spline = {
        let (x, z) = ([0.0, 10.0, 20.0, 40.0], [1e-3, 2e-3, 1e-3, 3e-3]);
        guideway::Spline::new(&x, &z, "test").unwrap()
    };
    for x in [5.0, 12.3, 17.0, 30.1] {
        let k = TAU / 25.0;
        let both = 0.002 * (k * (x - 5.0) + 0.3).sin() + 0.0005 * (2.0 * k * (x - 5.0)).sin();
        let left = both + 1e-4 * (TAU / 0.7 * (x - 5.0)).sin();
        let right = both + spline.at(x)[0];
        let found = [1.0, -1.0].map(|side| rails.irregularity(side, x)[0][0]);
        // quintics on 32 knots per shortest wave: 1e-9 of the amplitude; the spline's third derivative
        // jumps at its points, which are knots of both tables only nearly: 1e-6
        assert!((found[0] - left).abs() < 1e-11, "{x}: {} {left}", found[0]);
        assert!((found[1] - right).abs() < 2e-6, "{x}: {} {right}", found[1]);
        assert_eq!(rails.irregularity(1.0, x)[1], [0.0; 3]);
    }
    // a rail without any part is level, and a factor of 0 leaves one rail smooth
    let one = rails_of_one_side();
    assert!(one.irregularity(1.0, 12.0)[0][0] != 0.0);
    assert_eq!(one.irregularity(-1.0, 12.0), [[0.0; 3]; 2]);
}

fn rails_of_one_side() -> Rails {
    rails(r#""vertical": {"psd": {"form": "german-high"}, "right_factor": 0}"#)
}

/// Seeds give other profiles of the same kind, and vertical and lateral ones are not the same.
#[test]
fn invariant_profiles_depend_on_the_seed_and_the_direction() {
    let of = |seed: u64| {
        let part = r#"{"psd": {"form": "inverse-square", "amplitude": 7e-7}, "coherence": {"long_waves": 0}}"#;
        rails(&format!(r#""seed": {seed}, "vertical": {part}, "lateral": {part}"#))
    };
    let (a, b, c) = (of(1), of(1), of(2));
    assert_eq!(a, b);
    let at = |r: &Rails, direction: usize, side| r.irregularity(side, 20.0)[direction][0];
    for (x, y) in [
        (at(&a, 0, 1.0), at(&c, 0, 1.0)),
        (at(&a, 0, 1.0), at(&a, 1, 1.0)),
        (at(&a, 0, 1.0), at(&a, 0, -1.0)),
    ] {
        assert!((x - y).abs() > 1e-6, "{x} {y}");
    }
}

/// The number of cells is that of the sums, also where rounding of length over spacing gives one more.
#[test]
fn issue_windows_of_any_length_have_as_many_knots_as_sums() {
    for k in 0..40 {
        let end = 60.0 + 0.73 * f64::from(k);
        let r = rails(&format!(
            r#""end": {end}, "vertical": {{"psd": {{"form": "german-low"}}, "lines": 4, "shortest_wave": 0.7}}"#
        ));
        assert!(r.irregularity(1.0, 30.0)[0][0].is_finite());
    }
}
