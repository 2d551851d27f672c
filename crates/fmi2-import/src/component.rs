//! The C side of one instance: the functions of its library on its `fmi2Component`.
//!
//! Calls answer with what came back and judge nothing; [`Instance`](crate::instance::Instance) does.
//! The same code runs in this process and in a worker process ([`isolate`](crate::isolate)): what a
//! step needs has methods of its own, everything else is a [`Request`].

use std::ffi::{CStr, CString, c_void};
use std::fmt::Debug;
use std::ptr::{null, null_mut};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use fmi2_sys as sys;
use serde::{Deserialize, Serialize};
use sys::fmi2Status as Status;

use crate::library::{Call, Functions};
use crate::logger::{self, Sink};
use crate::trace::{Line, Traced, Tracer};

/// What came back from a call.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Outcome {
    /// The function returned this `fmi2Status`.
    Status(u32),
    /// The library has no such function.
    Lacks,
    /// The process that the call was made in is gone.
    Lost,
}

/// A call and what came back.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[must_use]
pub(crate) struct Answer {
    pub(crate) call: Call,
    pub(crate) outcome: Outcome,
}

impl Answer {
    pub(crate) const fn new(call: Call, status: Status) -> Self {
        Self { call, outcome: Outcome::Status(status.0) }
    }

    pub(crate) const fn good(call: Call) -> Self {
        Self::new(call, Status::fmi2OK)
    }

    #[inline]
    pub(crate) fn is_good(self) -> bool {
        self.outcome == Outcome::Status(Status::fmi2OK.0)
    }

    /// Whether the unit can go on as if nothing had happened.
    #[inline]
    pub(crate) fn goes_on(self) -> bool {
        self.is_good() || self.is(Status::fmi2Warning) || self.refuses_derivatives()
    }

    /// Whether the unit has not taken derivatives of inputs, and has come to no harm by it.
    pub(crate) fn refuses_derivatives(self) -> bool {
        self.call == Call::fmi2SetRealInputDerivatives
            && (self.is(Status::fmi2Warning) || self.is(Status::fmi2Discard))
    }

    /// This, or the next one if it says more.
    #[inline]
    pub(crate) fn then(self, next: Self) -> Self {
        if next.is_good() || self.weight() > next.weight() { self } else { next }
    }

    /// How much an answer says among those to one exchange, of which one is kept: a failure most, then
    /// what has consequences here.
    #[cold]
    fn weight(self) -> u8 {
        match self.call {
            _ if self.is_good() => 0,
            _ if !self.goes_on() => 4,
            Call::fmi2SetRealInputDerivatives => 3,
            Call::fmi2DoStep => 2,
            _ => 1,
        }
    }

    #[inline]
    pub(crate) fn is(self, status: Status) -> bool {
        self.outcome == Outcome::Status(status.0)
    }
}

/// Values of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Values {
    Real(Vec<f64>),
    Integer(Vec<i32>),
    Boolean(Vec<i32>),
    String(Vec<CString>),
}

type Getter<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *mut T) -> Status;
type Setter<T> = unsafe extern "C" fn(*mut c_void, *const u32, usize, *const T) -> Status;

/// A type whose values are plain numbers in C.
pub(crate) trait Numeric {
    type Value: Copy + Default + Debug;
    const KIND: Kind;
    const GET: Call;
    const SET: Call;
    fn getter(functions: &Functions) -> Option<Getter<Self::Value>>;
    fn setter(functions: &Functions) -> Option<Setter<Self::Value>>;
    /// For the way to another process.
    fn wrap(values: Vec<Self::Value>) -> Values;
    /// Back from there.
    fn unwrap(values: &Values) -> Option<&[Self::Value]>;
}

macro_rules! numeric {
    ($($kind:ident of $value:ty: $get:ident $getter:ident, $set:ident $setter:ident;)*) => {$(
        pub(crate) struct $kind;

        impl Numeric for $kind {
            type Value = $value;
            const KIND: Kind = Kind::$kind;
            const GET: Call = Call::$get;
            const SET: Call = Call::$set;
            #[inline]
            fn getter(functions: &Functions) -> Option<Getter<$value>> {
                functions.$getter
            }
            #[inline]
            fn setter(functions: &Functions) -> Option<Setter<$value>> {
                functions.$setter
            }
            fn wrap(values: Vec<$value>) -> Values {
                Values::$kind(values)
            }
            fn unwrap(values: &Values) -> Option<&[$value]> {
                match values {
                    Values::$kind(values) => Some(values),
                    _ => None,
                }
            }
        }
    )*};
}

