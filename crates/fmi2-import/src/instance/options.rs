//! Options of an instance.

use crate::trace::Trace;

/// Options of an instance, for diagnosis.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions {
    /// Categories of debug messages; empty: all categories; `None`: no debug messages.
    pub debug_log: Option<Vec<String>>,
    /// Trace that its calls are written to.
    pub trace: Option<Trace>,
}
