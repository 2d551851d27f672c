//! A checked scenario, ready to start.

use super::plan::Layout;
use super::selection::Selection;
use super::simulation::Simulation;
use crate::error::Error;
use crate::scenario::{Format, Scenario};
use crate::system::{Override, System};

/// A scenario whose units are opened and whose names, connections, units of measurement and values
/// are checked; nothing of the units has run yet.
pub struct Setup {
    pub(super) scenario: Scenario,
    pub(super) system: System,
    pub(super) selection: Selection,
    pub(super) layout: Layout,
    pub(super) steps: u64,
}

impl Setup {
    /// Opens the units and checks everything.
    ///
    /// # Errors
    /// The first thing found wrong.
    pub fn new(scenario: &Scenario, overrides: &[Override]) -> Result<Self, Error> {
        scenario.check()?;
        let system = System::new(scenario, overrides)?;
        let selection = Selection::new(scenario, &system)?;
        let layout = Layout::new(scenario, &system)?;
        let steps = scenario.experiment.steps()?;
        Ok(Self { scenario: scenario.clone(), system, selection, layout, steps })
    }

    /// Loads, instantiates, connects and initializes the units.
    ///
    /// # Errors
    /// A unit cannot be loaded, refuses or fails, or a loop cannot be solved.
    pub fn start(&self) -> Result<Simulation<'_>, Error> {
        Simulation::start(self)
    }

    /// The scenario.
    #[must_use]
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Its instances and connections.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// Names of the recorded signals, in the order of their values.
    pub fn signals(&self) -> impl Iterator<Item = String> {
        self.selection.recorded().map(|port| self.system.port_name(port))
    }

    /// Files that a run of it writes besides those of every run.
    pub(super) fn planned_files(&self) -> impl Iterator<Item = String> {
        let parquet = self.scenario.record.format.contains(&Format::Parquet);
        let pictures = self.scenario.plots.iter().map(|plot| plot.file.clone());
        pictures.chain(parquet.then(|| "results.parquet".to_owned()))
    }

    /// The time after so many steps (s), counted from the start.
    #[must_use]
    pub fn time_after(&self, steps: u64) -> f64 {
        self.scenario.experiment.time(steps)
    }
}
