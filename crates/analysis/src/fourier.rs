//! The Fourier transform of real signals, and what removes a mean or a slope before it.

use std::cell::RefCell;
use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use crate::error::Error;

thread_local! {
    /// Plans of the lengths seen: signals of a run have one length, and a plan costs more than its use.
    static PLANNER: RefCell<RealFftPlanner<f64>> = RefCell::new(RealFftPlanner::new());
}

/// The transform of real pieces of one length, with its buffers.
pub(crate) struct Transform {
    plan: Arc<dyn RealToComplex<f64>>,
    /// What is transformed; overwritten by it.
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

/// Which part of a piece is taken out before it is windowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detrend {
    /// Nothing.
    None,
    /// Its mean.
    #[default]
    Constant,
    /// The straight line that fits it best.
    Linear,
}

impl Detrend {
    /// Takes it out of `piece`.
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
