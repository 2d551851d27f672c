//! What follows from the answer to a call.

use std::sync::atomic::Ordering;

use fmi2_sys::fmi2Status as Status;

use super::{Backend, Instance};
use crate::answer::{Answer, Outcome};
use crate::fault::{FmuError, FmuFault, fail};
use crate::functions::Call;
use crate::per_type::CType;

impl Instance {
    /// An error that names the variable that is not finite.
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

    /// An error that names the value of an output that the connected Enumeration does not have.
    #[cold]
    pub fn no_item(&self, variable: usize, value: i32, target: &str, time: f64) -> FmuError {
        let variable = self.package.description().variables[variable].name.clone();
        let (instance, target) = (self.name.clone(), target.to_owned());
        FmuFault::NoItem { instance, variable, value, target, time }.into()
    }

    /// Turns an answer into a result. `references` are the variables of the call.
    #[inline]
    pub(super) fn check(&mut self, answer: Answer, references: &[u32]) -> Result<(), FmuError> {
        if answer.is_good() { Ok(()) } else { self.judge(answer, references) }
    }

    #[cold]
    pub(super) fn judge(&mut self, answer: Answer, references: &[u32]) -> Result<(), FmuError> {
        let call = answer.call;
        let instance = self.name.clone();
        let status = match answer.outcome {
            Outcome::Status(status) => Status(status),
            Outcome::Lacks => return fail(FmuFault::Lacks { instance, call }),
            Outcome::Lost => return fail(self.lost()),
        };
        match status {
            Status::fmi2OK => return Ok(()),
            _ if answer.refuses_derivatives() && self.warnings.may_refuse(self.steps) => {
                self.warnings.refuse(status);
                return Ok(());
            }
            Status::fmi2Warning => {
                self.warnings.note(call, self.time);
                return Ok(());
            }
            Status::fmi2Fatal => self.dead.store(true, Ordering::Relaxed),
            _ => {}
        }
        // after an error the standard allows to reset, to restore a state and to free, but not
        // fmi2Terminate
        let refused = status == Status::fmi2Discard
            && [
                Call::fmi2GetFMUstate,
                Call::fmi2SetRealInputDerivatives,
                Call::fmi2GetRealOutputDerivatives,
                Call::fmi2GetDirectionalDerivative,
            ]
            .contains(&call);
        if !refused {
            self.running = false;
        }
        fail(FmuFault::Status {
            instance,
            call,
            status,
            time: self.time,
            variables: self.names(call, references),
            messages: self.take_messages(),
        })
    }

    /// Why its process has ended.
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

    pub(super) fn zero_byte(&self, what: &str) -> FmuFault {
        FmuFault::ZeroByte { instance: self.name.clone(), what: what.to_owned() }
    }

    fn names(&self, call: Call, references: &[u32]) -> Vec<String> {
        if references.len() > 3 {
            return vec![format!("{} variables", references.len())];
        }
        let kind = match call {
            Call::fmi2GetInteger | Call::fmi2SetInteger => CType::Integer,
            Call::fmi2GetBoolean | Call::fmi2SetBoolean => CType::Boolean,
            Call::fmi2GetString | Call::fmi2SetString => CType::String,
            _ => CType::Real,
        };
        let name = |&reference| self.package.description().name_of(kind, reference);
        references.iter().filter_map(name).map(str::to_owned).collect()
    }
}
