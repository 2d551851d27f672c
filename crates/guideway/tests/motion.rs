//! Stepping and what magnets see: exactness for standing loads, joints, chirp, derivatives.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use std::f64::consts::PI;

use guideway::{Guideway, GuidewayDescription, Load, State, Surface, Workspace};
use proptest::prelude::*;

fn build(magnets: usize, extra: &str) -> (Guideway, Workspace) {
    let text = format!(
        r#"{{ "girders": {{
              "long": {{"length": 25.0, "modes": 3, "mass_per_length": 2780.8,
                        "frequencies": [7.1, 24.9], "damping": [0.0108, 0.0241]}},
              "short": {{"length": 20.0, "modes": 2, "mass_per_length": 2500.0,
                        "frequencies": [9.0], "damping": [0.0]}} }},
            "start": 5.0,
            "spans": [{{"girder": "long"}}, {{"girder": "short"}}, {{"girder": "long"}}],
            "magnets": {magnets} {extra} }}"#
    );
    let mut description = GuidewayDescription::from_json(&text).unwrap();
    // critical and above: no layout has it, but parameters may
    description.girders.get_mut("short").unwrap().damping = vec![1.0, 1.5];
    let g = Guideway::new(&description, None).unwrap();
    let work = Workspace::new(&g);
    (g, work)
}

fn at_rest(g: &Guideway) -> State {
    let zeros = vec![0.0; g.modes().len()];
    State { q: zeros.clone(), v: zeros }
}

