//! An instance of a unit under test.

use std::ffi::CString;
use std::path::Path;
use std::sync::PoisonError;

use fmi2_sys::{fmi2Component, fmi2FMUstate, fmi2Status, fmi2Type};

use super::log::{CallFailure, LoggedMessage, MessageLog, callbacks};
use crate::per_type::VariableType;
use crate::table::VariableTable;
use crate::{Error, Model, Resources, description, ffi};

/// An instance of a unit, freed when dropped.
#[derive(Debug)]
pub struct TestInstance {
    pub(super) component: fmi2Component,
    log: Box<MessageLog>,
    /// Name, type and value reference of every variable.
    pub(super) names: Vec<(String, VariableType, u32)>,
    /// Names of the outputs that offer derivatives, with the highest order.
    pub(super) offered: Vec<(String, u32)>,
    /// One saved state, for [`TestInstance::save`] and [`TestInstance::restore`].
    pub(super) saved: fmi2FMUstate,
}

// SAFETY: the instance behind the pointers is Send (its model must be), and is owned.
unsafe impl Send for TestInstance {}

impl TestInstance {
    /// Instantiates the model `M` with the files in the folder `resources`, logging everything.
    ///
    /// # Errors
    /// The model's resources or declarations are invalid.
    pub fn new<M: Model>(resources: impl AsRef<Path>) -> Result<Self, CallFailure> {
        Self::named::<M>(resources, "unit")
    }

    /// The same with an instance name.
    ///
    /// # Errors
    /// As [`TestInstance::new`], or the name is empty.
    pub fn named<M: Model>(resources: impl AsRef<Path>, name: &str) -> Result<Self, CallFailure> {
        let call = "fmi2Instantiate";
        let folder = resources.as_ref();
        let declared = VariableTable::declare::<M>(&Resources::new(folder));
        let (_, table) = declared.map_err(|error| CallFailure::new(call, &error))?;
        let location = folder.display().to_string();
        let mut this = Self::instantiate::<M>(name, &description::braced(&table.guid), &location)?;
        this.names = names(&table);
        let variables = table.interface.variables.iter();
        let offering = variables.filter(|variable| variable.derivatives > 0);
        this.offered = offering.map(|it| (it.name.clone(), it.derivatives)).collect();
        Ok(this)
    }

    /// Instantiates with any name, GUID and resource location. This instance then has no names of
    /// variables, and the methods that take one fail.
    ///
    /// # Errors
    /// The unit cannot be instantiated.
    pub fn instantiate<M: Model>(
        name: &str,
        guid: &str,
        location: &str,
    ) -> Result<Self, CallFailure> {
        let log = Box::<MessageLog>::default();
        let callbacks = callbacks(&log);
        let strings = [name, guid, location].map(|text| CString::new(text).unwrap_or_default());
        let [name, guid, location] = strings.each_ref().map(|text| text.as_ptr());
        let kind = fmi2Type::fmi2CoSimulation;
        // SAFETY: all pointers live through the call; the log lives as long as the instance.
        let component = unsafe {
            ffi::instantiate::<M>(name, kind, guid, location, &raw const callbacks, 0, 1)
        };
        let mut this = Self {
            component,
            log,
            names: Vec::new(),
            offered: Vec::new(),
            saved: std::ptr::null_mut(),
        };
        if component.is_null() {
            return Err(this.failure("fmi2Instantiate", fmi2Status::fmi2Error));
        }
        Ok(this)
    }

    /// The raw instance, for functions of [`ffi`] without a method here.
    #[must_use]
    pub fn component(&self) -> fmi2Component {
        self.component
    }

