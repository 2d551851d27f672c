//! One instance of a unit: a safe wrapper around its C functions.
//!
//! Every status of every call is looked at. `fmi2Warning` goes on (and is told once, see
//! [`Warnings`]), `fmi2Discard`, `fmi2Error` and `fmi2Fatal` become a [`FmuError`], `fmi2Pending` is
//! polled. After `fmi2Fatal` nothing of the unit is called any more, not even to free it. The functions are called
//! in this process, or in a [worker process](crate::isolate), where a crash is caught.

mod fault;
mod offers;
mod options;
mod state;
mod step;
mod warnings;

use std::ffi::{CStr, CString};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use fmi2_sys as sys;

use crate::component::{
    Answer, Boolean, Component, Data, Identity, Integer, Kind, Numeric, Outcome, Real, Reply,
    Request, Values,
};
use crate::description::Value;
use crate::isolate::{Isolation, Worker};
use crate::library::{Call, Functions};
use crate::logger::{self, Badge, Message, Sink};
use crate::package::Package;
use crate::witness::{CALL, Place};
use fault::fail;
#[cfg(unix)]
pub(crate) use fault::signal_name;
pub use fault::{FmuError, FmuFault};
pub use offers::BrokenPromise;
pub use offers::Offer;
pub use options::InstanceOptions;
pub use state::StateId;
pub use warnings::{Refusal, Warnings};

/// A step that is still pending after this time counts as hanging, unless another limit is set.
pub const PENDING_LIMIT: Duration = Duration::from_secs(600);

/// Where the functions of an instance are called.
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all are of the large kind, whose path is hot"
)]
enum Backend {
    /// In this process.
    Here { component: Component, sink: Arc<Sink> },
    /// In a process of its own.
    Elsewhere(Box<Worker>),
}

/// A running instance. Freed when dropped, unless its library failed fatally.
pub struct Instance {
    name: String,
    package: Arc<Package>,
    backend: Backend,
    place: &'static Place,
    /// shared by all instances of a library
    dead: Arc<AtomicBool>,
    warnings: Warnings,
    offers: offers::Offers,
    /// messages that came with a refusal, or to an earlier instance in its place
    earlier: Vec<Message>,
    running: bool,
    steps: u64,
    time: Option<f64>,
    pending_limit: Duration,
    /// where the state is saved before every step
    saved_before: Option<StateId>,
}

// SAFETY: what an instance owns is used by one thread at a time, as every method takes it by
// exclusive reference, and FMI 2.0 lets the caller choose which thread that is; what it shares with
// other instances (package, sink, fatal mark) is shared by Arc and synchronised
unsafe impl Send for Instance {}
/// What instances share may be used by several threads.
const _: fn(&Package) -> &(dyn std::any::Any + Send + Sync) = |package| package;

impl Instance {
    /// Creates an instance of the package's unit in this process.
    ///
    /// # Errors
    /// The unit refuses, for instance because its binary expects another GUID.
    pub fn new(
        package: &Arc<Package>,
        functions: Functions,
        dead: &Arc<AtomicBool>,
        name: &str,
    ) -> Result<Self, FmuError> {
        Self::with_options(package, functions, dead, name, &InstanceOptions::default())
    }

    /// The same with options.
    ///
    /// # Errors
    /// The unit refuses, or does not take its log categories.
    pub fn with_options(
        package: &Arc<Package>,
        functions: Functions,
        dead: &Arc<AtomicBool>,
        name: &str,
        options: &InstanceOptions,
    ) -> Result<Self, FmuError> {
        let identity = identity(package, name, options)?;
        let sink = Sink::new(name);
        let place = Place::new(name, sink.badge());
        place.enter();
        match Component::new(functions, dead, &identity, &sink, &CALL) {
            Some(component) => {
                let backend = Backend::Here { component, sink };
                Self::with(package, place, name, dead, backend).asked_for(options)
            }
            None => fail(FmuFault::Refused {
                instance: name.to_owned(),
                messages: sink.take(package.description()),
            }),
        }
    }

    /// Creates an instance of the package's unit in a worker process of its own.
    ///
    /// # Errors
    /// No process can be started, the binary cannot be loaded there, or the unit refuses or
    /// crashes.
    pub fn isolated(
        package: &Arc<Package>,
        isolation: &Isolation,
        name: &str,
    ) -> Result<Self, FmuError> {
        Self::isolated_with_options(package, isolation, name, &InstanceOptions::default())
    }

    /// The same with options.
    ///
    /// # Errors
    /// As without, or the unit does not take its log categories.
    pub fn isolated_with_options(
        package: &Arc<Package>,
        isolation: &Isolation,
        name: &str,
        options: &InstanceOptions,
    ) -> Result<Self, FmuError> {
        let identity = identity(package, name, options)?;
        let worker = Worker::start(package, isolation, &identity, name)?;
        let backend = Backend::Elsewhere(Box::new(worker));
        Self::with(package, Place::new(name, Badge::NONE), name, &Arc::default(), backend)
            .asked_for(options)
    }

