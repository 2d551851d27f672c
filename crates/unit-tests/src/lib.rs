//! Loads a unit's library and calls it only through its C functions.
//!
//! Separate from the other system tests, so that it has few dependencies and can be built with
//! sanitizers.
//!
//! The libraries are those of the build that this program belongs to (`target/release/libfmu_*.so`
//! for a release test), so a build with other flags or another target folder tests its own
//! libraries.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use fmi2_sys::*;
use libloading::Library;

macro_rules! functions {
    ($($field:ident: $symbol:ident as $type:ident,)*) => {
        /// The functions of a unit.
        pub struct Functions {
            $(
                #[doc = concat!("`", stringify!($symbol), "`")]
                pub $field: $type,
            )*
        }

        impl Functions {
            fn find(library: &Library) -> Result<Self, libloading::Error> {
                Ok(Self {
                    // SAFETY: the kit defines the symbols with the standard's types.
                    $($field: *unsafe {
                        library.get::<$type>(concat!(stringify!($symbol), "\0").as_bytes())
                    }?,)*
                })
            }
        }
    };
}

functions! {
    set_debug_logging: fmi2SetDebugLogging as fmi2SetDebugLoggingTYPE,
    instantiate: fmi2Instantiate as fmi2InstantiateTYPE,
    free_instance: fmi2FreeInstance as fmi2FreeInstanceTYPE,
    setup_experiment: fmi2SetupExperiment as fmi2SetupExperimentTYPE,
    enter_initialization_mode: fmi2EnterInitializationMode as fmi2EnterInitializationModeTYPE,
    exit_initialization_mode: fmi2ExitInitializationMode as fmi2ExitInitializationModeTYPE,
    terminate: fmi2Terminate as fmi2TerminateTYPE,
    reset: fmi2Reset as fmi2ResetTYPE,
    get_real: fmi2GetReal as fmi2GetRealTYPE,
    get_integer: fmi2GetInteger as fmi2GetIntegerTYPE,
    get_boolean: fmi2GetBoolean as fmi2GetBooleanTYPE,
    get_string: fmi2GetString as fmi2GetStringTYPE,
    set_real: fmi2SetReal as fmi2SetRealTYPE,
    set_integer: fmi2SetInteger as fmi2SetIntegerTYPE,
    set_boolean: fmi2SetBoolean as fmi2SetBooleanTYPE,
    set_string: fmi2SetString as fmi2SetStringTYPE,
    get_fmu_state: fmi2GetFMUstate as fmi2GetFMUstateTYPE,
    set_fmu_state: fmi2SetFMUstate as fmi2SetFMUstateTYPE,
    free_fmu_state: fmi2FreeFMUstate as fmi2FreeFMUstateTYPE,
    serialized_fmu_state_size: fmi2SerializedFMUstateSize as fmi2SerializedFMUstateSizeTYPE,
    serialize_fmu_state: fmi2SerializeFMUstate as fmi2SerializeFMUstateTYPE,
    deserialize_fmu_state: fmi2DeSerializeFMUstate as fmi2DeSerializeFMUstateTYPE,
    get_directional_derivative: fmi2GetDirectionalDerivative as fmi2GetDirectionalDerivativeTYPE,
    set_real_input_derivatives: fmi2SetRealInputDerivatives as fmi2SetRealInputDerivativesTYPE,
    get_real_output_derivatives: fmi2GetRealOutputDerivatives as fmi2GetRealOutputDerivativesTYPE,
    do_step: fmi2DoStep as fmi2DoStepTYPE,
    cancel_step: fmi2CancelStep as fmi2CancelStepTYPE,
    get_real_status: fmi2GetRealStatus as fmi2GetRealStatusTYPE,
    get_integer_status: fmi2GetIntegerStatus as fmi2GetIntegerStatusTYPE,
    get_boolean_status: fmi2GetBooleanStatus as fmi2GetBooleanStatusTYPE,
    get_string_status: fmi2GetStringStatus as fmi2GetStringStatusTYPE,
}

/// A real variable.
#[derive(Debug, Clone)]
pub struct RealVariable {
    /// Name, as in the description.
    pub name: String,
    /// FMI value reference.
    pub reference: u32,
    /// Causality, as in the description.
    pub causality: String,
    /// Start value, 0 if there is none.
    pub start: f64,
}

/// A loaded unit with its description.
pub struct Loaded {
    /// All functions of the unit.
    pub functions: Functions,
    /// All real variables of the unit.
    pub reals: Vec<RealVariable>,
    guid: CString,
    resources: CString,
    /// Keeps the library loaded while the functions are in use.
    _library: Library,
}

/// The error and its causes, separated by colons.
fn text(error: impl std::error::Error) -> String {
    let causes = std::iter::successors(error.source(), |cause| cause.source());
    causes.fold(error.to_string(), |text, cause| format!("{text}: {cause}"))
}

