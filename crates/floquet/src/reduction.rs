//! A smaller constant part with nearly the same response: balanced truncation.

use faer::linalg::solvers::Svd;
use faer::prelude::c64;
use faer::{Mat, Side};

use crate::{FloquetError, Modal};

/// Decay rate (1/s) that every mode has at least while Gramians are computed.
const LEAST_DECAY: f64 = 0.05;

/// A reduced system, and how well it represents the full one.
#[derive(Debug, Clone)]
pub struct Reduction {
    /// The reduced system.
    pub modal: Modal,
    /// States of the full system, and of the reduced one.
    pub states: (usize, usize),
    /// Largest relative error of the weighted frequency response between the frequencies given.
    pub error: f64,
}

/// Truncates the balanced system to states with Hankel singular values above `tolerance` of the largest.
///
/// `inputs` (inputs × directions) and `outputs` (outputs × directions) weigh what occurs: the response that is
/// approximated is outputsᵀ·(response)·inputs (Moore 1981; square-root method of Tombs and Postlethwaite 1987). Singular
/// values below some 1e-8 of the largest are rounding errors. `band` is the range of circular frequencies (rad/s) in
/// which the error is measured.
///
/// # Errors
/// Singular values or eigenvalues cannot be found.
pub fn reduced(
    full: &Modal,
    inputs: &Mat<f64>,
    outputs: &Mat<f64>,
    tolerance: f64,
    band: (f64, f64),
) -> Result<Reduction, FloquetError> {
    let weighted = Modal {
        values: full.values.clone(),
        g: &full.g * inputs,
        h: outputs.transpose() * &full.h,
        d: outputs.transpose() * &full.d * inputs,
        left_out: full.left_out,
    };
    let (controllable, observable) = factors(&weighted)?;
    let svd = singular(&(&observable * controllable.transpose()))?;
    let values: Vec<f64> = (0..svd.S().column_vector().nrows()).map(|k| svd.S()[k]).collect();
    let largest = values.first().copied().unwrap_or(0.0);
    let order = values.iter().take_while(|&&value| value > tolerance * largest).count();
    let n2 = 2 * full.modes();
    let right = Mat::from_fn(n2, order, |i, j| {
        let sum: f64 =
            (0..controllable.nrows()).map(|k| controllable[(k, i)] * svd.V()[(k, j)]).sum();
        sum / values[j].sqrt()
    });
    let left = Mat::from_fn(order, n2, |i, j| {
        let sum: f64 = (0..observable.nrows()).map(|k| svd.U()[(k, i)] * observable[(k, j)]).sum();
        sum / values[i].sqrt()
    });
    let a = &left * derivative(full, &right);
    let mut modal = Modal::new(&a, &(&left * &full.g), &(&full.h * &right), full.d.clone())?;
    modal.left_out = modal.left_out.max(full.left_out);
    let error = error(full, &modal, inputs, outputs, band);
    Ok(Reduction { modal, states: (states(full), order), error })
}

/// Number of real states.
fn states(modal: &Modal) -> usize {
    modal.values.iter().map(|value| if value.im > 0.0 { 2 } else { 1 }).sum()
}

/// Λ times a matrix in the coordinates (Re z, Im z).
fn derivative(modal: &Modal, x: &Mat<f64>) -> Mat<f64> {
    let n = modal.modes();
    Mat::from_fn(2 * n, x.ncols(), |i, j| {
        let value = modal.values[i % n];
        let (re, im) = (x[(i % n, j)], x[(n + i % n, j)]);
        if i < n { value.re * re - value.im * im } else { value.im * re + value.re * im }
    })
}

