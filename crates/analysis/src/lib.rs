//! Spectral analysis and ride quality of evenly sampled signals.
//!
//! Input and output are slices of numbers: this crate has no notion of FMI, files or maglev. A
//! signal is a slice of samples and their rate in Hz; [`series::rate`] finds the rate of a time
//! axis, or reports where it is uneven. With samples per metre instead of samples per second, every
//! function applies to space: [`spectrum::welch`] of an irregularity profile in m gives the
//! one-sided spatial power spectral density in m²/(1/m) over the wavenumber in 1/m.
#![forbid(unsafe_code)]

pub mod compare;
pub mod error;
mod fourier;
pub mod peaks;
pub mod ride;
pub mod series;
pub mod spectrum;
pub mod window;

pub use error::Error;
