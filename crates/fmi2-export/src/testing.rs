//! Drives a unit through its C functions from safe Rust: for the tests of unit crates.
//!
//! ```
//! # use fmi2_export::{Error, Info, Interface, Model, RealVar, Resources, Step, Values};
//! # struct Clock(RealVar);
//! # impl Model for Clock {
//! #     type State = ();
//! #     fn declare(_: &Resources, table: &mut Interface) -> Result<Self, Error> {
//! #         table.describe(Info::new("clock", "Clock"));
//! #         Ok(Self(table.real("t").output().done()))
//! #     }
//! #     fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> { Ok(()) }
//! #     fn outputs(&mut self, _: &(), values: &mut Values, time: f64) -> Result<(), Error> {
//! #         values.set_real(self.0, time);
//! #         Ok(())
//! #     }
//! #     fn step(&mut self, _: &mut (), _: &mut Values, _: Step) -> Result<(), Error> { Ok(()) }
//! # }
//! # fn main() -> Result<(), fmi2_export::testing::Failure> {
//! use fmi2_export::testing::Instance;
//!
//! let mut clock = Instance::new::<Clock>("resources")?;
//! clock.initialize(0.0)?;
//! clock.step(0.0, 0.1)?;
//! assert_eq!(clock.real("t")?, 0.1);
//! # Ok(())
//! # }
//! ```

use core::ffi::{CStr, c_char, c_void};
use std::ffi::CString;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use fmi2_sys::{
    fmi2CallbackFunctions, fmi2CallbackLogger, fmi2Component, fmi2ComponentEnvironment,
    fmi2FMUstate, fmi2Status, fmi2String, fmi2Type,
};

use crate::interface::Type;
use crate::table::Table;
use crate::{Error, Model, Resources, description, ffi};

/// A message that the unit logged.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Message {
    /// The status it came with.
    pub status: fmi2Status,
    /// The log category.
    pub category: String,
    /// The text as it was handed over: a printf format with `%` and `#` doubled.
    pub text: String,
}

/// A call that did not return `fmi2OK`, with what the unit logged meanwhile.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{call} returned {status}: {}", .messages.iter().map(|m| m.text.as_str()).collect::<Vec<_>>().join("; "))]
pub struct Failure {
    /// The function.
    pub call: &'static str,
    /// What it returned.
    pub status: fmi2Status,
    /// What was logged since the last failure or [`Instance::messages`].
    pub messages: Vec<Message>,
}

impl Failure {
    fn new(call: &'static str, error: &Error) -> Self {
        let text = error.to_string();
        let (status, category) = (fmi2Status::fmi2Error, String::new());
        Self { call, status, messages: vec![Message { status, category, text }] }
    }
}

/// Where the logger writes.
type Log = Mutex<Vec<Message>>;

/// An instance of a unit, freed when dropped.
#[derive(Debug)]
pub struct Instance {
    component: fmi2Component,
    log: Box<Log>,
    /// Name, type and value reference of every variable.
    names: Vec<(String, Type, u32)>,
    /// Names of the outputs that offer derivatives, with the highest order.
    offered: Vec<(String, u32)>,
    /// One saved state, for [`Instance::save`] and [`Instance::restore`].
    saved: fmi2FMUstate,
}

// SAFETY: the instance behind the pointers is Send (its model has to be), and is owned.
unsafe impl Send for Instance {}

impl Instance {
    /// Instantiates the model `M` with the files in the folder `resources`, logging everything.
    ///
    /// # Errors
    /// The model's resources or declarations are refused.
    pub fn new<M: Model>(resources: impl AsRef<Path>) -> Result<Self, Failure> {
        let call = "fmi2Instantiate";
        let folder = resources.as_ref();
        let declared = Table::declare::<M>(&Resources::new(folder));
        let (_, table) = declared.map_err(|error| Failure::new(call, &error))?;
        let location = folder.display().to_string();
        let mut this =
            Self::instantiate::<M>("unit", &description::braced(&table.guid), &location)?;
        this.names = names(&table);
        let variables = table.interface.variables.iter();
        let offering = variables.filter(|variable| variable.derivatives > 0);
        this.offered = offering.map(|it| (it.name.clone(), it.derivatives)).collect();
        Ok(this)
    }

