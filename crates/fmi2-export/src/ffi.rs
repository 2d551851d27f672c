//! The 34 C functions of an FMI 2.0 co-simulation unit, as [`export!`](crate::export) wires them.
//!
//! Every function of an instance passes through one guard (`guard.rs`): it checks for null and for
//! the allowed mode, catches panics, logs the reason and maps the status.
//!
//! # Safety
//! All functions require what the FMI standard requires of an importer: a component comes from
//! [`instantiate`] and was not freed, no two calls on one instance run at a time, arrays have the
//! length stated, strings end with NUL, and a saved state comes from the same library.

#![allow(clippy::missing_safety_doc, reason = "stated once for the module")]

use core::ffi::{CStr, c_char};
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};

use fmi2_sys::*;

use crate::erased::ModelWithState;
use crate::guard::{ERROR, OK, enter, null, slice, slice_out, string, text};
use crate::instance::{ExportedInstance, unknown};
use crate::logger::{Category, Logger};
use crate::panics::{dropped, panic_text};
use crate::per_type::VariableType;
use crate::snapshot::Snapshot;
use crate::state::{self, FmiCall};
use crate::values::CText;
use crate::{Error, Model, Resources, description, location, shared};

/// `fmi2GetTypesPlatform`: `default`.
pub extern "C" fn get_types_platform() -> *const c_char {
    fmi2TypesPlatform.as_ptr()
}

/// `fmi2GetVersion`: `2.0`.
pub extern "C" fn get_version() -> *const c_char {
    fmi2Version.as_ptr()
}

/// `fmi2Instantiate` for the model `M`. Null on failure, with the reason in the log.
pub unsafe extern "C" fn instantiate<M: Model>(
    name: fmi2String,
    kind: fmi2Type,
    guid: fmi2String,
    location: fmi2String,
    functions: *const fmi2CallbackFunctions,
    _visible: fmi2Boolean,
    logging_on: fmi2Boolean,
) -> fmi2Component {
    // SAFETY: null or a struct that is valid during this call.
    let Some(functions) = (unsafe { functions.as_ref() }) else {
        return std::ptr::null_mut();
    };
    let called = if name.is_null() {
        CString::default()
    } else {
        // SAFETY: not null; the importer guarantees the NUL at the end.
        unsafe { CStr::from_ptr(name) }.to_owned()
    };
    let logger = Logger::new(functions, called, logging_on != 0);
    // SAFETY: the caller guarantees it.
    let make = || unsafe { make::<M>(name, kind, guid, location, logger.clone()) };
    let message = match catch_unwind(AssertUnwindSafe(make)) {
        Ok(Ok(instance)) => return Box::into_raw(Box::new(instance)).cast(),
        Ok(Err(error)) => error.to_string(),
        Err(panic) => format!("the model panicked: {}", panic_text(panic)),
    };
    logger.send(ERROR, Category::Error, &format!("fmi2Instantiate: {message}"));
    std::ptr::null_mut()
}

unsafe fn make<M: Model>(
    name: fmi2String,
    kind: fmi2Type,
    guid: fmi2String,
    location: fmi2String,
    logger: Logger,
) -> Result<ExportedInstance, Error> {
    // SAFETY: the caller guarantees it, also below.
    let name = unsafe { text(name, "the instance name") }?;
    if name.trim().is_empty() {
        return Err(Error::invalid("the instance name is empty"));
    }
    if kind != fmi2Type::fmi2CoSimulation {
        return Err(Error::invalid("the unit is for co-simulation only"));
    }
    // SAFETY: see above.
    let guid = unsafe { text(guid, "the GUID") }?;
    let location = if location.is_null() {
        None
    } else {
        // SAFETY: not null, see above.
        unsafe { CStr::from_ptr(location) }.to_str().ok()
    };
    let resources = Resources::new(location::resources(location)).of_instance(name);
    let (model, table) = shared::declare::<M>(&resources)?;
    let own = description::braced(&table.guid);
    if guid != own {
        return Err(Error::invalid(format!(
            "the GUID {guid} of the description is not the unit's {own}: modelDescription.xml, \
             the library or a file in resources was changed; package the unit again"
        )));
    }
    let model_with_state = Box::new(ModelWithState::<M> { model, state: None });
    Ok(ExportedInstance::new(model_with_state, table, resources, logger))
}