numeric! {
    Real of f64: fmi2GetReal get_real, fmi2SetReal set_real;
    Integer of i32: fmi2GetInteger get_integer, fmi2SetInteger set_integer;
    Boolean of i32: fmi2GetBoolean get_boolean, fmi2SetBoolean set_boolean;
}

/// Which values to ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(crate) enum Kind {
    Real,
    Integer,
    Boolean,
    String,
}

/// Everything that is not done in every step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Request {
    SetupExperiment {
        tolerance: Option<f64>,
        start: f64,
        stop: f64,
    },
    /// of these categories
    SetDebugLogging(Vec<CString>),
    EnterInitializationMode,
    ExitInitializationMode,
    Terminate,
    Reset,
    Get(Kind, Vec<u32>),
    Set(Vec<u32>, Values),
    SetRealInputDerivatives(Vec<u32>, Vec<i32>, Vec<f64>),
    GetRealOutputDerivatives(Vec<u32>, Vec<i32>),
    GetDirectionalDerivative {
        unknowns: Vec<u32>,
        knowns: Vec<u32>,
        seed: Vec<f64>,
    },
    CancelStep,
    /// `fmi2DoStepStatus`
    GetStepStatus,
    /// `fmi2LastSuccessfulTime`
    GetLastSuccessfulTime,
    /// `fmi2Terminated`
    GetTerminated,
    /// into that slot, or a new one
    SaveState(Option<usize>),
    RestoreState(usize),
    FreeState(usize),
    SerializeState(usize),
    DeserializeState(Vec<u8>),
    Report(String),
}

/// What a request brings back besides its status.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Data {
    None,
    Values(Values),
    Bytes(Vec<u8>),
    Number(f64),
    Status(u32),
    Slot(usize),
    /// There is no such saved state.
    NoState,
    /// So many bytes for a saved state are not to be had.
    TooLarge(usize),
    /// A report, if the unit gives this one.
    Report(Option<String>),
}

impl Data {
    /// Copies Reals, if it is these.
    pub(crate) fn copy_reals(&self, to: &mut [f64]) {
        if let Self::Values(Values::Real(values)) = self {
            to.iter_mut().zip(values).for_each(|(to, value)| *to = *value);
        }
    }
}

/// Answer to a request.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Reply {
    pub(crate) answer: Answer,
    pub(crate) data: Data,
}

/// What goes to and comes from an instance in every step, by value references.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepLayout {
    /// Reals that are set.
    pub set_reals: Vec<u32>,
    /// Integers and Enumerations that are set.
    pub set_integers: Vec<u32>,
    /// Booleans that are set.
    pub set_booleans: Vec<u32>,
    /// Reals whose derivatives are set, once per derivative.
    pub set_derivatives: Vec<u32>,
    /// Order of each of these derivatives.
    pub set_orders: Vec<i32>,
    /// Where each call that sets derivatives ends in these two.
    pub set_derivative_calls: Vec<usize>,
    /// Reals that are read.
    pub get_reals: Vec<u32>,
    /// Integers and Enumerations that are read.
    pub get_integers: Vec<u32>,
    /// Booleans that are read.
    pub get_booleans: Vec<u32>,
    /// Reals whose derivatives are read, once per derivative.
    pub get_derivatives: Vec<u32>,
    /// Order of each of these derivatives.
    pub get_orders: Vec<i32>,
}

impl StepLayout {
    /// The variables that a call of [`Component::send`] or [`Component::receive`] is about.
    pub fn references(&self, call: Call) -> &[u32] {
        match call {
            Call::fmi2SetReal => &self.set_reals,
            Call::fmi2SetInteger => &self.set_integers,
            Call::fmi2SetBoolean => &self.set_booleans,
            Call::fmi2SetRealInputDerivatives => &self.set_derivatives,
            Call::fmi2GetReal => &self.get_reals,
            Call::fmi2GetInteger => &self.get_integers,
            Call::fmi2GetBoolean => &self.get_booleans,
            Call::fmi2GetRealOutputDerivatives => &self.get_derivatives,
            _ => &[],
        }
    }
}

