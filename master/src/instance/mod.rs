//! One instance of a unit: a safe wrapper around its C functions.
//!
//! Every status of every call is looked at. `fmi2Warning` goes on (and is told once),
//! `fmi2Discard`, `fmi2Error` and `fmi2Fatal` become a [`UnitError`], `fmi2Pending` is polled. After
//! `fmi2Fatal` nothing of the unit is called any more, not even to free it.

mod fault;
mod state;

use std::ffi::{CStr, CString, c_void};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::description::Value;
use crate::library::Functions;
use crate::logger::{Message, Sink};
use crate::package::Package;
use fault::fail;
pub use fault::{UnitError, UnitFault};
use fmi2_sys as sys;
pub use state::StateId;

/// A step that is still pending after this time counts as hanging.
pub const PENDING_LIMIT: Duration = Duration::from_secs(600);

/// A running instance. Freed when dropped, unless its library failed fatally.
pub struct Instance {
    name: String,
    package: Arc<Package>,
    functions: Functions,
    component: *mut c_void,
    // the unit holds their addresses as long as it lives
    sink: Box<Sink>,
    _callbacks: Box<sys::fmi2CallbackFunctions>,
    /// shared by all instances of a library
    dead: Arc<AtomicBool>,
    warned: bool,
    running: bool,
    steps: u64,
    time: Option<f64>,
    /// saved states, null where freed
    states: Vec<sys::fmi2FMUstate>,
}

// SAFETY: what an instance owns is used by one thread at a time, as every method takes it by
// exclusive reference, and FMI 2.0 lets the caller choose which thread that is; what it shares with
// other instances (package, fatal mark) is shared by Arc and synchronised
unsafe impl Send for Instance {}
/// What instances share may be used by several threads.
const _: fn(&Package) -> &(dyn std::any::Any + Send + Sync) = |package| package;

macro_rules! call {
    ($self:ident, $field:ident, $name:literal $(, $argument:expr)* $(,)?) => {{
        let Some(function) = $self.functions.$field else {
            return fail(UnitFault::Lacks { instance: $self.name.clone(), call: $name });
        };
        $self.alive()?;
        // SAFETY: the component is what the same library's fmi2Instantiate returned; pointers
        // come from slices of the length that is passed with them and outlive the call
        unsafe { function($self.component $(, $argument)*) }
    }};
}
use call;

impl Instance {
    /// Creates an instance of the package's unit.
    ///
    /// # Errors
    /// The unit refuses, for instance because its binary expects another GUID.
    pub fn new(
        package: &Arc<Package>,
        functions: Functions,
        dead: &Arc<AtomicBool>,
        name: &str,
    ) -> Result<Self, UnitError> {
        let sink = Box::new(Sink::default());
        let callbacks = Box::new(sink.callbacks());
        let text = |what: &str, text: &str| {
            CString::new(text).map_err(|_| {
                UnitError::from(UnitFault::ZeroByte {
                    instance: name.to_owned(),
                    what: what.to_owned(),
                })
            })
        };
        let c_name = text("its name", name)?;
        let guid = text("the GUID", &package.description().guid)?;
        let resources = text("the resource location", &package.resource_location())?;
        let Some(instantiate) = functions.instantiate else {
            return fail(UnitFault::Lacks { instance: name.to_owned(), call: "fmi2Instantiate" });
        };
        // SAFETY: all pointers are valid C strings; the callbacks are boxed and stay where they
        // are until the instance is freed
        let component = unsafe {
            instantiate(
                c_name.as_ptr(),
                sys::fmi2Type::fmi2CoSimulation,
                guid.as_ptr(),
                resources.as_ptr(),
                &raw const *callbacks,
                0,
                0,
            )
        };
        let mut instance = Self {
            name: name.to_owned(),
            package: Arc::clone(package),
            functions,
            component,
            sink,
            _callbacks: callbacks,
            dead: Arc::clone(dead),
            warned: false,
            running: false,
            steps: 0,
            time: None,
            states: Vec::new(),
        };
        if component.is_null() {
            let messages = instance.take_messages();
            return fail(UnitFault::Refused { instance: name.to_owned(), messages });
        }
        Ok(instance)
    }