    /// Instantiates with any name, GUID and resource location. Names of variables are not known
    /// to this instance then, and the methods that take one fail.
    ///
    /// # Errors
    /// The unit refuses.
    pub fn instantiate<M: Model>(name: &str, guid: &str, location: &str) -> Result<Self, Failure> {
        let log = Box::<Log>::default();
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

    /// The raw instance, for calls of [`ffi`] that have no method here.
    #[must_use]
    pub fn component(&self) -> fmi2Component {
        self.component
    }

    /// What was logged since the last call of this method or the last failure.
    pub fn messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut *self.log.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn failure(&mut self, call: &'static str, status: fmi2Status) -> Failure {
        Failure { call, status, messages: self.messages() }
    }

    /// Turns a status into a result.
    ///
    /// # Errors
    /// The status is not `fmi2OK`.
    pub fn check(&mut self, call: &'static str, status: fmi2Status) -> Result<(), Failure> {
        if status == fmi2Status::fmi2OK { Ok(()) } else { Err(self.failure(call, status)) }
    }

    /// Value reference of a real variable.
    ///
    /// # Errors
    /// There is none of this name.
    pub fn reference(&self, name: &str) -> Result<u32, Failure> {
        self.lookup(name, Type::Real)
    }

    fn lookup(&self, name: &str, kind: Type) -> Result<u32, Failure> {
        let found = self.names.iter().find(|known| known.0 == name && known.1 == kind);
        found.map(|known| known.2).ok_or_else(|| {
            let text = format!("there is no {} variable {name}", kind.name());
            Failure::new("looking up a name", &Error::invalid(text))
        })
    }

    /// `fmi2SetupExperiment` without a stop time, then into initialization mode and out of it.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn initialize(&mut self, start: f64) -> Result<(), Failure> {
        self.enter_initialization(start)?;
        self.exit_initialization()
    }

