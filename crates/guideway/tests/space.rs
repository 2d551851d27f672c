//! Lateral bending, torsion and rails against closed forms, and their energy.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use std::f64::consts::PI;

use guideway::{
    GirderPart, Guideway, GuidewayDescription, Load, LoadChange, RailSurface, State, Workspace,
};

const LENGTH: f64 = 25.0;
const FORCE: f64 = 5e3;
const SPEED: f64 = 12.0;
const HALF_GAUGE: f64 = 0.95;
const HEIGHT: f64 = 1.2;
const DENSITY: f64 = 2780.8;
const INERTIA: f64 = 3776.0;
const BENDING: [f64; 2] = [1.864e10, 2.989e10];
const TORSION: f64 = 1.444e10;
const WARPING: f64 = 3e9;

/// A girder with five modes of each kind under one magnet on the given rail; `extra` goes into the girder.
fn build(side: &str, extra: &str) -> (Guideway, Workspace) {
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": {LENGTH}, "mass_per_length": {DENSITY}, "damping": [0.0],
              "modes": 5, "bending_stiffness": {}, "lateral": {{"modes": 5, "bending_stiffness": {}}},
              "torsion": {{"modes": 5, "torsional_stiffness": {TORSION}, "warping_stiffness": {WARPING},
                           "polar_inertia": {INERTIA}}} {extra}}}}},
            "spans": [{{"girder": "g"}}], "magnets": 1, "pole": {{"length": 0.0, "forces": 1}},
            "rails": {{"half_gauge": {HALF_GAUGE}, "height": {HEIGHT}, "sides": ["{side}"]}},
            "initial": "undeformed" }}"#,
        BENDING[0], BENDING[1]
    );
    of_text(&text)
}

fn of_text(text: &str) -> (Guideway, Workspace) {
    let g = Guideway::new(&GuidewayDescription::from_json(text).unwrap(), None).unwrap();
    let work = Workspace::new(&g);
    (g, work)
}

/// Amplitude of a component at x under a load that moves from 0, undamped: Frýba, *Vibration of Solids
/// and Structures under Moving Loads*, chapter 1. `square(k)` is ω² of wavenumber k, `inertia` per length.
fn closed_form(load: f64, inertia: f64, square: impl Fn(f64) -> f64, x: f64, t: f64) -> f64 {
    let term = |n: i32| {
        let k = f64::from(n) * PI / LENGTH;
        let (omega, drive) = (square(k).sqrt(), k * SPEED);
        2.0 * load / (inertia * LENGTH) * (k * x).sin() / (omega * omega - drive * drive)
            * ((drive * t).sin() - drive / omega * (omega * t).sin())
    };
    (1..=5).map(term).sum()
}

fn vertical(load: f64, x: f64, t: f64) -> f64 {
    closed_form(load, DENSITY, |k| BENDING[0] * k.powi(4) / DENSITY, x, t)
}

fn lateral(load: f64, x: f64, t: f64) -> f64 {
    closed_form(load, DENSITY, |k| BENDING[1] * k.powi(4) / DENSITY, x, t)
}

fn twist(torque: f64, x: f64, t: f64) -> f64 {
    let square = |k: f64| (WARPING * k.powi(4) + TORSION * k * k) / INERTIA;
    closed_form(torque, INERTIA, square, x, t)
}

fn moving(force: f64, lateral: f64, t: f64) -> [Load; 1] {
    [Load {
        force: [force, 0.0, 0.0, 0.0],
        position: [SPEED * t, SPEED, 0.0, 0.0],
        lateral: [lateral, 0.0, 0.0, 0.0],
        ..Load::default()
    }]
}

