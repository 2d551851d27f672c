//! The girder of the paper (table 3): modal data, statics, free decay, the two-car train.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use std::f64::consts::{PI, TAU};

use guideway::{Guideway, GuidewayDescription, Load, State, Workspace};

/// Table 3 with its unit weight of 22,000 N/m³: 22,000·1.24/9.81 kg/m.
const DENSITY: f64 = 22_000.0 * 1.24 / 9.81;

fn table_3(modes: usize, spans: usize, magnets: usize, extra: &str) -> GuidewayDescription {
    let text = format!(
        r#"{{ "girders": {{"table 3": {{"length": 25.0, "modes": {modes},
              "mass_per_length": {DENSITY:?}, "frequencies": [7.1, 24.9],
              "damping": [0.0108, 0.0241]}}}},
            "spans": [{{"girder": "table 3", "count": {spans}}}], "magnets": {magnets} {extra} }}"#
    );
    GuidewayDescription::from_json(&text).unwrap()
}

fn build(description: &GuidewayDescription) -> (Guideway, Workspace) {
    let g = Guideway::new(description, None).unwrap();
    let work = Workspace::new(&g);
    (g, work)
}

#[test]
fn analytic_modal_masses_and_stiffnesses_of_table_3() {
    let (g, _) = build(&table_3(2, 3, 64, ""));
    assert_eq!((g.modes().len(), g.spans().len(), g.track()), (6, 3, (0.0, 75.0)));
    for (i, mode) in g.modes().iter().enumerate() {
        let (f, zeta) = [(7.1, 0.0108), (24.9, 0.0241)][i % 2];
        // m·L/2 = 34.76 t (to the digits given).
        assert!((mode.mass - 34_760.0).abs() < 5.0, "{}", mode.mass);
        assert!((mode.frequency() / f - 1.0).abs() < 1e-15 && mode.zeta == zeta);
        let k = mode.mass * (TAU * f).powi(2);
        assert!((mode.stiffness() / k - 1.0).abs() < 1e-15);
    }
}

#[test]
fn analytic_factors_shift_frequencies_and_keep_damping_ratios() {
    let mut d = table_3(2, 1, 1, "");
    (d.stiffness_factor, d.mass_factor) = (0.5, 2.0);
    let (g, _) = build(&d);
    assert!((g.modes()[0].frequency() - 7.1 / 2.0).abs() < 1e-14);
    assert_eq!((g.modes()[1].mass, g.modes()[1].zeta), (DENSITY * 25.0, 0.0241));
}

#[test]
fn analytic_modes_beyond_the_list_follow_n_squared_or_bending_stiffness() {
    let mut d = table_3(4, 1, 1, "");
    assert!((build(&d).0.modes()[3].frequency() - 16.0 * 7.1).abs() < 1e-12);
    d.girders.get_mut("table 3").unwrap().bending_stiffness = Some(28_825e6 * 0.64673);
    let expected = PI / 2.0 * 16.0 / 625.0 * (28_825e6 * 0.64673 / DENSITY).sqrt();
    assert!((build(&d).0.modes()[3].frequency() / expected - 1.0).abs() < 1e-14);
    // Neither of the table's two inertias gives its 7.1 Hz with this mass: I = 0.64673 m⁴ gives 6.5 Hz,
    // 1.037 m⁴ gives 8.2 Hz.
    let first = expected / 16.0;
    assert!((first - 6.5).abs() < 0.05, "{first}");
    let second = first * (1.037_f64 / 0.64673).sqrt();
    assert!((second - 8.2).abs() < 0.05, "{second}");
}

/// Frequency and damping read back from the decaying mid-span motion of one mode.
#[test]
fn analytic_free_decay_shows_imposed_frequency_and_damping() {
    let (g, mut work) = build(&table_3(2, 1, 1, ""));
    for (n, f, zeta) in [(0, 7.1, 0.0108), (1, 24.9, 0.0241)] {
        let mut state = State { q: vec![0.0; 2], v: vec![0.0; 2] };
        state.q[n] = 1e-3;
        let loads = [Load::standing(0.0, 12.5)];
        let h = 0.7e-3;
        // Upward zero crossings of q by linear interpolation, and q̇ there: the ratio of rates over
        // a number of periods is the logarithmic decrement.
        let (mut crossings, mut before) = (Vec::new(), (state.q[n], state.v[n]));
        for k in 0..2000 {
            g.step(&mut work, &mut state, &loads, f64::from(k) * h, h).unwrap();
            let now = (state.q[n], state.v[n]);
            if before.0 < 0.0 && now.0 >= 0.0 {
                let s = before.0 / (before.0 - now.0);
                crossings.push((h * (f64::from(k) + s), before.1 + s * (now.1 - before.1)));
            }
            before = now;
        }
        let (first, last) = (crossings[0], crossings[crossings.len() - 1]);
        let periods = (crossings.len() - 1) as f64;
        let damped = periods / (last.0 - first.0);
        let decrement = (first.1 / last.1).ln() / (TAU * periods);
        let ratio = decrement / (1.0 + decrement * decrement).sqrt();
        let frequency = damped / (1.0 - ratio * ratio).sqrt();
        // Linear interpolation near a zero errs by (ωh)³/15 of ω⁻¹ ≤ 9e-5/ω in time at each end,
        // and by (ωh)²/8 ≤ 1.5e-3 of the rate; over ≥ 9 periods: 3e-6 in f, 2.7e-5 in ζ.
        assert!((frequency / f - 1.0).abs() < 4e-6, "{frequency}");
        assert!((ratio - zeta).abs() < 3e-5, "{ratio}");
        // The other mode stays at rest.
        assert_eq!((state.q[1 - n], state.v[1 - n]), (0.0, 0.0));
    }
}

