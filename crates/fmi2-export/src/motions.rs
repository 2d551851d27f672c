//! What moves when the states of a linearisation move, as a report.

use serde::Serialize;

use crate::Error;

/// Motions of the parts of a unit by the states of its linearisation, the answer to the report
/// [`Motions::REQUEST`]: motion = matrix · x, with the states of [`StateSpace`](crate::StateSpace).
///
/// As JSON: `parts` lists what moves, `rows` the entries of the matrix that are not zero as
/// `[row, column, value]`, in SI units.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Motions {
    parts: Vec<Motion>,
    rows: Vec<(usize, usize, f64)>,
}

/// One motion of one part.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Motion {
    part: String,
    direction: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    at: Option<f64>,
    unit: &'static str,
}

impl Motions {
    /// The request that it answers.
    pub const REQUEST: &'static str = "motions";

    /// Adds a motion and gives its index: `part` moves in `direction` (`x` to `z`, `rx` to `rz`, or the name
    /// of a coordinate), at this fraction of its length if it bends, measured in `unit` (empty for a modal
    /// coordinate).
    pub fn motion(
        &mut self,
        part: impl Into<String>,
        direction: impl Into<String>,
        at: Option<f64>,
        unit: &'static str,
    ) -> usize {
        self.parts.push(Motion { part: part.into(), direction: direction.into(), at, unit });
        self.parts.len() - 1
    }

    /// Adds to ∂motionᵢ/∂xⱼ.
    pub fn by(&mut self, motion: usize, state: usize, value: f64) {
        if value != 0.0 {
            self.rows.push((motion, state, value));
        }
    }

    /// The report's text.
    ///
    /// # Errors
    /// An entry is not finite.
    pub fn to_json(&self) -> Result<String, Error> {
        if let Some((i, j, value)) = self.rows.iter().find(|entry| !entry.2.is_finite()) {
            return Err(Error::invalid(format!(
                "the motion [{i}][{j}] is {value}; all entries must be finite"
            )));
        }
        serde_json::to_string(self).map_err(Error::invalid)
    }
}