    /// Asks for the debug messages of single categories.
    fn asked_for(mut self, options: &InstanceOptions) -> Result<Self, FmuError> {
        let Some(categories) = options.debug_log.as_ref().filter(|it| !it.is_empty()) else {
            return Ok(self);
        };
        let c_string = |text: &String| {
            CString::new(text.as_str()).map_err(|_| self.zero_byte("a log category").into())
        };
        let categories: Result<Vec<CString>, FmuError> = categories.iter().map(c_string).collect();
        self.order(&Request::SetDebugLogging(categories?))?;
        Ok(self)
    }

    fn with(
        package: &Arc<Package>,
        place: &'static Place,
        name: &str,
        dead: &Arc<AtomicBool>,
        backend: Backend,
    ) -> Self {
        Self {
            name: name.to_owned(),
            package: Arc::clone(package),
            backend,
            place,
            dead: Arc::clone(dead),
            warnings: Warnings::default(),
            offers: offers::Offers::of(package.description()),
            earlier: Vec::new(),
            running: false,
            steps: 0,
            time: None,
            pending_limit: PENDING_LIMIT,
            saved_before: None,
        }
    }

    /// The name that was passed to `fmi2Instantiate`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The unit that it is an instance of.
    #[must_use]
    pub fn package(&self) -> &Package {
        &self.package
    }

    /// Whether it lives in a process of its own.
    #[must_use]
    pub fn is_isolated(&self) -> bool {
        matches!(self.backend, Backend::Elsewhere(_))
    }

    /// Whether it is initialized, and neither terminated nor failed.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Number of finished steps.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Takes the messages that arrived since the last call.
    pub fn take_messages(&mut self) -> Vec<Message> {
        let description = self.package.description();
        match &mut self.backend {
            Backend::Here { sink, .. } => sink.take(description),
            Backend::Elsewhere(worker) => worker.take_messages(description),
        }
    }

