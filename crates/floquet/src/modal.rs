//! The part with constant coefficients, in its modes.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::FloquetError;
use crate::balance::scales;

/// Largest relative error of the frequency response that the modal form may have.
const RESPONSE: f64 = 1e-6;
/// Modes whose part in the response is below this share of the largest are left out: they do not feel the track, or do
/// not press on it.
const NOTHING: f64 = 1e-9;
/// Relative changes of the entries of A that separate the modes of equal magnets. With equal eigenvalues the computed
/// eigenvectors would be nearly parallel.
const CHANGES: [f64; 4] = [0.0, 1e-10, 1e-9, 1e-8];
/// Frequencies at which the modal form is compared with the matrices, per largest and smallest eigenvalue.
const PROBES: [f64; 3] = [0.03, 0.3, 1.0];

/// ż = Λ z + G u, y = Re(H z) + D u: one entry of z for each real eigenvalue and for each conjugate pair.
///
/// G and H are kept as real matrices, real parts above imaginary parts: with s = (Re z, Im z), y = H s + D u.
#[derive(Debug, Clone, PartialEq)]
pub struct Modal {
    /// Eigenvalues with Im λ ≥ 0 (1/s).
    pub values: Vec<c64>,
    /// G (2 modes × inputs).
    pub g: Mat<f64>,
    /// H (outputs × 2 modes).
    pub h: Mat<f64>,
    /// D (outputs × inputs).
    pub d: Mat<f64>,
    /// Largest real part of the eigenvalues of modes that are left out (1/s): what they do, the girders do not change.
    pub left_out: f64,
}

fn complex(m: &Mat<f64>) -> Mat<c64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0))
}

/// A with every entry changed by up to this share, always in the same way.
fn changed(a: &Mat<f64>, share: f64) -> Mat<f64> {
    // Knuth's linear congruential generator (MMIX)
    let mut seed = 1_u64;
    Mat::from_fn(a.nrows(), a.ncols(), |i, j| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let part = (seed >> 11) as f64 / (1_u64 << 53) as f64;
        a[(i, j)] * (1.0 + share * (2.0 * part - 1.0))
    })
}

impl Modal {
    /// No states: y = D u.
    #[must_use]
    pub fn feedthrough(d: Mat<f64>) -> Self {
        let (rows, columns) = (d.nrows(), d.ncols());
        let left_out = f64::NEG_INFINITY;
        Self { values: Vec::new(), g: Mat::zeros(0, columns), h: Mat::zeros(rows, 0), d, left_out }
    }

    /// Of ż = A z + B u, y = C z + D u.
    ///
    /// # Errors
    /// The eigenvalues cannot be found, or A has no complete set of modes: then the frequency response of the modes is
    /// not that of the matrices.
    pub fn new(
        a: &Mat<f64>,
        b: &Mat<f64>,
        c: &Mat<f64>,
        d: Mat<f64>,
    ) -> Result<Self, FloquetError> {
        if a.nrows() == 0 {
            return Ok(Self::feedthrough(d));
        }
        let scale = scales(a);
        let n = a.nrows();
        let a = Mat::from_fn(n, n, |i, j| a[(i, j)] * scale[j] / scale[i]);
        let b = Mat::from_fn(n, b.ncols(), |i, j| b[(i, j)] / scale[i]);
        let c = Mat::from_fn(c.nrows(), n, |i, j| c[(i, j)] * scale[j]);
        // few states are hardly equal
        let changes = if n < 20 { CHANGES } else { [CHANGES[1], CHANGES[2], CHANGES[3], 0.0] };
        let mut least = f64::INFINITY;
        for change in changes {
            let modal = Self::of(&changed(&a, change), &b, &c, &d)?;
            let error = modal.error(&a, &b, &c);
            if error <= RESPONSE {
                return Ok(modal);
            }
            least = least.min(error);
        }
        Err(FloquetError::Defective { error: least })
    }