/// `fmi2FreeInstance`; null is ignored.
pub unsafe extern "C" fn free_instance(component: fmi2Component) {
    if component.is_null() {
        return;
    }
    // SAFETY: comes from `instantiate` and is freed once.
    let instance = unsafe { Box::from_raw(component.cast::<ExportedInstance>()) };
    dropped(instance);
}

/// `fmi2SetDebugLogging`; no categories means all.
pub unsafe extern "C" fn set_debug_logging(
    component: fmi2Component,
    on: fmi2Boolean,
    count: usize,
    categories: *const fmi2String,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees arrays and strings, also below.
        let categories = unsafe { slice(categories, count, "categories") }?;
        let mut logger = instance.logger.clone();
        logger.disable_all();
        for &category in categories {
            // SAFETY: see above.
            let name = unsafe { string(category, "a log category") }?;
            if !logger.enable(name) {
                let text = format!("there is no log category {name:?}; see modelDescription.xml");
                return Err(Error::invalid(text));
            }
        }
        match (on != 0, categories.is_empty()) {
            (false, _) => logger.disable_all(),
            (true, true) => logger.enable_all(),
            (true, false) => {}
        }
        instance.logger = logger;
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_DEBUG_LOGGING, body) }
}

/// `fmi2SetupExperiment`.
pub unsafe extern "C" fn setup_experiment(
    component: fmi2Component,
    tolerance_defined: fmi2Boolean,
    tolerance: fmi2Real,
    start: fmi2Real,
    stop_defined: fmi2Boolean,
    stop: fmi2Real,
) -> fmi2Status {
    let tolerance = (tolerance_defined != 0).then_some(tolerance);
    let stop = (stop_defined != 0).then_some(stop);
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SETUP_EXPERIMENT, |it| it.setup(tolerance, start, stop)) }
}

/// `fmi2EnterInitializationMode`.
pub unsafe extern "C" fn enter_initialization_mode(component: fmi2Component) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        instance.enter_initialization();
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::ENTER_INITIALIZATION, body) }
}

/// `fmi2ExitInitializationMode`.
pub unsafe extern "C" fn exit_initialization_mode(component: fmi2Component) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::EXIT_INITIALIZATION, ExportedInstance::exit_initialization) }
}

/// `fmi2Terminate`.
pub unsafe extern "C" fn terminate(component: fmi2Component) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        instance.terminate();
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::TERMINATE, body) }
}

/// `fmi2Reset`.
pub unsafe extern "C" fn reset(component: fmi2Component) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::RESET, ExportedInstance::reset) }
}

/// `fmi2GetReal`.
pub unsafe extern "C" fn get_real(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    out: *mut fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, out) =
            unsafe { (slice(references, count, "vr")?, slice_out(out, count, "value")?) };
        instance.get_reals(references, out)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_REAL, body) }
}

/// `fmi2GetInteger`.
pub unsafe extern "C" fn get_integer(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    out: *mut fmi2Integer,
) -> fmi2Status {
    // SAFETY: the importer guarantees all arguments.
    unsafe {
        get(
            component,
            &state::GET_INTEGER,
            VariableType::Integer,
            references,
            count,
            out,
            |instance, k| instance.values.arrays.integers.get(k).copied(),
        )
    }
}

/// `fmi2GetBoolean`.
pub unsafe extern "C" fn get_boolean(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    out: *mut fmi2Boolean,
) -> fmi2Status {
    // SAFETY: the importer guarantees all arguments.
    unsafe {
        get(
            component,
            &state::GET_BOOLEAN,
            VariableType::Boolean,
            references,
            count,
            out,
            |instance, k| {
                instance.values.arrays.booleans.get(k).map(|&value| fmi2Boolean::from(value))
            },
        )
    }
}

/// `fmi2GetString`; the strings live until the next call on the instance.
pub unsafe extern "C" fn get_string(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    out: *mut fmi2String,
) -> fmi2Status {
    // SAFETY: the importer guarantees all arguments.
    unsafe {
        get(
            component,
            &state::GET_STRING,
            VariableType::Text,
            references,
            count,
            out,
            |instance, k| instance.values.arrays.strings.get(k).map(CText::as_ptr),
        )
    }
}

unsafe fn get<T>(
    component: fmi2Component,
    call: &'static FmiCall,
    kind: VariableType,
    references: *const fmi2ValueReference,
    count: usize,
    out: *mut T,
    read: impl Fn(&ExportedInstance, usize) -> Option<T>,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, out) =
            unsafe { (slice(references, count, "vr")?, slice_out(out, count, "value")?) };
        instance.refresh_for(kind, references)?;
        for (&reference, out) in references.iter().zip(out) {
            let value = read(instance, reference as usize);
            out.write(value.ok_or_else(|| unknown(kind, reference))?);
        }
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, call, body) }
}

