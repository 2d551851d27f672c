//! State-space models, continuous or sampled, and their feedback.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;
use faer::{Mat, MatRef};
use linear::StateSpace;

use crate::error::ResponseError;

/// A pole this near to the border of stability, relative to its size, counts as lying on it: rounding
/// moves poles that do.
const ON_THE_BORDER: f64 = 1e-7;

/// What the variable of a transfer function is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Domain {
    /// s: ẋ = A x + B u.
    Continuous,
    /// z: x(k+1) = A x(k) + B u(k), a step of `period` (s).
    Sampled {
        /// Sample time (s).
        period: f64,
    },
}

impl Domain {
    /// s = jω, or z = exp(jωh).
    #[must_use]
    pub fn point(self, omega: f64) -> c64 {
        match self {
            Self::Continuous => c64::new(0.0, omega),
            Self::Sampled { period } => c64::from_polar(1.0, omega * period),
        }
    }

    /// Highest angular frequency (rad/s): half a period per sample.
    #[must_use]
    pub fn highest(self) -> f64 {
        match self {
            Self::Continuous => f64::INFINITY,
            Self::Sampled { period } => std::f64::consts::PI / period,
        }
    }

    /// Growth of a pole: Re s, or ln|z|/h (1/s).
    #[must_use]
    pub fn growth(self, pole: c64) -> f64 {
        match self {
            Self::Continuous => pole.re,
            Self::Sampled { period } => pole.norm().ln() / period,
        }
    }

    /// A pole as eigenvalue of a differential equation (1/s): itself, or ln z/h.
    #[must_use]
    pub fn rate(self, pole: c64) -> c64 {
        match self {
            Self::Continuous => pole,
            Self::Sampled { period } => pole.ln() / period,
        }
    }

    /// −1 for a pole that decays, 0 for one on the border, 1 for one that grows.
    #[must_use]
    pub fn side(self, pole: c64) -> i8 {
        let (distance, size) = match self {
            Self::Continuous => (pole.re, pole.norm().max(1e-3)),
            Self::Sampled { .. } => (pole.norm() - 1.0, 1.0),
        };
        if distance.abs() <= ON_THE_BORDER * size { 0 } else { distance.signum() as i8 }
    }
}

/// y = (C (σI − A)⁻¹ B + D) u, with σ = s or z.
#[derive(Debug, Clone)]
pub struct Model {
    /// A.
    pub a: Mat<f64>,
    /// B.
    pub b: Mat<f64>,
    /// C.
    pub c: Mat<f64>,
    /// D.
    pub d: Mat<f64>,
    /// Continuous or sampled.
    pub domain: Domain,
}

impl From<&StateSpace> for Model {
    fn from(it: &StateSpace) -> Self {
        let (a, b, c, d) = (it.a.clone(), it.b.clone(), it.c.clone(), it.d.clone());
        Self { a, b, c, d, domain: Domain::Continuous }
    }
}

impl Model {
    /// Poles.
    ///
    /// # Errors
    /// The eigenvalues do not converge.
    pub fn poles(&self) -> Result<Vec<c64>, ResponseError> {
        if self.a.nrows() == 0 {
            return Ok(Vec::new());
        }
        Ok(linear::eigenvalues(&self.a)?)
    }

    /// Without the states that no input reaches, or that reach no output. The transfer function is the
    /// same.
    #[must_use]
    pub fn reduced(&self) -> Self {
        let n = self.a.nrows();
        let forward = |j: usize, i: usize| self.a[(i, j)] != 0.0;
        let backward = |j: usize, i: usize| self.a[(j, i)] != 0.0;
        let entered = |i: usize| self.b.row(i).iter().any(|x| *x != 0.0);
        let shown = |i: usize| self.c.col(i).iter().any(|x| *x != 0.0);
        let (reached, reaching) = (reach(n, entered, forward), reach(n, shown, backward));
        let kept: Vec<usize> = (0..n).filter(|&i| reached[i] && reaching[i]).collect();
        let m = kept.len();
        Self {
            a: Mat::from_fn(m, m, |i, j| self.a[(kept[i], kept[j])]),
            b: Mat::from_fn(m, self.b.ncols(), |i, j| self.b[(kept[i], j)]),
            c: Mat::from_fn(self.c.nrows(), m, |i, j| self.c[(i, kept[j])]),
            d: self.d.clone(),
            domain: self.domain,
        }
    }

    /// From r to y with the loop closed by u = r − y. `None` if that has no solution.
    #[must_use]
    pub fn closed(&self) -> Option<Self> {
        let identity = Mat::<f64>::identity(self.d.nrows(), self.d.nrows());
        self.fed_back((&identity + &self.d).as_ref())
    }

    /// The loop transfer function L, of the sign with which 1 + L is singular, from the transfer function
    /// of the closed system between what adds to a signal and the signal. `None` if that has no solution.
    #[must_use]
    pub fn opened(&self) -> Option<Self> {
        // v = T d with v = C x + D d; the signal that acts is v + d, which becomes the input
        let identity = Mat::<f64>::identity(self.d.nrows(), self.d.nrows());
        let open = self.fed_back((&identity + &self.d).as_ref())?;
        Some(Self { c: -&open.c, d: -&open.d, ..open })
    }

    /// A − B K C, B K, K C, K D with the inverse K of a matrix.
    fn fed_back(&self, inverse: MatRef<'_, f64>) -> Option<Self> {
        let lu = PartialPivLu::new(inverse);
        let (c, d) = (lu.solve(&self.c), lu.solve(&self.d));
        let identity = Mat::<f64>::identity(inverse.nrows(), inverse.nrows());
        let b = &self.b * lu.solve(&identity);
        let a = &self.a - &self.b * &c;
        let finite = |m: &Mat<f64>| m.col_iter().all(|it| it.iter().all(|x| x.is_finite()));
        let all = [&a, &b, &c, &d].into_iter().all(finite);
        all.then_some(Self { a, b, c, d, domain: self.domain })
    }

    /// One input and one output.
    #[must_use]
    pub fn entry(&self, output: usize, input: usize) -> Self {
        let n = self.a.nrows();
        Self {
            a: self.a.clone(),
            b: Mat::from_fn(n, 1, |i, _| self.b[(i, input)]),
            c: Mat::from_fn(1, n, |_, j| self.c[(output, j)]),
            d: Mat::from_fn(1, 1, |_, _| self.d[(output, input)]),
            domain: self.domain,
        }
    }
}

/// States that are reached from some by steps.
fn reach(
    n: usize,
    start: impl Fn(usize) -> bool,
    step: impl Fn(usize, usize) -> bool,
) -> Vec<bool> {
    let mut reached: Vec<bool> = (0..n).map(start).collect();
    let mut waiting: Vec<usize> = (0..n).filter(|&i| reached[i]).collect();
    while let Some(j) = waiting.pop() {
        for (i, reached) in reached.iter_mut().enumerate() {
            if !*reached && step(j, i) {
                *reached = true;
                waiting.push(i);
            }
        }
    }
    reached
}