    /// By the eigenvectors of A, however well they are separated.
    fn of(a: &Mat<f64>, b: &Mat<f64>, c: &Mat<f64>, d: &Mat<f64>) -> Result<Self, FloquetError> {
        let eigen = a
            .eigen()
            .map_err(|_| FloquetError::Eigenvalues("modes of the train on a rigid track"))?;
        let shapes = eigen.U().to_owned();
        let by_input = PartialPivLu::new(shapes.as_ref()).solve(complex(b));
        let of_output = complex(c) * &shapes;
        // how much a mode takes part in the response, whatever the scale of its shape
        let part = |k: usize| {
            let moved = (0..b.ncols()).map(|j| by_input[(k, j)].norm_sqr()).sum::<f64>();
            let pressed = (0..c.nrows()).map(|i| of_output[(i, k)].norm_sqr()).sum::<f64>();
            (moved * pressed).sqrt()
        };
        let largest = (0..a.nrows()).map(part).fold(0.0, f64::max);
        let upper: Vec<usize> = (0..a.nrows())
            .filter(|&k| eigen.S()[k].im >= 0.0 && part(k) > NOTHING * largest)
            .collect();
        let n = upper.len();
        let values: Vec<c64> = upper.iter().map(|&k| eigen.S()[k]).collect();
        let g = Mat::from_fn(2 * n, b.ncols(), |i, j| {
            let value = by_input[(upper[i % n], j)];
            if i < n { value.re } else { value.im }
        });
        let h = Mat::from_fn(c.nrows(), 2 * n, |i, j| {
            let k = upper[j % n];
            let weight = if eigen.S()[k].im > 0.0 { 2.0 } else { 1.0 };
            let value = of_output[(i, k)] * weight;
            if j < n { value.re } else { -value.im }
        });
        let left_out = (0..a.nrows())
            .filter(|&k| part(k) <= NOTHING * largest)
            .map(|k| eigen.S()[k].re)
            .fold(f64::NEG_INFINITY, f64::max);
        Ok(Self { values, g, h, d: d.clone(), left_out })
    }

    /// Number of modes; a conjugate pair counts once.
    #[must_use]
    pub fn modes(&self) -> usize {
        self.values.len()
    }

    /// The slowest decaying mode of at least this frequency (Hz) among those that are kept.
    #[must_use]
    pub fn slowest(&self, above: f64) -> Option<c64> {
        let fast = |it: &&c64| it.norm() >= above * std::f64::consts::TAU;
        self.values.iter().filter(fast).max_by(|a, b| a.re.total_cmp(&b.re)).copied()
    }

    /// Number of inputs.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.d.ncols()
    }

    /// Number of outputs.
    #[must_use]
    pub fn outputs(&self) -> usize {
        self.d.nrows()
    }

    /// Relative error of H (jω − Λ)⁻¹ G against C (jω − A)⁻¹ B at some frequencies.
    fn error(&self, a: &Mat<f64>, b: &Mat<f64>, c: &Mat<f64>) -> f64 {
        let fastest = self.values.iter().map(|value| value.norm()).fold(0.0, f64::max);
        let mut worst = 0.0_f64;
        for probe in PROBES {
            let omega = probe * fastest;
            let shifted = Mat::from_fn(a.nrows(), a.nrows(), |i, j| {
                c64::new(-a[(i, j)], if i == j { omega } else { 0.0 })
            });
            let exact = complex(c) * PartialPivLu::new(shifted.as_ref()).solve(complex(b));
            let direct = complex(&self.d);
            let found = self.response(omega) - &direct;
            let size = exact.norm_l2();
            if size > 0.0 {
                worst = worst.max((&exact - &found).norm_l2() / size);
            }
        }
        // also true for NaN
        if worst.is_finite() { worst } else { f64::INFINITY }
    }

    /// The frequency response from u to y at a circular frequency (rad/s).
    #[must_use]
    pub fn response(&self, omega: f64) -> Mat<c64> {
        let columns = self.by_input(omega);
        let (n, inputs) = (2 * self.modes(), self.inputs());
        let mut sum = Mat::from_fn(self.outputs(), inputs, |i, j| c64::new(self.d[(i, j)], 0.0));
        let real = &self.h * Mat::from_fn(n, inputs, |i, j| columns[(i, j)].re);
        let imaginary = &self.h * Mat::from_fn(n, inputs, |i, j| columns[(i, j)].im);
        for j in 0..inputs {
            for i in 0..self.outputs() {
                sum[(i, j)] += c64::new(real[(i, j)], imaginary[(i, j)]);
            }
        }
        sum
    }

    /// (jω − Λ)⁻¹ G in the coordinates (Re z, Im z).
    fn by_input(&self, omega: f64) -> Mat<c64> {
        let n = self.modes();
        let mut x = Mat::zeros(2 * n, self.inputs());
        for (k, value) in self.values.iter().enumerate() {
            let (p, b) = (c64::new(-value.re, omega), value.im);
            let inverse = (p * p + b * b).inv();
            for j in 0..self.inputs() {
                let (re, im) = (self.g[(k, j)], self.g[(n + k, j)]);
                x[(k, j)] = (p * re - b * im) * inverse;
                x[(n + k, j)] = (p * im + b * re) * inverse;
            }
        }
        x
    }
}