/// Values of the `set_` lists of a [`StepLayout`].
#[derive(Debug, Clone, Copy)]
pub struct Sent<'a> {
    /// Reals.
    pub reals: &'a [f64],
    /// Integers and Enumerations.
    pub integers: &'a [i32],
    /// Booleans, as `fmi2Boolean`.
    pub booleans: &'a [i32],
    /// Derivatives of Reals.
    pub derivatives: &'a [f64],
}

/// Places for the values of the `get_` lists of a [`StepLayout`].
#[derive(Debug)]
pub struct Received<'a> {
    /// Reals.
    pub reals: &'a mut [f64],
    /// Integers and Enumerations.
    pub integers: &'a mut [i32],
    /// Booleans, as `fmi2Boolean`.
    pub booleans: &'a mut [i32],
    /// Derivatives of Reals.
    pub derivatives: &'a mut [f64],
}

/// What makes an instance.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Identity {
    pub(crate) name: CString,
    pub(crate) guid: CString,
    pub(crate) resources: CString,
    pub(crate) logging: bool,
    pub(crate) trace: Option<Traced>,
}

/// The mark of a component that is in no call.
pub(crate) const IDLE: u32 = u32::MAX;

/// The mark while the library of a component is loaded.
pub(crate) const LOADING: u32 = u32::MAX - 1;

/// One `fmi2Component`. Freed when dropped, unless its library failed fatally.
pub(crate) struct Component {
    functions: Functions,
    pointer: *mut c_void,
    // the unit holds the callbacks' address, and talks to the sink, as long as it lives
    sink: Arc<Sink>,
    _callbacks: Box<sys::fmi2CallbackFunctions>,
    /// saved states, null where freed
    states: Vec<sys::fmi2FMUstate>,
    /// shared by all instances of a library: nothing of it may be called any more
    dead: Arc<AtomicBool>,
    /// says which call is going on to whoever must explain a crash
    mark: &'static AtomicU32,
    trace: Option<Box<Tracer>>,
}

/// Makes a call, with a line in the trace before and after it if there is one.
macro_rules! traced {
    ($self:ident, $call:expr, $tell:expr, $run:expr) => {
        traced!($self, $call, $tell, $run, |_| {})
    };
    ($self:ident, $call:expr, $tell:expr, $run:expr, $brings:expr) => {
        match &$self.trace {
            None => $run,
            Some(trace) => {
                let begin = trace.before($call, $tell);
                let answer = $run;
                trace.after(answer, begin, $brings);
                answer
            }
        }
    };
}

/// A call of a function that the trace tells no more of than its arguments in words.
macro_rules! request {
    ($self:ident, $field:ident, $call:ident, [$($words:tt)*] $(, $argument:expr)* $(,)?) => {
        traced!(
            $self,
            Call::$call,
            |it| it.item(format_args!($($words)*)),
            invoke!($self, $field, $call $(, $argument)*)
        )
    };
}

macro_rules! invoke {
    ($self:ident, $field:ident, $call:ident $(, $argument:expr)* $(,)?) => {
        match $self.functions.$field {
            Some(function) => {
                $self.mark.store(Call::$call as u32, Ordering::Relaxed);
                // SAFETY: the component is what the same library's fmi2Instantiate returned;
                // pointers come from slices of the length that is passed with them, or from
                // places of the right type, and outlive the call
                let status = unsafe { function($self.pointer $(, $argument)*) };
                $self.mark.store(IDLE, Ordering::Relaxed);
                Answer::new(Call::$call, status)
            }
            None => Answer { call: Call::$call, outcome: Outcome::Lacks },
        }
    };
}

