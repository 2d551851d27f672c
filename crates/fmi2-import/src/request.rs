//! Calls outside of the step exchange, in a form that can be sent to another process.

use std::ffi::CString;

use serde::{Deserialize, Serialize};

use crate::answer::Answer;
use crate::per_type::CType;
use crate::trace::Traced;

/// Arguments of `fmi2Instantiate` and what else an instance is created with.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Identity {
    pub(crate) name: CString,
    pub(crate) guid: CString,
    pub(crate) resources: CString,
    pub(crate) logging: bool,
    pub(crate) trace: Option<Traced>,
}

/// Values of one type.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) enum Values {
    Real(Vec<f64>),
    Integer(Vec<i32>),
    Boolean(Vec<i32>),
    String(Vec<CString>),
}

/// A call that is not made in every step.
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
    Get(CType, Vec<u32>),
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
    /// into this slot, or a new one
    SaveState(Option<usize>),
    RestoreState(usize),
    FreeState(usize),
    SerializeState(usize),
    DeserializeState(Vec<u8>),
    Report(String),
}

/// What a request returns besides its status.
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
    /// The bytes of a saved state cannot be allocated.
    TooLarge(usize),
    /// A report; `None` if the FMU does not give this one.
    Report(Option<String>),
}

impl Data {
    /// Copies the Reals; does nothing if these are other data.
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