/// Steps the crossing, and compares middle and rail with the closed forms: largest errors of vertical
/// and lateral deflection and twist, each relative to its largest value.
fn cross(g: &Guideway, work: &mut Workspace, side: f64, force: f64, sideways: f64) {
    let mut state = g.initial_state(work, &moving(force, sideways, 0.0), SPEED, 0.0).unwrap();
    let (h, x) = (5e-3, 0.4 * LENGTH);
    let zeros = vec![0.0; state.q.len()];
    let torque = side * HALF_GAUGE * force - HEIGHT * sideways;
    let (mut worst, mut largest) = ([0.0f64; 5], [1e-300f64; 5]);
    for n in 0..400 {
        let t = f64::from(n) * h;
        g.step(work, &mut state, &moving(force, sideways, t), t, h).unwrap();
        let t = t + h;
        let found = g.section_motion(work, &state, &zeros, 0, x).map(|m| m.displacement);
        let rail = g.rail(work, &state, &zeros, 0, SPEED * t);
        let at = SPEED * t;
        let (z, y, theta) =
            (-vertical(force, at, t), -lateral(sideways, at, t), -twist(torque, at, t));
        let exact = [-vertical(force, x, t), -lateral(sideways, x, t), -twist(torque, x, t)];
        let exact = exact.into_iter().chain([z + side * HALF_GAUGE * theta, y - HEIGHT * theta]);
        let found = found.into_iter().chain([rail.vertical.u, rail.lateral.u]);
        for (k, (a, b)) in found.zip(exact).enumerate() {
            worst[k] = worst[k].max((a - b).abs());
            largest[k] = largest[k].max(b.abs());
        }
    }
    for k in 0..5 {
        // ω₅h = 5.8 of torsion: sub-steps keep πvh/L small, so the modal forces are cubics to 1e-10
        assert!(worst[k] <= 1e-9 * largest[k], "{k}: {:e} of {:e}", worst[k], largest[k]);
    }
}

#[test]
fn analytic_a_moving_torque_twists_a_fork_supported_girder() {
    // pure torque: a lateral force at a rail so far up that its bending does not count is not needed;
    // a vertical force at the rail has the torque b·F, and the twist is that of the torque alone
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let (g, mut work) = build(side, "");
        cross(&g, &mut work, sign, FORCE, 0.0);
    }
}

#[test]
fn analytic_a_moving_lateral_force_bends_and_twists() {
    let (g, mut work) = build("left", "");
    cross(&g, &mut work, 1.0, 0.0, FORCE);
}

#[test]
fn analytic_an_eccentric_oblique_force_splits_into_all_components() {
    let (g, mut work) = build("right", "");
    cross(&g, &mut work, -1.0, FORCE, -0.3 * FORCE);
    let frequencies = g.girders()[0].frequencies();
    let [first] = [g.girders()[0].part(GirderPart::Torsion).start];
    for n in 1..=5 {
        let k = f64::from(n) * PI / LENGTH;
        let exact = ((WARPING * k.powi(4) + TORSION * k * k) / INERTIA).sqrt() / (2.0 * PI);
        assert!((frequencies[first + n as usize - 1] / exact - 1.0).abs() < 1e-14);
    }
}

/// Beam elements with forks at both ends: as the closed forms of sines.
#[test]
fn analytic_beam_elements_of_a_fork_supported_girder_have_the_sines_frequencies() {
    let (sines, _) = build("left", "");
    let (beam, _) = build("left", r#", "elements": 60"#);
    for (a, b) in sines.girders()[0].frequencies().iter().zip(beam.girders()[0].frequencies()) {
        // (πn/60)⁴/1440 for n = 5: 3e-6, 1.6e-8 of cubics for second derivatives of torsion
        assert!((b / a - 1.0).abs() < 4e-6, "{a} {b}");
    }
}

/// Without warping stiffness the slope of the twist is free at every node, and frequencies are as exact.
#[test]
fn analytic_torsion_without_warping_by_elements() {
    let text = |warp: &str| {
        format!(
            r#"{{ "girders": {{"g": {{"length": {LENGTH}, "mass_per_length": 1, "bending_stiffness": 1e6,
              "damping": [0.0], "modes": 1, "elements": 40, "torsion": {{"modes": 5,
              "torsional_stiffness": {TORSION}, "polar_inertia": {INERTIA} {warp}}} }}}},
            "spans": [{{"girder": "g"}}], "magnets": 1, "rails": {{}} }}"#
        )
    };
    let (g, _) = of_text(&text(""));
    for (n, frequency) in g.girders()[0].frequencies()[1..].iter().enumerate() {
        let exact = (n + 1) as f64 / (2.0 * LENGTH) * (TORSION / INERTIA).sqrt();
        // cubics err with the sixth power of the length: 1.8e-8 for the fifth mode, 8 elements per half-wave
        assert!((frequency / exact - 1.0).abs() < 2e-8, "{n}: {frequency} {exact}");
    }
}