    /// Messages since the last call of this method or the last failure.
    pub fn messages(&mut self) -> Vec<LoggedMessage> {
        std::mem::take(&mut *self.log.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn failure(&mut self, call: &'static str, status: fmi2Status) -> CallFailure {
        CallFailure { call, status, messages: self.messages() }
    }

    /// Turns a status into a result.
    ///
    /// # Errors
    /// The status is not `fmi2OK`.
    pub fn check(&mut self, call: &'static str, status: fmi2Status) -> Result<(), CallFailure> {
        if status == fmi2Status::fmi2OK { Ok(()) } else { Err(self.failure(call, status)) }
    }

    /// Value reference of a real variable.
    ///
    /// # Errors
    /// There is no such variable.
    pub fn reference(&self, name: &str) -> Result<u32, CallFailure> {
        self.lookup(name, VariableType::Real)
    }

    pub(super) fn lookup(&self, name: &str, kind: VariableType) -> Result<u32, CallFailure> {
        let found = self.names.iter().find(|known| known.0 == name && known.1 == kind);
        found.map(|known| known.2).ok_or_else(|| {
            let text = format!("there is no {} variable {name}", kind.name());
            CallFailure::new("looking up a name", &Error::invalid(text))
        })
    }

    /// `fmi2SetupExperiment` without a stop time, then into initialization mode and out of it.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn initialize(&mut self, start: f64) -> Result<(), CallFailure> {
        self.enter_initialization(start)?;
        self.exit_initialization()
    }

    /// `fmi2SetupExperiment` without a stop time, then into initialization mode.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn enter_initialization(&mut self, start: f64) -> Result<(), CallFailure> {
        // SAFETY: the component is alive, here and in all methods below.
        let status = unsafe { ffi::setup_experiment(self.component, 0, 0.0, start, 0, 0.0) };
        self.check("fmi2SetupExperiment", status)?;
        // SAFETY: see above.
        let status = unsafe { ffi::enter_initialization_mode(self.component) };
        self.check("fmi2EnterInitializationMode", status)
    }

    /// `fmi2ExitInitializationMode`.
    ///
    /// # Errors
    /// The call fails.
    pub fn exit_initialization(&mut self) -> Result<(), CallFailure> {
        // SAFETY: see above.
        let status = unsafe { ffi::exit_initialization_mode(self.component) };
        self.check("fmi2ExitInitializationMode", status)
    }

    /// `fmi2DoStep`.
    ///
    /// # Errors
    /// The step fails or is discarded.
    pub fn step(&mut self, time: f64, size: f64) -> Result<(), CallFailure> {
        // SAFETY: see above.
        let status = unsafe { ffi::do_step(self.component, time, size, 1) };
        self.check("fmi2DoStep", status)
    }

    /// `fmi2Reset`.
    ///
    /// # Errors
    /// The call fails.
    pub fn reset(&mut self) -> Result<(), CallFailure> {
        // SAFETY: see above.
        let status = unsafe { ffi::reset(self.component) };
        self.check("fmi2Reset", status)
    }

    /// `fmi2_export_report`.
    ///
    /// # Errors
    /// There is no answer to this request in this mode.
    pub fn report(&mut self, request: &str) -> Result<String, CallFailure> {
        let call = "fmi2_export_report";
        let request = CString::new(request).unwrap_or_default();
        let mut buffer = Vec::<u8>::new();
        loop {
            let (start, room) = (buffer.as_mut_ptr().cast(), buffer.len());
            // SAFETY: the request and the buffer live through the call.
            let length = unsafe { ffi::report(self.component, request.as_ptr(), start, room) };
            if length == 0 {
                return Err(self.failure(call, fmi2Status::fmi2Error));
            }
            if length <= room {
                buffer.truncate(length);
                return Ok(String::from_utf8_lossy(&buffer).into_owned());
            }
            buffer.resize(length, 0);
        }
    }
}

impl Drop for TestInstance {
    fn drop(&mut self) {
        // SAFETY: both come from this unit and are freed once; the log lives longer.
        unsafe {
            ffi::free_fmu_state(self.component, &raw mut self.saved);
            ffi::free_instance(self.component);
        }
    }
}

fn names(table: &VariableTable) -> Vec<(String, VariableType, u32)> {
    let variables = table.interface.variables.iter();
    variables.map(|one| (one.name.clone(), one.kind(), one.reference)).collect()
}
