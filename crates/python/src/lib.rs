//! The native part of the Python package `maglev_cosim`: scenarios, simulations and tables as Python objects.
//!
//! Python files beside `Cargo.toml` make a package of it, with names, defaults and conversions that need no speed.
//! Everything that calls units releases the interpreter's lock, and looks for Ctrl-C between steps.

#![expect(clippy::result_large_err, reason = "an error ends the call")]

mod column;
mod error;
mod linearized;
mod recording;
mod running;
mod scenario;
mod simulation;
mod study;
mod table;
mod values;
mod watch;

/// Scenarios, simulations and tables. Use the package `maglev_cosim` instead of this module.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::column::Column;
    #[pymodule_export]
    use crate::scenario::{Scenario, read_results};
    #[pymodule_export]
    use crate::simulation::Simulation;
    #[pymodule_export]
    use crate::study::{Study, merge_study};
    #[pymodule_export]
    use crate::table::Table;

    /// Chooses the program that isolated units run in: the command `maglev`.
    #[pyo3::pyfunction]
    fn isolate_in(program: std::path::PathBuf) {
        fmi2_import::isolate::work_in(program);
    }
}
