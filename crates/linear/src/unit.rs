//! One unit as a linear system.

use faer::Mat;

use super::eigen::{balanced, eigenvalues};
use super::error::LinearError;
use super::rows::Rows;

/// An input or output.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Quantity {
    /// Name of the variable.
    pub name: String,
    /// Unit of measure, if it has one.
    pub unit: Option<String>,
}

/// ẋ = A x + B u, y = C x + D u: small motions of one unit about a point.
///
/// The first inputs and outputs are those that are connected, in the order of the coupling's
/// [`Links`](coupling::Links). All others that the unit reports follow.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinearUnit {
    /// The instance, by its name in the scenario.
    pub name: String,
    /// Names of the states, for people.
    pub states: Vec<String>,
    /// Inputs.
    pub inputs: Vec<Quantity>,
    /// Outputs.
    pub outputs: Vec<Quantity>,
    /// Number of inputs that are connected.
    pub connected_inputs: usize,
    /// Number of outputs that are connected.
    pub connected_outputs: usize,
    /// A.
    pub a: Rows,
    /// B.
    pub b: Rows,
    /// C.
    pub c: Rows,
    /// D.
    pub d: Rows,
}

impl LinearUnit {
    /// A as a dense matrix.
    #[must_use]
    pub fn matrix(&self) -> Mat<f64> {
        let n = self.states.len();
        let mut a = Mat::<f64>::zeros(n, n);
        for (i, j, value) in self.a.iter() {
            a[(i, j)] += value;
        }
        a
    }

    /// Size of the largest eigenvalue of A (1/s).
    ///
    /// # Errors
    /// The eigenvalues cannot be found.
    pub fn rate(&self) -> Result<f64, LinearError> {
        let values = eigenvalues(&self.matrix())?;
        Ok(values.iter().map(|value| value.norm()).fold(0.0, f64::max))
    }

    /// Largest sum of absolute values in a row of the balanced A (1/s): at least the size of its largest
    /// eigenvalue.
    #[must_use]
    pub fn norm(&self) -> f64 {
        let matrix = balanced(&self.matrix()).matrix;
        let mut sums = vec![0.0; matrix.nrows()];
        for column in matrix.col_iter() {
            sums.iter_mut().zip(column.iter()).for_each(|(sum, value)| *sum += value.abs());
        }
        sums.into_iter().fold(0.0, f64::max)
    }

    /// Whether the matrices between connected variables are the same, so that both step alike.
    #[must_use]
    pub(crate) fn steps_like(&self, other: &Self) -> bool {
        let sizes =
            |unit: &Self| (unit.states.len(), unit.connected_inputs, unit.connected_outputs);
        sizes(self) == sizes(other)
            && (&self.a, &self.b, &self.c, &self.d) == (&other.a, &other.b, &other.c, &other.d)
    }
}