    /// `fmi2SetupExperiment` without a stop time, then into initialization mode.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn enter_initialization(&mut self, start: f64) -> Result<(), Failure> {
        // SAFETY: the component is alive, here and in all methods below.
        let status = unsafe { ffi::setup_experiment(self.component, 0, 0.0, start, 0, 0.0) };
        self.check("fmi2SetupExperiment", status)?;
        // SAFETY: see above.
        let status = unsafe { ffi::enter_initialization_mode(self.component) };
        self.check("fmi2EnterInitializationMode", status)
    }

    /// Out of initialization mode.
    ///
    /// # Errors
    /// The call fails.
    pub fn exit_initialization(&mut self) -> Result<(), Failure> {
        // SAFETY: see above.
        let status = unsafe { ffi::exit_initialization_mode(self.component) };
        self.check("fmi2ExitInitializationMode", status)
    }

    /// `fmi2DoStep`.
    ///
    /// # Errors
    /// The step fails or is discarded.
    pub fn step(&mut self, time: f64, size: f64) -> Result<(), Failure> {
        // SAFETY: see above.
        let status = unsafe { ffi::do_step(self.component, time, size, 1) };
        self.check("fmi2DoStep", status)
    }

    /// `fmi2Reset`.
    ///
    /// # Errors
    /// The call fails.
    pub fn reset(&mut self) -> Result<(), Failure> {
        // SAFETY: see above.
        let status = unsafe { ffi::reset(self.component) };
        self.check("fmi2Reset", status)
    }

    /// `fmi2_export_report`.
    ///
    /// # Errors
    /// There is no answer to this request, or not now.
    pub fn report(&mut self, request: &str) -> Result<String, Failure> {
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

    /// Value of a real variable.
    ///
    /// # Errors
    /// There is no such variable, or it has no value now.
    pub fn real(&mut self, name: &str) -> Result<f64, Failure> {
        let mut value = [0.0];
        self.reals(&[self.reference(name)?], &mut value)?;
        Ok(value[0])
    }

    /// Values of real variables by value reference.
    ///
    /// # Errors
    /// There is no such variable, or it has no value now.
    pub fn reals(&mut self, references: &[u32], out: &mut [f64]) -> Result<(), Failure> {
        let count = references.len().min(out.len());
        // SAFETY: both arrays have at least `count` elements.
        let status =
            unsafe { ffi::get_real(self.component, references.as_ptr(), count, out.as_mut_ptr()) };
        self.check("fmi2GetReal", status)
    }

    /// Sets a real variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set now or to this.
    pub fn set_real(&mut self, name: &str, value: f64) -> Result<(), Failure> {
        self.set_reals(&[self.reference(name)?], &[value])
    }

    /// Sets real variables by value reference.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set now or to this.
    pub fn set_reals(&mut self, references: &[u32], values: &[f64]) -> Result<(), Failure> {
        let count = references.len().min(values.len());
        // SAFETY: both arrays have at least `count` elements.
        let status =
            unsafe { ffi::set_real(self.component, references.as_ptr(), count, values.as_ptr()) };
        self.check("fmi2SetReal", status)
    }

    /// Value of an integer variable.
    ///
    /// # Errors
    /// There is no such variable, or it has no value now.
    pub fn integer(&mut self, name: &str) -> Result<i32, Failure> {
        let (reference, mut value) = (self.lookup(name, Type::Integer)?, 0);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_integer(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetInteger", status).map(|()| value)
    }

    /// Sets an integer variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set now or to this.
    pub fn set_integer(&mut self, name: &str, value: i32) -> Result<(), Failure> {
        let reference = self.lookup(name, Type::Integer)?;
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_integer(self.component, &raw const reference, 1, &raw const value) };
        self.check("fmi2SetInteger", status)
    }

    /// Value of a boolean variable.
    ///
    /// # Errors
    /// There is no such variable, or it has no value now.
    pub fn boolean(&mut self, name: &str) -> Result<bool, Failure> {
        let (reference, mut value) = (self.lookup(name, Type::Boolean)?, 0);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_boolean(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetBoolean", status).map(|()| value != 0)
    }

    /// Sets a boolean variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set now or to this.
    pub fn set_boolean(&mut self, name: &str, value: bool) -> Result<(), Failure> {
        let (reference, value) = (self.lookup(name, Type::Boolean)?, i32::from(value));
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_boolean(self.component, &raw const reference, 1, &raw const value) };
        self.check("fmi2SetBoolean", status)
    }

    /// Value of a string variable.
    ///
    /// # Errors
    /// There is no such variable, or it has no value now.
    pub fn string(&mut self, name: &str) -> Result<String, Failure> {
        let reference = self.lookup(name, Type::Text)?;
        let mut value: fmi2String = std::ptr::null();
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_string(self.component, &raw const reference, 1, &raw mut value) };
        self.check("fmi2GetString", status)?;
        // SAFETY: a C string that lives until the next call.
        Ok(unsafe { CStr::from_ptr(value) }.to_string_lossy().into_owned())
    }

    /// Sets a string variable.
    ///
    /// # Errors
    /// There is no such variable, or it may not be set now; or the text has a NUL.
    pub fn set_string(&mut self, name: &str, value: &str) -> Result<(), Failure> {
        let call = "fmi2SetString";
        let reference = self.lookup(name, Type::Text)?;
        let value =
            CString::new(value).map_err(|error| Failure::new(call, &Error::invalid(error)))?;
        let pointer = value.as_ptr();
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_string(self.component, &raw const reference, 1, &raw const pointer) };
        self.check(call, status)
    }

    /// Sets the derivative of an order of a real input for the next step.
    ///
    /// # Errors
    /// There is no such input, or the order or value is refused.
    pub fn set_input_derivative(
        &mut self,
        name: &str,
        order: i32,
        value: f64,
    ) -> Result<(), Failure> {
        let reference = self.reference(name)?;
        let (component, vr, order) = (self.component, &raw const reference, &raw const order);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::set_real_input_derivatives(component, vr, 1, order, &raw const value) };
        self.check("fmi2SetRealInputDerivatives", status)
    }

    /// Asks for every derivative that an output is declared to offer; `Ok` with their number if all are
    /// given.
    ///
    /// # Errors
    /// The model does not give one that it declares.
    pub fn declared_derivatives(&mut self) -> Result<usize, Failure> {
        let mut count = 0;
        for (name, highest) in self.offered.clone() {
            for order in (1..).take(highest as usize) {
                self.output_derivative(&name, order)?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// Derivative of an order of a real output.
    ///
    /// # Errors
    /// There is no such output, or the derivative is not offered.
    pub fn output_derivative(&mut self, name: &str, order: i32) -> Result<f64, Failure> {
        let (reference, mut value) = (self.reference(name)?, 0.0);
        let (component, vr, order) = (self.component, &raw const reference, &raw const order);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_real_output_derivatives(component, vr, 1, order, &raw mut value) };
        self.check("fmi2GetRealOutputDerivatives", status).map(|()| value)
    }

    /// ∂unknown/∂known.
    ///
    /// # Errors
    /// A name is not known or not allowed here.
    pub fn derivative(&mut self, unknown: &str, known: &str) -> Result<f64, Failure> {
        let (unknown, known) = (self.reference(unknown)?, self.reference(known)?);
        let (seed, mut value) = (1.0, 0.0);
        let component = self.component;
        let (unknown, known) = (&raw const unknown, &raw const known);
        let (seed, out) = (&raw const seed, &raw mut value);
        // SAFETY: one of each.
        let status =
            unsafe { ffi::get_directional_derivative(component, unknown, 1, known, 1, seed, out) };
        self.check("fmi2GetDirectionalDerivative", status).map(|()| value)
    }

    /// Saves the state for [`Instance::restore`].
    ///
    /// # Errors
    /// The call fails.
    pub fn save(&mut self) -> Result<(), Failure> {
        // SAFETY: the place holds null or the state saved before.
        let status = unsafe { ffi::get_fmu_state(self.component, &raw mut self.saved) };
        self.check("fmi2GetFMUstate", status)
    }

    /// Back to the state saved last.
    ///
    /// # Errors
    /// Nothing was saved, or the call fails.
    pub fn restore(&mut self) -> Result<(), Failure> {
        // SAFETY: null or the state saved last.
        let status = unsafe { ffi::set_fmu_state(self.component, self.saved) };
        self.check("fmi2SetFMUstate", status)
    }

    /// The state as bytes.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn serialize(&mut self) -> Result<Vec<u8>, Failure> {
        self.save()?;
        let mut size = 0;
        // SAFETY: the state saved last, and a place for a number.
        let status =
            unsafe { ffi::serialized_fmu_state_size(self.component, self.saved, &raw mut size) };
        self.check("fmi2SerializedFMUstateSize", status)?;
        let mut bytes = vec![0_u8; size];
        let out = bytes.as_mut_ptr().cast::<c_char>();
        // SAFETY: the array has the size stated.
        let status = unsafe { ffi::serialize_fmu_state(self.component, self.saved, out, size) };
        self.check("fmi2SerializeFMUstate", status).map(|()| bytes)
    }

    /// Sets the state that the bytes mean.
    ///
    /// # Errors
    /// They are not a state of this unit.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let (pointer, size) = (bytes.as_ptr().cast::<c_char>(), bytes.len());
        // SAFETY: the array has the size stated; the place holds null or the state saved before.
        let status = unsafe {
            ffi::deserialize_fmu_state(self.component, pointer, size, &raw mut self.saved)
        };
        self.check("fmi2DeSerializeFMUstate", status)?;
        self.restore()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: both come from this unit and are freed once; the log outlives them.
        unsafe {
            ffi::free_fmu_state(self.component, &raw mut self.saved);
            ffi::free_instance(self.component);
        }
    }
}

