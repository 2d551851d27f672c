//! The observed order, an independent integration, and runs without loads.

use multibody::{Scheme, State, VehicleDescription, VehicleModel};

use crate::common::run_free;

/// The integration is of fourth order: of each pair of errors, at h and h/2, the quotient is 2⁴ but
/// for higher terms, which may help a coarse step. Errors must stay well above `floor`, what rounding or the reference leaves.
pub fn assert_fourth_order(errors: &[f64], floor: f64) {
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.6..5.8).contains(&order), "order {order} of {errors:?}");
    }
    assert!(errors.iter().all(|e| *e > 10.0 * floor), "too near the floor {floor:e}: {errors:?}");
}

/// Independent solutions of small differential equations: Gragg's modified midpoint rule
/// extrapolated over eight step numbers, so of order 16; nothing in common with Runge-Kutta.
pub fn extrapolated<const N: usize>(
    f: impl Fn(&[f64; N]) -> [f64; N],
    start: [f64; N],
    t: f64,
    steps: usize,
) -> [f64; N] {
    let h = t / steps as f64;
    let along = |y: &[f64; N], d: &[f64; N], s: f64| std::array::from_fn(|i| y[i] + s * d[i]);
    let mut y = start;
    for _ in 0..steps {
        let mut table: Vec<[f64; N]> = Vec::new();
        for k in 0..8 {
            let n = 2 * (k + 1);
            let s = h / n as f64;
            let (mut before, mut now): ([f64; N], [f64; N]) = (y, along(&y, &f(&y), s));
            for _ in 1..n {
                (before, now) = (now, along(&before, &f(&now), 2.0 * s));
            }
            let last = along(&before, &f(&now), s);
            let mut value: [f64; N] = std::array::from_fn(|i| 0.5 * (now[i] + last[i]));
            // Neville's scheme in s²
            for j in 1..=k {
                let ratio = ((k + 1) as f64 / (k + 1 - j) as f64).powi(2);
                let earlier = table[j - 1];
                let next =
                    std::array::from_fn(|i| value[i] + (value[i] - earlier[i]) / (ratio - 1.0));
                table[j - 1] = value;
                value = next;
            }
            table.push(value);
        }
        y = table[7];
    }
    y
}

/// The scheme of order 4, whatever the default is.
pub fn classical(description: &VehicleDescription) -> VehicleModel {
    VehicleModel::new(description).unwrap().with_scheme(Scheme::Classical)
}

/// The state after the time t in steps of h.
pub fn after(model: &VehicleModel, state: &State, h: f64, t: f64) -> State {
    let mut state = state.clone();
    run_free(model, &mut state, h, (t / h).round() as usize);
    state
}
