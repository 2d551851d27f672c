//! How the girders and the constant part see each other.

use faer::Mat;

/// The connection as a function of the place, over one period.
pub trait Passage: Sync {
    /// Length of a period (m).
    fn period(&self) -> f64;

    /// The matrices at a place x, 0 … period: P with u = P η, from the girders' seen states to the inputs of the
    /// constant part, and Q with f = Q y, from its outputs to the girders' forces. Both have the right size and any
    /// content when called.
    fn at(&self, x: f64, p: &mut Mat<f64>, q: &mut Mat<f64>);
}
