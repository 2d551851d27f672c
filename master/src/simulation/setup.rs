//! A checked scenario, ready to start.

use super::Simulation;
use super::plan::Layout;
use super::selection::Selection;
use crate::error::Error;
use crate::system::System;
use scenario::Scenario;

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
    pub fn new(scenario: &Scenario) -> Result<Self, Error> {
        scenario.check()?;
        let system = System::new(scenario)?;
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

    /// The signals to record and to draw.
    #[must_use]
    pub fn selection(&self) -> &Selection {
        &self.selection
    }

    /// How the units are coupled.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
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
