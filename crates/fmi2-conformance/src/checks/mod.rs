//! The checks of behaviour, one file per subject.

mod arguments;
mod derivatives;
mod instances;
mod lifecycle;
mod logging;
mod order;
mod process;
mod resources;
mod serialization;
mod states;
mod stepping;
mod values;

use crate::harness::Check;

/// All checks of behaviour, in the order in which they run.
pub fn checks() -> impl Iterator<Item = &'static Check> {
    [
        lifecycle::CHECKS,
        order::CHECKS,
        arguments::CHECKS,
        values::CHECKS,
        resources::CHECKS,
        logging::CHECKS,
        process::CHECKS,
        instances::CHECKS,
        stepping::CHECKS,
        states::CHECKS,
        serialization::CHECKS,
        derivatives::CHECKS,
    ]
    .into_iter()
    .flatten()
}
