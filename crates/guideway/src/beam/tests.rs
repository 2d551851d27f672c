//! Computed modes against closed forms.

use std::f64::consts::PI;

use super::*;
use crate::check::positive;
use crate::description::GuidewayDescription;
use crate::shapes::ShapeRow;

/// EI/m = 1 m⁴/s², m = 1 kg/m: ω = (βL)²/L².
fn beam(extra: &str) -> GirderDescription {
    let text = format!(
        r#"{{"girders": {{"g": {{"length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "damping": [0.0], {extra} }}}}, "spans": [{{"girder": "g"}}], "magnets": 1}}"#
    );
    let mut description = GuidewayDescription::from_json(&text).unwrap();
    description.girders.remove("g").unwrap()
}

fn modes(extra: &str) -> BeamModes {
    let given = beam(extra);
    BeamModes::new(&given, given.mode_count(), "g").unwrap()
}

/// Circular frequencies (rad/s).
fn omegas(extra: &str) -> Vec<f64> {
    modes(extra).frequencies.iter().map(|f| 2.0 * PI * f).collect()
}

/// The root of `f` between a and b, by bisection.
fn root(f: impl Fn(f64) -> f64, mut a: f64, mut b: f64) -> f64 {
    assert!(f(a) * f(b) < 0.0, "no change of sign between {a} and {b}");
    for _ in 0..200 {
        let middle = 0.5 * (a + b);
        if f(a) * f(middle) <= 0.0 { b = middle } else { a = middle }
    }
    0.5 * (a + b)
}

fn refused(extra: &str) -> String {
    let given = beam(extra);
    BeamModes::new(&given, given.mode_count(), "g").unwrap_err().to_string()
}

/// βL of a clamped-pinned beam: tan βL = tanh βL, first root.
fn clamped_pinned() -> f64 {
    root(|b| b.sin() * b.cosh() - b.cos() * b.sinh(), 3.5, 4.5)
}

