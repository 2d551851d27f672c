//! Creating instances, in this process or in processes of their own.

use std::ffi::CString;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{Backend, Instance, InstanceOptions, PENDING_LIMIT, Warnings, offers};
use crate::component::Component;
use crate::fault::{FmuError, FmuFault, fail};
use crate::functions::Functions;
use crate::isolate::{Isolation, Worker};
use crate::logger::{Badge, Sink};
use crate::package::Package;
use crate::request::{Identity, Request};
use crate::witness::{CALL, Place};

impl Instance {
    /// Creates an instance in this process.
    ///
    /// # Errors
    /// The FMU refuses, for instance because its binary expects another GUID.
    pub fn new(
        package: &Arc<Package>,
        functions: Functions,
        dead: &Arc<AtomicBool>,
        name: &str,
    ) -> Result<Self, FmuError> {
        Self::with_options(package, functions, dead, name, &InstanceOptions::default())
    }

    /// [`Instance::new`] with options.
    ///
    /// # Errors
    /// The FMU refuses, or does not accept the log categories.
    pub fn with_options(
        package: &Arc<Package>,
        functions: Functions,
        dead: &Arc<AtomicBool>,
        name: &str,
        options: &InstanceOptions,
    ) -> Result<Self, FmuError> {
        let identity = identity(package, name, options)?;
        let sink = Sink::new(name);
        let place = Place::new(name, sink.badge());
        place.enter();
        match Component::new(functions, dead, &identity, &sink, &CALL) {
            Some(component) => {
                let backend = Backend::Here { component, sink };
                Self::with(package, place, name, dead, backend).with_categories(options)
            }
            None => fail(FmuFault::Refused {
                instance: name.to_owned(),
                messages: sink.take(package.description()),
            }),
        }
    }

    /// Creates an instance in a worker process of its own.
    ///
    /// # Errors
    /// No process can be started, the binary cannot be loaded there, or the FMU refuses or crashes.
    pub fn isolated(
        package: &Arc<Package>,
        isolation: &Isolation,
        name: &str,
    ) -> Result<Self, FmuError> {
        Self::isolated_with_options(package, isolation, name, &InstanceOptions::default())
    }

    /// [`Instance::isolated`] with options.
    ///
    /// # Errors
    /// The same, or the FMU does not accept the log categories.
    pub fn isolated_with_options(
        package: &Arc<Package>,
        isolation: &Isolation,
        name: &str,
        options: &InstanceOptions,
    ) -> Result<Self, FmuError> {
        let identity = identity(package, name, options)?;
        let worker = Worker::start(package, isolation, &identity, name)?;
        let backend = Backend::Elsewhere(Box::new(worker));
        Self::with(package, Place::new(name, Badge::NONE), name, &Arc::default(), backend)
            .with_categories(options)
    }

    /// Turns on the debug messages of single categories.
    fn with_categories(mut self, options: &InstanceOptions) -> Result<Self, FmuError> {
        let Some(categories) = options.debug_log.as_ref().filter(|it| !it.is_empty()) else {
            return Ok(self);
        };
        let c_string = |text: &String| {
            CString::new(text.as_str()).map_err(|_| self.zero_byte("a log category").into())
        };
        let categories: Result<Vec<CString>, FmuError> = categories.iter().map(c_string).collect();
        self.order(&Request::SetDebugLogging(categories?))?;
        Ok(self)
    }

    fn with(
        package: &Arc<Package>,
        place: &'static Place,
        name: &str,
        dead: &Arc<AtomicBool>,
        backend: Backend,
    ) -> Self {
        Self {
            name: name.to_owned(),
            package: Arc::clone(package),
            backend,
            place,
            dead: Arc::clone(dead),
            warnings: Warnings::default(),
            offers: offers::Offers::of(package.description()),
            earlier: Vec::new(),
            running: false,
            steps: 0,
            time: None,
            pending_limit: PENDING_LIMIT,
            saved_before: None,
        }
    }
}

fn identity(
    package: &Package,
    name: &str,
    options: &InstanceOptions,
) -> Result<Identity, FmuError> {
    let text = |what: &str, text: &str| {
        CString::new(text).map_err(|_| {
            FmuError::from(FmuFault::ZeroByte { instance: name.to_owned(), what: what.to_owned() })
        })
    };
    Ok(Identity {
        name: text("its name", name)?,
        guid: text("the GUID", &package.description().guid)?,
        resources: text("the resource location", &package.resource_location())?,
        logging: options.debug_log.is_some(),
        trace: options.trace.as_ref().map(|it| it.of(name, package.description())),
    })
}