impl Component {
    /// Creates a component; `None` when the unit refuses, which it has told the sink.
    pub(crate) fn new(
        functions: Functions,
        dead: &Arc<AtomicBool>,
        identity: &Identity,
        sink: &Arc<Sink>,
        mark: &'static AtomicU32,
    ) -> Option<Self> {
        let callbacks = Box::new(sink.callbacks());
        // a worker that cannot open the file, which its master could, works without
        let trace = identity.trace.as_ref().and_then(|it| Tracer::open(it).ok()).map(Box::new);
        let begin = trace.as_ref().map(|it| {
            it.before(Call::fmi2Instantiate, |line| {
                let Identity { name, guid, resources, logging, .. } = identity;
                line.item(format_args!(
                    "{name:?}, fmi2CoSimulation, {guid:?}, {resources:?}, loggingOn {logging}"
                ));
            })
        });
        mark.store(Call::fmi2Instantiate as u32, Ordering::Relaxed);
        // SAFETY: all pointers are valid C strings; the callbacks are boxed and stay where they
        // are until the instance is freed
        let pointer = unsafe {
            functions.instantiate?(
                identity.name.as_ptr(),
                sys::fmi2Type::fmi2CoSimulation,
                identity.guid.as_ptr(),
                identity.resources.as_ptr(),
                &raw const *callbacks,
                0,
                identity.logging.into(),
            )
        };
        mark.store(IDLE, Ordering::Relaxed);
        if let (Some(trace), Some(begin)) = (&trace, begin) {
            let answer = Answer::good(Call::fmi2Instantiate);
            let null = pointer.is_null();
            trace.after(answer, begin, |it| {
                it.item(format_args!("{}", if null { "null" } else { "an instance" }));
            });
        }
        if pointer.is_null() {
            return None;
        }
        Some(Self {
            functions,
            pointer,
            sink: Arc::clone(sink),
            _callbacks: callbacks,
            states: Vec::new(),
            dead: Arc::clone(dead),
            mark,
            trace,
        })
    }

    /// Reads values of one type.
    #[inline]
    pub(crate) fn get<K: Numeric>(
        &mut self,
        references: &[u32],
        values: &mut [K::Value],
    ) -> Answer {
        let n = references.len().min(values.len());
        traced!(
            self,
            K::GET,
            |it| it.variables(K::KIND, references),
            self.transfer(K::GET, K::getter(&self.functions), |component, get| {
                // SAFETY: a live component; both pointers are good for n values
                unsafe { get(component, references.as_ptr(), n, values.as_mut_ptr()) }
            }),
            |it| it.values(K::KIND, references, values)
        )
    }

    /// Sets values of one type.
    #[inline]
    pub(crate) fn set<K: Numeric>(&mut self, references: &[u32], values: &[K::Value]) -> Answer {
        let n = references.len().min(values.len());
        traced!(
            self,
            K::SET,
            |it| it.values(K::KIND, references, values),
            self.transfer(K::SET, K::setter(&self.functions), |component, set| {
                // SAFETY: a live component; both pointers are good for n values
                unsafe { set(component, references.as_ptr(), n, values.as_ptr()) }
            })
        )
    }

    #[inline]
    fn transfer<F>(
        &self,
        call: Call,
        function: Option<F>,
        run: impl FnOnce(*mut c_void, F) -> Status,
    ) -> Answer {
        let Some(function) = function else { return Answer { call, outcome: Outcome::Lacks } };
        self.mark.store(call as u32, Ordering::Relaxed);
        let status = run(self.pointer, function);
        self.mark.store(IDLE, Ordering::Relaxed);
        Answer::new(call, status)
    }

    /// Reads one String; null reads as empty.
    pub(crate) fn get_string(&mut self, reference: u32) -> (Answer, CString) {
        let mut pointer: sys::fmi2String = null();
        let answer = traced!(
            self,
            Call::fmi2GetString,
            |it| it.variables(Kind::String, &[reference]),
            invoke!(self, get_string, fmi2GetString, &raw const reference, 1, &raw mut pointer),
            |it| if !pointer.is_null() {
                // SAFETY: not null; the standard keeps the string alive until the next call
                it.values(Kind::String, &[reference], &[unsafe { CStr::from_ptr(pointer) }]);
            }
        );
        if pointer.is_null() || !answer.goes_on() {
            return (answer, CString::default());
        }
        // SAFETY: not null; the standard keeps the string alive until the next call
        (answer, unsafe { CStr::from_ptr(pointer) }.to_owned())
    }

