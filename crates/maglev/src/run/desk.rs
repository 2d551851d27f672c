//! The run's books, shared by the thread that steps and the one that gives up a hanging step.
//!
//! They are locked between steps and open during them: who finds a step hanging can complete them in
//! the place of the thread that is in it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::course::Run;
use crate::error::Error;
use fmi2_import::witness;
use master::Simulation;
use results::summary::{Status, Summary};

/// Why the stepping thread ends early.
pub(super) enum Halt {
    Error(Error),
    /// The books are complete: another thread has given up this one.
    GivenUp,
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl From<master::Error> for Halt {
    fn from(error: master::Error) -> Self {
        Self::Error(error.into())
    }
}

/// The books of one run.
pub(super) struct Desk<'a>(Mutex<Books<'a>>);

enum Books<'a> {
    Open(Box<Run<'a>>),
    /// with the outcome, until the stepping thread takes it
    Complete(Option<Box<Result<Summary, Error>>>),
}

impl<'a> Desk<'a> {
    pub(super) fn new(run: Run<'a>) -> Self {
        Self(Mutex::new(Books::Open(Box::new(run))))
    }

    fn books(&self) -> MutexGuard<'_, Books<'a>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Works on the books; not for calls of units, which may not return.
    #[inline]
    pub(super) fn with<T>(
        &self,
        work: impl FnOnce(&mut Run<'a>) -> Result<T, Error>,
    ) -> Result<T, Halt> {
        match &mut *self.books() {
            Books::Open(run) => work(run).map_err(Halt::Error),
            Books::Complete(_) => Err(Halt::GivenUp),
        }
    }

    /// Completes the books, at the end of stepping, and then terminates the units.
    pub(super) fn complete(
        &self,
        result: Result<Status, Halt>,
        mut simulation: Option<&mut Simulation<'_>>,
    ) -> Result<Summary, Error> {
        let mut books = self.books();
        let units = simulation.as_deref_mut();
        let end = match (std::mem::replace(&mut *books, Books::Complete(None)), result) {
            (Books::Open(run), Ok(status)) => run.finish(Ok(status), units),
            (Books::Open(run), Err(Halt::Error(error))) => run.finish(Err(error), units),
            (Books::Complete(Some(outcome)), _) => return *outcome,
            (_, _) => return Err(Error::GivenUp),
        };
        // units may hang from here on; the books are complete
        drop(books);
        end.part(simulation)
    }

    /// Completes the books up to the last finished step, in the place of a thread that hangs.
    pub(super) fn rescue(&self) {
        let mut books = self.books();
        *books = match std::mem::replace(&mut *books, Books::Complete(None)) {
            Books::Open(mut run) => {
                if let Some(text) = witness::whereabouts() {
                    run.interrupted_in(&text);
                }
                Books::Complete(Some(Box::new(
                    run.finish(Ok(Status::Interrupted), None).part(None),
                )))
            }
            complete @ Books::Complete(_) => complete,
        };
    }
}
