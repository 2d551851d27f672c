//! A checked scenario, ready to start.

use super::coupling_setup::CouplingSetup;
use super::selection::Selection;
use super::story::Story;
use crate::error::Error;
use crate::system::System;
use scenario::Scenario;

/// A scenario whose units are opened and whose names, connections, units of measurement and values
/// are checked. No code of the units has run yet.
pub struct Setup {
    pub(super) scenario: Scenario,
    pub(super) system: System,
    pub(super) selection: Selection,
    pub(super) coupling: CouplingSetup,
    pub(super) story: Story,
    pub(super) steps: u64,
}

impl Setup {
    /// Opens the units and checks everything.
    ///
    /// # Errors
    /// The first error found.
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        scenario.check()?;
        Self::of(scenario, System::new(scenario)?)
    }

    /// Checks what goes beyond the system.
    pub(super) fn of(scenario: &Scenario, mut system: System) -> Result<Self, Error> {
        let story = Story::new(scenario, &mut system)?;
        let selection = Selection::new(scenario, &system)?;
        let coupling = CouplingSetup::new(scenario, &system)?;
        let steps = scenario.experiment.steps()?;
        Ok(Self { scenario: scenario.clone(), system, selection, coupling, story, steps })
    }

    /// The scenario that was checked.
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

    /// The signals to record and to plot.
    #[must_use]
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// How the units are coupled.
    #[must_use]
    pub fn coupling(&self) -> &CouplingSetup {
        &self.coupling
    }

    /// Number of communication steps from start to stop.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// The time after so many steps (s), counted from the start.
    #[must_use]
    pub fn time_after(&self, steps: u64) -> f64 {
        self.scenario.experiment.time(steps)
    }
}