    /// Sets one String.
    pub(crate) fn set_string(&mut self, reference: u32, value: &CStr) -> Answer {
        let pointer = value.as_ptr();
        traced!(
            self,
            Call::fmi2SetString,
            |it| it.values(Kind::String, &[reference], &[value]),
            invoke!(self, set_string, fmi2SetString, &raw const reference, 1, &raw const pointer)
        )
    }

    /// Sets derivatives of inputs for the coming step.
    #[inline]
    pub(crate) fn set_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Answer {
        let n = references.len().min(orders.len()).min(values.len());
        traced!(
            self,
            Call::fmi2SetRealInputDerivatives,
            |it| it.derivatives(references, orders, values),
            invoke!(
                self,
                set_real_input_derivatives,
                fmi2SetRealInputDerivatives,
                references.as_ptr(),
                n,
                orders.as_ptr(),
                values.as_ptr()
            )
        )
    }

    /// Reads derivatives of outputs at the end of the last step.
    #[inline]
    pub(crate) fn get_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Answer {
        let n = references.len().min(orders.len()).min(values.len());
        traced!(
            self,
            Call::fmi2GetRealOutputDerivatives,
            |it| it.derivatives(references, orders, &[]),
            invoke!(
                self,
                get_real_output_derivatives,
                fmi2GetRealOutputDerivatives,
                references.as_ptr(),
                n,
                orders.as_ptr(),
                values.as_mut_ptr()
            ),
            |it| it.derivatives(references, orders, values)
        )
    }

    /// Sets all inputs of a step. Stops at the first call that fails; a warning is kept.
    #[inline]
    pub(crate) fn send(&mut self, layout: &StepLayout, sent: &Sent) -> Answer {
        let mut worst = Answer::good(Call::fmi2SetReal);
        let l = layout;
        if !l.set_reals.is_empty() {
            worst = worst.then(self.set::<Real>(&l.set_reals, sent.reals));
        }
        if !l.set_integers.is_empty() && worst.goes_on() {
            worst = worst.then(self.set::<Integer>(&l.set_integers, sent.integers));
        }
        if !l.set_booleans.is_empty() && worst.goes_on() {
            worst = worst.then(self.set::<Boolean>(&l.set_booleans, sent.booleans));
        }
        let mut begin = 0;
        for &end in &l.set_derivative_calls {
            if !worst.goes_on() {
                break;
            }
            let part = begin..end;
            let (references, orders) =
                (&l.set_derivatives[part.clone()], &l.set_orders[part.clone()]);
            worst = worst.then(self.set_derivatives(references, orders, &sent.derivatives[part]));
            begin = end;
        }
        worst
    }

    /// Reads all outputs after a step. Stops at the first call that fails; a warning is kept.
    #[inline]
    pub(crate) fn receive(&mut self, layout: &StepLayout, received: &mut Received) -> Answer {
        let mut worst = Answer::good(Call::fmi2GetReal);
        let l = layout;
        if !l.get_reals.is_empty() {
            worst = worst.then(self.get::<Real>(&l.get_reals, received.reals));
        }
        if !l.get_derivatives.is_empty() && worst.goes_on() {
            let values = &mut *received.derivatives;
            worst = worst.then(self.get_derivatives(&l.get_derivatives, &l.get_orders, values));
        }
        if !l.get_integers.is_empty() && worst.goes_on() {
            worst = worst.then(self.get::<Integer>(&l.get_integers, received.integers));
        }
        if !l.get_booleans.is_empty() && worst.goes_on() {
            worst = worst.then(self.get::<Boolean>(&l.get_booleans, received.booleans));
        }
        worst
    }

    /// Steps from `time` over `size`.
    #[inline]
    pub(crate) fn do_step(&mut self, time: f64, size: f64) -> Answer {
        traced!(
            self,
            Call::fmi2DoStep,
            |it| it.item(format_args!("from {time:?} over {size:?}, noSetFMUStatePrior true")),
            invoke!(self, do_step, fmi2DoStep, time, size, 1)
        )
    }

