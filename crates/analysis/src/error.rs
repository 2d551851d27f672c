//! Errors of signals and settings.

/// An error of an analysis.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// Fewer samples than the analysis needs.
    #[error(
        "the signal has {samples} samples, and {needed} are needed; record it longer or more often"
    )]
    TooShort {
        /// Samples given.
        samples: usize,
        /// Samples needed.
        needed: usize,
    },
    /// A sample is infinite or not a number.
    #[error(
        "sample {index} is {value}; a spectrum needs finite numbers, so cut the signal before it"
    )]
    NotFinite {
        /// Index of the sample, from 0.
        index: usize,
        /// The value given.
        value: f64,
    },
    /// The samples are not evenly spaced.
    #[error(
        "the time axis is uneven: sample {index} is at {time} s, and at the interval of {interval} s it \
         would be at {expected} s; record at a constant interval, or cut the signal to where it is"
    )]
    Uneven {
        /// Index of the sample, from 0.
        index: usize,
        /// Its time, in s.
        time: f64,
        /// Expected time, in s.
        expected: f64,
        /// The mean interval, in s.
        interval: f64,
    },
    /// A setting of the analysis is invalid.
    #[error("{setting} is {value}, but must be {rule}")]
    Setting {
        /// Name of the setting.
        setting: &'static str,
        /// The value given.
        value: f64,
        /// The condition that it breaks.
        rule: &'static str,
    },
    /// The Fourier transform failed.
    #[error("Fourier transform of {length} samples: {reason}")]
    Transform {
        /// Number of samples.
        length: usize,
        /// Error of the FFT library.
        reason: String,
    },
}

/// Checks a setting.
pub(crate) fn require(
    right: bool,
    setting: &'static str,
    value: f64,
    rule: &'static str,
) -> Result<(), Error> {
    if right { Ok(()) } else { Err(Error::Setting { setting, value, rule }) }
}