#[test]
fn analytic_simply_supported_beam() {
    for (n, omega) in omegas(r#""elements": 100, "modes": 4"#).iter().enumerate() {
        let exact = (PI * (n as f64 + 1.0)).powi(2);
        // (4π/100)⁴/1440 = 2e-7
        assert!((omega / exact - 1.0).abs() < 1e-6, "{n}: {omega} {exact}");
    }
    let modes = modes(r#""elements": 100, "modes": 3"#);
    let mut row = ShapeRow::with_modes(3);
    for x in [0.0, 0.13, 0.5, 0.77, 1.0] {
        modes.shapes.at(x, &mut row);
        for n in 0..3 {
            let k = PI * (n as f64 + 1.0);
            // shapes err by (kh)⁴/384 between nodes, slopes and curvatures by more
            assert!((row.value[n] - (k * x).sin()).abs() < 1e-6, "{n} {x}");
            assert!((row.slope[n] - k * (k * x).cos()).abs() < 1e-4, "{n} {x}");
            assert!((row.curvature[n] + k * k * (k * x).sin()).abs() < 0.1, "{n} {x}");
        }
    }
    for mass in &modes.masses {
        assert!((mass - 0.5).abs() < 1e-6, "{mass}");
    }
}

#[test]
fn analytic_two_span_continuous_beam() {
    let found =
        omegas(r#""elements": 120, "modes": 4, "supports": [{"x": 0.0}, {"x": 0.5}, {"x": 1.0}]"#);
    let second = root(|b| b.sin() * b.cosh() - b.cos() * b.sinh(), 6.5, 7.5);
    // each field of ½ alone: odd modes as if pinned, even modes as if clamped in the middle
    for (omega, beta) in found.iter().zip([PI, clamped_pinned(), 2.0 * PI, second]) {
        let exact = (beta / 0.5).powi(2);
        assert!((omega / exact - 1.0).abs() < 1e-6, "{omega} {exact}");
    }
    assert!((clamped_pinned() - 3.926_602_312).abs() < 1e-9);
}

#[test]
fn analytic_cantilever_and_its_tip() {
    let extra = r#""elements": 100, "modes": 3, "supports": [{"x": 0.0, "clamped": true}]"#;
    let exact = |a, b| root(|x: f64| x.cos() * x.cosh() + 1.0, a, b).powi(2);
    for (omega, exact) in
        omegas(extra).iter().zip([exact(1.0, 3.0), exact(4.0, 6.0), exact(7.0, 9.0)])
    {
        assert!((omega / exact - 1.0).abs() < 1e-6, "{omega} {exact}");
    }
    // the tip moves most; modal mass of every mode is mL/4 for a tip of 1
    let modes = modes(extra);
    let mut row = ShapeRow::with_modes(3);
    modes.shapes.at(1.0, &mut row);
    for n in 0..3 {
        assert!((row.value[n].abs() - 1.0).abs() < 1e-14);
        assert!((modes.masses[n] - 0.25).abs() < 1e-6, "{}", modes.masses[n]);
    }
}

fn functions(z: f64) -> (f64, f64, f64, f64) {
    (z.sin(), z.cos(), z.sinh(), z.cosh())
}

/// Free beam on equal springs k (in EI/L³) at its ends: about the middle
/// w = A·cos βx + B·cosh βx or the same with sines, w″ = 0 and EI·w‴ = k·w at the end, z = βL/2.
#[test]
fn analytic_free_ends_on_springs() {
    for k in [1.0f64, 30.0, 1e4] {
        let extra = format!(
            r#""elements": 100, "modes": 4, "supports": [{{"x": 0.0, "stiffness": {k}}},
               {{"x": 1.0, "stiffness": {k}}}]"#
        );
        let found = omegas(&extra);
        let symmetric = |b: f64| {
            let (s, c, sh, ch) = functions(0.5 * b);
            b.powi(3) * (s * ch + c * sh) - 2.0 * k * c * ch
        };
        let antisymmetric = |b: f64| {
            let (s, c, sh, ch) = functions(0.5 * b);
            b.powi(3) * (s * ch - c * sh) - 2.0 * k * s * sh
        };
        for (n, omega) in found.iter().enumerate() {
            let b = omega.sqrt();
            let f: &dyn Fn(f64) -> f64 = if n % 2 == 0 { &symmetric } else { &antisymmetric };
            let exact = root(f, b * (1.0 - 1e-3), b * (1.0 + 1e-3)).powi(2);
            assert!((omega / exact - 1.0).abs() < 1e-6, "{k} {n}: {omega} {exact}");
        }
        // more than the rigid body would have: springs in series with the beam
        assert!(found[0] < (2.0 * k).sqrt());
    }
}

/// On soft springs the girder is a rigid body: ω² = 2k/m and 6k/m, less a correction that falls with
/// kL³/EI.
#[test]
fn analytic_soft_bearings_carry_a_rigid_body() {
    let error = |k: f64| {
        let found = omegas(&format!(
            r#""supports": [{{"x": 0.0, "stiffness": {k}}}, {{"x": 1.0, "stiffness": {k}}}]"#
        ));
        [1.0 - found[0].powi(2) / (2.0 * k), 1.0 - found[1].powi(2) / (6.0 * k)]
    };
    let (soft, softer) = (error(0.1), error(0.01));
    for (a, b) in soft.iter().zip(softer) {
        assert!(a.abs() < 2e-3 && (a / b - 10.0).abs() < 0.1, "{a} {b}");
    }
    // far softer than double precision can tell from the beam's stiffness
    let message =
        refused(r#""supports": [{"x": 0, "stiffness": 1e-9}, {"x": 1, "stiffness": 1e-9}]"#);
    assert!(message.contains("g.supports") && message.contains("double precision"), "{message}");
}

/// Timoshenko beam on pinned ends: with kₙ = nπ/L and the stiffnesses
/// (ρI·ω² − κGA − EI·k²)(ρA·ω² − κGA·k²) = (κGA·k)², two frequencies for each n. Between them lies
/// ω² = κGA/ρI, where only the cross-sections turn: it is left out.
#[test]
fn analytic_timoshenko_beam_on_pinned_ends() {
    let (shear, rotary) = (40.0f64, 0.02f64);
    let found = omegas(&format!(
        r#""elements": 60, "modes": 5, "shear_stiffness": {shear}, "rotary_inertia": {rotary}"#
    ));
    let mut exact: Vec<f64> = Vec::new();
    for n in 1..=5 {
        let k = PI * f64::from(n);
        let b = shear + k * k + rotary * shear * k * k;
        let root = (b * b - 4.0 * rotary * shear * k.powi(4)).sqrt();
        exact.extend([b - root, b + root].map(|b| (b / (2.0 * rotary)).sqrt()));
        // far below the beam that is rigid in shear
        assert!(exact[exact.len() - 2] < 0.9 * k * k);
    }
    exact.sort_by(f64::total_cmp);
    for (omega, exact) in found.iter().zip(&exact) {
        assert!((omega / exact - 1.0).abs() < 1e-6, "{omega} {exact}");
        assert!((omega / (shear / rotary).sqrt() - 1.0).abs() > 1e-3);
    }
    assert!(exact[4] > (shear / rotary).sqrt());
    let (stiff, rigid) = (omegas(r#""shear_stiffness": 1e9"#), omegas(r#""elements": 40"#));
    assert!((stiff[0] / rigid[0] - 1.0).abs() < 1e-7);
}

/// A row of simply supported spans on common piers: hinges over the supports.
#[test]
fn analytic_hinges_make_spans_of_their_own() {
    let found = omegas(
        r#""elements": 120, "modes": 4, "hinges": [0.5],
           "supports": [{"x": 0.0}, {"x": 0.5}, {"x": 1.0}]"#,
    );
    for (omega, order) in found.iter().zip([1.0, 1.0, 2.0, 2.0]) {
        let exact = (order * PI / 0.5f64).powi(2);
        assert!((omega / exact - 1.0).abs() < 1e-6, "{omega} {exact}");
    }
}

/// A rigid beam on a bearing and a pier at both ends is two masses in a row:
/// ω⁴·mM − ω²·(m(k+K) + Mk) + kK = 0, for half the beam.
#[test]
fn analytic_piers_are_masses_between_springs() {
    let (k, big_k, pier) = (1e-2f64, 3e-2f64, 0.7f64);
    let side = |x: f64| {
        format!(
            r#"{{"x": {x}, "stiffness": {k}, "pier": {{"mass": {pier}, "stiffness": {big_k}}}}}"#
        )
    };
    let found = omegas(&format!(r#""supports": [{}, {}], "modes": 4"#, side(0.0), side(1.0)));
    let m = 0.5f64;
    let (a, b, c) = (m * pier, m * (k + big_k) + pier * k, k * big_k);
    let exact = [-1.0, 1.0].map(|s| ((b + s * (b * b - 4.0 * a * c).sqrt()) / (2.0 * a)).sqrt());
    // heave of beam and piers; the beam bends by kL³/EI/100 of its motion
    assert!((found[0] / exact[0] - 1.0).abs() < 1e-3, "{} {exact:?}", found[0]);
    assert!(found.iter().any(|omega| (omega / exact[1] - 1.0).abs() < 1e-3), "{found:?} {exact:?}");
    // a rigid bearing: the pier's mass moves with the beam's end
    let rigid =
        |x: f64| format!(r#"{{"x": {x}, "pier": {{"mass": {pier}, "stiffness": {big_k}}}}}"#);
    let found = omegas(&format!(r#""supports": [{}, {}]"#, rigid(0.0), rigid(1.0)));
    assert!((found[0] / (big_k / (m + pier)).sqrt() - 1.0).abs() < 1e-3, "{found:?}");
}

#[test]
fn order_frequencies_converge_with_the_fourth_power_of_the_elements() {
    for (extra, exact) in [
        (r#""modes": 1"#, PI.powi(2)),
        (
            r#""modes": 1, "supports": [{"x": 0, "clamped": true}, {"x": 1}]"#,
            clamped_pinned().powi(2),
        ),
    ] {
        let error =
            |elements| omegas(&format!(r#""elements": {elements}, {extra}"#))[0] / exact - 1.0;
        let (coarse, fine) = (error(6), error(12));
        assert!((15.0..17.0).contains(&(coarse / fine)), "{extra}: {coarse} {fine}");
        // (βL/N)⁴/1440
        let estimate = (exact.sqrt() / 12.0).powi(4) / 1440.0;
        assert!((fine / estimate - 1.0).abs() < 0.1, "{fine} {estimate}");
    }
    let exact = {
        let (k, s, r) = (PI, 40.0f64, 0.02f64);
        let b = s + k * k + r * s * k * k;
        ((b - (b * b - 4.0 * r * s * k.powi(4)).sqrt()) / (2.0 * r)).sqrt()
    };
    let error = |elements| {
        let extra = r#""modes": 1, "shear_stiffness": 40.0, "rotary_inertia": 0.02"#;
        omegas(&format!(r#""elements": {elements}, {extra}"#))[0] / exact - 1.0
    };
    let ratio = error(6) / error(12);
    assert!((15.0..17.0).contains(&ratio), "{ratio}");
    assert!(error(12) < (PI / 12.0).powi(4) / 1440.0, "{}", error(12));
}

/// Section by section, ∫ρA·φᵢφⱼ + ΣMφᵢφⱼ vanishes for i ≠ j, and the masses are its diagonal.
#[test]
fn invariant_modes_are_orthogonal_with_sections_and_piers() {
    let modes = modes(
        r#""modes": 5, "elements": 60, "sections": [{"length": 0.3, "mass_per_length": 2.0},
           {"length": 0.7, "bending_stiffness": 3.0}],
           "supports": [{"x": 0.0, "stiffness": 500.0}, {"x": 0.45},
                        {"x": 1.0, "pier": {"mass": 0.4, "stiffness": 200.0}}]"#,
    );
    let mut row = ShapeRow::with_modes(5);
    let mut gram = [[0.0; 5]; 5];
    let mut add = |x: f64, mass: f64| {
        modes.shapes.at(x, &mut row);
        for (i, line) in gram.iter_mut().enumerate() {
            for (j, entry) in line.iter_mut().enumerate() {
                *entry += mass * row.value[i] * row.value[j];
            }
        }
    };
    let cells = 6000;
    for cell in 0..cells {
        for (point, weight) in crate::pole::gauss_legendre(4) {
            let x = (f64::from(cell) + 0.5 * (1.0 + point)) / f64::from(cells);
            add(x, 0.5 * weight / f64::from(cells) * if x < 0.3 { 2.0 } else { 1.0 });
        }
    }
    add(1.0, 0.4);
    for (i, row) in gram.iter().enumerate() {
        // the rule is exact up to rounding, but in cells that a node divides
        assert!((row[i] / modes.masses[i] - 1.0).abs() < 1e-9, "{i}");
        for (j, entry) in row.iter().enumerate().take(i) {
            let scale = (modes.masses[i] * modes.masses[j]).sqrt();
            assert!(entry.abs() < 1e-8 * scale, "{i} {j}: {}", entry / scale);
        }
    }
}

/// The damper at an end enters with the square of the shape there, and couples the modes.
#[test]
fn analytic_modal_damping_of_a_bearing() {
    let modes = modes(
        r#""modes": 2, "supports": [{"x": 0.0, "stiffness": 50.0, "damping": 0.3},
           {"x": 1.0, "stiffness": 50.0}]"#,
    );
    let mut row = ShapeRow::with_modes(2);
    modes.shapes.at(0.0, &mut row);
    for i in 0..2 {
        for j in 0..2 {
            let exact = 0.3 * row.value[i] * row.value[j];
            assert!((modes.damping[2 * i + j] - exact).abs() < 1e-15, "{i} {j}");
        }
    }
    assert!(modes.damping[1].abs() > 1e-3);
}

#[test]
fn refusal_bad_beams_are_named_with_a_remedy() {
    let ends = |x: &str| format!(r#""supports": [{{"x": 0}}, {{"x": 1{x}}}]"#);
    for (extra, path, part) in [
        (
            r#""supports": [{"x": 0}, {"x": 1.1}]"#.to_owned(),
            "g.supports[1].x",
            "not on the girder",
        ),
        (r#""supports": [{"x": 0.5}, {"x": 0.5}]"#.to_owned(), "g.supports[1].x", "order"),
        (ends(r#", "stiffness": -1e8"#), "g.supports[1].stiffness", "rigid bearing"),
        (ends(r#", "stiffness": 0"#), "g.supports[1].stiffness", "rigid bearing"),
        (ends(r#", "damping": 10"#), "g.supports[1].damping", "does not move"),
        (ends(r#", "stiffness": 1, "damping": -10"#), "g.supports[1].damping", "at least 0"),
        (
            ends(r#", "rotational_stiffness": -1"#),
            "g.supports[1].rotational_stiffness",
            "at least 0",
        ),
        (
            ends(r#", "clamped": true, "rotational_stiffness": 1"#),
            "g.supports[1].clamped",
            "remove",
        ),
        (ends(r#", "pier": {"mass": 0, "stiffness": 1}"#), "g.supports[1].pier.mass", "in series"),
        (ends(r#", "pier": {"mass": -2, "stiffness": 1}"#), "g.supports[1].pier.mass", "positive"),
        (
            ends(r#", "pier": {"mass": 2, "stiffness": 0}"#),
            "g.supports[1].pier.stiffness",
            "positive",
        ),
        (
            r#""supports": [{"x": 0, "name": "a"}, {"x": 1, "name": "a"}]"#.to_owned(),
            "g.supports[1].name",
            "again",
        ),
        (r#""supports": [{"x": 0.5}]"#.to_owned(), "g.supports", "mechanism"),
        (r#""supports": []"#.to_owned(), "g.supports", "mechanism"),
        (r#""hinges": [0.4]"#.to_owned(), "g.supports", "1 hinge"),
        (r#""hinges": [1.0]"#.to_owned(), "g.hinges[0]", "inside"),
        (
            r#""hinges": [0.5], "supports": [{"x": 0}, {"x": 0.5, "clamped": true}, {"x": 1}]"#
                .to_owned(),
            "g.hinges[0]",
            "rotat",
        ),
        (r#""elements": 12"#.to_owned(), "g.elements", "4 per mode"),
        (r#""elements": 200, "modes": 51"#.to_owned(), "g.modes", "at most 50"),
        (r#""shear_stiffness": 9.0, "modes": 26"#.to_owned(), "g.modes", "at most 25"),
        (r#""elements": 4000"#.to_owned(), "g.elements", "200"),
        (
            r#""sections": [{"length": 0.4}, {"length": 0.5}]"#.to_owned(),
            "g.sections",
            "0.9 m long",
        ),
        (
            r#""sections": [{"length": 1, "mass_per_length": 0}]"#.to_owned(),
            "g.sections[0].mass_per_length",
            "positive",
        ),
        (
            r#""sections": [{"length": 0.4, "bending_stiffness": -1}, {"length": 0.6}]"#.to_owned(),
            "g.sections[0].bending_stiffness",
            "positive",
        ),
        (r#""shear_stiffness": 0"#.to_owned(), "g.shear_stiffness", "positive"),
        (r#""rotary_inertia": -1"#.to_owned(), "g.rotary_inertia", "at least 0"),
        (r#""supports": [{"x": 0}, {"x": 0.0001}, {"x": 1}]"#.to_owned(), "g", "too close"),
    ] {
        let message = refused(&extra);
        assert!(message.contains(&format!("`{path}`")), "{extra}: {message}");
        assert!(message.contains(part), "{extra}: {message}");
    }
    assert!(positive(f64::NAN, "g", "length", "m").is_err());
}