    /// Name of the instance.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The unit that it is an instance of.
    #[must_use]
    pub fn package(&self) -> &Package {
        &self.package
    }

    /// Number of finished steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Takes the messages that arrived since the last call.
    pub fn take_messages(&mut self) -> Vec<Message> {
        self.sink.take(self.package.description())
    }

    /// Tells the unit about the span of time.
    ///
    /// # Errors
    /// The unit's.
    pub fn setup_experiment(&mut self, start: f64, stop: f64) -> Result<(), UnitError> {
        let status = call!(self, setup_experiment, "fmi2SetupExperiment", 0, 0.0, start, 1, stop);
        self.check(status, "fmi2SetupExperiment", &[])
    }

    /// Begins initialization.
    ///
    /// # Errors
    /// The unit's.
    pub fn enter_initialization_mode(&mut self) -> Result<(), UnitError> {
        let status = call!(self, enter_initialization_mode, "fmi2EnterInitializationMode");
        self.check(status, "fmi2EnterInitializationMode", &[])
    }

    /// Ends initialization: the unit is ready to step.
    ///
    /// # Errors
    /// The unit's.
    pub fn exit_initialization_mode(&mut self) -> Result<(), UnitError> {
        let status = call!(self, exit_initialization_mode, "fmi2ExitInitializationMode");
        self.check(status, "fmi2ExitInitializationMode", &[])?;
        self.running = true;
        Ok(())
    }

    /// Asks for a report, which is not of the standard (`fmi2_export_report`).
    ///
    /// # Errors
    /// The unit offers no reports, not this one, or not now.
    pub fn report(&mut self, request: &str) -> Result<String, UnitError> {
        let Some(function) = self.functions.report else {
            return fail(UnitFault::NoReports { instance: self.name.clone() });
        };
        self.alive()?;
        let Ok(text) = CString::new(request) else {
            let what = "the request for a report".to_owned();
            return fail(UnitFault::ZeroByte { instance: self.name.clone(), what });
        };
        // room for most reports, so that they are made once
        let mut buffer = vec![0_u8; 1 << 20];
        loop {
            let (start, room) = (buffer.as_mut_ptr().cast(), buffer.len());
            // SAFETY: the component is this library's; request and buffer outlive the call
            let length = unsafe { function(self.component, text.as_ptr(), start, room) };
            if length == 0 {
                return fail(UnitFault::Unanswered {
                    instance: self.name.clone(),
                    request: request.to_owned(),
                    messages: self.take_messages(),
                });
            }
            if length <= room {
                buffer.truncate(length);
                return Ok(String::from_utf8_lossy(&buffer).into_owned());
            }
            buffer.resize(length, 0);
        }
    }

    /// Ends the run.
    ///
    /// # Errors
    /// The unit's.
    pub fn terminate(&mut self) -> Result<(), UnitError> {
        if !std::mem::take(&mut self.running) {
            return Ok(());
        }
        let status = call!(self, terminate, "fmi2Terminate");
        self.check(status, "fmi2Terminate", &[])
    }

