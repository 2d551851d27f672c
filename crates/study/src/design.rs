//! Which combinations of values are computed.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which combinations of the factors' values are computed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Design {
    /// All combinations. The last factor changes fastest.
    #[default]
    Grid,
    /// The rows of a table, with a column for each factor.
    Table {
        /// Path of a CSV or Parquet file, relative to the study file.
        file: PathBuf,
    },
    /// A Latin hypercube: each factor takes one value of each of `points` equally probable parts. Another number of
    /// points gives other points.
    LatinHypercube {
        /// Number of points.
        #[schemars(range(min = 1))]
        points: u64,
    },
    /// The Sobol sequence with Owen's scrambling. More points leave the first ones as they are. A power of two covers
    /// evenly.
    Sobol {
        /// Number of points, at most 65536.
        #[schemars(range(min = 1, max = 65536))]
        points: u64,
    },
    /// Independent random values. More points leave the first ones as they are.
    Random {
        /// Number of points.
        #[schemars(range(min = 1))]
        points: u64,
    },
    /// The arrangement of Saltelli for Sobol indices: of two Sobol samples A and B of `points` rows, the rows of A, of B,
    /// and of A with one factor of B each: points·(factors + 2) in all.
    Saltelli {
        /// Number of rows of A, at most 65536.
        #[schemars(range(min = 1, max = 65536))]
        points: u64,
    },
}

impl Design {
    /// Number of points of a sample. `None` of a grid or a table.
    #[must_use]
    pub fn sampled(&self) -> Option<u64> {
        match *self {
            Self::Grid | Self::Table { .. } => None,
            Self::LatinHypercube { points }
            | Self::Sobol { points }
            | Self::Random { points }
            | Self::Saltelli { points } => Some(points),
        }
    }
}