/// Root of a function between two places by bisection.
fn root(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    assert!(f(a) * f(b) < 0.0);
    for _ in 0..200 {
        let c = 0.5 * (a + b);
        if f(a) * f(c) <= 0.0 { b = c } else { a = c }
    }
    0.5 * (a + b)
}

#[test]
fn analytic_two_span_continuous_and_elastic_supports() {
    let (k, spring) = (4e8, 6e7);
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": {}, "mass_per_length": {DENSITY}, "bending_stiffness": {},
              "damping": [0.0], "modes": 4, "elements": 120,
              "lateral": {{"modes": 4, "bending_stiffness": {}}},
              "torsion": {{"modes": 3, "torsional_stiffness": {TORSION}, "polar_inertia": {INERTIA}}},
              "supports": [{{"x": 0, "torsional_stiffness": {k}}}, {{"x": {LENGTH}, "torsion_free": true}},
                           {{"x": {}, "torsional_stiffness": {k}}}] }},
            "h": {{"length": {LENGTH}, "mass_per_length": {DENSITY}, "bending_stiffness": {},
              "damping": [0.0], "modes": 1, "elements": 120, "lateral": {{"modes": 2, "bending_stiffness": {}}},
              "supports": [{{"x": 0, "lateral_stiffness": {spring}}},
                           {{"x": {LENGTH}, "lateral_stiffness": {spring}}}] }}}},
            "spans": [{{"girder": "g"}}, {{"girder": "h"}}], "magnets": 1, "rails": {{}} }}"#,
        2.0 * LENGTH,
        BENDING[0],
        BENDING[1],
        2.0 * LENGTH,
        BENDING[0],
        BENDING[1]
    );
    let (g, _) = of_text(&text);
    let girder = &g.girders()[0];
    // continuous over two equal fields: modes of a pinned field, and of one clamped at the inner support,
    // tan λ = tanh λ
    let clamped = root(3.6, 4.2, |x| x.tan() - x.tanh());
    let second = root(6.8, 7.3, |x| x.tan() - x.tanh());
    let lambdas = [PI, clamped, 2.0 * PI, second];
    for (part, stiffness) in [(GirderPart::Vertical, BENDING[0]), (GirderPart::Lateral, BENDING[1])]
    {
        for (frequency, lambda) in girder.frequencies()[girder.part(part)].iter().zip(lambdas) {
            let square = (lambda / LENGTH).powi(2);
            let exact = square * (stiffness / DENSITY).sqrt() / (2.0 * PI);
            // (π·4/120)⁴/1440 of the fourth mode: 8e-8
            assert!((frequency / exact - 1.0).abs() < 3e-7, "{part:?}: {frequency} {exact}");
        }
    }
    // twist of a bar of length 2L on springs at its ends: symmetric λ·tan(λL) = k/GJ, antisymmetric
    // λ·cot(λL) = −k/GJ
    let (l, ratio) = (LENGTH, k / TORSION);
    let symmetric = |x: f64| x * (x * l).sin() - ratio * (x * l).cos();
    let antisymmetric = |x: f64| x * (x * l).cos() + ratio * (x * l).sin();
    let roots = [
        root(1e-6, 0.5 * PI / l, symmetric),
        root(0.5 * PI / l, PI / l, antisymmetric),
        root(PI / l, 1.5 * PI / l, symmetric),
    ];
    for (frequency, lambda) in
        girder.frequencies()[girder.part(GirderPart::Torsion)].iter().zip(roots)
    {
        let exact = lambda * (TORSION / INERTIA).sqrt() / (2.0 * PI);
        assert!((frequency / exact - 1.0).abs() < 1e-9, "{frequency} {exact}");
    }
    // a beam on springs at both ends, halved: symmetric about the middle, half-length a, m = EIλ³/k:
    // w = A·cos λx + B·cosh λx, w″(a) = 0, EI·w‴(a) = k·w(a)
    let girder = &g.girders()[1];
    let a = 0.5 * LENGTH;
    let first = |x: f64| {
        let (c, ch) = ((x * a).cos(), (x * a).cosh());
        // B = A·cos/cosh
        let shear = BENDING[1] * x.powi(3) * ((x * a).sin() * ch + c * (x * a).sinh());
        shear - spring * (2.0 * c * ch)
    };
    let lambda = root(1e-3, PI / LENGTH, first);
    let exact = lambda * lambda * (BENDING[1] / DENSITY).sqrt() / (2.0 * PI);
    let frequency = girder.frequencies()[girder.part(GirderPart::Lateral).start];
    assert!((frequency / exact - 1.0).abs() < 1e-8, "{frequency} {exact}");
}

