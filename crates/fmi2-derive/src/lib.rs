//! Units with other resources: new layouts of FMUs that were made with `fmi2-export`.
//!
//! A [`UnitSource`] is an .fmu file with changes of its resources. [`open`] unpacks it for a run, [`derive()`] makes a new
//! .fmu file of it. Both let the unit's own library print the new description.

#![expect(clippy::result_large_err, reason = "errors carry their context, and are rare")]

mod derived;
mod error;
mod open;
mod resource;
mod source;

pub use derived::{Derived, derive};
pub use error::DeriveError;
pub use open::{describe, open};
pub use resource::read;
pub use source::{Change, Changes, Resources, UnitSource};