/// The workspace's root folder.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

/// `target/<profile>/` beside `target/<profile>/deps/`, where this program is.
fn built(name: &str) -> Result<PathBuf, String> {
    use std::env::consts::{DLL_PREFIX, DLL_SUFFIX};
    let program = std::env::current_exe().map_err(text)?;
    let folder = program.ancestors().nth(2).unwrap_or(Path::new("."));
    let path = folder.join(format!("{DLL_PREFIX}fmu_{name}{DLL_SUFFIX}"));
    let missing =
        || format!("{} is missing: run `cargo build --release -p fmu-{name}`", path.display());
    path.is_file().then_some(()).ok_or_else(missing)?;
    Ok(path)
}

fn real(node: roxmltree::Node) -> Option<RealVariable> {
    let kind = node.children().find(|child| child.has_tag_name("Real"))?;
    Some(RealVariable {
        name: node.attribute("name")?.to_owned(),
        reference: node.attribute("valueReference")?.parse().ok()?,
        causality: node.attribute("causality").unwrap_or("local").to_owned(),
        start: kind.attribute("start").and_then(|start| start.parse().ok()).unwrap_or(0.0),
    })
}

impl Loaded {
    /// The unit `ems`, or `guideway` or `vehicle` with one of their layouts.
    ///
    /// # Errors
    /// It is not built, cannot be loaded, or its description cannot be read.
    pub fn new(name: &str, layout: Option<&str>) -> Result<Self, String> {
        let path = built(name)?;
        let resources = layout.map(|l| root().join(format!("fmu-{name}/resources")).join(l));
        let xml = fmi2_package::describe(&path, resources.as_deref()).map_err(text)?;
        let document = roxmltree::Document::parse(&xml).map_err(text)?;
        let guid = document.root_element().attribute("guid").unwrap_or_default();
        let variables = document.descendants().filter(|node| node.has_tag_name("ScalarVariable"));
        // SAFETY: our own library, without initialisers.
        let library = unsafe { Library::new(&path) }.map_err(text)?;
        let resources = resources.unwrap_or_default().display().to_string();
        Ok(Self {
            functions: Functions::find(&library).map_err(text)?,
            reals: variables.filter_map(real).collect(),
            guid: CString::new(guid).map_err(text)?,
            resources: CString::new(format!("file://{resources}")).map_err(text)?,
            _library: library,
        })
    }

    /// Value reference and start value of the real variables of a causality.
    #[must_use]
    pub fn reals(&self, causality: &str) -> Vec<(u32, f64)> {
        let chosen = self.reals.iter().filter(|real| real.causality == causality);
        chosen.map(|real| (real.reference, real.start)).collect()
    }

    /// A new instance with a logger that reads every message; `None` if the instantiation fails.
    #[must_use]
    pub fn instantiate(&self, messages: &AtomicU64) -> Option<fmi2Component> {
        let callbacks = callbacks(messages);
        let kind = fmi2Type::fmi2CoSimulation;
        let (guid, resources) = (self.guid.as_ptr(), self.resources.as_ptr());
        // SAFETY: the function's own type; all pointers live through the call. The standard does
        // not require the callbacks to live longer.
        let component = unsafe {
            self.functions.instantiate?(
                c"one".as_ptr(),
                kind,
                guid,
                resources,
                &raw const callbacks,
                0,
                1,
            )
        };
        (!component.is_null()).then_some(component)
    }
}

fn callbacks(messages: &AtomicU64) -> fmi2CallbackFunctions {
    type Fixed = unsafe extern "C" fn(
        fmi2ComponentEnvironment,
        fmi2String,
        fmi2Status,
        fmi2String,
        fmi2String,
    );
    // SAFETY: stable Rust cannot define a variadic function; where FMI units run, the named
    // arguments of one are passed like those of any other function, and our units pass no others.
    let logger = unsafe { std::mem::transmute::<Option<Fixed>, fmi2CallbackLogger>(Some(count)) };
    fmi2CallbackFunctions {
        logger,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: std::ptr::from_ref(messages).cast_mut().cast(),
    }
}

/// Adds the lengths of the strings, so that every byte is read.
unsafe extern "C" fn count(
    environment: fmi2ComponentEnvironment,
    instance: fmi2String,
    _: fmi2Status,
    category: fmi2String,
    message: fmi2String,
) {
    // SAFETY: by the standard these are C strings; the kit never passes null for them.
    let length = [instance, category, message]
        .map(|text| unsafe { core::ffi::CStr::from_ptr(text) }.to_bytes().len() as u64);
    // SAFETY: the environment is the counter that lives as long as the instance.
    let messages = unsafe { &*environment.cast::<AtomicU64>() };
    messages.fetch_add(length.iter().sum(), Ordering::Relaxed);
}