/// `fmi2SetReal`.
pub unsafe extern "C" fn set_real(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    new: *const fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, new) =
            unsafe { (slice(references, count, "vr")?, slice(new, count, "value")?) };
        instance.set_reals(references, new)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_REAL, body) }
}

/// `fmi2SetInteger`.
pub unsafe extern "C" fn set_integer(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    new: *const fmi2Integer,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, new) =
            unsafe { (slice(references, count, "vr")?, slice(new, count, "value")?) };
        instance.set_integers(references, new)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_INTEGER, body) }
}

/// `fmi2SetBoolean`.
pub unsafe extern "C" fn set_boolean(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    new: *const fmi2Boolean,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, new) =
            unsafe { (slice(references, count, "vr")?, slice(new, count, "value")?) };
        instance.set_booleans(references, new)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_BOOLEAN, body) }
}

/// `fmi2SetString`.
pub unsafe extern "C" fn set_string(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    new: *const fmi2String,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, new) =
            unsafe { (slice(references, count, "vr")?, slice(new, count, "value")?) };
        let copy = |&pointer: &fmi2String| {
            // SAFETY: the importer guarantees the strings.
            let text = unsafe { text(pointer, "a string value") }?;
            CText::new(text).ok_or_else(|| null("a string value"))
        };
        let copies = new.iter().map(copy).collect::<Result<Vec<_>, Error>>()?;
        instance.set_strings(references, copies)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_STRING, body) }
}

/// `fmi2GetFMUstate`: creates a saved state, or overwrites an older one in its memory.
pub unsafe extern "C" fn get_fmu_state(
    component: fmi2Component,
    saved: *mut fmi2FMUstate,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: null or a place for a pointer.
        let place = unsafe { saved.as_mut() }.ok_or_else(|| null("FMUstate"))?;
        // SAFETY: null or a saved state of this library that was not freed.
        match unsafe { place.cast::<Snapshot>().as_mut() } {
            Some(snapshot) => snapshot.retake(instance)?,
            None => *place = Box::into_raw(Box::new(Snapshot::take(instance)?)).cast(),
        }
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_STATE, body) }
}

/// `fmi2SetFMUstate`.
pub unsafe extern "C" fn set_fmu_state(
    component: fmi2Component,
    saved: fmi2FMUstate,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: null or a saved state of this library that was not freed.
        let snapshot = unsafe { saved.cast::<Snapshot>().as_ref() };
        snapshot.ok_or_else(|| null("FMUstate"))?.restore(instance)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_STATE, body) }
}

/// `fmi2FreeFMUstate`; null is ignored, and the pointer becomes null.
pub unsafe extern "C" fn free_fmu_state(
    component: fmi2Component,
    saved: *mut fmi2FMUstate,
) -> fmi2Status {
    let body = |_: &mut ExportedInstance| {
        // SAFETY: null or a place for a pointer.
        let Some(place) = (unsafe { saved.as_mut() }) else { return Ok(()) };
        let pointer = std::mem::replace(place, std::ptr::null_mut()).cast::<Snapshot>();
        if !pointer.is_null() {
            // SAFETY: made by `get_fmu_state` or `deserialize_fmu_state` and freed once.
            drop(unsafe { Box::from_raw(pointer) });
        }
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::FREE_STATE, body) }
}

/// `fmi2SerializedFMUstateSize`.
pub unsafe extern "C" fn serialized_fmu_state_size(
    component: fmi2Component,
    saved: fmi2FMUstate,
    size: *mut usize,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: null or a saved state of this library that was not freed.
        let snapshot = unsafe { saved.cast::<Snapshot>().as_mut() };
        let bytes = snapshot.ok_or_else(|| null("FMUstate"))?.serialize(instance)?;
        // SAFETY: null or a place for a number.
        *unsafe { size.as_mut() }.ok_or_else(|| null("size"))? = bytes.len();
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::STATE_SIZE, body) }
}