    /// Saves the state into a slot, whose memory the unit uses again; a slot beyond the last is a
    /// new one.
    pub(crate) fn save_state(&mut self, slot: usize) -> Answer {
        let mut state = self.states.get(slot).copied().unwrap_or(null_mut());
        let answer =
            request!(self, get_fmu_state, fmi2GetFMUstate, ["state {slot}"], &raw mut state);
        if answer.goes_on() {
            self.put_state(slot, state);
        }
        answer
    }

    fn put_state(&mut self, slot: usize, state: sys::fmi2FMUstate) {
        match self.states.get_mut(slot) {
            Some(place) => *place = state,
            None => self.states.push(state),
        }
    }

    fn free_slot(&self) -> usize {
        self.states.iter().position(|it| it.is_null()).unwrap_or(self.states.len())
    }

    /// Answers a request.
    pub(crate) fn perform(&mut self, request: &Request) -> Reply {
        let answer = match request {
            &Request::SetupExperiment { tolerance, start, stop } => {
                let (defined, value) = (i32::from(tolerance.is_some()), tolerance.unwrap_or(0.0));
                request!(
                    self,
                    setup_experiment,
                    fmi2SetupExperiment,
                    ["tolerance {tolerance:?}, start {start:?}, stop {stop:?}"],
                    defined,
                    value,
                    start,
                    1,
                    stop
                )
            }
            Request::SetDebugLogging(categories) => self.set_debug_logging(categories),
            Request::EnterInitializationMode => {
                request!(self, enter_initialization_mode, fmi2EnterInitializationMode, [""])
            }
            Request::ExitInitializationMode => {
                request!(self, exit_initialization_mode, fmi2ExitInitializationMode, [""])
            }
            Request::Terminate => request!(self, terminate, fmi2Terminate, [""]),
            Request::Reset => request!(self, reset, fmi2Reset, [""]),
            Request::CancelStep => request!(self, cancel_step, fmi2CancelStep, [""]),
            Request::Set(references, values) => self.set_any(references, values),
            Request::SetRealInputDerivatives(references, orders, values) => {
                self.set_derivatives(references, orders, values)
            }
            _ => return self.ask(request),
        };
        Reply { answer, data: Data::None }
    }

    /// Turns debug messages of these categories on.
    fn set_debug_logging(&mut self, categories: &[CString]) -> Answer {
        let names: Vec<_> = categories.iter().map(|it| it.as_ptr()).collect();
        request!(
            self,
            set_debug_logging,
            fmi2SetDebugLogging,
            ["true, {categories:?}"],
            1,
            names.len(),
            names.as_ptr()
        )
    }

    fn set_any(&mut self, references: &[u32], values: &Values) -> Answer {
        match values {
            Values::Real(values) => self.set::<Real>(references, values),
            Values::Integer(values) => self.set::<Integer>(references, values),
            Values::Boolean(values) => self.set::<Boolean>(references, values),
            Values::String(values) => {
                let mut worst = Answer::good(Call::fmi2SetString);
                for (&reference, value) in references.iter().zip(values) {
                    worst = worst.then(self.set_string(reference, value));
                    if !worst.goes_on() {
                        break;
                    }
                }
                worst
            }
        }
    }

