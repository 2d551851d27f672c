//! Units, libraries and instances that many simulations use, one after another.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indexmap::IndexMap;

use super::Simulation;
use super::setup::Setup;
use crate::error::Error;
use crate::system::{self, InstanceSetup, System};
use fmi2_import::instance::Instance;
use fmi2_import::library::{Functions, LibraryError};
use fmi2_import::package::Package;
use scenario::Scenario;

/// Most opened units that are kept. A study of layouts has one for each layout.
const KEPT: usize = 32;

/// A loaded library, and the mark that is set after `fmi2Fatal`.
type Library = (Functions, Arc<AtomicBool>);

/// What a simulation leaves for the next one: opened units, loaded libraries, and instances to use again.
///
/// Instances are used again after `fmi2Reset`, and only those of units for which [`Pool::renew_instances_of`] allows it.
#[derive(Default)]
pub struct Pool {
    /// by the unit as JSON
    packages: IndexMap<String, Arc<Package>>,
    /// by the path of the unpacked binary: one file under two names is unpacked and loaded twice
    libraries: HashMap<PathBuf, Library>,
    /// by the path of the binary and the name of the instance
    idle: HashMap<(PathBuf, String), Instance>,
    /// paths of .fmu files
    renewed: HashSet<PathBuf>,
    loaded: usize,
}

impl Pool {
    /// Checks a scenario as [`Setup::new`] does. Units that the pool knows are not opened again.
    ///
    /// # Errors
    /// The first error found.
    pub fn setup(&mut self, scenario: &Scenario) -> Result<Setup, Error> {
        scenario.check()?;
        let system = System::of_units(scenario, &mut |name, unit| {
            // a unit is a path and patches, which can always be printed
            let key = serde_json::to_string(unit).unwrap_or_default();
            if let Some(package) = self.packages.get(&key) {
                return Ok(Arc::clone(package));
            }
            let package = Arc::new(system::open(name, unit, scenario.strict)?);
            self.loaded += usize::from(!unit.resources.is_empty());
            if self.packages.len() >= KEPT
                && let Some((_, old)) = self.packages.shift_remove_index(0)
            {
                let binary = old.binary();
                self.idle.retain(|(path, _), _| *path != binary);
                self.libraries.remove(&binary);
            }
            self.packages.insert(key, Arc::clone(&package));
            Ok(package)
        })?;
        Setup::of(scenario, system)
    }

    /// From now on instances of this .fmu file are reset and used again. Only do so if a reset instance has been found to
    /// behave as a new one.
    pub fn renew_instances_of(&mut self, fmu: &Path) {
        self.renewed.insert(fmu.to_owned());
    }

    /// From now on all instances of this .fmu file are made anew.
    pub fn make_instances_anew_of(&mut self, fmu: &Path) {
        self.renewed.remove(fmu);
        self.idle.retain(|_, instance| instance.package().path() != fmu);
    }

    /// Terminates a simulation and keeps its instances where that is allowed.
    ///
    /// # Errors
    /// A unit fails while it is terminated or reset.
    pub fn take_back(&mut self, mut simulation: Simulation<'_>) -> Result<(), Error> {
        simulation.terminate()?;
        let time = simulation.time();
        let Simulation { participants, setup, .. } = simulation;
        for (participant, plan) in participants.into_iter().zip(&setup.system.instances) {
            if !self.may_keep(participant.instance(), plan) {
                continue;
            }
            let released = participant.release();
            let renewed = released.and_then(|mut it| it.renew().map(|()| it));
            let instance = renewed.map_err(|source| Error::Step { time, source })?;
            self.idle.insert((plan.package.binary(), plan.name.clone()), instance);
        }
        Ok(())
    }

    fn may_keep(&self, instance: &Instance, plan: &InstanceSetup) -> bool {
        !instance.is_isolated()
            && plan.debug_log.is_none()
            && self.renewed.contains(plan.package.path())
    }

    /// Whether this process should end soon: libraries cannot be unloaded, and one that has failed fatally cannot be
    /// used again.
    #[must_use]
    pub fn is_worn(&self) -> bool {
        const MOST: usize = 200;
        self.loaded > MOST || self.libraries.values().any(|(_, dead)| dead.load(Ordering::Relaxed))
    }

    /// An instance of an earlier simulation.
    pub(super) fn take(&mut self, plan: &InstanceSetup) -> Option<Instance> {
        if self.idle.is_empty() {
            return None;
        }
        self.idle.remove(&(plan.package.binary(), plan.name.clone()))
    }

    /// The library of a unit for a new instance. `again`: this process has had instances of the unit before.
    pub(super) fn library(
        &mut self,
        package: &Package,
        again: bool,
    ) -> Result<Library, LibraryError> {
        let binary = package.binary();
        let once = package.description().co_simulation.can_be_instantiated_only_once_per_process;
        match self.libraries.get(&binary) {
            Some(known) if !once => Ok(known.clone()),
            None if !once || !again => {
                let fresh: Library = (Functions::load(package)?, Arc::default());
                self.libraries.insert(binary, fresh.clone());
                self.loaded += 1;
                Ok(fresh)
            }
            _ => {
                self.loaded += 1;
                Ok((Functions::load_copy(package)?, Arc::default()))
            }
        }
    }

    /// Forgets libraries and instances. Units stay open.
    pub(super) fn forget(&mut self) {
        self.libraries.clear();
        self.idle.clear();
    }
}