/// `fmi2SerializeFMUstate`; the array must have at least the size that `fmi2SerializedFMUstateSize`
/// returned.
pub unsafe extern "C" fn serialize_fmu_state(
    component: fmi2Component,
    saved: fmi2FMUstate,
    out: *mut fmi2Byte,
    size: usize,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: null or a saved state of this library that was not freed.
        let snapshot = unsafe { saved.cast::<Snapshot>().as_mut() };
        let bytes = snapshot.ok_or_else(|| null("FMUstate"))?.serialize(instance)?;
        if size < bytes.len() {
            let text = format!("the state has {} bytes, the array only {size}", bytes.len());
            return Err(Error::invalid(text));
        }
        // SAFETY: the importer guarantees the array.
        let out = unsafe { slice_out(out.cast::<u8>(), size, "serializedState") }?;
        for (out, &byte) in out.iter_mut().zip(bytes) {
            out.write(byte);
        }
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SERIALIZE, body) }
}

/// `fmi2DeSerializeFMUstate`.
pub unsafe extern "C" fn deserialize_fmu_state(
    component: fmi2Component,
    bytes: *const fmi2Byte,
    size: usize,
    saved: *mut fmi2FMUstate,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the array.
        let bytes = unsafe { slice(bytes.cast::<u8>(), size, "serializedState") }?;
        // SAFETY: null or a place for a pointer.
        let place = unsafe { saved.as_mut() }.ok_or_else(|| null("FMUstate"))?;
        let snapshot = Snapshot::deserialize(bytes, instance)?;
        // SAFETY: null or a saved state of this library that was not freed.
        match unsafe { place.cast::<Snapshot>().as_mut() } {
            Some(older) => *older = snapshot,
            None => *place = Box::into_raw(Box::new(snapshot)).cast(),
        }
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::DESERIALIZE, body) }
}

/// `fmi2GetDirectionalDerivative`.
pub unsafe extern "C" fn get_directional_derivative(
    component: fmi2Component,
    unknowns: *const fmi2ValueReference,
    unknown_count: usize,
    knowns: *const fmi2ValueReference,
    known_count: usize,
    direction: *const fmi2Real,
    out: *mut fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (unknowns, knowns, direction, out) = unsafe {
            (
                slice(unknowns, unknown_count, "vUnknown_ref")?,
                slice(knowns, known_count, "vKnown_ref")?,
                slice(direction, known_count, "dvKnown")?,
                slice_out(out, unknown_count, "dvUnknown")?,
            )
        };
        instance.directional_derivative(unknowns, knowns, direction, out)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::DIRECTIONAL, body) }
}

/// `fmi2SetRealInputDerivatives`.
pub unsafe extern "C" fn set_real_input_derivatives(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    orders: *const fmi2Integer,
    new: *const fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, orders, new) = unsafe {
            (
                slice(references, count, "vr")?,
                slice(orders, count, "order")?,
                slice(new, count, "value")?,
            )
        };
        instance.set_input_derivatives(references, orders, new)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::SET_INPUT_DERIVATIVES, body) }
}

/// `fmi2GetRealOutputDerivatives`.
pub unsafe extern "C" fn get_real_output_derivatives(
    component: fmi2Component,
    references: *const fmi2ValueReference,
    count: usize,
    orders: *const fmi2Integer,
    out: *mut fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees the arrays.
        let (references, orders, out) = unsafe {
            (
                slice(references, count, "vr")?,
                slice(orders, count, "order")?,
                slice_out(out, count, "value")?,
            )
        };
        instance.output_derivatives(references, orders, out)
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_OUTPUT_DERIVATIVES, body) }
}

/// `fmi2DoStep`.
pub unsafe extern "C" fn do_step(
    component: fmi2Component,
    time: fmi2Real,
    size: fmi2Real,
    _no_set_state_prior: fmi2Boolean,
) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::DO_STEP, |instance| instance.do_step(time, size)) }
}

/// `fmi2CancelStep`: steps are never pending, so there is nothing to cancel.
pub unsafe extern "C" fn cancel_step(component: fmi2Component) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::CANCEL_STEP, |_| Ok(())) }
}

/// Error for a status kind that only exists after `fmi2Pending`, which this kit never returns.
fn no_status() -> Error {
    Error::discard("there is no such status: steps are never pending")
}

/// `fmi2GetStatus`: nothing is ever pending.
pub unsafe extern "C" fn get_status(
    component: fmi2Component,
    _kind: fmi2StatusKind,
    _out: *mut fmi2Status,
) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_STATUS, |_| Err(no_status())) }
}