/// A polynomial re-expanded about τ.
fn shifted(u: [f64; 4], tau: f64) -> [f64; 4] {
    [
        u[0] + tau * (u[1] + tau * (u[2] / 2.0 + tau * u[3] / 6.0)),
        u[1] + tau * (u[2] + tau * u[3] / 2.0),
        u[2] + tau * u[3],
        u[3],
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Claim: for standing loads with cubic forces a step of any size is exact; hence cutting it
    /// anywhere changes nothing but rounding. A sample-and-hold or low-order scheme fails.
    #[test]
    fn invariant_standing_loads_may_be_stepped_in_any_pieces(
        forces in prop::collection::vec(prop::array::uniform4(-1e4f64..1e4), 3),
        places in prop::collection::vec(0.0f64..80.0, 3),
        h in 1e-4f64..0.5,
        cut in 0.05f64..0.95,
    ) {
        let (g, mut work) = build(3, "");
        let loads = |tau: f64| -> Vec<Load> {
            forces.iter().zip(&places).map(|(f, &x)| Load {
                force: shifted(*f, tau), position: [x, 0.0, 0.0, 0.0], ..Load::default() }).collect()
        };
        let mut whole = g.initial_state(&mut work, &loads(0.0), 0.0, 0.0).unwrap();
        let mut parts = whole.clone();
        g.step(&mut work, &mut whole, &loads(0.0), 0.0, h).unwrap();
        g.step(&mut work, &mut parts, &loads(0.0), 0.0, cut * h).unwrap();
        g.step(&mut work, &mut parts, &loads(cut * h), cut * h, h - cut * h).unwrap();
        for (i, mode) in g.modes().iter().enumerate() {
            // 3 loads of 1e4 with their derivatives over ≤ 0.5 s, against the mode's stiffness;
            // rounding is amplified by ωh ≤ 330 turns of the exponential's squarings.
            let scale = 6e4 / mode.stiffness();
            prop_assert!((whole.q[i] - parts.q[i]).abs() < 1e-12 * scale);
            prop_assert!((whole.v[i] - parts.v[i]).abs() < 1e-12 * scale * mode.omega.max(1.0 / h));
        }
    }

    /// Claim: the surface's derivatives are those of the displacement itself.
    #[test]
    fn invariant_surface_derivatives_agree_with_differences(
        q in prop::collection::vec(-1e-3f64..1e-3, 8),
        v in prop::collection::vec(-1e-2f64..1e-2, 8),
        x in 6.0f64..29.0,
        speed in -20.0f64..20.0,
        acceleration in -2.0f64..2.0,
    ) {
        let (g, mut work) = build(1, r#", "irregularity": {"on": true, "averaged": true}"#);
        let state = State { q, v };
        let e = 1e-4;
        // Follow the magnet along x(t) = x + v·t + a·t²/2 for ±e with the modes' Taylor motion.
        let loads = [Load::standing(3e3, x)];
        let mut a = vec![0.0; 8];
        g.accelerations(&mut work, &state, &loads, 0.0, &mut a);
        let at = |t: f64, work: &mut Workspace| -> f64 {
            let moved = State {
                q: (0..8).map(|i| state.q[i] + t * (state.v[i] + 0.5 * t * a[i])).collect(),
                v: state.v.clone(),
            };
            g.surface(work, &moved, &a, x + t * (speed + 0.5 * t * acceleration)).displacement()
        };
        let (l, c, r) = (at(-e, &mut work), at(0.0, &mut work), at(e, &mut work));
        let s: Surface = g.surface(&mut work, &state, &a, x);
        // Third derivatives v³·w_xxx ≤ 8e3·0.5·1e-2…, times e²/6; fourth times e²/12; rounding
        // of displacements of 1e-2 m: 1e-18/e and 4e-18/e².
        prop_assert!(((r - l) / (2.0 * e) - s.rate(speed)).abs() < 1e-5);
        prop_assert!(
            ((r - 2.0 * c + l) / (e * e) - s.acceleration(speed, acceleration)).abs() < 2e-3
        );
        let (l, r) = (g.surface(&mut work, &state, &a, x - e), g.surface(&mut work, &state, &a, x + e));
        prop_assert!(((r.displacement() - l.displacement()) / (2.0 * e) - s.slope()).abs() < 1e-8);
        prop_assert!(((r.rate(speed) - l.rate(speed)) / (2.0 * e) - s.rate_slope(speed)).abs() < 1e-5);
    }
}

#[test]
fn invariant_loads_act_only_on_the_span_they_stand_on() {
    let (g, mut work) = build(1, "");
    let state = |x, work: &mut Workspace| {
        g.initial_state(work, &[Load::standing(1e4, x)], 0.0, 0.0).unwrap().q
    };
    let loaded = |q: &[f64]| [&q[..3], &q[3..5], &q[5..]].map(|m| m.iter().any(|q| *q != 0.0));
    for (x, expected) in [
        (4.0, [false, false, false]),
        (5.2, [true, false, false]),
        (29.0, [true, false, false]),
        (30.1, [true, true, false]),
        (49.9, [false, true, true]),
        (75.1, [false, false, true]),
        (75.4, [false, false, false]),
        (1e9, [false, false, false]),
        (-1e9, [false, false, false]),
    ] {
        assert_eq!(loaded(&state(x, &mut work)), expected, "{x}");
    }
}

#[test]
fn invariant_poles_across_joints_agree_with_single_forces() {
    // A pole as one magnet, or its eight points as eight magnets with their shares.
    let (g, mut work) = build(1, "");
    let (single, mut single_work) = build(8, r#", "pole": {"length": 0.0, "forces": 1}"#);
    for x in [5.0, 17.0, 29.8, 30.0, 30.3, 50.1, 75.0] {
        let whole = g.initial_state(&mut work, &[Load::standing(1e4, x)], 0.0, 0.0).unwrap();
        let points: Vec<Load> = g
            .pole()
            .points()
            .iter()
            .map(|&(offset, share)| Load::standing(1e4 * share, x + offset))
            .collect();
        let parts = single.initial_state(&mut single_work, &points, 0.0, 0.0).unwrap();
        for (a, b) in whole.q.iter().zip(&parts.q) {
            // 1e4 N over the softest mode's 7e7 N/m, times rounding of some terms.
            assert!((a - b).abs() < 1e-15 * 1.5e-4 * 20.0, "{x}: {a} {b}");
        }
    }
}

#[test]
fn invariant_displacement_is_continuous_over_joints() {
    let (g, mut work) = build(1, "");
    let state = State { q: vec![1e-3; 8], v: vec![1e-2; 8] };
    let zeros = vec![0.0; 8];
    let mut before = g.surface(&mut work, &state, &zeros, 3.0);
    for i in 1..74_000 {
        let s = g.surface(&mut work, &state, &zeros, 3.0 + 1e-3 * f64::from(i));
        // Slope ≤ 6 modes' q·nπ/L = 1e-3·(1+2+3)·0.126 = 7.6e-4: 7.6e-7 m per mm.
        assert!((s.u - before.u).abs() < 8e-7 && (s.u_t - before.u_t).abs() < 8e-6, "{i}");
        before = s;
    }
}

#[test]
fn invariant_quasi_static_start_hardly_rings() {
    // A train of loads on the span at 5 km/h: started at rest the girder rings with
    // q̇/ω = (v·π/L)/ω of the deflection; started with the rate of rolling loads it does not.
    let ring = |initial: &str| {
        let (g, mut work) = build(1, &format!(r#", "initial": "{initial}""#));
        let speed = 5.0 / 3.6;
        let load = |t: f64| {
            [Load {
                force: [3e5, 0.0, 0.0, 0.0],
                position: [10.0 + speed * t, speed, 0.0, 0.0],
                ..Load::default()
            }]
        };
        let mut state = g.initial_state(&mut work, &load(0.0), speed, 0.0).unwrap();
        let mut worst: f64 = 0.0;
        for n in 0..200 {
            let t = f64::from(n) * 1e-3;
            g.step(&mut work, &mut state, &load(t), t, 1e-3).unwrap();
            let quiet = g.initial_state(&mut work, &load(t + 1e-3), speed, 0.0).unwrap();
            worst = worst.max((state.q[0] - quiet.q[0]).abs() / quiet.q[0].abs());
        }
        worst
    };
    let (at_rest, rolling) = (ring("static"), ring("quasi-static"));
    // cot(π·5/25)·(π/L)·v/ω = 1.38·0.126·1.39/44.6 = 5.4e-3 of the deflection when at rest.
    assert!((4e-3..6e-3).contains(&at_rest), "{at_rest}");
    // Rolling: lag 2ζ/ω·q̇ = 1.2e-4, and ringing of the same size about it.
    assert!(rolling < 3e-4, "{rolling}");
}

#[test]
fn analytic_chirp_response_agrees_with_a_fine_integration() {
    let extra = r#", "chirp": {"on": true, "amplitude": 2000.0, "position": 11.25, "start": 0.5,
        "end_frequency": 30.0}"#;
    let (g, mut work) = build(1, extra);
    let loads = [Load::standing(0.0, 11.25)];
    let run = |h: f64, steps: u32, work: &mut Workspace| {
        let mut state = at_rest(&g);
        for n in 0..steps {
            g.step(work, &mut state, &loads, f64::from(n) * h, h).unwrap();
        }
        state
    };
    let a = run(1e-3, 26_000, &mut work);
    let b = run(0.1, 260, &mut work);
    // Classical Runge-Kutta on the first mode, 0.1 ms: (ωh)⁴/120·ωT ≈ 3e-12·1200 relative.
    let mode = g.modes()[0];
    let phi = (PI * 6.25 / 25.0).sin();
    let f = |t: f64, q: f64, v: f64| {
        let s = t - 0.5;
        let p = if s > 0.0 && s < 30.0 { -2000.0 * phi * (PI * s * s).sin() } else { 0.0 };
        (p - mode.damping() * v - mode.stiffness() * q) / mode.mass
    };
    let (mut q, mut v, h) = (0.0, 0.0, 1e-4);
    for n in 0..260_000 {
        let t = f64::from(n) * h;
        let (k1, l1) = (v, f(t, q, v));
        let (k2, l2) = (v + h / 2.0 * l1, f(t + h / 2.0, q + h / 2.0 * k1, v + h / 2.0 * l1));
        let (k3, l3) = (v + h / 2.0 * l2, f(t + h / 2.0, q + h / 2.0 * k2, v + h / 2.0 * l2));
        let (k4, l4) = (v + h * l3, f(t + h, q + h * k3, v + h * l3));
        q += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
        v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
    }
    let scale = 2000.0 / mode.stiffness();
    // 1 ms steps: quadrature of order 8 at 0.19 rad, kinks at start and end of the chirp of
    // (2π·30·A)·h²/… ≤ 1e-6 of the impulse; 100 ms steps: 2.3e-6 of the force.
    assert!((a.q[0] - q).abs() < 2e-6 * scale, "{} {q}", a.q[0]);
    assert!((b.q[0] - q).abs() < 2e-5 * scale, "{} {q}", b.q[0]);
}

/// The chirp's frequency in Hz is the time in s: mode 1 rings most just after 7.1 s, and mode 2,
/// which has a node at mid-span, only when the force stands off the centre.
#[test]
fn analytic_chirp_excites_each_mode_at_its_frequency() {
    let peak = |position: f64, mode: usize| {
        let extra =
            format!(r#", "chirp": {{"on": true, "amplitude": 1000.0, "position": {position:?}}}"#);
        let (g, mut work) = build(1, &extra);
        let mut state = at_rest(&g);
        let loads = [Load::standing(0.0, 17.5)];
        let mut best = (0.0, 0.0);
        for n in 0..30_000 {
            let t = f64::from(n) * 1e-3;
            g.step(&mut work, &mut state, &loads, t, 1e-3).unwrap();
            if state.q[mode].abs() > best.1 {
                best = (t, state.q[mode].abs());
            }
        }
        best
    };
    // Resonance is passed in 1/√(1 Hz/s) ≈ 1 s or less; the largest swing follows within it.
    let (t, _) = peak(17.5, 0);
    assert!((7.1..8.1).contains(&t), "{t}");
    let (t, at_quarter) = peak(11.25, 1);
    assert!((24.9..25.9).contains(&t), "{t}");
    // sin(2π·½) in rounding is 1e-16 of the force.
    assert!(peak(17.5, 1).1 < 1e-12 * at_quarter);
}

#[test]
fn analytic_tabulated_sine_shapes_agree_with_the_sine() {
    let x: Vec<f64> = (0..=100).map(|i| 0.25 * f64::from(i)).collect();
    let shapes: Vec<String> = [1.0, 2.0]
        .iter()
        .map(|n| {
            let phi: Vec<f64> = x.iter().map(|x| (n * PI * x / 25.0).sin()).collect();
            // sin(nπ) is 1e-16, well within what counts as zero.
            format!(r#"{{"modal_mass": 34760.0, "x": {x:?}, "phi": {phi:?}}}"#)
        })
        .collect();
    let text = |shapes: &str| {
        format!(
            r#"{{"girders": {{"g": {{"length": 25.0, "modes": 2, "mass_per_length": 2780.8,
                "frequencies": [7.1, 24.9], "damping": [0.01] {shapes}}}}},
               "spans": [{{"girder": "g", "count": 2}}], "magnets": 1}}"#
        )
    };
    let build =
        |text: &str| Guideway::new(&GuidewayDescription::from_json(text).unwrap(), None).unwrap();
    let sine = build(&text(""));
    let table = build(&text(&format!(r#", "shapes": [{}]"#, shapes.join(", "))));
    let (mut w1, mut w2) = (Workspace::new(&sine), Workspace::new(&table));
    let load = |t: f64| {
        [Load {
            force: [1e4, 0.0, 0.0, 0.0],
            position: [5.0 + 10.0 * t, 10.0, 0.0, 0.0],
            ..Load::default()
        }]
    };
    let (mut a, mut b) = (at_rest(&sine), at_rest(&table));
    for n in 0..300 {
        let t = f64::from(n) * 0.01;
        sine.step(&mut w1, &mut a, &load(t), t, 0.01).unwrap();
        table.step(&mut w2, &mut b, &load(t), t, 0.01).unwrap();
    }
    for (i, mode) in sine.modes().iter().enumerate() {
        // Spline error 5/384·(2π/25·0.25)⁴ = 2e-7 of the force; resonance amplifies by < 10.
        let tolerance = 2e-6 * 1e4 / mode.stiffness();
        assert!((a.q[i] - b.q[i]).abs() < tolerance, "{i}: {} {}", a.q[i], b.q[i]);
    }
}

#[test]
fn invariant_bad_steps_and_loads_are_refused() {
    let (g, mut work) = build(2, "");
    let mut state = at_rest(&g);
    let good = [Load::standing(0.0, 0.0); 2];
    for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let m = g.step(&mut work, &mut state, &good, 3.0, step).unwrap_err().to_string();
        assert!(m.contains("t = 3") && m.contains("step"), "{m}");
    }
    let bad = [good[0], Load::standing(f64::NAN, 0.0)];
    let m = g.step(&mut work, &mut state, &bad, 3.0, 0.1).unwrap_err().to_string();
    assert!(m.contains("force of magnet 2"), "{m}");
    let fast = [Load { force: [0.0; 4], position: [0.0, 1e12, 0.0, 0.0], ..Load::default() }; 2];
    let m = g.step(&mut work, &mut state, &fast, 3.0, 0.1).unwrap_err().to_string();
    assert!(m.contains("sub-steps"), "{m}");
    assert_eq!(state, at_rest(&g));
}

#[test]
fn invariant_bad_descriptions_are_refused_by_path() {
    let text = r#"{"girders": {"g": {"length": 25.0, "modes": 2, "mass_per_length": 2780.8,
            "frequencies": [7.1, 24.9], "damping": [0.01]}},
            "spans": [{"girder": "g"}], "magnets": 1}"#;
    let good = GuidewayDescription::from_json(text).unwrap();
    let refused = |change: &dyn Fn(&mut GuidewayDescription), needle: &str| {
        let mut d = good.clone();
        change(&mut d);
        let message = Guideway::new(&d, None).unwrap_err().to_string();
        assert!(message.contains(needle), "{needle}: {message}");
    };
    let girder = |change: &dyn Fn(&mut guideway::description::GirderDescription), needle: &str| {
        refused(&|d| change(d.girders.get_mut("g").unwrap()), needle);
    };
    refused(&|d| d.magnets = 0, "magnets");
    refused(&|d| d.spans[0].girder = "h".into(), "spans[0].girder");
    refused(&|d| d.spans[0].count = 0, "spans");
    refused(&|d| d.start = f64::NAN, "start");
    refused(&|d| d.pole.forces = 0, "pole.forces");
    refused(&|d| d.pole.length = -1.0, "pole.length");
    refused(&|d| d.mass_factor = 0.0, "mass_factor");
    refused(
        &|d| {
            d.irregularity.on = {
                d.irregularity.file = Some("x".into());
                true
            }
        },
        "file",
    );
    refused(
        &|d| {
            d.chirp.on = {
                d.chirp.start = f64::NAN;
                true
            }
        },
        "chirp.start",
    );
    girder(&|g| g.length = 0.0, "girders.g.length");
    girder(&|g| g.modes = Some(0), "girders.g.modes");
    girder(&|g| g.mass_per_length = None, "girders.g.mass_per_length");
    girder(&|g| g.frequencies[1] = -1.0, "girders.g.frequencies[1]");
    girder(&|g| g.frequencies.clear(), "girders.g.frequencies");
    girder(&|g| g.frequencies[0] = 0.0, "initial");
    girder(&|g| g.damping.clear(), "girders.g.damping");
    girder(&|g| g.damping[0] = f64::NAN, "girders.g.damping[0]");
    girder(&|g| g.shapes = Some(vec![]), "girders.g.shapes");
    let table = |x: &[f64], phi: &[f64]| {
        let shape = guideway::description::TabulatedShape {
            modal_mass: 1.0,
            x: x.to_vec(),
            phi: phi.to_vec(),
            ..Default::default()
        };
        vec![shape.clone(), shape]
    };
    girder(&|g| g.shapes = Some(table(&[0.0, 24.0], &[0.0, 0.0])), "shapes[0].x");
    girder(&|g| g.shapes = Some(table(&[0.0, 9.0, 25.0], &[0.1, 1.0, 0.0])), "shapes[0].phi");
}
