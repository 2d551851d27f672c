//! What an instance is made with besides its unit.

use crate::trace::Trace;

/// What an instance is made with besides its unit: nothing, unless somebody wants to look closely.
#[derive(Debug, Clone, Default)]
pub struct InstanceOptions {
    /// Debug messages of these categories; empty: of all categories; `None`: no debug messages.
    pub debug_log: Option<Vec<String>>,
    /// Where its calls are noted.
    pub trace: Option<Trace>,
}
