//! `maglev inspect --modes` on the packaged units.

use serde_json::Value;
use system_tests::{root, start};

const HELD: &str = r#"{"magnet_stiffness": 7e5, "magnet_damping": 8e3}"#;

fn unit(name: &str) -> String {
    root().join(format!("target/fmu/{name}.fmu")).display().to_string()
}

/// The two-car train on 7e5 N/m and 8e3 N·s/m per magnet: 128 degrees of freedom by rank 502 of 630,
/// 256 states, and the fastest pair of a prototype written apart.
#[test]
fn golden_modes_of_the_two_car_train() {
    let vehicle = unit("vehicle");
    let asked = ["inspect", "--modes", &vehicle, "--options", HELD, "--json"];
    let output = start(&asked).unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(report["bodies"], 105);
    assert_eq!(report["constraint_rank"], 502);
    assert_eq!(report["degrees_of_freedom"], 128);
    let modes = report["modes"].as_array().unwrap();
    let fastest = modes.last().unwrap();
    // two digits behind the point are the prototype's
    assert!((fastest["real"].as_f64().unwrap() + 209.48).abs() < 0.005, "{fastest}");
    assert!((fastest["imaginary"].as_f64().unwrap() - 308.47).abs() < 0.005, "{fastest}");
    for mode in modes {
        let shares: f64 = mode["participation"]
            .as_array()
            .unwrap()
            .iter()
            .map(|p| p["share"].as_f64().unwrap())
            .sum();
        // shares below 1e-3 are left out; there are 80 bodies
        assert!(shares > 0.92 && shares < 1.0 + 1e-9, "{mode}");
    }

    let page = start(&asked[..5]).unwrap();
    let page = String::from_utf8(page.stdout).unwrap();
    let last = page.lines().last().unwrap();
    assert!(last.contains("-209.4") && last.contains("± 308.4"), "{last}");
}

/// Units that offer no modes, and wrong options, end with status 2 and a reason.
#[test]
fn invariant_what_has_no_modes_says_so() {
    for (name, options, reason) in [
        ("ems", "{}", "offers no report"),
        ("guideway", "{}", "offers no report"),
        ("vehicle", r#"{"stiffness": 1}"#, "unknown field `stiffness`"),
    ] {
        let output = start(&["inspect", "--modes", &unit(name), "--options", options]).unwrap();
        assert_eq!(output.status.code(), Some(2), "{name}");
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(text.contains(reason), "{text}");
        assert!(output.stdout.is_empty());
    }
}
