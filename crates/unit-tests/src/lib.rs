//! A unit's library, driven by its C functions alone.
//!
//! Apart from the other system tests, so that it needs little and can be built with sanitizers.
//!
//! The libraries are those beside this program's folder (`target/release/libfmu_*.so` for a release
//! test), so a build with other flags or another target folder tests itself.

use std::ffi::CString;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use fmi2_package::Archive;
use fmi2_sys as sys;
use master::description::{Causality, Description, Type, Value};
use master::{library::Functions, package::Package};

/// A unit that is packed, loaded and described.
pub struct Loaded {
    /// Its functions, all of them there.
    pub functions: Functions,
    package: Package,
    guid: CString,
    resources: CString,
}

/// The error and its causes.
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

impl Loaded {
    /// The unit `ems`, or `guideway` or `vehicle` with one of their layouts.
    ///
    /// # Errors
    /// It is not built, or cannot be packed or loaded.
    pub fn new(name: &str, layout: Option<&str>) -> Result<Self, String> {
        let library = built(name)?;
        let resources = layout.map(|l| root().join(format!("fmu-{name}/resources")).join(l));
        let xml = fmi2_package::describe(&library, resources.as_deref()).map_err(text)?;
        let mut archive = Archive::new(&xml).map_err(text)?;
        archive.binary(fmi2_package::host().map_err(text)?, &library).map_err(text)?;
        if let Some(folder) = &resources {
            archive.folder("resources", folder).map_err(text)?;
        }
        let folder = tempfile::tempdir().map_err(text)?;
        let file = folder.path().join(format!("{name}.fmu"));
        archive.write(&file).map_err(text)?;
        let package = Package::open(&file).map_err(text)?;
        let functions = Functions::load(&package).map_err(text)?;
        let guid = CString::new(package.description().guid.as_str()).map_err(text)?;
        let resources = CString::new(package.resource_location()).map_err(text)?;
        Ok(Self { functions, package, guid, resources })
    }

    /// What the unit says about itself.
    #[must_use]
    pub fn description(&self) -> &Description {
        self.package.description()
    }

    /// Value reference and start value (0 without one) of the real variables of a causality.
    #[must_use]
    pub fn reals(&self, causality: Causality) -> Vec<(u32, f64)> {
        let variables = self.description().variables.iter();
        variables
            .filter(|v| v.kind == Type::Real && v.causality == causality)
            .map(|v| {
                let start = match v.start {
                    Some(Value::Real(value)) => value,
                    _ => 0.0,
                };
                (v.value_reference, start)
            })
            .collect()
    }

    /// A new instance with a logger that reads every message; `None` where the unit refuses.
    #[must_use]
    pub fn instantiate(&self, messages: &AtomicU64) -> Option<sys::fmi2Component> {
        let callbacks = callbacks(messages);
        let kind = sys::fmi2Type::fmi2CoSimulation;
        let (guid, resources) = (self.guid.as_ptr(), self.resources.as_ptr());
        // SAFETY: the function's own type; all pointers live through the call. The standard lets
        // the callbacks' memory go after it.
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

fn callbacks(messages: &AtomicU64) -> sys::fmi2CallbackFunctions {
    type Fixed = unsafe extern "C" fn(
        sys::fmi2ComponentEnvironment,
        sys::fmi2String,
        sys::fmi2Status,
        sys::fmi2String,
        sys::fmi2String,
    );
    // SAFETY: stable Rust cannot define a variadic function; where FMI units run, the named
    // arguments of one travel like those of any other function, and our units pass no others.
    let logger =
        unsafe { std::mem::transmute::<Option<Fixed>, sys::fmi2CallbackLogger>(Some(count)) };
    sys::fmi2CallbackFunctions {
        logger,
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: std::ptr::from_ref(messages).cast_mut().cast(),
    }
}

/// Adds a message's length, so that all of it is read.
unsafe extern "C" fn count(
    environment: sys::fmi2ComponentEnvironment,
    instance: sys::fmi2String,
    _: sys::fmi2Status,
    category: sys::fmi2String,
    message: sys::fmi2String,
) {
    // SAFETY: the standard says that these are C strings; the kit never passes null for them.
    let length = [instance, category, message]
        .map(|text| unsafe { core::ffi::CStr::from_ptr(text) }.to_bytes().len() as u64);
    // SAFETY: the environment is the counter that lives as long as the instance.
    let messages = unsafe { &*environment.cast::<AtomicU64>() };
    messages.fetch_add(length.iter().sum(), Ordering::Relaxed);
}
