//! Values that are NaN or infinite. In outputs that feed other units they end the run. In variables that
//! are only recorded they are recorded, and reported once per variable.

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
        write!(f, "{variable} is {value}; it is recorded unchanged, since it feeds no other unit")
    }
}

impl Participant {
    /// Takes the variables that have become NaN or infinite since the last call, each once in a run.
    pub fn take_odd_values(&mut self) -> Vec<OddValue> {
        std::mem::take(&mut self.odd_values)
    }

    /// Finds values that are NaN or infinite among the Reals that have been read.
    #[cold]
    pub(super) fn find_odd_values(&mut self, time: f64) -> Result<(), FmuError> {
        // outputs that feed inputs come first
        let feeding = self.variables.outputs.reals.len();
        let reals = &self.received.values.reals;
        for (k, &value) in reals.iter().enumerate().filter(|(_, x)| !x.is_finite()) {
            if k < feeding {
                return Err(self.instance.not_finite(self.read.reals[k].0, value, time).into());
            }
            if !std::mem::replace(&mut self.known_odd[k], true) {
                let variables = &self.instance.package().description().variables;
                let variable = variables[self.read.reals[k]].name.clone();
                self.odd_values.push(OddValue { variable, value, time });
                logger::note_arrival();
            }
        }
        Ok(())
    }
}
