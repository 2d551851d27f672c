//! A smaller constant part with nearly the same response: balanced truncation.

use faer::Mat;
use faer::linalg::solvers::Svd;

use crate::{FloquetError, Modal};

/// Frequencies of the quadrature.
const FREQUENCIES: usize = 80;

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
/// approximated is outputsᵀ·(response)·inputs. The Gramians are integrals over the frequency, so that their factors
/// follow from the response at some frequencies (Phillips and Silveira 2005, "Poor man's TBR"), without forming
/// products that would lose half of the digits. `band` is the range of circular frequencies (rad/s) in which the error
/// is measured.
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
    };
    let (controllable, observable) = factors(&weighted);
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
    let modal = Modal::new(&a, &(&left * &full.g), &(&full.h * &right), full.d.clone())?;
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
fn factors(modal: &Modal) -> (Mat<f64>, Mat<f64>) {
    let sizes = || modal.values.iter().map(|value| value.norm());
    let fastest = sizes().fold(0.0, f64::max);
    let slowest = sizes().filter(|&it| it > 1e-6 * fastest).fold(fastest, f64::min);
    let (low, high) = (0.2 * slowest, 4.0 * fastest);
    let ratio = (high / low).powf(1.0 / (FREQUENCIES - 1) as f64);
    let mut omegas = vec![0.0];
    omegas.extend((0..FREQUENCIES).map(|k| low * ratio.powf(k as f64)));
    let n2 = 2 * modal.modes();
    let (m, p, count) = (modal.inputs(), modal.outputs(), omegas.len());
    let mut by_input = Mat::zeros(2 * m * count, n2);
    let mut of_output = Mat::zeros(2 * p * count, n2);
    for (k, &omega) in omegas.iter().enumerate() {
        // trapezoidal rule
        let before = if k > 0 { omega - omegas[k - 1] } else { 0.0 };
        let after = if k + 1 < count { omegas[k + 1] - omega } else { 0.0 };
        let weight = (0.5 * (before + after)).sqrt();
        let (x, y) = (modal.by_input(omega), modal.of_output(omega));
        for i in 0..n2 {
            for j in 0..m {
                by_input[(2 * (k * m + j), i)] = weight * x[(i, j)].re;
                by_input[(2 * (k * m + j) + 1, i)] = weight * x[(i, j)].im;
            }
            for j in 0..p {
                of_output[(2 * (k * p + j), i)] = weight * y[(j, i)].re;
                of_output[(2 * (k * p + j) + 1, i)] = weight * y[(j, i)].im;
            }
        }
    }
    (by_input.qr().thin_R().to_owned(), of_output.qr().thin_R().to_owned())
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
    let complex = |m: &Mat<f64>| {
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| faer::prelude::c64::new(m[(i, j)], 0.0))
    };
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
