//! Messages to the importer, through the logger that it provides.

use std::ffi::{CStr, CString};

use fmi2_sys::{fmi2CallbackFunctions, fmi2CallbackLogger, fmi2ComponentEnvironment, fmi2Status};

/// The categories that the description declares, from the standard's list.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Category {
    Error = 0,
    Discard = 1,
    Fatal = 2,
    Events = 3,
    All = 4,
}

impl Category {
    pub(crate) const ALL: [Self; 5] =
        [Self::Error, Self::Discard, Self::Fatal, Self::Events, Self::All];

    pub(crate) const fn name(self) -> &'static CStr {
        match self {
            Self::Error => c"logStatusError",
            Self::Discard => c"logStatusDiscard",
            Self::Fatal => c"logStatusFatal",
            Self::Events => c"logEvents",
            Self::All => c"logAll",
        }
    }

    pub(crate) const fn description(self) -> &'static str {
        match self {
            Self::Error => "Why a call returned fmi2Error; always logged",
            Self::Discard => "Why a call returned fmi2Discard; always logged",
            Self::Fatal => "Why a call returned fmi2Fatal; always logged",
            Self::Events => "Changes of mode and time of the instance",
            Self::All => "All messages",
        }
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// The importer's logger with the environment that it wants back.
#[derive(Clone, Debug)]
pub(crate) struct Logger {
    callback: fmi2CallbackLogger,
    environment: fmi2ComponentEnvironment,
    instance: CString,
    /// Categories switched on, as bits; errors are logged in any case.
    enabled: u8,
}

// SAFETY: the environment is the importer's and is only handed back to its own function; FMI lets
// the importer call an instance from one thread after another, and a logger must stand that.
unsafe impl Send for Logger {}

impl Logger {
    /// Copies the callbacks: the struct is only valid during instantiation.
    pub(crate) fn new(functions: &fmi2CallbackFunctions, instance: CString, on: bool) -> Self {
        let mut logger = Self {
            callback: functions.logger,
            environment: functions.componentEnvironment,
            instance,
            enabled: 0,
        };
        if on {
            logger.enable_all();
        }
        logger
    }

    pub(crate) fn enable_all(&mut self) {
        self.enabled = u8::MAX;
    }

    pub(crate) fn disable_all(&mut self) {
        self.enabled = 0;
    }

    /// Enables a category; `false` if there is none of this name.
    pub(crate) fn enable(&mut self, name: &CStr) -> bool {
        let category = Category::ALL.into_iter().find(|category| category.name() == name);
        match category {
            Some(Category::All) => self.enable_all(),
            Some(category) => self.enabled |= category.bit(),
            None => return false,
        }
        true
    }

    /// Whether event messages are enabled, so that none is formatted without need.
    #[inline]
    pub(crate) fn wants_events(&self) -> bool {
        self.enabled & Category::Events.bit() != 0
    }

    /// Sends one message.
    #[cold]
    pub(crate) fn send(&self, status: fmi2Status, category: Category, message: &str) {
        let Some(callback) = self.callback else { return };
        let Ok(text) = CString::new(escape(message)) else { return };
        // SAFETY: the importer guarantees its function; all strings end with NUL and live through
        // the call. The message needs no further arguments: `%` is doubled.
        unsafe {
            callback(
                self.environment,
                self.instance.as_ptr(),
                status,
                category.name().as_ptr(),
                text.as_ptr(),
            );
        }
    }
}

/// The message is a printf format in which `#r1#` refers to a variable, so `%` and `#` are doubled.
/// A NUL would end the text early and is replaced.
fn escape(message: &str) -> String {
    let mut text = String::with_capacity(message.len() + 8);
    for character in message.chars() {
        match character {
            '%' => text.push_str("%%"),
            '#' => text.push_str("##"),
            '\0' => text.push('\u{FFFD}'),
            other => text.push(other),
        }
    }
    text
}
