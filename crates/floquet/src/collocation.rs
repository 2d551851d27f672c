//! Coefficients of exponential collocation at Gauss nodes.
//!
//! Over a step of size h the input of a linear system ż = λ z + g is replaced by the polynomial through its values gᵢ
//! at the nodes cᵢ, and the response to that polynomial is exact:
//!
//! ```text
//! z(cₖh) = e^{cₖλh} z(0) + h Σᵢ aₖᵢ(λh) gᵢ,    z(h) = e^{λh} z(0) + h Σᵢ bᵢ(λh) gᵢ.
//! ```
//!
//! The remainder is orthogonal to polynomials of degree below the number of nodes, so that the error of a run falls
//! with h to the power of twice that number, 6, as long as the input is smooth and |λ|h is not large (Hochbruck and
//! Ostermann 2005, "Exponential Runge-Kutta methods for parabolic problems"). Fast decaying modes cost no stability.

use faer::prelude::c64;

/// Number of nodes.
pub const NODES: usize = 3;

/// Gauss-Legendre nodes on [0, 1].
#[must_use]
pub fn nodes() -> [f64; NODES] {
    let half = 0.1 * 15.0_f64.sqrt();
    [0.5 - half, 0.5, 0.5 + half]
}

/// `d[n][i]`: n-th derivative at 0 of the polynomial that is 1 at node i and 0 at the others.
#[must_use]
pub fn derivatives() -> [[f64; NODES]; NODES] {
    let c = nodes();
    let mut d = [[0.0; NODES]; NODES];
    for i in 0..NODES {
        let (a, b) = (c[(i + 1) % NODES], c[(i + 2) % NODES]);
        let scale = (c[i] - a) * (c[i] - b);
        d[0][i] = a * b / scale;
        d[1][i] = -(a + b) / scale;
        d[2][i] = 2.0 / scale;
    }
    d
}

/// φ₁ … φ₃ of z: φ₀ = e^z, φₖ₊₁ = (φₖ − 1/k!)/z.
fn phi(z: c64) -> [c64; NODES] {
    let one = c64::new(1.0, 0.0);
    if z.norm() < 1.0 {
        // φₖ = Σ zʲ/(j + k)!; the first term left out is below 1/24!
        return std::array::from_fn(|k| {
            let mut sum = c64::new(0.0, 0.0);
            for j in (0..=20_u32).rev() {
                // Horner: 1/(j+k+1)! by successive division
                let next = sum * z / f64::from(j + 2 + u32::try_from(k).unwrap_or(0));
                sum = one + next;
            }
            sum / (1..=k + 1).map(|n| n as f64).product::<f64>()
        });
    }
    let first = (z.exp() - one) / z;
    let second = (first - one) / z;
    let third = (second - one * 0.5) / z;
    [first, second, third]
}

/// The coefficients of one mode and one step size.
#[derive(Debug, Clone, Copy)]
pub struct Coefficients {
    /// e^{cₖλh}.
    pub decay: [c64; NODES],
    /// h·aₖᵢ.
    pub inner: [[c64; NODES]; NODES],
    /// e^{λh}.
    pub end: c64,
    /// h·bᵢ.
    pub weights: [c64; NODES],
}

impl Coefficients {
    /// Of the mode λ (1/s) and a step h (s).
    #[must_use]
    pub fn new(lambda: c64, h: f64) -> Self {
        let d = derivatives();
        let c = nodes();
        let weights = |c: f64| -> [c64; NODES] {
            let phi = phi(lambda * (c * h));
            std::array::from_fn(|i| {
                let mut sum = c64::new(0.0, 0.0);
                for (n, phi) in phi.iter().enumerate() {
                    let power = c.powi(i32::try_from(n).unwrap_or(0) + 1);
                    sum += *phi * (d[n][i] * power * h);
                }
                sum
            })
        };
        Self {
            decay: c.map(|c| (lambda * (c * h)).exp()),
            inner: c.map(weights),
            end: (lambda * h).exp(),
            weights: weights(1.0),
        }
    }
}
