//! Requests: the calls outside of the step exchange.

use std::ffi::CString;

use fmi2_sys as sys;
use sys::fmi2Status as Status;

use super::Component;
use crate::answer::{Answer, Outcome};
use crate::functions::Call;
use crate::request::{Data, Reply, Request, Values};

impl Component {
    /// Answers a request.
    pub(crate) fn perform(&mut self, request: &Request) -> Reply {
        let answer = match request {
            &Request::SetupExperiment { tolerance, start, stop } => {
                let (defined, value) = (i32::from(tolerance.is_some()), tolerance.unwrap_or(0.0));
                let ends = i32::from(stop.is_finite());
                let stop = if stop.is_finite() { stop } else { start };
                request!(
                    self,
                    setup_experiment,
                    fmi2SetupExperiment,
                    ["tolerance {tolerance:?}, start {start:?}, stop {stop:?}"],
                    defined,
                    value,
                    start,
                    ends,
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

    /// Turns on debug messages of these categories.
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

    /// Requests that return data.
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

    /// Requests a report, an extension of the standard (`fmi2_export_report`).
    fn report(&mut self, request: &str) -> Option<String> {
        let function = self.functions.report?;
        let text = CString::new(request).ok()?;
        // large enough for most reports, so that they are written once
        let mut buffer = vec![0_u8; 1 << 20];
        loop {
            let (start, room) = (buffer.as_mut_ptr().cast(), buffer.len());
            // SAFETY: the component belongs to this library; request and buffer outlive the call
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
