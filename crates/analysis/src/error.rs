//! What can be wrong with a signal or with what is asked of it.

/// Why an analysis was refused.
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
        /// Which sample, from 0.
        index: usize,
        /// What it is.
        value: f64,
    },
    /// Samples do not follow each other at one interval.
    #[error(
        "the time axis is uneven: sample {index} is at {time} s, and at the interval of {interval} s it \
         would be at {expected} s; record at a constant interval, or cut the signal to where it is"
    )]
    Uneven {
        /// Which sample, from 0.
        index: usize,
        /// Its time, in s.
        time: f64,
        /// Where it should be, in s.
        expected: f64,
        /// The mean interval, in s.
        interval: f64,
    },
    /// A setting of the analysis makes no sense.
    #[error("{setting} is {value}, and must be {rule}")]
    Setting {
        /// Which setting.
        setting: &'static str,
        /// What it is.
        value: f64,
        /// What it must be.
        rule: &'static str,
    },
    /// The Fourier transform refused its buffers.
    #[error("Fourier transform of {length} samples: {reason}")]
    Transform {
        /// Samples to transform.
        length: usize,
        /// What the FFT crate says.
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
