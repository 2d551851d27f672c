//! Each gain parameter acts on the estimate that its description names.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::EmsFmu;

/// The five gains with the estimates that eq. 3 gives them.
const PAIRS: [(&str, &str); 5] = [
    ("gain_acceleration", "estimate_acceleration"),
    ("gain_velocity", "estimate_velocity"),
    ("gain_position", "estimate_position"),
    ("gain_gap_velocity", "estimate_gap_velocity"),
    ("gain_gap", "estimate_gap"),
];

fn moved(gains: [f64; 5]) -> TestInstance {
    let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
    for ((name, _), gain) in PAIRS.iter().zip(gains) {
        unit.set_real(name, gain).unwrap();
    }
    unit.initialize(0.0).unwrap();
    unit.set_real("gap", 0.0083).unwrap();
    unit.set_real("gap_rate", 0.02).unwrap();
    unit.set_real("acceleration", 1.5).unwrap();
    for n in 0..7 {
        unit.step(f64::from(n) * 1e-3, 1e-3).unwrap();
    }
    unit
}

/// Δv = Σ gain · estimate (eq. 3) from the unit's own outputs, over R·i₀ = 0.6 Ω · 24 A: with all
/// five gains different, and with each alone.
#[test]
fn issue_14_each_gain_acts_on_its_own_estimate() {
    let mut cases = vec![[2.0, 3.0, 5.0, 7.0, 11.0]];
    for k in 0..5 {
        cases.push(std::array::from_fn(|i| if i == k { 13.0 } else { 0.0 }));
    }
    for gains in cases {
        let mut unit = moved(gains);
        let estimates = PAIRS.map(|(_, name)| unit.real(name).unwrap());
        for (k, a) in estimates.iter().enumerate() {
            assert!(a.abs() > 1e-4, "{estimates:?}");
            assert!(estimates[..k].iter().all(|b| (a - b).abs() > 1e-3), "{estimates:?}");
        }
        let expected: f64 = gains.iter().zip(estimates).map(|(gain, y)| gain * y).sum();
        let deviation = unit.real("voltage").unwrap() - 0.6 * 24.0;
        // rounding of 14.4 V
        assert!((deviation - expected).abs() < 1e-13 * 24.0, "{gains:?}: {deviation} {expected}");
    }
}
