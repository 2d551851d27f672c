//! Girders that users describe: on elastic supports, continuous, with shapes from a file.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use std::f64::consts::PI;

use guideway::{Guideway, GuidewayDescription, Load, State, Surface, Workspace};

/// EI (N·m²) and mass per length (kg/m) of all these girders.
const BENDING: f64 = 1.2e10;
const DENSITY: f64 = 2100.0;

/// One span of a girder with `keys`, one magnet, `extra` keys of the guideway.
fn describe(keys: &str, extra: &str) -> GuidewayDescription {
    let text = format!(
        r#"{{"girders": {{"own": {{"mass_per_length": {DENSITY}, "bending_stiffness": {BENDING:e},
            {keys} }}}}, "spans": [{{"girder": "own"}}], "magnets": 1 {extra} }}"#
    );
    GuidewayDescription::from_json(&text).unwrap()
}

fn build(description: &GuidewayDescription) -> (Guideway, Workspace) {
    let g = Guideway::new(description, None).unwrap();
    let work = Workspace::new(&g);
    (g, work)
}

/// Two fields of 25 m on three elastic bearings with dampers.
const TWO_FIELDS: &str = r#""length": 50.0, "modes": 6, "damping": [0.009],
    "supports": [{"x": 0.0, "stiffness": 4e8, "damping": 2e6},
                 {"x": 25.0, "stiffness": 8e8, "damping": 1e6},
                 {"x": 50.0, "stiffness": 4e8}]"#;

fn static_under(g: &Guideway, work: &mut Workspace, force: f64, x: f64) -> State {
    g.initial_state(work, &[Load::standing(force, x)], 0.0, 0.0).unwrap()
}

fn surface(g: &Guideway, work: &mut Workspace, state: &State, x: f64) -> Surface {
    g.surface(work, state, &vec![0.0; g.modes().len()], x)
}

