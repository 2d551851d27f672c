//! An instance with direct access to its C functions. Every call is traced and returns its status; no call is
//! prevented.

use std::cell::Cell;
use std::ffi::{CStr, CString, c_char, c_void};
use std::ptr::{null, null_mut};

use fmi2_sys as sys;
use sys::fmi2Status as Status;

use super::bench::Bench;
use super::log::{InstanceLog, LogMessage};
use super::{Stop, fault};

/// Status of a call to a function that the binary does not have; no FMU returns it.
pub(crate) const LACKING: Status = Status(0xFFFF);

/// Arguments of `fmi2Instantiate`.
#[derive(Clone)]
pub(crate) struct Making {
    pub(crate) name: Option<CString>,
    pub(crate) guid: Option<CString>,
    pub(crate) location: Option<CString>,
    pub(crate) kind: sys::fmi2Type,
    pub(crate) logging: bool,
}

/// A saved state.
pub(crate) type SavedState = sys::fmi2FMUstate;

/// An instance. Freed when dropped.
pub(crate) struct Raw<'b> {
    bench: &'b Bench,
    label: String,
    component: *mut c_void,
    log: Box<InstanceLog>,
    // the FMU keeps its address as long as the instance exists
    _callbacks: Box<sys::fmi2CallbackFunctions>,
    freed: Cell<bool>,
}

/// A traced call of the component; [`LACKING`] if the binary does not have the function.
macro_rules! call {
    ($self:ident, $field:ident($($argument:expr),*), $($text:tt)+) => {{
        let trace = $self.bench.trace();
        trace.call(&$self.label, format_args!($($text)+));
        let status = match $self.bench.functions().$field {
            // SAFETY: the component was made by this library. Arguments may be wrong on purpose; this process may crash
            Some(function) => unsafe { function($self.component, $($argument),*) },
            None => LACKING,
        };
        trace.answer(status);
        status
    }};
}

/// Functions with the component as their only argument.
macro_rules! plain {
    ($($method:ident $field:ident $name:literal;)*) => {
        $(pub(crate) fn $method(&self) -> Status { call!(self, $field(), $name) })*
    };
}

/// Get and set functions of a type.
macro_rules! values {
    ($($get:ident $set:ident $get_field:ident $set_field:ident $type:ty, $get_name:literal $set_name:literal;)*) => {
        $(
            pub(crate) fn $get(&self, references: &[u32], values: &mut [$type]) -> Status {
                let (r, n) = (references.as_ptr(), references.len().min(values.len()));
                let v = values.as_mut_ptr();
                call!(self, $get_field(r, n, v), concat!($get_name, "({})"), few(references))
            }
            pub(crate) fn $set(&self, references: &[u32], values: &[$type]) -> Status {
                let (r, n) = (references.as_ptr(), references.len().min(values.len()));
                let v = values.as_ptr();
                call!(
                    self, $set_field(r, n, v), concat!($set_name, "({}, {})"),
                    few(references), few(values)
                )
            }
        )*
    };
}

/// The first few items, for the trace.
fn few<T: std::fmt::Debug>(items: &[T]) -> String {
    match items {
        [a, b, c, _, ..] => format!("[{a:?}, {b:?}, {c:?}, … {} in total]", items.len()),
        _ => format!("{items:?}"),
    }
}

fn pointer(text: Option<&CString>) -> *const c_char {
    text.map_or(null(), |text| text.as_ptr())
}

impl<'b> Raw<'b> {
    /// Calls fmi2Instantiate. `Err` has the messages logged if it returns null.
    pub(crate) fn make(bench: &'b Bench, making: &Making) -> Result<Self, Vec<LogMessage>> {
        let log = InstanceLog::new();
        let callbacks = Box::new(log.callbacks());
        let label = making.name.as_deref().unwrap_or_default().to_string_lossy().into_owned();
        bench.trace().call(
            &label,
            format_args!(
                "fmi2Instantiate({:?}, {}, {:?}, {:?}, logging {})",
                making.name, making.kind.0, making.guid, making.location, making.logging
            ),
        );
        let component = match bench.functions().instantiate {
            // SAFETY: C strings or null, and callbacks that outlive the instance
            Some(function) => unsafe {
                function(
                    pointer(making.name.as_ref()),
                    making.kind,
                    pointer(making.guid.as_ref()),
                    pointer(making.location.as_ref()),
                    &raw const *callbacks,
                    0,
                    making.logging.into(),
                )
            },
            None => null_mut(),
        };
        if component.is_null() {
            return Err(log.take());
        }
        let freed = Cell::new(false);
        Ok(Self { bench, label, component, log, _callbacks: callbacks, freed })
    }

