//! Values that are NaN or infinite: of what feeds other units they end the run, of what is only
//! recorded they are recorded, and reported once per variable.

use super::Participant;
use fmi2_import::instance::FmuError;
use fmi2_import::logger;

/// The first value of a recorded variable that is NaN or infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct OddValue {
    /// Variable whose value is not finite.
    pub variable: String,
    /// NaN, inf or -inf.
    pub value: f64,
    /// When (s).
    pub time: f64,
}

impl std::fmt::Display for OddValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { variable, value, .. } = self;
        write!(f, "{variable} is {value}; it is recorded as it is, since it feeds no other unit")
    }
}

impl Participant {
    /// Takes the variables that have been found to be NaN or infinite since the last call, each of
    /// them once in a run.
    pub fn take_odd_values(&mut self) -> Vec<OddValue> {
        std::mem::take(&mut self.odd_values)
    }

    /// Looks for what is odd among the Reals that have been read.
    #[cold]
    pub(super) fn judge_odd_values(&mut self, time: f64) -> Result<(), FmuError> {
        // outputs that feed inputs come first
        let feeding = self.traffic.real_outputs.len();
        for (k, &value) in self.received.reals.iter().enumerate().filter(|(_, x)| !x.is_finite()) {
            if k < feeding {
                return Err(self.instance.not_finite(self.reals[k], value, time).into());
            }
            if !std::mem::replace(&mut self.known_odd[k], true) {
                let variables = &self.instance.package().description().variables;
                let variable = variables[self.reals[k]].name.clone();
                self.odd_values.push(OddValue { variable, value, time });
                logger::note_arrival();
            }
        }
        Ok(())
    }
}
