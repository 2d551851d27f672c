//! Measures of ride quality: [`iso2631`] and [`sperling`].
//!
//! Both weight an acceleration by frequency, according to human perception, and compute numbers
//! from the result. The filters apply to the whole signal, which is zero before its first sample.
//! The transient of the start has decayed to a thousandth after [`SETTLING`], so that a run that
//! starts in motion is evaluated from there on.

pub mod iso2631;
pub mod sperling;

pub use crate::ride::iso2631::{Exposure, Weighting, comfort};

/// Time in s after which the response to a constant acceleration that begins with the signal has
/// decayed to a thousandth: the high-pass of second order at 0.4 Hz decays by e^(-2π 0.4 t/√2).
pub const SETTLING: f64 = 5.0;

/// Time in s after which the filters' response has decayed to 1e-9.
const MEMORY: f64 = 15.0;
