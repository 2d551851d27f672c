//! The course of a run, shared by the thread that steps and the one that gives up a hanging step.
//!
//! It is locked between steps and free during them. So a thread that finds a step hanging can complete
//! the results in place of the thread that hangs in it.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::course::Course;
use crate::error::Error;
use fmi2_import::witness;
use master::Simulation;
use results::summary::{Status, Summary};

/// Why the stepping thread ends early.
pub(super) enum Halt {
    Error(Box<Error>),
    /// The results are complete: another thread has given up this one.
    GivenUp,
}

impl From<Error> for Halt {
    fn from(error: Error) -> Self {
        Self::Error(Box::new(error))
    }
}

impl From<master::Error> for Halt {
    fn from(error: master::Error) -> Self {
        Self::Error(Box::new(error.into()))
    }
}

/// The course of one run behind a lock.
pub(super) struct Shared<'a>(Mutex<State<'a>>);

enum State<'a> {
    Open(Box<Course<'a>>),
    /// with the outcome, until the stepping thread takes it
    Complete(Option<Box<Result<Summary, Error>>>),
}

impl<'a> Shared<'a> {
    pub(super) fn new(course: Course<'a>) -> Self {
        Self(Mutex::new(State::Open(Box::new(course))))
    }

    fn lock(&self) -> MutexGuard<'_, State<'a>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Works on the course. Must not call units, which may never return.
    #[inline]
    pub(super) fn with<T>(
        &self,
        work: impl FnOnce(&mut Course<'a>) -> Result<T, Error>,
    ) -> Result<T, Halt> {
        match &mut *self.lock() {
            State::Open(course) => work(course).map_err(|error| Halt::Error(Box::new(error))),
            State::Complete(_) => Err(Halt::GivenUp),
        }
    }

    /// Completes the results, at the end of stepping, and then terminates the units.
    pub(super) fn complete(
        &self,
        result: Result<Status, Halt>,
        mut simulation: Option<&mut Simulation<'_>>,
    ) -> Result<Summary, Error> {
        let mut state = self.lock();
        let units = simulation.as_deref_mut();
        let end = match (std::mem::replace(&mut *state, State::Complete(None)), result) {
            (State::Open(course), Ok(status)) => course.finish(Ok(status), units),
            (State::Open(course), Err(Halt::Error(error))) => course.finish(Err(*error), units),
            (State::Complete(Some(outcome)), _) => return *outcome,
            (_, _) => return Err(Error::GivenUp),
        };
        // units may hang from here on; the results are complete
        drop(state);
        end.close(simulation)
    }

    /// Completes the results up to the last finished step, in place of a thread that hangs.
    pub(super) fn rescue(&self) {
        let mut state = self.lock();
        *state = match std::mem::replace(&mut *state, State::Complete(None)) {
            State::Open(mut course) => {
                if let Some(text) = witness::whereabouts() {
                    course.interrupted_in(&text);
                }
                State::Complete(Some(Box::new(
                    course.finish(Ok(Status::Interrupted), None).close(None),
                )))
            }
            complete @ State::Complete(_) => complete,
        };
    }
}