/// P/(k₁ + …) for a rigid beam plus PL³/48EI: a beam on springs under a force in its middle.
#[test]
fn analytic_static_deflection_on_springs() {
    let (k, length, force) = (3e8, 30.0f64, 1e5);
    let exact = force / (2.0 * k) + force * length.powi(3) / (48.0 * BENDING);
    let error = |modes: usize| {
        let keys = format!(
            r#""length": 30.0, "modes": {modes}, "damping": [0.0], "elements": 160,
               "supports": [{{"x": 0, "stiffness": {k:e}}}, {{"x": 30, "stiffness": {k:e}}}]"#
        );
        let (g, mut work) = build(&describe(&keys, r#", "pole": {"length": 0.0, "forces": 1}"#));
        let state = static_under(&g, &mut work, force, 15.0);
        let middle = g.mid_span(&mut work, &state, &vec![0.0; modes], 0);
        1.0 + middle.displacement / exact
    };
    // what modes left out would carry falls with their number to the third
    let errors = [5, 10, 20, 40].map(error);
    assert!(errors[0] < 3e-3 && errors[3] < 1e-5, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((5.0..12.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// P at the middle of one of two fields on rigid supports: 23·PL³/1536EI there.
#[test]
fn analytic_static_deflection_of_a_continuous_girder() {
    let keys = r#""length": 50.0, "modes": 30, "damping": [0.0], "elements": 200,
        "supports": [{"x": 0}, {"x": 25}, {"x": 50}]"#;
    let extra = r#", "pole": {"length": 0.0, "forces": 1},
        "points": [{"name": "field_1", "span": 1, "x": 12.5}, {"name": "pier", "span": 1, "x": 25.0}]"#;
    let (g, mut work) = build(&describe(keys, extra));
    let state = static_under(&g, &mut work, 1e5, 12.5);
    let still = vec![0.0; 30];
    let deflection = -g.point(&mut work, &state, &still, 0).displacement;
    let exact = 23.0 * 1e5 * 25f64.powi(3) / (1536.0 * BENDING);
    assert!((deflection / exact - 1.0).abs() < 1e-4, "{deflection} {exact}");
    // the named point on the rigid support, and the middle of the girder, which is the same
    assert!(g.point(&mut work, &state, &still, 1).displacement.abs() < 1e-15);
    assert!(g.mid_span(&mut work, &state, &still, 0).displacement.abs() < 1e-15);
}

/// Constant loads in equilibrium: nothing moves.
#[test]
fn invariant_every_own_girder_starts_in_equilibrium() {
    for keys in [
        r#""length": 30.0, "frequencies": [4.8], "damping": [0.009]"#,
        r#""length": 30.0, "damping": [0.009]"#,
        r#""length": 30.0, "damping": [0.009], "shear_stiffness": 4e9, "rotary_inertia": 1000.0"#,
        r#""length": 30.0, "damping": [0.009], "supports": [{"x": 0, "clamped": true}]"#,
        r#""length": 50.0, "damping": [0.009], "hinges": [25.0], "supports": [{"x": 0},
            {"x": 25, "pier": {"mass": 5e4, "stiffness": 1e9, "damping": 1e6}}, {"x": 50}]"#,
        TWO_FIELDS,
    ] {
        let (g, mut work) = build(&describe(keys, ""));
        for x in [0.1, 7.0, 24.9] {
            let loads = [Load::standing(6e4, x)];
            let mut state = g.initial_state(&mut work, &loads, 0.0, 0.0).unwrap();
            let start = surface(&g, &mut work, &state, x).u;
            for n in 0..500 {
                g.step(&mut work, &mut state, &loads, 2e-3 * f64::from(n), 2e-3).unwrap();
                let now = surface(&g, &mut work, &state, x).u;
                assert!((now - start).abs() < 1e-14, "{keys} {x}: {now} {start}");
            }
            assert!(start < -1e-10, "{keys} {x}: {start}");
        }
    }
}

/// Dampers of bearings couple the modes; the steps are exact all the same. Reference: RK4 with steps of
/// 1/200 of the fastest period, error (ωh)⁴/120.
#[test]
fn analytic_coupled_damping_agrees_with_a_fine_integration() {
    let (g, mut work) = build(&describe(TWO_FIELDS, ""));
    let loads = [Load::standing(6e4, 8.0)];
    let n = g.modes().len();
    let mut state = State { q: vec![0.0; n], v: vec![0.0; n] };
    let fastest = g.modes().iter().map(|m| m.omega).fold(0.0, f64::max);
    let (stop, pieces) = (0.25, (0.25 * fastest / (2.0 * PI) * 200.0).ceil() as u32);
    let mut fine = State { q: vec![0.0; n], v: vec![0.0; n] };
    let h = stop / f64::from(pieces);
    let rate = |s: &State, work: &mut Workspace| {
        let mut a = vec![0.0; n];
        g.accelerations(work, s, &loads, 0.0, &mut a);
        (s.v.clone(), a)
    };
    let moved = |s: &State, (dq, dv): &(Vec<f64>, Vec<f64>), by: f64| State {
        q: s.q.iter().zip(dq).map(|(q, d)| q + by * d).collect(),
        v: s.v.iter().zip(dv).map(|(v, d)| v + by * d).collect(),
    };
    for _ in 0..pieces {
        let k1 = rate(&fine, &mut work);
        let k2 = rate(&moved(&fine, &k1, 0.5 * h), &mut work);
        let k3 = rate(&moved(&fine, &k2, 0.5 * h), &mut work);
        let k4 = rate(&moved(&fine, &k3, h), &mut work);
        for (k, by) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
            fine = moved(&fine, &k, by * h / 6.0);
        }
    }
    for k in 0..5 {
        g.step(&mut work, &mut state, &loads, 0.05 * f64::from(k), 0.05).unwrap();
    }
    for i in 0..n {
        // after some 6 to 60 periods, with (2π/200)⁴/120 = 8e-9 per radian of phase
        assert!((state.q[i] - fine.q[i]).abs() < 1e-10, "{i}: {} {}", state.q[i], fine.q[i]);
        assert!((state.v[i] - fine.v[i]).abs() < 1e-8, "{i}: {} {}", state.v[i], fine.v[i]);
    }
    // the coupling matters: a mode that the load does not excite directly
    let zeta: Vec<f64> = g.modes().iter().map(|m| m.zeta).collect();
    assert!(zeta.iter().any(|z| *z > 0.02), "{zeta:?}");
}

/// A pole that crosses the step from a deflected girder end to rigid ground feels a ramp, and its rate
/// is that ramp's; the girder's energy is the work of the moving force, across the step as well.
#[test]
fn invariant_energy_is_the_work_of_a_force_that_crosses_an_elastic_end() {
    let keys = r#""length": 20.0, "modes": 5, "damping": [0.0], "supports":
        [{"x": 0, "stiffness": 5e7}, {"x": 20, "stiffness": 5e7}]"#;
    let (g, mut work) = build(&describe(keys, r#", "initial": "undeformed""#));
    let (speed, force, h) = (15.0, 2e4, 1e-4);
    let mut state = State { q: vec![0.0; 5], v: vec![0.0; 5] };
    let (mut work_done, mut jump, mut before) = (0.0, 0.0f64, 0.0);
    let steps = (22.0 / speed / h) as u32;
    for n in 0..steps {
        let x = -1.0 + speed * h * f64::from(n);
        let load = Load {
            force: [force, 0.0, 0.0, 0.0],
            position: [x, speed, 0.0, 0.0],
            ..Load::default()
        };
        let a = surface(&g, &mut work, &state, x);
        g.step(&mut work, &mut state, &[load], h * f64::from(n), h).unwrap();
        let b = surface(&g, &mut work, &state, x + speed * h);
        // power of the force on the girder: −F·∂u/∂t under the pole; trapezoidal rule
        work_done -= force * 0.5 * h * (a.u_t + b.u_t);
        // displacement and rate agree, also across the step
        let mean_rate = 0.5 * (a.rate(speed) + b.rate(speed));
        jump = jump.max(((b.u - a.u) / h - mean_rate).abs());
        before = b.u;
    }
    assert_eq!(before, 0.0, "the force has left the girder");
    let energy = g.energy(&state);
    assert!(energy > 0.1, "{energy}");
    assert!((work_done / energy - 1.0).abs() < 1e-4, "{work_done} {energy}");
    // ramps of F/k = 0.4 mm over 0.65 m: 9 mm/s. At their ends the rate jumps within one step.
    assert!(jump < 0.5 * 0.011, "{jump}");
}

/// docs/units/guideway.md: what the modes that are left out would carry, at the middle of a field and
/// over the inner pier of the two-span girder.
#[test]
fn golden_shares_of_the_deflection_that_the_guide_states() {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../fmu-guideway/resources/two-span-continuous/guideway.json"
    );
    let text = std::fs::read_to_string(file).unwrap();
    let deflections = |modes: usize| {
        let mut d = GuidewayDescription::from_json(&text).unwrap();
        d.girders.get_mut("continuous").unwrap().modes = Some(modes);
        d.magnets = 1;
        let (g, mut work) = build(&d);
        [12.5, 25.0].map(|x| {
            let state = static_under(&g, &mut work, 1e5, x);
            surface(&g, &mut work, &state, x).u
        })
    };
    let all = deflections(50);
    for (modes, missing) in [(6, [0.02, 0.21]), (12, [0.002, 0.05])] {
        for ((some, all), missing) in deflections(modes).iter().zip(all).zip(missing) {
            let found = 1.0 - some / all;
            assert!((found / missing - 1.0).abs() < 0.25, "{modes}: {found} {missing}");
        }
    }
}

/// The kinds of girder that docs/units/guideway.md shows, in one row.
#[test]
fn golden_kinds_of_the_guide_are_valid() {
    let page = include_str!("../../../docs/units/guideway.md");
    let (_, after) = page.split_once("```json\n").unwrap();
    let (kinds, _) = after.split_once("```").unwrap();
    let text = format!(
        r#"{{"girders": {{ {kinds} }}, "spans": [{{"girder": "measured"}}, {{"girder": "designed"}},
            {{"girder": "from_fe"}}, {{"girder": "continuous"}}], "magnets": 1}}"#
    );
    let mut d = GuidewayDescription::from_json(&text).unwrap();
    let file: String = (0..=30)
        .map(|i| (f64::from(i), PI * f64::from(i) / 30.0))
        .map(|(x, a)| format!("{x},{},{}\n", a.sin(), (2.0 * a).sin() * f64::from(x < 30.0)))
        .collect();
    d.set_shapes("from_fe", &file).unwrap();
    let (g, _) = build(&d);
    assert_eq!((g.spans().len(), g.track()), (4, (0.0, 150.0)));
    let first = |k: usize| g.modes()[g.spans()[k].first_mode].frequency();
    // the design is that of the measured girder
    assert!((first(0) - 4.8).abs() < 1e-12 && (first(1) - 4.8).abs() < 0.1, "{}", first(1));
    assert!((first(3) - first(1)).abs() < 0.3, "{}", first(3));
}

/// Half of a pole on the girder's end: half of the force, and half of the deflection is felt.
#[test]
fn analytic_half_a_pole_over_an_elastic_end() {
    let keys = r#""length": 20.0, "modes": 8, "damping": [0.0], "supports":
        [{"x": 0, "stiffness": 5e7}, {"x": 20, "stiffness": 5e7}]"#;
    let (g, mut work) = build(&describe(keys, ""));
    let at = |x: f64, work: &mut Workspace| {
        let state = static_under(&g, work, 1e4, 10.0);
        surface(&g, work, &state, x)
    };
    let end = at(0.325, &mut work).u;
    let half = at(0.0, &mut work);
    // the shapes bend by some (π·0.3/20)² within the pole
    assert!((half.u / (0.5 * end) - 1.0).abs() < 0.05, "{} {end}", half.u);
    // the slope of the mean is the step over the pole's length
    assert!((half.u_x / (end / 0.65) - 1.0).abs() < 0.05);
    assert_eq!(at(-0.4, &mut work).u, 0.0);
}

/// Sines from a table, as a file and with a girder that computes them.
fn sine_file(columns: usize, points: usize) -> String {
    let mut text = String::from("x; phi_1; phi_2\n# from a modal analysis\n");
    for i in 0..=points {
        let x = 25.0 * i as f64 / points as f64;
        text.push_str(&format!("{x}"));
        for n in 1..=columns {
            text.push_str(&format!("; {}", (PI * n as f64 * x / 25.0).sin()));
        }
        text.push('\n');
    }
    text
}

#[test]
fn analytic_shapes_from_a_file_give_the_girder_of_their_modes() {
    let keys = r#""length": 25.0, "frequencies": [7.1, 24.9], "damping": [0.01]"#;
    let (sine, mut sine_work) = build(&describe(keys, ""));
    let expected = static_under(&sine, &mut sine_work, 1e5, 10.0);
    let deflection = surface(&sine, &mut sine_work, &expected, 10.0).u;
    let error = |points: usize, elastic: bool| {
        let more = if elastic { r#", "elastic_ends": true"# } else { "" };
        let mut d = describe(&format!(r#"{keys}, "shapes_file": "modes.csv" {more}"#), "");
        assert_eq!(d.shapes_files(), [("own".to_owned(), "modes.csv".to_owned())]);
        d.set_shapes("own", &sine_file(2, points)).unwrap();
        let (g, mut work) = build(&d);
        for mode in g.modes() {
            // m·L/2
            assert!((mode.mass / (DENSITY * 12.5) - 1.0).abs() < 1e-3, "{}", mode.mass);
        }
        let state = static_under(&g, &mut work, 1e5, 10.0);
        (surface(&g, &mut work, &state, 10.0).u / deflection - 1.0).abs()
    };
    for elastic in [false, true] {
        let (coarse, fine) = (error(20, elastic), error(40, elastic));
        // the spline errs by (πh/L)⁴/384: 1.6e-6 of φ with 20 points
        assert!(coarse < 3e-6 && fine < 2e-7, "{coarse} {fine}");
    }
}

/// Programs write names and units above the numbers.
#[test]
fn issue_a_row_of_units_and_a_dot_in_the_path_are_accepted() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01], "modal_masses": [3e4]"#;
    let mut d = describe(&format!(r#"{keys}, "shapes_file": "./m.csv""#), "");
    assert_eq!(d.shapes_files(), [("own".to_owned(), "m.csv".to_owned())]);
    d.set_shapes("own", "x,phi_1\nm,-\n0,0\n12,1\n25,0\n").unwrap();
    assert_eq!(d.girders["own"].shapes.as_ref().unwrap()[0].x, [0.0, 12.0, 25.0]);
    // a broken row of numbers is not a heading
    let mut d = describe(&format!(r#"{keys}, "shapes_file": "m.csv""#), "");
    let message = d.set_shapes("own", "x,phi_1\n0,O\n12,1\n25,0\n").unwrap_err().to_string();
    assert!(message.contains("m.csv, line 2"), "{message}");
}

#[test]
fn refusal_of_columns_that_are_the_same_shape() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01], "shapes_file": "m.csv""#;
    let table = "0,0,0\n12,1,-3\n25,0,0\n";
    let message = describe(keys, "").set_shapes("own", table).unwrap_err().to_string();
    assert!(message.contains("girders.own.shapes_file, column 3"), "{message}");
}

#[test]
fn refusal_of_more_magnets_or_spans_than_anyone_has() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01]"#;
    let mut many = describe(keys, "");
    many.magnets = 4097;
    let message = Guideway::new(&many, None).unwrap_err().to_string();
    assert!(message.contains("magnets") && message.contains("1 to 4096"), "{message}");
    let mut long = describe(keys, "");
    long.spans[0].count = usize::MAX;
    let message = Guideway::new(&long, None).unwrap_err().to_string();
    assert!(message.contains("spans") && message.contains("at most 100000"), "{message}");
}

#[test]
fn analytic_given_modal_masses_replace_the_integral() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01], "modes": 1,
        "shapes_file": "m.csv", "modal_masses": [3e4, 4e4]"#;
    let mut d = describe(keys, "");
    d.set_shapes("own", &sine_file(2, 20)).unwrap();
    let (g, _) = build(&d);
    assert_eq!((g.modes().len(), g.modes()[0].mass), (1, 3e4));
}

/// Imposed frequencies replace computed ones; factors of a kind act on its spans only.
#[test]
fn analytic_frequencies_and_factors_of_a_kind() {
    let keys = r#""length": 30.0, "damping": [0.009], "supports": [{"x": 0}, {"x": 30}],
        "frequencies": [0, 20.0], "stiffness_factor": 4.0, "modes": 3"#;
    let (g, _) = build(&describe(keys, ""));
    let first = 0.5 * PI / 900.0 * (BENDING / DENSITY).sqrt();
    for (mode, exact) in g.modes().iter().zip([2.0 * first, 40.0, 18.0 * first]) {
        assert!((mode.frequency() / exact - 1.0).abs() < 1e-5, "{} {exact}", mode.frequency());
    }
    let mut d = describe(r#""length": 30.0, "damping": [0.009], "frequencies": [4.8]"#, "");
    let mut other = d.girders["own"].clone();
    other.mass_factor = 4.0;
    d.girders.insert("other".into(), other);
    d.spans.push(guideway::description::SpanRun { girder: "other".into(), name: None, count: 1 });
    let (g, _) = build(&d);
    let frequencies: Vec<f64> = g.modes().iter().map(guideway::GirderMode::frequency).collect();
    assert!((frequencies[0] - 4.8).abs() < 1e-12 && (frequencies[2] - 2.4).abs() < 1e-12);
}

/// Softer supports lower all frequencies, a stiffer beam raises them; dampers scale.
#[test]
fn invariant_scaling_of_beam_and_supports() {
    let modes = |change: &dyn Fn(&mut guideway::description::GirderDescription)| {
        let mut d = describe(TWO_FIELDS, "");
        change(d.girders.get_mut("own").unwrap());
        build(&d).0.modes().to_vec()
    };
    let base = modes(&|_| {});
    let soft = modes(&|g| g.scale_supports(0.5, 1.0));
    let stiff = modes(&|g| g.scale_beam_stiffness(2.0));
    let both = modes(&|g| {
        g.scale_beam_stiffness(4.0);
        g.scale_supports(4.0, 2.0);
    });
    for i in 0..6 {
        assert!(soft[i].omega < base[i].omega && stiff[i].omega > base[i].omega);
        // K·4 and C·2: the same shapes and damping ratios
        assert!((both[i].omega / base[i].omega - 2.0).abs() < 1e-6);
        assert!((both[i].zeta / base[i].zeta - 1.0).abs() < 1e-6);
        assert!((both[i].mass / base[i].mass - 1.0).abs() < 1e-6);
    }
}

#[test]
fn refusal_bad_layouts_name_the_key_and_the_remedy() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01]"#;
    let refused = |keys: &str, extra: &str| {
        Guideway::new(&describe(keys, extra), None).unwrap_err().to_string()
    };
    for (more, path, part) in [
        (r#", "shapes_file": "m.csv""#, "girders.own.shapes_file", "read the file"),
        (r#", "modal_masses": [1.0]"#, "girders.own.modal_masses", "shapes_file"),
        (r#", "elastic_ends": true"#, "girders.own.elastic_ends", "tabulated"),
        (r#", "stiffness_factor": -1"#, "girders.own.stiffness_factor", "positive"),
        (r#", "mass_factor": 0"#, "girders.own.mass_factor", "positive"),
        (
            r#", "elements": 40, "shapes": [{"modal_mass": 1, "x": [0, 25], "phi": [0, 0]}]"#,
            "girders.own.shapes",
            "remove one",
        ),
        (
            r#", "supports": [{"x": 0}, {"x": 26}]"#,
            "girders.own.supports[1].x",
            "not on the girder",
        ),
    ] {
        let message = refused(&format!("{keys}{more}"), "");
        assert!(message.contains(&format!("`{path}`")) && message.contains(part), "{message}");
    }
    for (points, path, part) in [
        (r#"{"name": "a b", "span": 1, "x": 1}"#, "points[0].name", "letters"),
        (r#"{"name": "a", "span": 2, "x": 1}"#, "points[0].span", "1 to 1"),
        (r#"{"name": "a", "span": 1, "x": 25.1}"#, "points[0].x", "0 to"),
        (
            r#"{"name": "a", "span": 1, "x": 1}, {"name": "a", "span": 1, "x": 2}"#,
            "points[1].name",
            "again",
        ),
    ] {
        let message = refused(keys, &format!(r#", "points": [{points}]"#));
        assert!(message.contains(&format!("`{path}`")) && message.contains(part), "{message}");
    }
    let mut named = describe(keys, "");
    named.spans[0].name = Some("s".into());
    named.spans.push(named.spans[0].clone());
    let message = Guideway::new(&named, None).unwrap_err().to_string();
    assert!(message.contains("spans[1].name"), "{message}");
    // unknown keys name the nearest one
    let text = r#"{"girders": {"g": {"length": 1, "damping": [0], "suports": []}}, "spans": [],
        "magnets": 1}"#;
    let message = GuidewayDescription::from_json(text).unwrap_err().to_string();
    assert!(message.contains("girders.g") && message.contains("`supports`"), "{message}");
}

#[test]
fn refusal_bad_shape_files_name_the_line() {
    let keys = r#""length": 25.0, "frequencies": [7.1], "damping": [0.01], "shapes_file": "m.csv""#;
    let refused = |keys: &str, text: &str| {
        let mut d = describe(keys, "");
        match d.set_shapes("own", text) {
            Err(error) => error.to_string(),
            Ok(()) => Guideway::new(&d, None).unwrap_err().to_string(),
        }
    };
    for (text, part) in [
        ("", "fewer than two rows"),
        ("x,phi\n0,0\n", "fewer than two rows"),
        ("0,0\n12,x\n25,0\n", "line 2"),
        ("0,0\n12,1,2\n25,0\n", "line 2"),
        ("0\n12\n25\n", "one column"),
        ("0,0\n0,1\n25,0\n", "does not exceed"),
        ("0,0\n12,1\n24,0\n", "from 0 m to 24 m"),
        ("0,0\n12,1\n25,0.5\n", "elastic_ends"),
        ("0,0\n12,0\n25,0\n", "phi_1 is 0 everywhere"),
    ] {
        let message = refused(keys, text);
        assert!(message.contains(part), "{text:?}: {message}");
    }
    let few = format!(r#"{keys}, "modal_masses": [1.0, 2.0]"#);
    assert!(refused(&few, "0,0\n12,1\n25,0\n").contains("2 masses for 1 columns"));
    let both = format!(r#"{keys}, "shapes": []"#);
    assert!(refused(&both, "0,0\n25,0\n").contains("remove one"));
}
