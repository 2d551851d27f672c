//! Ride quality as people in the field state it: [`iso2631`] and [`sperling`].
//!
//! Both weight an acceleration by frequency, as people feel it, and make numbers of the result. The filters
//! work on the whole signal, at rest before its first sample; what the start leaves in them has faded to a
//! thousandth after [`SETTLING`], so that a run that starts in motion is judged from there on.

pub mod iso2631;
pub mod sperling;

pub use crate::ride::iso2631::{Exposure, Weighting, comfort};

/// After how long, in s, a constant acceleration that begins with the signal has left the weighted signal to
/// a thousandth: the high-pass of second order at 0.4 Hz decays by e^(-2π 0.4 t/√2).
pub const SETTLING: f64 = 5.0;

/// How long, in s, the filters remember anything (1e-9).
const MEMORY: f64 = 15.0;