/// Fork-supported circular girder: with w = W·sin kx, θ = B·sin kx the strains are κ = −(k²W + B/R) and
/// τ = k(B + W/R), so each half-wave has two modes.
#[test]
fn analytic_circular_girder_couples_bending_and_torsion() {
    for radius in [50.0, -200.0] {
        let text = format!(
            r#"{{ "girders": {{"g": {{"length": {LENGTH}, "mass_per_length": {DENSITY}, "radius": {radius},
                "bending_stiffness": {}, "damping": [0.0], "modes": 6, "elements": 80,
                "torsion": {{"torsional_stiffness": {TORSION}, "warping_stiffness": {WARPING},
                             "polar_inertia": {INERTIA}}} }}}},
              "spans": [{{"girder": "g"}}], "magnets": 1, "pole": {{"length": 0.0, "forces": 1}},
              "rails": {{"sides": ["left"]}} }}"#,
            BENDING[0]
        );
        let (g, mut work) = of_text(&text);
        let mut exact = Vec::new();
        for n in 1..=6 {
            let k = f64::from(n) * PI / LENGTH;
            let (r, t) = (1.0 / radius, TORSION * k * k + WARPING * k.powi(4));
            let a = (BENDING[0] * k.powi(4) + t * r * r) / DENSITY;
            let c = (BENDING[0] * r * r + t) / INERTIA;
            let b = (BENDING[0] * k * k + t) * r / (DENSITY * INERTIA).sqrt();
            let (mean, half) = (0.5 * (a + c), (0.25 * (a - c).powi(2) + b * b).sqrt());
            exact.extend([(mean - half).sqrt() / (2.0 * PI), (mean + half).sqrt() / (2.0 * PI)]);
        }
        exact.sort_by(f64::total_cmp);
        for (frequency, exact) in g.girders()[0].frequencies().iter().zip(exact) {
            // (πn/80)⁴/1440 for n ≤ 4: 4e-7
            assert!((frequency / exact - 1.0).abs() < 5e-7, "{radius}: {frequency} {exact}");
        }
        // static: a load on the axis turns the girder outward, the left rail up in a curve to the left
        let loads = [Load::standing(FORCE, 0.5 * LENGTH)];
        let state = g.initial_state(&mut work, &loads, 0.0, 0.0).unwrap();
        let zeros = vec![0.0; 6];
        let [z, y, theta] = g.section_motion(&mut work, &state, &zeros, 0, 0.5 * LENGTH);
        assert!(z.displacement < 0.0 && y.displacement == 0.0);
        if radius < 0.0 {
            assert!(theta.displacement < 0.0, "{}", theta.displacement);
        }
    }
}