    /// Requests that bring something back.
    fn ask(&mut self, request: &Request) -> Reply {
        match request {
            Request::Get(kind, references) => self.get_any(*kind, references),
            Request::GetRealOutputDerivatives(references, orders) => {
                let mut values = vec![f64::NAN; references.len()];
                let answer = self.get_derivatives(references, orders, &mut values);
                Reply { answer, data: Data::Values(Values::Real(values)) }
            }
            Request::GetDirectionalDerivative { unknowns, knowns, seed } => {
                let mut values = vec![f64::NAN; unknowns.len()];
                let answer = self.directional_derivative(unknowns, knowns, seed, &mut values);
                Reply { answer, data: Data::Values(Values::Real(values)) }
            }
            Request::GetStepStatus => {
                let mut status = Status::fmi2Pending;
                let kind = sys::fmi2StatusKind::fmi2DoStepStatus;
                let answer = traced!(
                    self,
                    Call::fmi2GetStatus,
                    |it| it.item(format_args!("fmi2DoStepStatus")),
                    invoke!(self, get_status, fmi2GetStatus, kind, &raw mut status),
                    |it| it.item(format_args!("{status}"))
                );
                Reply { answer, data: Data::Status(status.0) }
            }
            Request::GetLastSuccessfulTime => {
                let mut time = f64::NAN;
                let kind = sys::fmi2StatusKind::fmi2LastSuccessfulTime;
                let answer = traced!(
                    self,
                    Call::fmi2GetRealStatus,
                    |it| it.item(format_args!("fmi2LastSuccessfulTime")),
                    invoke!(self, get_real_status, fmi2GetRealStatus, kind, &raw mut time),
                    |it| it.item(format_args!("{time:?}"))
                );
                Reply { answer, data: Data::Number(time) }
            }
            Request::GetTerminated => {
                let mut ended = 0;
                let kind = sys::fmi2StatusKind::fmi2Terminated;
                let answer = traced!(
                    self,
                    Call::fmi2GetBooleanStatus,
                    |it| it.item(format_args!("fmi2Terminated")),
                    invoke!(self, get_boolean_status, fmi2GetBooleanStatus, kind, &raw mut ended),
                    |it| it.item(format_args!("{ended}"))
                );
                Reply { answer, data: Data::Number(f64::from(ended)) }
            }
            Request::Report(text) => {
                let answer = Answer::good(Call::fmi2GetStringStatus);
                if self.functions.report.is_none() {
                    let outcome = Outcome::Lacks;
                    return Reply { answer: Answer { outcome, ..answer }, data: Data::None };
                }
                Reply { answer, data: Data::Report(self.report(text)) }
            }
            state => self.state(state),
        }
    }

    fn get_any(&mut self, kind: Kind, references: &[u32]) -> Reply {
        fn read<K: Numeric>(component: &mut Component, references: &[u32]) -> Reply {
            let mut values = vec![K::Value::default(); references.len()];
            let answer = component.get::<K>(references, &mut values);
            Reply { answer, data: Data::Values(K::wrap(values)) }
        }
        match kind {
            Kind::Real => read::<Real>(self, references),
            Kind::Integer => read::<Integer>(self, references),
            Kind::Boolean => read::<Boolean>(self, references),
            Kind::String => {
                let mut worst = Answer::good(Call::fmi2GetString);
                let mut texts = Vec::with_capacity(references.len());
                for &reference in references {
                    let (answer, text) = self.get_string(reference);
                    worst = worst.then(answer);
                    texts.push(text);
                    if !worst.goes_on() {
                        break;
                    }
                }
                Reply { answer: worst, data: Data::Values(Values::String(texts)) }
            }
        }
    }

    /// Derivative of unknowns along a direction of knowns.
    pub(crate) fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Answer {
        traced!(
            self,
            Call::fmi2GetDirectionalDerivative,
            |it| {
                it.variables(Kind::Real, unknowns);
                it.item(format_args!("along"));
                it.values(Kind::Real, knowns, seed);
            },
            invoke!(
                self,
                get_directional_derivative,
                fmi2GetDirectionalDerivative,
                unknowns.as_ptr(),
                unknowns.len().min(out.len()),
                knowns.as_ptr(),
                knowns.len().min(seed.len()),
                seed.as_ptr(),
                out.as_mut_ptr()
            ),
            |it| it.values(Kind::Real, unknowns, out)
        )
    }