    /// The messages since the last call.
    pub(crate) fn logged(&self) -> Vec<LogMessage> {
        self.log.take()
    }

    pub(crate) fn component(&self) -> *mut c_void {
        self.component
    }

    pub(crate) fn bench(&self) -> &'b Bench {
        self.bench
    }

    plain! {
        enter_initialization enter_initialization_mode "fmi2EnterInitializationMode";
        exit_initialization exit_initialization_mode "fmi2ExitInitializationMode";
        terminate terminate "fmi2Terminate";
        reset reset "fmi2Reset";
        cancel_step cancel_step "fmi2CancelStep";
    }

    values! {
        get_real set_real get_real set_real f64, "fmi2GetReal" "fmi2SetReal";
        get_integer set_integer get_integer set_integer i32, "fmi2GetInteger" "fmi2SetInteger";
        get_boolean set_boolean get_boolean set_boolean i32, "fmi2GetBoolean" "fmi2SetBoolean";
    }

    pub(crate) fn setup(&self, start: f64, stop: Option<f64>) -> Status {
        let (defined, end) = (stop.is_some().into(), stop.unwrap_or(0.0));
        call!(
            self,
            setup_experiment(0, 0.0, start, defined, end),
            "fmi2SetupExperiment(start {start}, stop {stop:?})"
        )
    }

    pub(crate) fn debug_logging(&self, on: bool, categories: &[CString]) -> Status {
        let pointers: Vec<_> = categories.iter().map(|text| text.as_ptr()).collect();
        let start = if pointers.is_empty() { null() } else { pointers.as_ptr() };
        call!(
            self,
            set_debug_logging(on.into(), pointers.len(), start),
            "fmi2SetDebugLogging({on}, {categories:?})"
        )
    }

    /// Reads Strings; `None` for a null pointer.
    pub(crate) fn get_string(&self, references: &[u32]) -> (Status, Vec<Option<Vec<u8>>>) {
        let mut pointers: Vec<sys::fmi2String> = vec![null(); references.len()];
        let (r, n, v) = (references.as_ptr(), references.len(), pointers.as_mut_ptr());
        let status = call!(self, get_string(r, n, v), "fmi2GetString({})", few(references));
        if !passed(status) {
            return (status, Vec::new());
        }
        let copy = |&pointer: &sys::fmi2String| {
            // SAFETY: not null; the FMU keeps its strings until the next call
            (!pointer.is_null()).then(|| unsafe { CStr::from_ptr(pointer) }.to_bytes().to_vec())
        };
        (status, pointers.iter().map(copy).collect())
    }

    pub(crate) fn set_string(&self, references: &[u32], values: &[CString]) -> Status {
        let pointers: Vec<_> = values.iter().map(|text| text.as_ptr()).collect();
        let (r, n) = (references.as_ptr(), references.len().min(pointers.len()));
        let v = pointers.as_ptr();
        call!(self, set_string(r, n, v), "fmi2SetString({}, {values:?})", few(references))
    }

    pub(crate) fn do_step(&self, time: f64, size: f64) -> Status {
        call!(self, do_step(time, size, 0), "fmi2DoStep({time}, {size})")
    }

    /// Saves the state, into the memory of an older one if `saved` is not null.
    pub(crate) fn get_state(&self, saved: &mut SavedState) -> Status {
        call!(self, get_fmu_state(&raw mut *saved), "fmi2GetFMUstate")
    }

    pub(crate) fn set_state(&self, saved: SavedState) -> Status {
        call!(self, set_fmu_state(saved), "fmi2SetFMUstate")
    }

    pub(crate) fn free_state(&self, saved: &mut SavedState) -> Status {
        call!(self, free_fmu_state(&raw mut *saved), "fmi2FreeFMUstate")
    }

    pub(crate) fn state_size(&self, saved: SavedState, size: &mut usize) -> Status {
        call!(self, serialized_fmu_state_size(saved, &raw mut *size), "fmi2SerializedFMUstateSize")
    }

    pub(crate) fn serialize(&self, saved: SavedState, bytes: &mut [u8]) -> Status {
        let (n, out) = (bytes.len(), bytes.as_mut_ptr().cast());
        call!(self, serialize_fmu_state(saved, out, n), "fmi2SerializeFMUstate({n} bytes)")
    }

    pub(crate) fn deserialize(&self, bytes: &[u8], saved: &mut SavedState) -> Status {
        let (n, from) = (bytes.len(), bytes.as_ptr().cast());
        call!(
            self,
            deserialize_fmu_state(from, n, &raw mut *saved),
            "fmi2DeSerializeFMUstate({n} bytes)"
        )
    }

    pub(crate) fn directional(&self, unknowns: &[u32], known: u32, out: &mut [f64]) -> Status {
        let (z, n, one) = (unknowns.as_ptr(), unknowns.len(), 1.0);
        call!(
            self,
            get_directional_derivative(z, n, &raw const known, 1, &raw const one, out.as_mut_ptr()),
            "fmi2GetDirectionalDerivative({}, [{known}], [1])",
            few(unknowns)
        )
    }

    pub(crate) fn set_input_derivatives(
        &self,
        r: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Status {
        let n = r.len().min(orders.len()).min(values.len());
        call!(
            self,
            set_real_input_derivatives(r.as_ptr(), n, orders.as_ptr(), values.as_ptr()),
            "fmi2SetRealInputDerivatives({}, {}, {})",
            few(r),
            few(orders),
            few(values)
        )
    }

    pub(crate) fn get_output_derivatives(
        &self,
        r: &[u32],
        orders: &[i32],
        out: &mut [f64],
    ) -> Status {
        let n = r.len().min(orders.len()).min(out.len());
        call!(
            self,
            get_real_output_derivatives(r.as_ptr(), n, orders.as_ptr(), out.as_mut_ptr()),
            "fmi2GetRealOutputDerivatives({}, {})",
            few(r),
            few(orders)
        )
    }

    pub(crate) fn status(&self, kind: u32, out: &mut u32) -> Status {
        let mut value = Status::fmi2OK;
        let kind = sys::fmi2StatusKind(kind);
        let status = call!(self, get_status(kind, &raw mut value), "fmi2GetStatus({})", kind.0);
        *out = value.0;
        status
    }

    pub(crate) fn real_status(&self, kind: u32, out: &mut f64) -> Status {
        let kind = sys::fmi2StatusKind(kind);
        call!(self, get_real_status(kind, &raw mut *out), "fmi2GetRealStatus({})", kind.0)
    }

    pub(crate) fn integer_status(&self, kind: u32) -> Status {
        let (kind, mut out) = (sys::fmi2StatusKind(kind), 0);
        call!(self, get_integer_status(kind, &raw mut out), "fmi2GetIntegerStatus({})", kind.0)
    }

    pub(crate) fn boolean_status(&self, kind: u32, out: &mut i32) -> Status {
        let kind = sys::fmi2StatusKind(kind);
        call!(self, get_boolean_status(kind, &raw mut *out), "fmi2GetBooleanStatus({})", kind.0)
    }

    /// Whether the FMU requests the end of the simulation after it discarded a step.
    pub(crate) fn wants_end(&self) -> bool {
        let mut terminated = 0;
        let kind = sys::fmi2StatusKind::fmi2Terminated.0;
        self.boolean_status(kind, &mut terminated) == Status::fmi2OK && terminated != 0
    }

    pub(crate) fn string_status(&self, kind: u32) -> Status {
        let (kind, mut out) = (sys::fmi2StatusKind(kind), null());
        call!(self, get_string_status(kind, &raw mut out), "fmi2GetStringStatus({})", kind.0)
    }

    /// Frees the instance before it is dropped.
    pub(crate) fn free(&self) {
        if self.freed.replace(true) {
            return;
        }
        self.bench.trace().call(&self.label, format_args!("fmi2FreeInstance"));
        if let Some(function) = self.bench.functions().free_instance {
            // SAFETY: alive, and not used after this
            unsafe { function(self.component) };
        }
    }
}

impl Drop for Raw<'_> {
    fn drop(&mut self) {
        self.free();
    }
}

/// Whether a call succeeded, perhaps with a warning.
pub(crate) fn passed(status: Status) -> bool {
    status == Status::fmi2OK || status == Status::fmi2Warning
}

/// Ends the check with a finding if a call failed.
pub(crate) fn ok(status: Status, what: &str) -> Result<(), Stop> {
    if passed(status) { Ok(()) } else { fault(format!("{what} returned {}", name(status))) }
}

/// The name of a status.
pub(crate) fn name(status: Status) -> String {
    if status == LACKING {
        "nothing, because the binary does not have the function".to_owned()
    } else {
        status.to_string()
    }
}

/// Whether a status refuses the call without ending all instances, as a wrong call must.
pub(crate) fn refused(status: Status) -> bool {
    status == Status::fmi2Error || status == Status::fmi2Discard
}