/// dE/dt = −F·u_t − H·y_t at the rail − dissipation, by Simpson's rule; tables whose modes bend, shift
/// and twist at once, lateral and torsional dampers, and the sines of analytic girders.
#[test]
fn invariant_power_at_the_rails_is_the_change_of_energy() {
    let x: Vec<f64> = (0..=20).map(|i| LENGTH * f64::from(i) / 20.0).collect();
    let sine = |a: f64, n: f64| -> Vec<f64> {
        x.iter().map(|x| a * (n * PI * x / LENGTH).sin()).collect()
    };
    let mixed = format!(
        r#"{{ "girders": {{"g": {{"length": {LENGTH}, "damping": [0.01], "frequencies": [6.5, 8.2, 30],
              "shapes": [
                {{"modal_mass": 35e3, "x": {x:?}, "phi": {:?}, "y": {:?}, "theta": {:?}}},
                {{"modal_mass": 35e3, "x": {x:?}, "phi": {:?}, "y": {:?}, "theta": {:?}}},
                {{"modal_mass": 50e3, "x": {x:?}, "phi": {:?}, "theta": {:?}}}] }}}},
            "spans": [{{"girder": "g"}}], "magnets": 1, "rails": {{"height": {HEIGHT}, "sides": ["right"]}} }}"#,
        sine(1.0, 1.0),
        sine(0.2, 1.0),
        sine(0.1, 1.0),
        sine(-0.2, 1.0),
        sine(1.0, 1.0),
        sine(0.3, 2.0),
        sine(0.05, 2.0),
        sine(1.0, 1.0)
    );
    let damped = format!(
        r#"{{ "girders": {{"g": {{"length": {LENGTH}, "mass_per_length": {DENSITY}, "bending_stiffness": 1.8e10,
              "damping": [0.01], "modes": 3, "lateral": {{"bending_stiffness": 3e10}},
              "torsion": {{"torsional_stiffness": {TORSION}, "polar_inertia": {INERTIA}}},
              "supports": [{{"x": 0, "stiffness": 1e9, "damping": 1e5, "lateral_stiffness": 3e8,
                             "lateral_damping": 1e5, "torsional_stiffness": 2e9, "torsional_damping": 3e5}},
                           {{"x": {LENGTH}}}] }}}},
            "spans": [{{"girder": "g"}}], "magnets": 1, "rails": {{"height": {HEIGHT}}} }}"#
    );
    for text in [mixed, damped] {
        let (g, mut work) = of_text(&text);
        let h = 0.5e-3;
        let load = |t: f64| {
            let force = [FORCE * (20.0 * t).cos(), -20.0 * FORCE * (20.0 * t).sin(), 0.0, 0.0];
            let lateral = [2e3, 1e3, 0.0, 0.0];
            let position = [2.0 + SPEED * t, SPEED, 0.0, 0.0];
            [Load { force, position, lateral, ..Load::default() }]
        };
        // constant slopes over a step, so that the values at its ends are continuous: sampled anew
        let value = |t: f64, tau: f64| {
            let l = load(t)[0];
            (l.force[0] + tau * l.force[1], l.lateral[0] + tau * l.lateral[1])
        };
        let mut state = g.initial_state(&mut work, &load(0.0), SPEED, 0.0).unwrap();
        let start = g.energy(&state);
        let zeros = vec![0.0; state.q.len()];
        let girder = &g.girders()[0];
        let power = |state: &State, t: f64, (force, lateral): (f64, f64), work: &mut Workspace| {
            let rail = g.rail(work, state, &zeros, 0, 2.0 + SPEED * t);
            let mut lost = 0.0;
            for (j, v) in state.v.iter().enumerate() {
                for (i, rate) in girder.damping_rates(j) {
                    lost -= g.modes()[i].mass * rate * v * state.v[i];
                }
            }
            -force * rail.vertical.u_t - lateral * rail.lateral.u_t - lost
        };
        let mut done = 0.0;
        for n in 0..1000 {
            let t = 2.0 * f64::from(n) * h;
            let mut p = [power(&state, t, value(t, 0.0), &mut work), 0.0, 0.0];
            for k in 0..2 {
                let tau = f64::from(k) * h;
                let mut now = load(t);
                now[0].force[0] += tau * now[0].force[1];
                now[0].lateral[0] += tau * now[0].lateral[1];
                now[0].position[0] += tau * SPEED;
                g.step(&mut work, &mut state, &now, t + tau, h).unwrap();
                p[k as usize + 1] = power(&state, t + tau + h, value(t, tau + h), &mut work);
            }
            done += h / 3.0 * (p[0] + 4.0 * p[1] + p[2]);
        }
        let energy = g.energy(&state) - start;
        // Simpson's rule on the third torsional mode, ωh = 0.4, some 1e-4 of the energy
        assert!((done - energy).abs() < 2e-6 * start.max(energy.abs()), "{done} {energy} {start}");
    }
}

