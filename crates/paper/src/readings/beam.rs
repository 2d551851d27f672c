//! The girders on elastic bearings have the frequencies of table 3: from the closed form of the beam, not from the
//! beam elements of `crates/guideway`.

use std::f64::consts::TAU;

use serde_json::Value;

/// Where the determinant of the beam's boundary conditions is zero, there is a natural frequency.
///
/// With w = A cos βx + B sin βx + C exp(−βx) + D exp(−β(L − x)) and β⁴ = m·ω²/EI, the conditions are w'' = 0 at both ends,
/// EI·w''' = −k₁·w at the start and EI·w''' = k₂·w at the end.
fn determinant(frequency: f64, mass: f64, stiffness: f64, springs: [f64; 2]) -> f64 {
    const LENGTH: f64 = 25.0;
    let beta = (mass * (TAU * frequency).powi(2) / stiffness).powf(0.25);
    let (shear, e) = (stiffness * beta.powi(3), (-beta * LENGTH).exp());
    let (c, s) = ((beta * LENGTH).cos(), (beta * LENGTH).sin());
    let [k1, k2] = springs;
    let rows = [
        [-1.0, 0.0, 1.0, e],
        [k1, -shear, -shear + k1, (shear + k1) * e].map(|it| it / (k1 + shear)),
        [-c, -s, e, 1.0],
        [shear * s - k2 * c, -shear * c - k2 * s, (-shear - k2) * e, shear - k2]
            .map(|it| it / (k2 + shear)),
    ];
    let mut m = rows;
    let mut product = 1.0;
    for k in 0..4 {
        let pivot = (k..4).max_by(|&a, &b| m[a][k].abs().total_cmp(&m[b][k].abs())).unwrap();
        if pivot != k {
            m.swap(pivot, k);
            product = -product;
        }
        product *= m[k][k];
        for row in k + 1..4 {
            let (source, factor) = (m[k], m[row][k] / m[k][k]);
            for (it, from) in m[row].iter_mut().zip(source) {
                *it -= factor * from;
            }
        }
    }
    product
}

/// The natural frequency between two others (Hz), by bisection.
fn frequency(between: [f64; 2], at: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = between;
    assert!(at(low) * at(high) < 0.0, "no root, or two");
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(low) * at(middle) <= 0.0 { high = middle } else { low = middle }
    }
    low
}

const RIGID: f64 = 1e15;
const TABLE_3: f64 = 28_825e6 * 0.64673;

#[test]
fn analytic_elastic_bearings_give_table_3s_frequencies() {
    let mass = super::catalogue::MASS;
    for (layout, springs, share) in
        [("one-bearing", [true, false], 1.28), ("two-bearings", [true, true], 1.30)]
    {
        let file = crate::root().join(format!("scenarios/girders/{layout}.json"));
        let layout: Value = serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap();
        let girder = &layout["girders"]["table_3"];
        let stiffness = girder["bending_stiffness"].as_f64().unwrap();
        assert!((stiffness / TABLE_3 - share).abs() < 0.005, "{}", stiffness / TABLE_3);
        assert!((girder["mass_per_length"].as_f64().unwrap() - mass).abs() < 1e-9);
        let k = [0, 1].map(|k| {
            let given = girder["supports"][k]["stiffness"].as_f64();
            assert_eq!(given.is_some(), springs[k]);
            given.unwrap_or(RIGID)
        });
        let at = |f: f64| determinant(f, mass, stiffness, k);
        let found = [frequency([6.0, 8.0], at), frequency([22.0, 27.0], at)];
        assert!((found[0] - 7.1).abs() < 1e-3 && (found[1] - 24.9).abs() < 1e-3, "{found:?}");
    }
    // and rigid bearings give 4 times the first
    let at = |f: f64| determinant(f, mass, TABLE_3, [RIGID; 2]);
    let ratio = frequency([25.0, 27.0], at) / frequency([6.0, 7.0], at);
    assert!((ratio - 4.0).abs() < 1e-5, "{ratio}");
}
