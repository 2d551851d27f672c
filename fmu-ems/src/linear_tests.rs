//! The report `linear` of a magnet that is aside, with lift loss.
#![allow(clippy::unwrap_used)]

use fmi2_export::testing::TestInstance;

use crate::EmsFmu;

fn aside(change: [f64; 2]) -> TestInstance {
    let mut unit = TestInstance::new::<EmsFmu>("resources").unwrap();
    for name in ["nonlinear", "lift_loss"] {
        unit.set_boolean(name, true).unwrap();
    }
    unit.set_real("gap", 0.008).unwrap();
    unit.set_real("lateral_offset", 0.015).unwrap();
    unit.set_real("static_force", 5500.0).unwrap();
    unit.initialize(0.0).unwrap();
    unit.set_real("gap", 0.008 + change[0]).unwrap();
    unit.set_real("lateral_offset", 0.015 + change[1]).unwrap();
    (0..40).for_each(|n| unit.step(f64::from(n) * 1e-3, 1e-3).unwrap());
    unit
}

/// 15 mm aside, after 40 ms behind a step of gap or offset, force, lateral force and current are those of x' = A x + B u,
/// y = C x + D u: central differences of the unit's own steps.
#[test]
fn analytic_a_magnet_aside_with_lift_loss_is_linear_as_it_says() {
    let mut unit = aside([0.0; 2]);
    let report: serde_json::Value = serde_json::from_str(&unit.report("linear").unwrap()).unwrap();
    let states = report["states"].as_array().unwrap().len();
    let index = |list: &str, name: &str| {
        let reference = unit.reference(name).unwrap();
        report[list].as_array().unwrap().iter().position(|v| *v == reference).unwrap()
    };
    let entries = |matrix: &str| -> Vec<(usize, usize, f64)> {
        let whole = |value: &serde_json::Value| usize::try_from(value.as_u64().unwrap()).unwrap();
        let entries = report[matrix].as_array().unwrap().iter();
        entries.map(|e| (whole(&e[0]), whole(&e[1]), e[2].as_f64().unwrap())).collect()
    };
    let [a, b, c, d] = ["a", "b", "c", "d"].map(entries);
    for (n, input) in ["gap", "lateral_offset"].into_iter().enumerate() {
        let u = index("inputs", input);
        let rates = |x: &[f64]| {
            let mut rates = vec![0.0; states];
            a.iter().for_each(|(i, j, value)| rates[*i] += value * x[*j]);
            b.iter().filter(|(_, j, _)| *j == u).for_each(|(i, _, value)| rates[*i] += value);
            rates
        };
        let (h, mut x) = (2e-5, vec![0.0; states]);
        for _ in 0..2000 {
            let mut half = x.clone();
            half.iter_mut().zip(rates(&x)).for_each(|(x, rate)| *x += 0.5 * h * rate);
            x.iter_mut().zip(rates(&half)).for_each(|(x, rate)| *x += h * rate);
        }
        let size = 1e-7;
        let at = |change: f64| {
            let mut changes = [0.0; 2];
            changes[n] = change;
            let mut unit = aside(changes);
            ["force", "lateral_force", "current"].map(|name| unit.real(name).unwrap())
        };
        let (more, less) = (at(size), at(-size));
        for (k, name) in ["force", "lateral_force", "current"].into_iter().enumerate() {
            let y = index("outputs", name);
            let state: f64 = c.iter().filter(|e| e.0 == y).map(|e| e.2 * x[e.1]).sum();
            let direct: f64 = d.iter().filter(|e| e.0 == y && e.1 == u).map(|e| e.2).sum();
            let slope = (more[k] - less[k]) / (2.0 * size);
            let found = state + direct;
            assert!(
                found != 0.0 && (slope - found).abs() < 1e-4 * found.abs(),
                "{name} by {input}: {slope} {found}"
            );
        }
    }
}