    /// Requests about saved states.
    fn state(&mut self, request: &Request) -> Reply {
        let held = |slot: usize| self.states.get(slot).copied().filter(|state| !state.is_null());
        match *request {
            Request::SaveState(into) => {
                let slot = into.unwrap_or_else(|| self.free_slot());
                Reply { answer: self.save_state(slot), data: Data::Slot(slot) }
            }
            Request::DeserializeState(ref bytes) => {
                let mut state = null_mut();
                let answer = request!(
                    self,
                    deserialize_fmu_state,
                    fmi2DeSerializeFMUstate,
                    ["{} bytes", bytes.len()],
                    bytes.as_ptr().cast(),
                    bytes.len(),
                    &raw mut state
                );
                let slot = self.free_slot();
                if answer.goes_on() {
                    self.put_state(slot, state);
                }
                Reply { answer, data: Data::Slot(slot) }
            }
            Request::RestoreState(slot) => match held(slot) {
                Some(state) => {
                    let answer =
                        request!(self, set_fmu_state, fmi2SetFMUstate, ["state {slot}"], state);
                    Reply { answer, data: Data::None }
                }
                None => no_state(Call::fmi2SetFMUstate),
            },
            Request::FreeState(slot) => match held(slot) {
                Some(mut state) => {
                    self.states[slot] = null_mut();
                    let answer = request!(
                        self,
                        free_fmu_state,
                        fmi2FreeFMUstate,
                        ["state {slot}"],
                        &raw mut state
                    );
                    Reply { answer, data: Data::None }
                }
                None => no_state(Call::fmi2FreeFMUstate),
            },
            Request::SerializeState(slot) => match held(slot) {
                Some(state) => self.serialize(state),
                None => no_state(Call::fmi2SerializeFMUstate),
            },
            _ => no_state(Call::fmi2SetFMUstate),
        }
    }

    fn serialize(&mut self, state: sys::fmi2FMUstate) -> Reply {
        let mut size = 0;
        let answer = traced!(
            self,
            Call::fmi2SerializedFMUstateSize,
            |_| {},
            invoke!(
                self,
                serialized_fmu_state_size,
                fmi2SerializedFMUstateSize,
                state,
                &raw mut size
            ),
            |it| it.item(format_args!("{size} bytes"))
        );
        if !answer.goes_on() {
            return Reply { answer, data: Data::None };
        }
        let mut bytes = Vec::new();
        if bytes.try_reserve_exact(size).is_err() {
            return Reply { answer, data: Data::TooLarge(size) };
        }
        bytes.resize(size, 0_u8);
        let place = bytes.as_mut_ptr().cast();
        let written = request!(
            self,
            serialize_fmu_state,
            fmi2SerializeFMUstate,
            ["{size} bytes"],
            state,
            place,
            size
        );
        Reply { answer: answer.then(written), data: Data::Bytes(bytes) }
    }

    /// Asks for a report, which is not of the standard (`fmi2_export_report`).
    fn report(&mut self, request: &str) -> Option<String> {
        let function = self.functions.report?;
        let text = CString::new(request).ok()?;
        // room for most reports, so that they are made once
        let mut buffer = vec![0_u8; 1 << 20];
        loop {
            let (start, room) = (buffer.as_mut_ptr().cast(), buffer.len());
            // SAFETY: the component is this library's; request and buffer outlive the call
            let length = unsafe { function(self.pointer, text.as_ptr(), start, room) };
            if length == 0 {
                return None;
            }
            if length <= room {
                buffer.truncate(length);
                return Some(String::from_utf8_lossy(&buffer).into_owned());
            }
            buffer.resize(length, 0);
        }
    }
}

fn no_state(call: Call) -> Reply {
    Reply { answer: Answer::good(call), data: Data::NoState }
}

impl Drop for Component {
    fn drop(&mut self) {
        if self.dead.load(Ordering::Relaxed) {
            return;
        }
        logger::calls(self.sink.badge());
        if let Some(free) = self.functions.free_fmu_state {
            self.mark.store(Call::fmi2FreeFMUstate as u32, Ordering::Relaxed);
            for (slot, mut state) in self.states.drain(..).enumerate() {
                if state.is_null() {
                    continue;
                }
                let mut call = || {
                    // SAFETY: the component is alive, the state is one of its own and freed once
                    let status = unsafe { free(self.pointer, &raw mut state) };
                    Answer::new(Call::fmi2FreeFMUstate, status)
                };
                let words = |it: &mut Line<'_>| it.item(format_args!("state {slot}"));
                let _ = traced!(self, Call::fmi2FreeFMUstate, words, call());
            }
        }
        if let Some(free) = self.functions.free_instance {
            self.mark.store(Call::fmi2FreeInstance as u32, Ordering::Relaxed);
            let call = || {
                // SAFETY: the component is alive and not used after this
                unsafe { free(self.pointer) };
                Answer::good(Call::fmi2FreeInstance)
            };
            let _ = traced!(self, Call::fmi2FreeInstance, |_| {}, call());
        }
        self.mark.store(IDLE, Ordering::Relaxed);
    }
}
