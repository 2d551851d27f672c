//! One instance of an FMU: a safe wrapper around its C functions.
//!
//! The status of every call is checked. `fmi2Warning` is counted (see [`Warnings`]), `fmi2Pending` is
//! polled, and `fmi2Discard`, `fmi2Error` and `fmi2Fatal` become a [`FmuError`]. After `fmi2Fatal` no
//! function of the library is called any more, not even to free the instance. The functions are called in
//! this process, or in a [worker process](crate::isolate), where a crash is caught.

mod create;
mod judge;
mod offers;
mod options;
mod state;
mod step;
mod values;
mod warnings;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use crate::answer::Outcome;
use crate::component::Component;
use crate::fault::fail;
pub use crate::fault::{FmuError, FmuFault, Loss};
use crate::isolate::Worker;
use crate::logger::{self, Message, Sink};
use crate::package::Package;
use crate::request::{Data, Reply, Request};
use crate::witness::Place;
pub use offers::{BrokenPromise, Offer};
pub use options::InstanceOptions;
pub use state::StateId;
pub use warnings::{Refusal, Warnings};

/// A step that is still pending after this time counts as hanging, unless another limit is set.
const PENDING_LIMIT: Duration = Duration::from_secs(600);

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
    /// messages that came with a refusal or were sent to an instance that this one replaces
    earlier: Vec<Message>,
    running: bool,
    steps: u64,
    time: Option<f64>,
    pending_limit: Duration,
    /// where the state is saved before every step
    saved_before: Option<StateId>,
}

// SAFETY: one thread at a time uses what an instance owns, since every method that calls the FMU takes
// an exclusive reference, and FMI 2.0 allows calls from any thread; what it shares with other
// instances (package, sink, fatal mark) is shared by Arc and synchronised
unsafe impl Send for Instance {}
/// Several threads may use what instances share.
const _: fn(&Package) -> &(dyn std::any::Any + Send + Sync) = |package| package;

impl Instance {
    /// The name that was passed to `fmi2Instantiate`.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The FMU that it is an instance of.
    #[must_use]
    pub fn package(&self) -> &Package {
        &self.package
    }

    /// Whether it runs in a process of its own.
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

    /// Takes messages that came with a refusal or were sent to an instance that this one replaces.
    pub fn take_earlier_messages(&mut self) -> Vec<Message> {
        std::mem::take(&mut self.earlier)
    }

    /// Adds messages that came with a refusal or were sent to an instance that this one replaces.
    pub fn inherit(&mut self, messages: Vec<Message>) {
        self.earlier.extend(messages);
        logger::note_arrival();
    }

    /// Sets how long a step may be pending before it counts as hanging.
    pub fn set_pending_limit(&mut self, limit: Duration) {
        self.pending_limit = limit;
    }

    /// Sets start and stop time, and the relative tolerance for the FMU's own integration if there is
    /// one. An infinite stop time is none.
    ///
    /// # Errors
    /// The call fails.
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
    /// The call fails.
    pub fn enter_initialization_mode(&mut self) -> Result<(), FmuError> {
        self.order(&Request::EnterInitializationMode)
    }

    /// Ends initialization: the FMU is ready to step.
    ///
    /// # Errors
    /// The call fails.
    pub fn exit_initialization_mode(&mut self) -> Result<(), FmuError> {
        self.order(&Request::ExitInitializationMode)?;
        self.running = true;
        Ok(())
    }

    /// Ends the run.
    ///
    /// # Errors
    /// The call fails.
    pub fn terminate(&mut self) -> Result<(), FmuError> {
        if !std::mem::take(&mut self.running) {
            return Ok(());
        }
        self.order(&Request::Terminate)
    }

    /// Returns to the state after instantiation.
    ///
    /// # Errors
    /// The call fails.
    pub fn reset(&mut self) -> Result<(), FmuError> {
        self.running = false;
        self.order(&Request::Reset)
    }

    /// Returns to the state after instantiation, for another run: also saved states, counts, messages and what the FMU
    /// was found to refuse are forgotten.
    ///
    /// # Errors
    /// The call of `fmi2Reset` fails. The instance is of no use then.
    pub fn renew(&mut self) -> Result<(), FmuError> {
        if let Some(state) = self.saved_before.take() {
            self.free_state(state)?;
        }
        self.reset()?;
        self.take_messages();
        self.earlier.clear();
        self.warnings = Warnings::default();
        self.offers = offers::Offers::of(self.package.description());
        (self.steps, self.time, self.pending_limit) = (0, None, PENDING_LIMIT);
        self.place.set_time(f64::NAN);
        Ok(())
    }

    /// Requests a report, an extension of the standard (`fmi2_export_report`).
    ///
    /// # Errors
    /// The FMU gives no reports, not this one, or not now.
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

    /// Calls that have returned `fmi2Warning` so far.
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

    /// Checks that the FMU may be called, and notes that it will be.
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

    /// A request that returns only a status.
    fn order(&mut self, request: &Request) -> Result<(), FmuError> {
        self.ask(request, &[]).map(|_| ())
    }

    /// Makes a request. `references` are its variables, for messages.
    fn ask(&mut self, request: &Request, references: &[u32]) -> Result<Data, FmuError> {
        self.alive()?;
        let reply = self.perform(request);
        self.check(reply.answer, references)?;
        Ok(reply.data)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // the backend frees the instance next
        self.place.enter();
    }
}
