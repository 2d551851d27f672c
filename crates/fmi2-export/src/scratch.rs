//! Memory for directional derivatives.

use crate::model::{Seed, Sensitivity};
use crate::values::Values;

/// Memory for directional derivatives, allocated at the first request.
pub(crate) struct DerivativeScratch {
    pub(crate) seed: Seed,
    pub(crate) result: Sensitivity,
    pub(crate) values: Values,
}