fn names(table: &Table) -> Vec<(String, Type, u32)> {
    let variables = table.interface.variables.iter();
    variables.map(|one| (one.name.clone(), one.kind(), one.reference)).collect()
}

/// Callbacks as an importer hands them over: the kit needs no more than a logger.
pub(crate) fn callbacks(log: &Log) -> fmi2CallbackFunctions {
    type Fixed = unsafe extern "C" fn(
        fmi2ComponentEnvironment,
        fmi2String,
        fmi2Status,
        fmi2String,
        fmi2String,
    );
    // SAFETY: stable Rust cannot define a variadic function. In the C calling conventions of the
    // platforms that FMI knows (System V, Windows x64, AAPCS64 and Apple's) the named arguments
    // of a variadic function travel like those of any other, and the kit passes no others.
    let logger =
        unsafe { std::mem::transmute::<Option<Fixed>, fmi2CallbackLogger>(Some(write_log)) };
    fmi2CallbackFunctions {
        logger,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: std::ptr::from_ref(log).cast_mut().cast::<c_void>(),
    }
}

unsafe extern "C" fn write_log(
    environment: fmi2ComponentEnvironment,
    _instance: fmi2String,
    status: fmi2Status,
    category: fmi2String,
    text: fmi2String,
) {
    let read = |pointer: fmi2String| {
        if pointer.is_null() {
            return "(null)".to_owned();
        }
        // SAFETY: not null, so a C string.
        unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
    };
    let message = Message { status, category: read(category), text: read(text) };
    // SAFETY: the environment is the log of a live instance.
    if let Some(log) = unsafe { environment.cast::<Log>().as_ref() } {
        log.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}
