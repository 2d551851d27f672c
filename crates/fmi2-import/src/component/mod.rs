//! The C side of one instance: calls the functions of its library with its `fmi2Component`.
//!
//! A call returns an [`Answer`]. [`Instance`](crate::instance::Instance) decides what follows from it.
//! The same code runs in this process and in a worker process ([`isolate`](crate::isolate)).

#[macro_use]
mod macros;
mod numeric;
mod perform;
mod states;
mod values;

use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use fmi2_sys as sys;

use crate::activity::Activity;
use crate::answer::Answer;
use crate::exchange::{DerivativeList, Received, Sent, StepLayout};
use crate::functions::{Call, Functions};
use crate::logger::{self, Sink};
use crate::request::Identity;
use crate::trace::{Line, Tracer};
pub(crate) use numeric::{Boolean, Integer, Numeric, Real};

/// One `fmi2Component`. Freed when dropped, unless its library failed fatally.
pub(crate) struct Component {
    functions: Functions,
    pointer: *mut c_void,
    // the FMU keeps the address of the callbacks and sends messages until it is freed
    sink: Arc<Sink>,
    _callbacks: Box<sys::fmi2CallbackFunctions>,
    /// saved states, null where freed
    states: Vec<sys::fmi2FMUstate>,
    /// shared by all instances of a library: true if none of its functions may be called any more
    dead: Arc<AtomicBool>,
    /// number of the current [`Activity`], to explain a crash
    mark: &'static AtomicU32,
    trace: Option<Box<Tracer>>,
}

impl Component {
    /// Creates a component. `None` if the FMU refuses; its messages are in the sink then.
    pub(crate) fn new(
        functions: Functions,
        dead: &Arc<AtomicBool>,
        identity: &Identity,
        sink: &Arc<Sink>,
        mark: &'static AtomicU32,
    ) -> Option<Self> {
        let callbacks = Box::new(sink.callbacks());
        // a worker that cannot open the trace works without it
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
        mark.store(Activity::IDLE, Ordering::Relaxed);
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

    /// Sets all inputs of a step. Stops at the first call that fails; a warning is kept.
    #[inline]
    pub(crate) fn send(&mut self, layout: &StepLayout, sent: &Sent) -> Answer {
        let mut worst = Answer::good(Call::fmi2SetReal);
        let (set, values) = (&layout.set, &sent.values);
        if !set.reals.is_empty() {
            worst = worst.or_worse(self.set::<Real>(&set.reals, values.reals));
        }
        if !set.integers.is_empty() && worst.can_continue() {
            worst = worst.or_worse(self.set::<Integer>(&set.integers, values.integers));
        }
        if !set.booleans.is_empty() && worst.can_continue() {
            worst = worst.or_worse(self.set::<Boolean>(&set.booleans, values.booleans));
        }
        let DerivativeList { references, orders } = &layout.set_derivatives;
        let mut begin = 0;
        for &end in &layout.set_derivative_calls {
            if !worst.can_continue() {
                break;
            }
            let call = begin..end;
            let (references, orders) = (&references[call.clone()], &orders[call.clone()]);
            worst =
                worst.or_worse(self.set_derivatives(references, orders, &sent.derivatives[call]));
            begin = end;
        }
        worst
    }

    /// Reads all outputs after a step. Stops at the first call that fails; a warning is kept.
    #[inline]
    pub(crate) fn receive(&mut self, layout: &StepLayout, received: &mut Received) -> Answer {
        let mut worst = Answer::good(Call::fmi2GetReal);
        let (get, values) = (&layout.get, &mut received.values);
        if !get.reals.is_empty() {
            worst = worst.or_worse(self.get::<Real>(&get.reals, values.reals));
        }
        let DerivativeList { references, orders } = &layout.get_derivatives;
        if !references.is_empty() && worst.can_continue() {
            let derivatives = &mut *received.derivatives;
            worst = worst.or_worse(self.get_derivatives(references, orders, derivatives));
        }
        if !get.integers.is_empty() && worst.can_continue() {
            worst = worst.or_worse(self.get::<Integer>(&get.integers, values.integers));
        }
        if !get.booleans.is_empty() && worst.can_continue() {
            worst = worst.or_worse(self.get::<Boolean>(&get.booleans, values.booleans));
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
}

impl Drop for Component {
    fn drop(&mut self) {
        if self.dead.load(Ordering::Relaxed) {
            if cfg!(windows) {
                // unloading the library would call it
                std::mem::forget(Arc::clone(&self.functions.loaded));
            }
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
                    // SAFETY: the component is alive, and the state belongs to it and is freed once
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
        self.mark.store(Activity::IDLE, Ordering::Relaxed);
    }
}