    /// Reads Reals.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), UnitError> {
        debug_assert_eq!(references.len(), values.len());
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status =
            call!(self, get_real, "fmi2GetReal", references.as_ptr(), n, values.as_mut_ptr());
        self.check(status, "fmi2GetReal", references)
    }

    /// Reads Integers and Enumerations.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status =
            call!(self, get_integer, "fmi2GetInteger", references.as_ptr(), n, values.as_mut_ptr());
        self.check(status, "fmi2GetInteger", references)
    }

    /// Reads Booleans: 0 or 1.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status =
            call!(self, get_boolean, "fmi2GetBoolean", references.as_ptr(), n, values.as_mut_ptr());
        self.check(status, "fmi2GetBoolean", references)
    }

    /// Reads one String; null reads as empty.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_string(&mut self, reference: u32) -> Result<CString, UnitError> {
        let mut pointer: sys::fmi2String = std::ptr::null();
        let status =
            call!(self, get_string, "fmi2GetString", &raw const reference, 1, &raw mut pointer);
        self.check(status, "fmi2GetString", &[reference])?;
        if pointer.is_null() {
            return Ok(CString::default());
        }
        // SAFETY: not null; the standard keeps the string alive until the next call
        Ok(unsafe { CStr::from_ptr(pointer) }.to_owned())
    }

    /// Sets Reals.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status = call!(self, set_real, "fmi2SetReal", references.as_ptr(), n, values.as_ptr());
        self.check(status, "fmi2SetReal", references)
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status =
            call!(self, set_integer, "fmi2SetInteger", references.as_ptr(), n, values.as_ptr());
        self.check(status, "fmi2SetInteger", references)
    }

    /// Sets Booleans: 0 or 1.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(values.len());
        let status =
            call!(self, set_boolean, "fmi2SetBoolean", references.as_ptr(), n, values.as_ptr());
        self.check(status, "fmi2SetBoolean", references)
    }

    /// Sets one String.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_string(&mut self, reference: u32, value: &CStr) -> Result<(), UnitError> {
        let pointer = value.as_ptr();
        let status =
            call!(self, set_string, "fmi2SetString", &raw const reference, 1, &raw const pointer);
        self.check(status, "fmi2SetString", &[reference])
    }

    /// Sets one variable of any type.
    ///
    /// # Errors
    /// The unit's, or a text with a zero byte.
    pub fn set(&mut self, variable: usize, value: &Value) -> Result<(), UnitError> {
        let reference = self.package.description().variables[variable].value_reference;
        match value {
            Value::Real(value) => self.set_real(&[reference], &[*value]),
            Value::Integer(value) => self.set_integer(&[reference], &[*value]),
            Value::Boolean(value) => self.set_boolean(&[reference], &[i32::from(*value)]),
            Value::String(value) => {
                let text = CString::new(value.as_str()).map_err(|_| UnitFault::ZeroByte {
                    instance: self.name.clone(),
                    what: self.package.description().variables[variable].name.clone(),
                })?;
                self.set_string(reference, &text)
            }
        }
    }

    /// Sets derivatives of inputs for the coming step.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(orders.len()).min(values.len());
        let status = call!(
            self,
            set_real_input_derivatives,
            "fmi2SetRealInputDerivatives",
            references.as_ptr(),
            n,
            orders.as_ptr(),
            values.as_ptr()
        );
        self.check(status, "fmi2SetRealInputDerivatives", references)
    }

    /// Reads derivatives of outputs at the end of the last step.
    ///
    /// # Errors
    /// The unit's.
    #[inline]
    pub fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), UnitError> {
        if references.is_empty() {
            return Ok(());
        }
        let n = references.len().min(orders.len()).min(values.len());
        let status = call!(
            self,
            get_real_output_derivatives,
            "fmi2GetRealOutputDerivatives",
            references.as_ptr(),
            n,
            orders.as_ptr(),
            values.as_mut_ptr()
        );
        self.check(status, "fmi2GetRealOutputDerivatives", references)
    }

    /// Steps from `time` over `size`.
    ///
    /// # Errors
    /// Discarded, hanging, or the unit's.
    #[inline]
    pub fn do_step(&mut self, time: f64, size: f64) -> Result<(), UnitError> {
        self.time = Some(time);
        let mut status = call!(self, do_step, "fmi2DoStep", time, size, 1);
        if status == sys::fmi2Status::fmi2Pending {
            status = self.poll(time)?;
        }
        if status == sys::fmi2Status::fmi2Discard {
            return fail(self.discarded(time, size));
        }
        self.check(status, "fmi2DoStep", &[])?;
        self.steps += 1;
        Ok(())
    }

    /// Waits until a pending step has ended.
    #[cold]
    fn poll(&mut self, time: f64) -> Result<sys::fmi2Status, UnitError> {
        let begin = Instant::now();
        let mut pause = Duration::from_micros(10);
        loop {
            let mut status = sys::fmi2Status::fmi2Pending;
            let answer = call!(
                self,
                get_status,
                "fmi2GetStatus",
                sys::fmi2StatusKind::fmi2DoStepStatus,
                &raw mut status
            );
            self.check(answer, "fmi2GetStatus", &[])?;
            if status != sys::fmi2Status::fmi2Pending {
                return Ok(status);
            }
            if begin.elapsed() > PENDING_LIMIT {
                return fail(UnitFault::Hanging { instance: self.name.clone(), time });
            }
            std::thread::sleep(pause);
            pause = (pause * 2).min(Duration::from_millis(10));
        }
    }

    #[cold]
    fn discarded(&mut self, time: f64, size: f64) -> UnitFault {
        let (mut last, mut ended) = (f64::NAN, 0);
        let mut last_successful = None;
        if let Some(function) = self.functions.get_real_status {
            // SAFETY: a live component and a valid address
            let status = unsafe {
                function(self.component, sys::fmi2StatusKind::fmi2LastSuccessfulTime, &raw mut last)
            };
            last_successful =
                (status == sys::fmi2Status::fmi2OK && last.is_finite()).then_some(last);
        }
        if let Some(function) = self.functions.get_boolean_status {
            // SAFETY: a live component and a valid address
            let status = unsafe {
                function(self.component, sys::fmi2StatusKind::fmi2Terminated, &raw mut ended)
            };
            if status != sys::fmi2Status::fmi2OK {
                ended = 0;
            }
        }
        UnitFault::Discarded {
            instance: self.name.clone(),
            time,
            size,
            last_successful,
            terminated: ended != 0,
            messages: self.take_messages(),
        }
    }

    /// An error that says which variable is not finite.
    #[cold]
    pub(crate) fn not_finite(&mut self, variable: usize, value: f64, time: f64) -> UnitFault {
        UnitFault::NotFinite {
            instance: self.name.clone(),
            variable: self.package.description().variables[variable].name.clone(),
            value,
            time,
            messages: self.take_messages(),
        }
    }

    /// Whether the unit may still be called.
    ///
    /// # Errors
    /// Its library has failed fatally.
    pub fn still_alive(&self) -> Result<(), UnitError> {
        self.alive()
    }

    #[inline]
    fn alive(&self) -> Result<(), UnitError> {
        if self.dead.load(Ordering::Relaxed) {
            return fail(UnitFault::Dead { instance: self.name.clone() });
        }
        Ok(())
    }

    #[inline]
    fn check(
        &mut self,
        status: sys::fmi2Status,
        call: &'static str,
        references: &[u32],
    ) -> Result<(), UnitError> {
        if status == sys::fmi2Status::fmi2OK {
            return Ok(());
        }
        self.judge(status, call, references)
    }

    #[cold]
    fn judge(
        &mut self,
        status: sys::fmi2Status,
        call: &'static str,
        references: &[u32],
    ) -> Result<(), UnitError> {
        if status == sys::fmi2Status::fmi2Warning {
            self.warned = true;
            return Ok(());
        }
        if status == sys::fmi2Status::fmi2Fatal {
            self.dead.store(true, Ordering::Relaxed);
        }
        fail(UnitFault::Status {
            instance: self.name.clone(),
            call,
            status: status.to_string(),
            time: self.time,
            variables: self.names(call, references),
            messages: self.take_messages(),
        })
    }

    /// Whether a call has returned `fmi2Warning` so far.
    #[must_use]
    pub fn warned(&self) -> bool {
        self.warned
    }

    fn names(&self, call: &str, references: &[u32]) -> Vec<String> {
        if references.len() > 3 {
            return vec![format!("{} variables", references.len())];
        }
        let letter = if call.contains("Integer") {
            'i'
        } else if call.contains("Boolean") {
            'b'
        } else if call.contains("String") {
            's'
        } else {
            'r'
        };
        references
            .iter()
            .filter_map(|&reference| {
                self.package.description().name_of(letter, reference).map(str::to_owned)
            })
            .collect()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if self.component.is_null() || self.dead.load(Ordering::Relaxed) {
            return;
        }
        self.free_states();
        if let Some(free) = self.functions.free_instance {
            // SAFETY: the component is alive and not used after this
            unsafe { free(self.component) };
        }
    }
}