#[test]
fn order_static_deflection_converges_to_the_textbook_value() {
    // P·L³/48EI for a force at mid-span; the sum over odd modes up to N misses
    // 2PL³/(π⁴EI)·Σ_{n>N, odd} n⁻⁴ ≈ 2PL³/(π⁴EI)/(6N³).
    let stiffness = 28_825e6 * 0.64673;
    let exact = 1e5 * 25f64.powi(3) / (48.0 * stiffness);
    let error = |modes| {
        let mut d = table_3(modes, 1, 1, r#", "pole": {"length": 0.0, "forces": 1}"#);
        let girder = d.girders.get_mut("table 3").unwrap();
        (girder.frequencies, girder.bending_stiffness) = (vec![], Some(stiffness));
        let (g, mut work) = build(&d);
        let loads = [Load::standing(1e5, 12.5)];
        let state = g.initial_state(&mut work, &loads, 0.0, 0.0).unwrap();
        let mut a = vec![0.0; modes];
        g.accelerations(&mut work, &state, &loads, 0.0, &mut a);
        let mid = g.mid_span(&mut work, &state, &a, 0);
        // Static: at rest, and no acceleration but rounding of terms of 2π²·f²·q.
        assert!(mid.velocity == 0.0 && mid.acceleration.abs() < 1e-9);
        (exact + mid.displacement) / exact
    };
    for modes in [9, 19, 39] {
        // Sum from the next odd number on, by the midpoint rule: 1/(6(N+1)³), N odd.
        let missing = 96.0 / PI.powi(4) / (6.0 * (modes as f64 + 1.0).powi(3));
        let e = error(modes);
        assert!((e / missing - 1.0).abs() < 0.05, "{modes}: {e:e} {missing:e}");
    }
}

/// 64 magnets of the two-car train as the paper's vehicle has them: 4 per side frame at 0.7 m,
/// bogies at 3 m, cars' centres 12.3 m apart; both sides load the same girder.
fn train(centre: f64, force: f64, speed: f64) -> Vec<Load> {
    let mut loads = Vec::new();
    for car in [6.15, -6.15] {
        for bogie in [4.5, 1.5, -1.5, -4.5] {
            for _side in 0..2 {
                for magnet in [1.05, 0.35, -0.35, -1.05] {
                    let x = centre + car + bogie + magnet;
                    loads.push(Load {
                        force: [force, 0.0, 0.0, 0.0],
                        position: [x, speed, 0.0, 0.0],
                        ..Load::default()
                    });
                }
            }
        }
    }
    loads
}

#[test]
fn analytic_train_of_table_1_deflects_the_first_mode_by_3_5_mm() {
    let force = 38_000.0 * 9.81 / 64.0;
    let (g, mut work) = build(&table_3(1, 1, 64, ""));
    let loads = train(12.5, force, 0.0);
    let state = g.initial_state(&mut work, &loads, 0.0, 0.0).unwrap();
    // Independent sum over discrete forces: q = Σ F·φ/(M·ω²), poles by their closed-form mean.
    let k = PI / 25.0;
    let pole = (k * 0.325).sin() / (k * 0.325);
    let phi: f64 = loads.iter().map(|l| (k * l.position[0]).sin() * pole).sum();
    let expected = force * phi / (DENSITY * 12.5 * (TAU * 7.1).powi(2));
    assert!((-state.q[0] / expected - 1.0).abs() < 1e-12);
    // The paper's simulation: 3.5 mm, its test 3.7 mm.
    assert!((1e3 * expected - 3.5056).abs() < 0.0001, "{}", 1e3 * expected);
}

#[test]
fn golden_train_at_5_km_h_deflects_a_span_by_3_506_mm() {
    let speed = 5.0 / 3.6;
    let force = 38_000.0 * 9.81 / 64.0;
    let (g, mut work) = build(&table_3(1, 3, 64, ""));
    let start = -12.5;
    let mut state = g.initial_state(&mut work, &train(start, force, speed), speed, 0.0).unwrap();
    let (h, zeros) = (2e-3, vec![0.0; 3]);
    let mut deepest = [0.0f64; 3];
    for n in 0..36_000u32 {
        let t = f64::from(n) * h;
        let loads = train(start + speed * t, force, speed);
        g.step(&mut work, &mut state, &loads, t, h).unwrap();
        for (k, deepest) in deepest.iter_mut().enumerate() {
            let y = g.mid_span(&mut work, &state, &zeros, k);
            *deepest = deepest.max(-1e3 * y.displacement);
        }
    }
    for d in deepest {
        // From an independent linear prototype, to its digits.
        assert!((d - 3.506).abs() < 0.001, "{deepest:?}");
    }
}

#[test]
fn order_forces_per_magnet_converge() {
    // Mean of the second mode under one pole near a bearing, against the evenly spread force.
    let q = |forces| {
        let extra = format!(r#", "pole": {{"length": 0.65, "forces": {forces}}}"#);
        let (g, mut work) = build(&table_3(2, 1, 1, &extra));
        g.initial_state(&mut work, &[Load::standing(1e4, 1.0)], 0.0, 0.0).unwrap().q[1]
    };
    let (k, half) = (TAU / 25.0, 0.325);
    let stiffness = DENSITY * 12.5 * (TAU * 24.9f64).powi(2);
    let even = -1e4 / stiffness * k.sin() * (k * half).sin() / (k * half);
    // Errors (k·half)²ⁿ/(2n)!·O(1): 1.1e-3, 2e-7·… , then rounding.
    let error = |n| (q(n) / even - 1.0f64).abs();
    assert!(error(1) > 5e-4 && error(1) < 2e-3, "{}", error(1));
    assert!(error(2) < 1e-6 && error(8) < 1e-14, "{} {}", error(2), error(8));
}