/// `fmi2GetRealStatus`: the last successful time.
pub unsafe extern "C" fn get_real_status(
    component: fmi2Component,
    kind: fmi2StatusKind,
    out: *mut fmi2Real,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        if kind != fmi2StatusKind::fmi2LastSuccessfulTime {
            return Err(no_status());
        }
        // SAFETY: null or a place for a number.
        *unsafe { out.as_mut() }.ok_or_else(|| null("value"))? = instance.progress.time;
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_REAL_STATUS, body) }
}

/// `fmi2GetIntegerStatus`: always discarded.
pub unsafe extern "C" fn get_integer_status(
    component: fmi2Component,
    _kind: fmi2StatusKind,
    _out: *mut fmi2Integer,
) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_INTEGER_STATUS, |_| Err(no_status())) }
}

/// `fmi2GetBooleanStatus`: whether the unit has ended the simulation ([`Error::terminated`]).
pub unsafe extern "C" fn get_boolean_status(
    component: fmi2Component,
    kind: fmi2StatusKind,
    out: *mut fmi2Boolean,
) -> fmi2Status {
    let body = |instance: &mut ExportedInstance| {
        if kind != fmi2StatusKind::fmi2Terminated {
            return Err(no_status());
        }
        // SAFETY: null or a place for a number.
        *unsafe { out.as_mut() }.ok_or_else(|| null("value"))? =
            fmi2Boolean::from(instance.progress.ended);
        Ok(())
    };
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_BOOLEAN_STATUS, body) }
}

/// `fmi2GetStringStatus`: always discarded.
pub unsafe extern "C" fn get_string_status(
    component: fmi2Component,
    _kind: fmi2StatusKind,
    _out: *mut fmi2String,
) -> fmi2Status {
    // SAFETY: the importer guarantees the component.
    unsafe { enter(component, &state::GET_STRING_STATUS, |_| Err(no_status())) }
}

/// Not part of the standard: writes `modelDescription.xml` of `M` with the resources in
/// `resource_dir` (a path in UTF-8, null for none) into `buffer` and returns its length in bytes.
/// At most `capacity` bytes are written, so a first call may determine the length. On failure it
/// returns 0 and writes the reason, terminated by NUL.
pub unsafe extern "C" fn describe<M: Model>(
    resource_dir: *const c_char,
    buffer: *mut c_char,
    capacity: usize,
) -> usize {
    let make = || {
        let folder = if resource_dir.is_null() {
            "resources"
        } else {
            // SAFETY: not null; the caller guarantees the NUL at the end.
            unsafe { text(resource_dir, "the resource folder") }?
        };
        crate::describe::<M>(&Resources::new(folder))
    };
    let (length, bytes) = match catch_unwind(AssertUnwindSafe(make)) {
        Ok(Ok(xml)) => (xml.len(), xml.into_bytes()),
        Ok(Err(error)) => (0, ended(error.to_string(), capacity)),
        Err(panic) => (0, ended(format!("the model panicked: {}", panic_text(panic)), capacity)),
    };
    // SAFETY: the caller guarantees the buffer.
    if let Ok(out) = unsafe { slice_out(buffer.cast::<u8>(), capacity, "buffer") } {
        for (out, byte) in out.iter_mut().zip(bytes) {
            out.write(byte);
        }
    }
    length
}

/// Not part of the standard: writes the model's answer to `request` (UTF-8) into `buffer` and
/// returns its length in bytes. At most `capacity` bytes are written. Returns 0 if there is no
/// answer, with the reason in the log.
pub unsafe extern "C" fn report(
    component: fmi2Component,
    request: fmi2String,
    buffer: *mut c_char,
    capacity: usize,
) -> usize {
    let mut length = 0;
    let body = |instance: &mut ExportedInstance| {
        // SAFETY: the importer guarantees strings and arrays, also below.
        let request = unsafe { text(request, "the request") }?;
        // SAFETY: see above.
        let out = unsafe { slice_out(buffer.cast::<u8>(), capacity, "buffer") }?;
        let answer = instance.report(request)?;
        for (out, byte) in out.iter_mut().zip(answer.bytes()) {
            out.write(byte);
        }
        length = answer.len();
        Ok(())
    };
    // SAFETY: the caller guarantees it.
    let status = unsafe { enter(component, &state::REPORT, body) };
    if status == OK { length } else { 0 }
}

/// A message truncated to the buffer, with its NUL.
fn ended(message: String, capacity: usize) -> Vec<u8> {
    let mut bytes = message.into_bytes();
    bytes.truncate(capacity.saturating_sub(1));
    bytes.push(0);
    bytes
}
