//! From one iterate of a fixed-point iteration x = G(x) to the next, with r = G(x) − x.
//!
//! - **Relaxation**: x ← x + ω r.
//! - **Aitken**'s dynamic relaxation (Irons & Tuck 1969; Küttler & Wall 2008):
//!   ω ← −ω · r₋·(r − r₋)/|r − r₋|², with the last residual r₋.
//! - **Anderson** acceleration (Anderson 1965), in its quasi-Newton form that fluid-structure codes
//!   call IQN-ILS (Degroote, Bathe & Vierendeels 2009): from the differences V of successive
//!   residuals and W of successive G(x) within the step, x ← G(x) + W α with α the least-squares
//!   solution of V α ≈ −r. For a linear problem in n unknowns it ends after n + 1 differences;
//!   usually it needs only the few directions in which the coupling is strong.
//!
//! All norms are of components divided by their scales, since signals have different units.

use scenario::algorithm::Acceleration;

/// Number of differences that Anderson acceleration keeps.
const DEPTH: usize = 8;
/// A difference is dropped if its component orthogonal to the others is below this fraction of its
/// length.
const DEPENDENT: f64 = 1e-7;

/// Computes the next iterate from the last ones.
#[derive(Debug, Clone)]
pub struct Accelerator {
    kind: Acceleration,
    relaxation: f64,
    omega: f64,
    /// iterates so far in this step
    count: usize,
    last_residual: Vec<f64>,
    last_image: Vec<f64>,
    /// rows: scaled differences of residuals, latest first; and of images, not scaled
    residuals: Vec<Vec<f64>>,
    images: Vec<Vec<f64>>,
    basis: Vec<Vec<f64>>,
    triangle: [[f64; DEPTH]; DEPTH],
}

impl Accelerator {
    /// For so many unknowns. `relaxation` is ω, of Aitken's method and Anderson acceleration for the
    /// first step.
    #[must_use]
    pub fn new(kind: Acceleration, relaxation: f64, size: usize) -> Self {
        let rows = || vec![vec![0.0; size]; if kind == Acceleration::Anderson { DEPTH } else { 0 }];
        Self {
            kind,
            relaxation,
            omega: relaxation,
            count: 0,
            last_residual: vec![0.0; size],
            last_image: vec![0.0; size],
            residuals: rows(),
            images: rows(),
            basis: rows(),
            triangle: [[0.0; DEPTH]; DEPTH],
        }
    }

    /// Discards the history: a new step begins.
    pub fn begin(&mut self) {
        self.count = 0;
        self.omega = self.relaxation;
    }

    /// Replaces `x`, whose image is `image`, by the next iterate.
    pub fn next(&mut self, x: &mut [f64], image: &[f64], scales: &[f64]) {
        match self.kind {
            Acceleration::None => relax(x, image, self.relaxation),
            Acceleration::Aitken => {
                if self.count > 0 {
                    self.omega = self.aitken(x, image, scales);
                }
                self.remember(x, image);
                relax(x, image, self.omega);
            }
            Acceleration::Anderson => {
                if self.count > 0 {
                    self.add_difference(x, image, scales);
                }
                self.remember(x, image);
                if self.count > 1 {
                    self.quasi_newton(x, image, scales);
                } else {
                    relax(x, image, self.relaxation);
                }
            }
        }
    }

    fn remember(&mut self, x: &[f64], image: &[f64]) {
        for ((last, image), x) in self.last_residual.iter_mut().zip(image).zip(x) {
            *last = image - x;
        }
        self.last_image.copy_from_slice(image);
        self.count += 1;
    }

    fn aitken(&self, x: &[f64], image: &[f64], scales: &[f64]) -> f64 {
        let (mut along, mut square) = (0.0, 0.0);
        for (i, scale) in scales.iter().enumerate() {
            let last = self.last_residual[i];
            let change = image[i] - x[i] - last;
            along += last / scale * change / scale;
            square += (change / scale).powi(2);
        }
        if square > 0.0 { (-self.omega * along / square).clamp(-10.0, 10.0) } else { self.omega }
    }

    fn add_difference(&mut self, x: &[f64], image: &[f64], scales: &[f64]) {
        self.residuals.rotate_right(1);
        self.images.rotate_right(1);
        for (i, scale) in scales.iter().enumerate() {
            self.residuals[0][i] = (image[i] - x[i] - self.last_residual[i]) / scale;
            self.images[0][i] = image[i] - self.last_image[i];
        }
    }

    /// Least squares by modified Gram-Schmidt, latest difference first.
    fn quasi_newton(&mut self, x: &mut [f64], image: &[f64], scales: &[f64]) {
        let known = (self.count - 1).min(DEPTH);
        let mut used = [0; DEPTH];
        let mut rank = 0;
        for column in 0..known {
            let (done, rest) = self.basis.split_at_mut(rank);
            let q = &mut rest[0];
            q.copy_from_slice(&self.residuals[column]);
            let length = norm(q);
            for (k, base) in done.iter().enumerate() {
                let part = dot(base, q);
                self.triangle[k][rank] = part;
                q.iter_mut().zip(base).for_each(|(q, b)| *q -= part * b);
            }
            let left = norm(q);
            if left > DEPENDENT * length && left > 0.0 {
                q.iter_mut().for_each(|q| *q /= left);
                self.triangle[rank][rank] = left;
                used[rank] = column;
                rank += 1;
            }
        }
        let mut alpha = [0.0; DEPTH];
        for (k, base) in self.basis[..rank].iter().enumerate() {
            let mut part = 0.0;
            for (i, scale) in scales.iter().enumerate() {
                part += base[i] * (image[i] - x[i]) / scale;
            }
            alpha[k] = -part;
        }
        for k in (0..rank).rev() {
            for j in k + 1..rank {
                alpha[k] -= self.triangle[k][j] * alpha[j];
            }
            alpha[k] /= self.triangle[k][k];
        }
        x.copy_from_slice(image);
        for (alpha, &column) in alpha.iter().zip(&used[..rank]) {
            x.iter_mut().zip(&self.images[column]).for_each(|(x, w)| *x += alpha * w);
        }
    }
}

fn relax(x: &mut [f64], image: &[f64], omega: f64) {
    for (x, image) in x.iter_mut().zip(image) {
        *x += omega * (image - *x);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}
