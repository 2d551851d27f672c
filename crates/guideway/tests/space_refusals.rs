//! Girders in three dimensions that are refused, each with its path and reason.
#![allow(clippy::unwrap_used, reason = "a failing test may panic")]

use guideway::{Guideway, GuidewayDescription};

#[test]
fn refusal_of_girders_in_three_dimensions_has_path_and_reason() {
    let refused = |girder: &str, rest: &str| {
        let text = format!(
            r#"{{ "girders": {{"g": {{"length": 25, "mass_per_length": 100, "damping": [0.01],
                  "bending_stiffness": 1e8 {girder}}}}}, "spans": [{{"girder": "g"}}], "magnets": 8 {rest} }}"#
        );
        let description = GuidewayDescription::from_json(&text).map_err(|e| e.to_string());
        description.and_then(|d| Guideway::new(&d, None).map_err(|e| e.to_string())).unwrap_err()
    };
    let rails = r#", "rails": {}"#;
    let irregular =
        |part: &str| format!(r#", "rails": {{"irregularity": {{"on": true, {part}}}}}"#);
    let torsion = r#""torsional_stiffness": 1e8, "polar_inertia": 100"#;
    for (girder, rest, parts) in [
        (
            r#", "lateral": {"bending_stiffness": 1e8}"#,
            "",
            ["`rails`", "girder `g` bends laterally"],
        ),
        (r#", "lateral": {}"#, rails, ["girders.g.lateral.frequencies", "empty"]),
        (r#", "lateral": {"modes": 0}"#, rails, ["girders.g.lateral.modes", "0 modes"]),
        (
            r#", "elements": 40, "lateral": {}"#,
            rails,
            ["girders.g.lateral.bending_stiffness", "missing"],
        ),
        (r#", "torsion": {}"#, rails, ["girders.g.torsion.polar_inertia", "missing"]),
        (
            r#", "torsion": {"polar_inertia": -1}"#,
            rails,
            ["girders.g.torsion.polar_inertia", "-1 kg·m"],
        ),
        (r#", "torsion": {"polar_inertia": 9}"#, rails, ["torsion.torsional_stiffness", "missing"]),
        (r#", "radius": 50"#, rails, ["girders.g.torsion", "needs its"]),
        (
            &format!(r#", "radius": 5, "torsion": {{{torsion}}}"#),
            rails,
            ["girders.g.radius", "5 m for"],
        ),
        (
            &format!(r#", "radius": 50, "torsion": {{"damping": [0.1], {torsion}}}"#),
            rails,
            ["girders.g.torsion", "of the girder"],
        ),
        (
            &format!(
                r#", "radius": 50, "hinges": [12], "supports": [{{"x": 0}}, {{"x": 12}}, {{"x": 25}}],
            "torsion": {{{torsion}}}"#
            ),
            rails,
            ["girders.g.radius", "no hinges"],
        ),
        (
            &format!(
                r#", "supports": [{{"x": 0, "torsion_free": true}}, {{"x": 25, "torsion_free": true}}],
            "torsion": {{{torsion}}}"#
            ),
            rails,
            ["girders.g.supports", "can twist at all"],
        ),
        (
            &format!(
                r#", "supports": [{{"x": 0, "torsional_damping": 1}}, {{"x": 25}}],
            "torsion": {{{torsion}}}"#
            ),
            rails,
            ["supports[0].torsional_damping", "fork"],
        ),
        (r#", "components": ["y"]"#, rails, ["girders.g.components", "without shapes_file"]),
        ("", r#", "rails": {"half_gauge": 0}"#, ["rails.half_gauge", "0 m"]),
        ("", r#", "rails": {"sides": []}"#, ["rails.sides", "0 of them"]),
        ("", r#", "rails": {"sides": ["both"]}"#, ["rails.sides[0]", "one rail"]),
        (
            "",
            &irregular(r#""vertical": {"psd": {"form": "inverse-square", "amplitude": -1}}"#),
            ["rails.irregularity.vertical.psd", "finite and at least 0"],
        ),
        (
            "",
            &irregular(r#""lateral": {"psd": {"form": "german-low"}, "lines": 0}"#),
            ["rails.irregularity.lateral.lines", "0 harmonics"],
        ),
        (
            "",
            &irregular(
                r#""lateral": {"psd": {"form": "german-low"}, "coherence": {"long_waves": 2}}"#,
            ),
            ["lateral.coherence.long_waves", "-1 to 1"],
        ),
        (
            "",
            &irregular(r#""lateral": {"left": {"file": "left.csv"}}"#),
            ["rails.irregularity.lateral.left.file", "`left.csv`"],
        ),
        (
            "",
            &irregular(r#""vertical": {"periodic": [{"wavelength": 0.1, "amplitudes": []}]}"#),
            ["rails.irregularity.vertical.periodic[0]", "at least one"],
        ),
        (
            "",
            &irregular(r#""end": 1, "vertical": {"psd": {"form": "german-low"}}"#),
            ["rails.irregularity.end", "two fade lengths"],
        ),
    ] {
        let message = refused(girder, rest);
        assert!(parts.iter().all(|part| message.contains(part)), "{girder} {rest}: {message}");
    }
}