/// Factors L with LᵀL the Gramian, of the inputs and of the outputs.
///
/// In the modes the integrals over time have closed forms, ∫ e^{λₐt} e^{λ̄ᵦt} dt = −1/(λₐ + λ̄ᵦ). Modes that do not
/// decay are treated as if all decayed faster.
fn factors(modal: &Modal) -> Result<(Mat<f64>, Mat<f64>), FloquetError> {
    let growth = modal.values.iter().map(|value| value.re).fold(f64::NEG_INFINITY, f64::max);
    let shift = (growth + LEAST_DECAY).max(0.0);
    let values: Vec<c64> = modal.values.iter().map(|value| value - shift).collect();
    let n = values.len();
    let g: Vec<Vec<c64>> = (0..n)
        .map(|k| {
            (0..modal.inputs()).map(|j| c64::new(modal.g[(k, j)], modal.g[(n + k, j)])).collect()
        })
        .collect();
    let h: Vec<Vec<c64>> = (0..n)
        .map(|k| {
            (0..modal.outputs()).map(|i| c64::new(modal.h[(i, k)], -modal.h[(i, n + k)])).collect()
        })
        .collect();
    // e^{Λt} G has the parts Re and Im of z; y = Re(h z) has h on Re z, and its imaginary part negative on Im z
    Ok((root(&gramian(&values, &g, 1.0))?, root(&gramian(&values, &h, -1.0))?))
}

/// ∫ w wᵀ dt for w = (Re v, sign·Im v) with v = e^{λt} times these rows.
fn gramian(values: &[c64], rows: &[Vec<c64>], sign: f64) -> Mat<f64> {
    let n = values.len();
    let mut gramian = Mat::zeros(2 * n, 2 * n);
    for a in 0..n {
        for b in 0..n {
            let (mut s, mut t) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
            for (x, y) in rows[a].iter().zip(&rows[b]) {
                s += x * y.conj();
                t += x * y;
            }
            let (s, t) = (-s / (values[a] + values[b].conj()), -t / (values[a] + values[b]));
            gramian[(a, b)] = 0.5 * (s + t).re;
            gramian[(n + a, n + b)] = 0.5 * (s - t).re;
            gramian[(a, n + b)] = 0.5 * sign * (t - s).im;
            gramian[(n + a, b)] = 0.5 * sign * (t + s).im;
        }
    }
    gramian
}

/// L with LᵀL = a symmetric matrix without negative eigenvalues.
fn root(matrix: &Mat<f64>) -> Result<Mat<f64>, FloquetError> {
    let n = matrix.nrows();
    let eigen = matrix
        .self_adjoint_eigen(Side::Lower)
        .map_err(|_| FloquetError::Eigenvalues("eigenvalues of the Gramian"))?;
    Ok(Mat::from_fn(n, n, |i, j| eigen.S()[i].max(0.0).sqrt() * eigen.U()[(j, i)]))
}

fn singular(matrix: &Mat<f64>) -> Result<Svd<f64>, FloquetError> {
    matrix.thin_svd().map_err(|_| FloquetError::Eigenvalues("singular values of the reduction"))
}

/// Largest relative difference of the weighted responses at frequencies between those of the band.
fn error(
    full: &Modal,
    small: &Modal,
    inputs: &Mat<f64>,
    outputs: &Mat<f64>,
    band: (f64, f64),
) -> f64 {
    let complex =
        |m: &Mat<f64>| Mat::from_fn(m.nrows(), m.ncols(), |i, j| c64::new(m[(i, j)], 0.0));
    let (u, y) = (complex(inputs), complex(&outputs.transpose().to_owned()));
    let points = 16;
    (0..points)
        .map(|k| {
            let part = (f64::from(k) + 0.5) / f64::from(points);
            let omega = band.0 * (band.1 / band.0).powf(part);
            let exact = &y * full.response(omega) * &u;
            let found = &y * small.response(omega) * &u;
            (&exact - &found).norm_l2() / exact.norm_l2()
        })
        .fold(0.0, f64::max)
}

/// Directions in which signals occur, each weighted by its size, from samples (signals × samples): fewer columns with
/// the same sum of squares in every direction.
///
/// # Errors
/// The singular values cannot be found.
pub fn directions(samples: &Mat<f64>) -> Result<Mat<f64>, FloquetError> {
    let svd = singular(samples)?;
    let count = samples.nrows().min(samples.ncols());
    let largest = svd.S()[0];
    let kept = (0..count).take_while(|&k| svd.S()[k] > 1e-12 * largest).count();
    Ok(Mat::from_fn(samples.nrows(), kept, |i, j| svd.U()[(i, j)] * svd.S()[j]))
}