/// The rail's derivatives are those of its displacement along the magnet's path, with irregularity.
#[test]
fn invariant_rail_derivatives_agree_with_differences() {
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": {LENGTH}, "mass_per_length": {DENSITY}, "damping": [0.01],
              "bending_stiffness": 1.8e10, "lateral": {{"bending_stiffness": 3e10}},
              "torsion": {{"torsional_stiffness": {TORSION}, "polar_inertia": {INERTIA}}}}}}},
            "spans": [{{"girder": "g", "count": 2}}], "magnets": 5,
            "rails": {{"height": {HEIGHT}, "irregularity": {{"on": true,
              "vertical": {{"psd": {{"form": "german-low"}}}},
              "lateral": {{"psd": {{"form": "german-low"}}, "coherence": {{"corner": 0.3}}}}}}}} }}"#
    );
    let (g, mut work) = of_text(&text);
    let modes = g.modes().len();
    let state = State {
        q: (0..modes).map(|i| 1e-3 * (i as f64).cos()).collect(),
        v: (0..modes).map(|i| 1e-2 * (1.7 * i as f64).sin()).collect(),
    };
    let a: Vec<f64> = (0..modes).map(|i| (0.4 * i as f64).cos()).collect();
    let (speed, acceleration, e) = (7.0, 0.5, 1e-4);
    for k in [0, 4] {
        for x in [3.0, 11.0, 24.9, 25.2, 40.0] {
            let at = |t: f64, work: &mut Workspace| -> RailSurface {
                let moved = State {
                    q: (0..modes).map(|i| state.q[i] + t * (state.v[i] + 0.5 * t * a[i])).collect(),
                    v: (0..modes).map(|i| state.v[i] + t * a[i]).collect(),
                };
                g.rail(work, &moved, &a, k, x + t * (speed + 0.5 * t * acceleration))
            };
            let (l, c, r) = (at(-e, &mut work), at(0.0, &mut work), at(e, &mut work));
            for of in [|s: &RailSurface| s.vertical, |s: &RailSurface| s.lateral] {
                let (l, c, r) = (of(&l), of(&c), of(&r));
                let rate = (r.displacement() - l.displacement()) / (2.0 * e);
                assert!((rate - c.rate(speed)).abs() < 1e-6, "{k} {x}: {rate} {}", c.rate(speed));
                if (x - LENGTH).abs() < 0.4 {
                    // a discrete force passes the joint: the slope steps
                    continue;
                }
                let rate = |s: &guideway::Surface, t: f64| s.rate(speed + t * acceleration);
                let found = (rate(&r, e) - rate(&l, -e)) / (2.0 * e);
                let exact = c.acceleration(speed, acceleration);
                assert!((found - exact).abs() < 1e-4, "{k} {x}: {found} {exact}");
            }
        }
    }
    // feed-through: accelerations change as the difference of two loads says
    let load = |d: f64| {
        let mut loads = vec![Load::standing(3e3, 12.0); 5];
        for (k, load) in loads.iter_mut().enumerate() {
            load.position[0] += 0.7 * k as f64 + if k == 4 { 1e-3 * d } else { 0.0 };
            load.lateral[0] = 500.0 + if k == 4 { 40.0 * d } else { 0.0 };
            load.force[0] += if k == 4 { 70.0 * d } else { 0.0 };
        }
        loads
    };
    let mut all = [vec![0.0; modes], vec![0.0; modes], vec![0.0; modes]];
    g.accelerations(&mut work, &state, &load(-0.01), 0.0, &mut all[0]);
    g.accelerations(&mut work, &state, &load(0.01), 0.0, &mut all[1]);
    let changes = (0..5).map(|k| match k {
        4 => LoadChange { force: 70.0, place: 1e-3, lateral: 40.0 },
        _ => LoadChange::default(),
    });
    g.acceleration_change(&mut work, &load(0.0), changes, &mut all[2]);
    for ((l, r), exact) in all[0].iter().zip(&all[1]).zip(&all[2]) {
        assert!(((r - l) / 0.02 - exact).abs() < 1e-7, "{l} {r} {exact}");
    }
}

