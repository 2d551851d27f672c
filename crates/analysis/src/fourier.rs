//! The Fourier transform of real signals, and the removal of a mean or a slope before it.

use std::cell::RefCell;
use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use crate::error::Error;

thread_local! {
    /// Plans by length: the signals of a run have one length, and a plan costs more than a
    /// transform.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// The transform of real pieces of one length, with its buffers.
pub(crate) struct Transform {
    plan: Arc<dyn RealToComplex<f64>>,
    /// Input of the transform, which overwrites it.
    pub input: Vec<f64>,
    output: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

impl Transform {
    /// For pieces of `length` samples.
    pub fn new(length: usize) -> Self {
        let plan = PLANNER.with_borrow_mut(|planner| planner.plan_fft_forward(length));
        Self {
            input: plan.make_input_vec(),
            output: plan.make_output_vec(),
            scratch: plan.make_scratch_vec(),
            plan,
        }
    }

    /// X_k = Σ x_n e^(-2πikn/N) of `input`, for k = 0 … N/2.
    pub fn run(&mut self) -> Result<&[Complex64], Error> {
        self.plan
            .process_with_scratch(&mut self.input, &mut self.output, &mut self.scratch)
            .map_err(|error| Error::Transform {
                length: self.plan.len(),
                reason: error.to_string(),
            })?;
        Ok(&self.output)
    }
}

/// What is subtracted from a piece before it is windowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detrend {
    /// Nothing.
    None,
    /// Its mean.
    #[default]
    Constant,
    /// The line of least squares.
    Linear,
}

impl Detrend {
    /// Subtracts it from `piece`.
    pub(crate) fn remove(self, piece: &mut [f64]) {
        let count = piece.len() as f64;
        let mean = piece.iter().sum::<f64>() / count;
        let centre = 0.5 * (count - 1.0);
        let slope = match self {
            Self::None => return,
            Self::Constant => 0.0,
            Self::Linear => {
                let moment: f64 =
                    piece.iter().enumerate().map(|(i, x)| (i as f64 - centre) * x).sum();
                // Σ (i - centre)² = n (n² - 1) / 12
                moment * 12.0 / (count * (count * count - 1.0))
            }
        };
        for (i, x) in piece.iter_mut().enumerate() {
            *x -= mean + slope * (i as f64 - centre);
        }
    }
}

/// Applies a linear filter to a signal that is zero before its first sample. The filter is given by
/// its response at any frequency from 0 to half the rate.
///
/// The response is applied to the transform of the zero-padded signal, so it is exact at any rate.
/// `memory` in s is the duration of the filter's response: that many zeros keep the response to the
/// end of the signal from wrapping around to its beginning.
pub(crate) fn filter(
    values: &[f64],
    rate: f64,
    memory: f64,
    response: impl Fn(f64) -> Complex64,
) -> Result<Vec<f64>, Error> {
    let zeros = (memory * rate).ceil() as usize;
    // a power of two has the cheapest transform
    let length = (values.len() + zeros).next_power_of_two();
    let mut forward = Transform::new(length);
    forward.input.fill(0.0);
    forward.input[..values.len()].copy_from_slice(values);
    forward.run()?;
    let mut spectrum = forward.output;
    let last = spectrum.len() - 1;
    for (k, x) in spectrum.iter_mut().enumerate() {
        *x *= response(k as f64 * rate / length as f64) / length as f64;
        // the first and last value of a real signal's spectrum are real
        if k == 0 || k == last {
            x.im = 0.0;
        }
    }
    let inverse = PLANNER.with_borrow_mut(|planner| planner.plan_fft_inverse(length));
    let mut filtered = forward.input;
    inverse
        .process(&mut spectrum, &mut filtered)
        .map_err(|error| Error::Transform { length, reason: error.to_string() })?;
    filtered.truncate(values.len());
    Ok(filtered)
}

/// Σ_k y_k x_(k+s) for every shift s; that of a negative shift is at the end, as of the shift plus the length.
pub(crate) fn correlation_sums(x: &[f64], y: &[f64]) -> Result<Vec<f64>, Error> {
    let length = (x.len() + y.len()).next_power_of_two();
    let spectrum = |signal: &[f64]| {
        let mut transform = Transform::new(length);
        transform.input.fill(0.0);
        transform.input[..signal.len()].copy_from_slice(signal);
        transform.run()?;
        Ok(transform.output)
    };
    let (mut product, other) = (spectrum(x)?, spectrum(y)?);
    let last = product.len() - 1;
    for (k, (a, b)) in product.iter_mut().zip(&other).enumerate() {
        *a *= b.conj() / length as f64;
        // the first and last value of a real signal's spectrum are real
        if k == 0 || k == last {
            a.im = 0.0;
        }
    }
    let inverse = PLANNER.with_borrow_mut(|planner| planner.plan_fft_inverse(length));
    let mut sums = inverse.make_output_vec();
    inverse
        .process(&mut product, &mut sums)
        .map_err(|error| Error::Transform { length, reason: error.to_string() })?;
    Ok(sums)
}