    /// Takes messages that came with a refusal, or to an earlier instance in its place.
    pub fn take_earlier_messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.earlier)
    }

    /// Gives it messages that came with a refusal, or to an earlier instance in its place.
    pub fn inherit(&mut self, messages: Vec<Message>) {
        self.earlier.extend(messages);
        logger::note_arrival();
    }

    /// Sets how long a step may be pending before it counts as hanging.
    pub fn set_pending_limit(&mut self, limit: Duration) {
        self.pending_limit = limit;
    }

    /// Tells the unit about the span of time, and the relative tolerance for its own integration if
    /// there is one.
    ///
    /// # Errors
    /// The unit's.
    pub fn setup_experiment(
        &mut self,
        tolerance: Option<f64>,
        start: f64,
        stop: f64,
    ) -> Result<(), FmuError> {
        self.order(&Request::SetupExperiment { tolerance, start, stop })
    }

    /// Begins initialization.
    ///
    /// # Errors
    /// The unit's.
    pub fn enter_initialization_mode(&mut self) -> Result<(), FmuError> {
        self.order(&Request::EnterInitializationMode)
    }

    /// Ends initialization: the unit is ready to step.
    ///
    /// # Errors
    /// The unit's.
    pub fn exit_initialization_mode(&mut self) -> Result<(), FmuError> {
        self.order(&Request::ExitInitializationMode)?;
        self.running = true;
        Ok(())
    }

    /// Ends the run.
    ///
    /// # Errors
    /// The unit's.
    pub fn terminate(&mut self) -> Result<(), FmuError> {
        if !std::mem::take(&mut self.running) {
            return Ok(());
        }
        self.order(&Request::Terminate)
    }

    /// Returns to what it was when fresh.
    ///
    /// # Errors
    /// The unit's.
    pub fn reset(&mut self) -> Result<(), FmuError> {
        self.running = false;
        self.order(&Request::Reset)
    }

    /// Asks for a report, which is not of the standard (`fmi2_export_report`).
    ///
    /// # Errors
    /// The unit offers no reports, not this one, or not now.
    pub fn report(&mut self, request: &str) -> Result<String, FmuError> {
        if request.contains('\0') {
            return fail(self.zero_byte("the request for a report"));
        }
        self.alive()?;
        let reply = self.perform(&Request::Report(request.to_owned()));
        let instance = self.name.clone();
        match (reply.answer.outcome, reply.data) {
            (Outcome::Lacks, _) => fail(FmuFault::NoReports { instance }),
            (_, Data::Report(Some(text))) => Ok(text),
            (_, Data::Report(None)) => fail(FmuFault::Unanswered {
                instance,
                request: request.to_owned(),
                messages: self.take_messages(),
            }),
            _ => self.judge(reply.answer, &[]).map(|()| String::new()),
        }
    }

    /// Reads Reals.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), FmuError> {
        self.get::<Real>(references, values)
    }

    /// Reads Integers and Enumerations.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), FmuError> {
        self.get::<Integer>(references, values)
    }

    /// Reads Booleans: 0 or 1.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), FmuError> {
        self.get::<Boolean>(references, values)
    }

    /// Reads one String; null reads as empty.
    ///
    /// # Errors
    /// The unit's.
    pub fn get_string(&mut self, reference: u32) -> Result<CString, FmuError> {
        self.alive()?;
        let (answer, text) = match &mut self.backend {
            Backend::Here { component, .. } => component.get_string(reference),
            Backend::Elsewhere(worker) => {
                let reply = worker.perform(&Request::Get(Kind::String, vec![reference]));
                let text = match reply.data {
                    Data::Values(Values::String(mut texts)) => texts.pop(),
                    _ => None,
                };
                (reply.answer, text.unwrap_or_default())
            }
        };
        self.check(answer, &[reference])?;
        Ok(text)
    }

    /// Sets Reals.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), FmuError> {
        self.set_numbers::<Real>(references, values)
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), FmuError> {
        self.set_numbers::<Integer>(references, values)
    }

    /// Sets Booleans: 0 or 1.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Result<(), FmuError> {
        self.set_numbers::<Boolean>(references, values)
    }

    /// Sets one String.
    ///
    /// # Errors
    /// The unit's.
    pub fn set_string(&mut self, reference: u32, value: &CStr) -> Result<(), FmuError> {
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.set_string(reference, value),
            Backend::Elsewhere(worker) => {
                let values = Values::String(vec![value.to_owned()]);
                worker.perform(&Request::Set(vec![reference], values)).answer
            }
        };
        self.check(answer, &[reference])
    }

    /// Sets one variable of any type.
    ///
    /// # Errors
    /// The unit's, or a text with a zero byte.
    pub fn set(&mut self, variable: usize, value: &Value) -> Result<(), FmuError> {
        let package = Arc::clone(&self.package);
        let variable = &package.description().variables[variable];
        let reference = variable.value_reference;
        match value {
            Value::Real(value) => self.set_real(&[reference], &[*value]),
            Value::Integer(value) => self.set_integer(&[reference], &[*value]),
            Value::Boolean(value) => self.set_boolean(&[reference], &[i32::from(*value)]),
            Value::String(value) => match CString::new(value.as_str()) {
                Ok(text) => self.set_string(reference, &text),
                Err(_) => fail(self.zero_byte(&variable.name)),
            },
        }
    }

    fn get<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &mut [K::Value],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.get::<K>(references, values),
            Backend::Elsewhere(worker) => {
                let reply = worker.perform(&Request::Get(K::KIND, references.to_vec()));
                if let Data::Values(read) = &reply.data
                    && let Some(read) = K::unwrap(read)
                {
                    values.iter_mut().zip(read).for_each(|(value, read)| *value = *read);
                }
                reply.answer
            }
        };
        self.check(answer, references)
    }

    fn set_numbers<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &[K::Value],
    ) -> Result<(), FmuError> {
        if references.is_empty() {
            return Ok(());
        }
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => component.set::<K>(references, values),
            Backend::Elsewhere(worker) => {
                let values = K::wrap(values.to_vec());
                worker.perform(&Request::Set(references.to_vec(), values)).answer
            }
        };
        self.check(answer, references)
    }

    /// An error that says which variable is not finite.
    #[cold]
    pub fn not_finite(&mut self, variable: usize, value: f64, time: f64) -> FmuFault {
        FmuFault::NotFinite {
            instance: self.name.clone(),
            variable: self.package.description().variables[variable].name.clone(),
            value,
            time,
            messages: self.take_messages(),
        }
    }

    /// An error that says which value of an output an Enumeration does not have.
    #[cold]
    pub fn no_item(&self, variable: usize, value: i32, target: &str, time: f64) -> FmuError {
        let variable = self.package.description().variables[variable].name.clone();
        let (instance, target) = (self.name.clone(), target.to_owned());
        FmuFault::NoItem { instance, variable, value, target, time }.into()
    }

    /// Whether the unit may still be called.
    ///
    /// # Errors
    /// Its library has failed fatally, or its process is gone.
    pub fn still_alive(&self) -> Result<(), FmuError> {
        self.alive()
    }

    /// What calls have returned `fmi2Warning` so far.
    #[inline]
    #[must_use]
    pub fn warnings(&self) -> &Warnings {
        &self.warnings
    }

    #[inline]
    fn set_time(&mut self, time: f64) {
        self.time = Some(time);
        self.place.set_time(time);
    }

    /// To be asked before every call.
    #[inline]
    fn alive(&self) -> Result<(), FmuError> {
        self.place.enter();
        if self.dead.load(Ordering::Relaxed) {
            return fail(FmuFault::Dead { instance: self.name.clone() });
        }
        Ok(())
    }

    fn perform(&mut self, request: &Request) -> Reply {
        match &mut self.backend {
            Backend::Here { component, .. } => component.perform(request),
            Backend::Elsewhere(worker) => worker.perform(request),
        }
    }

    /// A request that brings back nothing but its status.
    fn order(&mut self, request: &Request) -> Result<(), FmuError> {
        self.ask(request, &[]).map(|_| ())
    }

    /// A request; `references` are the variables that it is about.
    fn ask(&mut self, request: &Request, references: &[u32]) -> Result<Data, FmuError> {
        self.alive()?;
        let reply = self.perform(request);
        self.check(reply.answer, references)?;
        Ok(reply.data)
    }

    #[inline]
    fn check(&mut self, answer: Answer, references: &[u32]) -> Result<(), FmuError> {
        if answer.is_good() { Ok(()) } else { self.judge(answer, references) }
    }

    #[cold]
    fn judge(&mut self, answer: Answer, references: &[u32]) -> Result<(), FmuError> {
        let call = answer.call.name();
        let instance = self.name.clone();
        let status = match answer.outcome {
            Outcome::Status(status) => sys::fmi2Status(status),
            Outcome::Lacks => return fail(FmuFault::Lacks { instance, call }),
            Outcome::Lost => return fail(self.lost()),
        };
        match status {
            sys::fmi2Status::fmi2OK => return Ok(()),
            _ if answer.refuses_derivatives() && self.warnings.may_refuse(self.steps) => {
                self.warnings.refuse(status);
                return Ok(());
            }
            sys::fmi2Status::fmi2Warning => {
                self.warnings.note(answer.call, self.time);
                return Ok(());
            }
            sys::fmi2Status::fmi2Fatal => self.dead.store(true, Ordering::Relaxed),
            _ => {}
        }
        // after an error, the standard allows reset, restoring and freeing, but no fmi2Terminate
        let refused = status == sys::fmi2Status::fmi2Discard
            && [
                Call::fmi2GetFMUstate,
                Call::fmi2SetRealInputDerivatives,
                Call::fmi2GetRealOutputDerivatives,
                Call::fmi2GetDirectionalDerivative,
            ]
            .contains(&answer.call);
        if !refused {
            self.running = false;
        }
        fail(FmuFault::Status {
            instance,
            call,
            status: status.to_string(),
            time: self.time,
            variables: self.names(answer.call, references),
            messages: self.take_messages(),
        })
    }

    /// Why its process is gone.
    #[cold]
    fn lost(&mut self) -> FmuFault {
        self.dead.store(true, Ordering::Relaxed);
        self.running = false;
        let messages = self.take_messages();
        match &mut self.backend {
            Backend::Elsewhere(worker) => worker.loss(&self.name, self.time, messages),
            Backend::Here { .. } => FmuFault::Dead { instance: self.name.clone() },
        }
    }

    fn zero_byte(&self, what: &str) -> FmuFault {
        FmuFault::ZeroByte { instance: self.name.clone(), what: what.to_owned() }
    }

    fn names(&self, call: Call, references: &[u32]) -> Vec<String> {
        if references.len() > 3 {
            return vec![format!("{} variables", references.len())];
        }
        let letter = match call {
            Call::fmi2GetInteger | Call::fmi2SetInteger => 'i',
            Call::fmi2GetBoolean | Call::fmi2SetBoolean => 'b',
            Call::fmi2GetString | Call::fmi2SetString => 's',
            _ => 'r',
        };
        let name = |&reference| self.package.description().name_of(letter, reference);
        references.iter().filter_map(name).map(str::to_owned).collect()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // the backend frees the unit
        self.place.enter();
    }
}

fn identity(
    package: &Package,
    name: &str,
    options: &InstanceOptions,
) -> Result<Identity, FmuError> {
    let text = |what: &str, text: &str| {
        CString::new(text).map_err(|_| {
            FmuError::from(FmuFault::ZeroByte { instance: name.to_owned(), what: what.to_owned() })
        })
    };
    Ok(Identity {
        name: text("its name", name)?,
        guid: text("the GUID", &package.description().guid)?,
        resources: text("the resource location", &package.resource_location())?,
        logging: options.debug_log.is_some(),
        trace: options.trace.as_ref().map(|it| it.of(name, package.description())),
    })
}