/// Tables of sines with y and θ in modes of their own are the analytic girder, to the splines' accuracy.
#[test]
fn analytic_tables_of_a_finite_element_programme_are_the_girder_they_came_from() {
    let (sines, mut work) = build("left", "");
    let frequencies = sines.girders()[0].frequencies();
    let mut csv = String::from("x,y1,z1,theta1,y2,z2,theta2,y3,z3,theta3\n");
    for i in 0..=100 {
        let x = LENGTH * f64::from(i) / 100.0;
        let phi = (PI * x / LENGTH).sin();
        csv += &format!("{x},0,{phi},0,{phi},0,0,0,0,{phi}\n");
    }
    let mass = [DENSITY, DENSITY, INERTIA].map(|m| m * LENGTH / 2.0);
    let text = format!(
        r#"{{ "girders": {{"g": {{"length": {LENGTH}, "damping": [0.0], "shapes_file": "fe.csv",
              "frequencies": {:?}, "components": ["y", "z", "theta"], "modal_masses": {mass:?} }}}},
            "spans": [{{"girder": "g"}}], "magnets": 1, "pole": {{"length": 0.0, "forces": 1}},
            "rails": {{"half_gauge": {HALF_GAUGE}, "height": {HEIGHT}, "sides": ["left"]}},
            "initial": "static" }}"#,
        [frequencies[0], frequencies[5], frequencies[10]]
    );
    let mut description = GuidewayDescription::from_json(&text).unwrap();
    description.set_shapes("g", &csv).unwrap();
    let tables = Guideway::new(&description, None).unwrap();
    let mut load = Load::standing(FORCE, 9.0);
    load.lateral[0] = 1e3;
    let start = |g: &Guideway, work: &mut Workspace| {
        let mut state = g.initial_state(work, &[load], 0.0, 0.0).unwrap();
        for n in 0..50 {
            g.step(work, &mut state, &[load], 0.01 * f64::from(n), 0.01).unwrap();
        }
        state
    };
    let a = start(&tables, &mut Workspace::new(&tables));
    let b = start(&sines, &mut work);
    for (i, j) in [(0, 0), (1, 5), (2, 10)] {
        // the sines start undeformed and swing about the static state of the tables
        let still = tables.initial_state(&mut work_of(&tables), &[load], 0.0, 0.0).unwrap();
        assert!((a.q[i] - still.q[i]).abs() < 1e-12, "{i}");
        let omega = sines.modes()[j].omega;
        assert!(
            (b.q[j] - still.q[i] * (1.0 - (omega * 0.5).cos())).abs()
                < 1e-6 * still.q[i].abs() + 1e-12
        );
    }
}

fn work_of(g: &Guideway) -> Workspace {
    Workspace::new(g)
}

#[test]
fn analytic_kinks_and_steps_at_joints() {
    let (g, mut work) = build("left", "");
    let loads = [Load::standing(FORCE, 0.5 * LENGTH)];
    let mut state = g.initial_state(&mut work, &loads, 0.0, 0.0).unwrap();
    (state.q[0], state.q[5], state.q[10]) = (-2e-3, 1e-3, 3e-4);
    let (first, last) = (g.joint(&mut work, &state, 0), g.joint(&mut work, &state, 1));
    let slope = PI / LENGTH;
    for (joint, sign) in [(first, 1.0), (last, 1.0)] {
        // both ends fall toward the middle: a kink downward at the start, and again at the end
        assert!((joint.kink - sign * -2e-3 * slope).abs() < 1e-15, "{joint:?}");
        assert!((joint.lateral_kink - (1e-3 - HEIGHT * 3e-4) * slope).abs() < 1e-15, "{joint:?}");
        assert!(joint.step.abs() < 1e-15 && joint.twist_step.abs() < 1e-15, "{joint:?}");
    }
}
