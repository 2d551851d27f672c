//! The dynamic filter that estimates the five controlled quantities (eqs 4 and 5).

use crate::parameters::FilterDesign;

/// Scale of the gap and of the position in the filter: u₁ = 250·Δc, x₁ ≈ 250·Δc, x₅ ≈ 250·q
/// (eq. 4), in 1/m.
pub const POSITION_SCALE: f64 = 250.0;
/// Scale of the velocities: x₂ ≈ 2.5·ċ, x₄ ≈ 2.5·q̇, in s/m. It follows from eq. 4's first row,
/// x₁' = 100·x₂.
pub const VELOCITY_SCALE: f64 = 2.5;
/// Scale of the acceleration: u₂ = 0.25·q̈ (eq. 4), in s²/m.
pub const ACCELERATION_SCALE: f64 = 0.25;

/// x' = A·x + B·u, y = C·x + D·u with u = (250·Δc, 0.25·q̈), eqs 4 and 5.
///
/// It is three filters in a chain, with the scales above
/// (g = 250/2.5 = 100 1/s, b = 2.5/0.25 = 10 1/s):
/// - a low-pass of second order on the gap, whose states are gap and gap velocity:
///   x₁' = g·x₂, x₂' = −(ω_c²/g)·(x₁ − u₁) − 2ζ_cω_c·x₂;
/// - a complementary filter for the velocity, gap rate at low and integrated acceleration at high
///   frequency: y₃ = u₂ + (2ζ_vω_v/b)·(x₂ − x₄) − x₃, x₄' = b·y₃, x₃' = (ω_v²/b)·(x₄ − x₂), so that
///   x₄ = [s²·(2.5q/s) + (2ζ_vω_v·s + ω_v²)·x₂] / (s² + 2ζ_vω_v·s + ω_v²);
/// - a complementary filter of first order for the position, gap at low and integrated velocity at
///   high frequency: x₅' = g·x₄ − ω_p·(x₅ − u₁).
///
/// The outputs are y₁ = x₁ (gap), y₂ = x₂ (gap velocity), y₃ (acceleration), y₄ = x₄ (velocity),
/// y₅ = x₅ (position).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// A, row by row, in 1/s.
    pub a: [[f64; 5]; 5],
    /// B, row by row, in 1/s.
    pub b: [[f64; 2]; 5],
    /// C, row by row.
    pub c: [[f64; 5]; 5],
    /// D, row by row.
    pub d: [[f64; 2]; 5],
}

impl Filter {
    /// The matrices of a design; [`crate::filter_design_of_eq_4`] gives eq. 4's.
    pub fn new(design: &FilterDesign) -> Self {
        let FilterDesign {
            gap_cutoff: wc,
            gap_damping: zc,
            velocity_cutoff: wv,
            velocity_damping: zv,
            position_cutoff: wp,
        } = *design;
        let gap_to_velocity = POSITION_SCALE / VELOCITY_SCALE;
        let velocity_to_acceleration = VELOCITY_SCALE / ACCELERATION_SCALE;
        let stiff = wc * wc / gap_to_velocity;
        let blend = 2.0 * zv * wv;
        let slow = wv * wv / velocity_to_acceleration;
        let mix = blend / velocity_to_acceleration;
        Self {
            a: [
                [0.0, gap_to_velocity, 0.0, 0.0, 0.0],
                [-stiff, -2.0 * zc * wc, 0.0, 0.0, 0.0],
                [0.0, -slow, 0.0, slow, 0.0],
                [0.0, blend, -velocity_to_acceleration, -blend, 0.0],
                [0.0, 0.0, 0.0, gap_to_velocity, -wp],
            ],
            b: [[0.0, 0.0], [stiff, 0.0], [0.0, 0.0], [0.0, velocity_to_acceleration], [wp, 0.0]],
            c: [
                [1.0, 0.0, 0.0, 0.0, 0.0],
                [0.0, 1.0, 0.0, 0.0, 0.0],
                [0.0, mix, -1.0, -mix, 0.0],
                [0.0, 0.0, 0.0, 1.0, 0.0],
                [0.0, 0.0, 0.0, 0.0, 1.0],
            ],
            d: [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0], [0.0, 0.0]],
        }
    }

    /// x' in 1/s. `gap_deviation` is Δc in m, `acceleration` q̈ in m/s².
    pub fn rates(&self, x: &[f64; 5], gap_deviation: f64, acceleration: f64) -> [f64; 5] {
        combine(&self.a, &self.b, x, gap_deviation, acceleration)
    }

    /// The five scaled estimates y, in eq. 5's order: gap, gap velocity, acceleration, velocity,
    /// position.
    pub fn estimates(&self, x: &[f64; 5], gap_deviation: f64, acceleration: f64) -> [f64; 5] {
        combine(&self.c, &self.d, x, gap_deviation, acceleration)
    }

    /// The state in which the filter rests: for a gap that deviates by Δc (m) and changes at the
    /// rate ċ (m/s), and a constant acceleration q̈ (m/s²), x₁ = 250·Δc, x₂ = 2.5·ċ, and x₃, x₄, x₅
    /// from their equations with x' = 0. The estimated acceleration is then zero: a constant
    /// accelerometer signal is treated as bias.
    pub fn rest(&self, gap_deviation: f64, gap_rate: f64, acceleration: f64) -> [f64; 5] {
        let x1 = POSITION_SCALE * gap_deviation;
        let x2 = VELOCITY_SCALE * gap_rate;
        let x3 = ACCELERATION_SCALE * acceleration;
        let x4 = x2;
        let x5 = x1 + self.a[4][3] / -self.a[4][4] * x4;
        [x1, x2, x3, x4, x5]
    }
}

fn combine(
    by_state: &[[f64; 5]; 5],
    by_input: &[[f64; 2]; 5],
    x: &[f64; 5],
    gap_deviation: f64,
    acceleration: f64,
) -> [f64; 5] {
    let u = [POSITION_SCALE * gap_deviation, ACCELERATION_SCALE * acceleration];
    let mut result = [0.0; 5];
    for ((value, row), inputs) in result.iter_mut().zip(by_state).zip(by_input) {
        *value = inputs[0] * u[0] + inputs[1] * u[1];
        for (entry, x) in row.iter().zip(x) {
            *value += entry * x;
        }
    }
    result
}
