//! How much of a run a page holds. Many runs share the room that one alone takes.

/// Limits of what is embedded of one run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Detail {
    /// Values of all time histories, at 4 bytes each.
    pub(crate) room: usize,
    /// Least limit on the values of one signal.
    pub(crate) least: usize,
    /// Values of a signal that the scenario plots.
    pub(crate) drawn: usize,
    /// Bytes of all spectrograms.
    pub(crate) spectrograms: usize,
    /// Signals with spectra, besides those that the scenario plots.
    pub(crate) spectra: usize,
    /// Values of a spectrum in the range that is shown first.
    pub(crate) bins: usize,
    /// Slices of a spectrum above that range, with two values each.
    pub(crate) slices: usize,
    /// Frames of the 3D view: 50 per second for a minute if alone, for about 80 channels.
    pub(crate) frames: usize,
}

impl Detail {
    /// Limits for each of some runs.
    pub(crate) fn of(runs: usize) -> Self {
        let runs = runs.max(1);
        // up to this number, runs keep what only one signal or view after the other shows
        let crowd = runs.div_ceil(2);
        Self {
            room: 900_000 / runs,
            // two values per pixel of a wide screen, or one
            least: if runs > 3 { 800 } else { 2_000 },
            drawn: 80_000 / runs,
            spectrograms: if runs > 3 { 1_400_000 } else { 2_800_000 } / runs,
            spectra: 400 / crowd,
            bins: (2_400 / crowd).max(500),
            slices: if runs > 3 { 160 } else { 350 },
            frames: (3_000 / crowd).max(500),
        }
    }
}
