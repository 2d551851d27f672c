//! Frequency responses, stability margins and root loci of linear systems.
//!
//! A [`Model`] is a state-space model, continuous or sampled. An [`Evaluator`] gives its values at many
//! frequencies. [`Loops`] has the margins of loops that are broken one by one and all at once;
//! [`breaking`] makes the loop transfer functions of a coupled system, [`sampled`] those of a digital
//! controller. [`transfer`] has the responses of the closed system, [`locus`] its eigenvalues over a gain.
//!
//! ```no_run
//! use response::{BreakPoint, Loops, breaking};
//!
//! # fn show(system: &linear::LinearSystem) -> Result<(), response::ResponseError> {
//! let point = BreakPoint::new(system, "ems_01.voltage")?;
//! let open = breaking::loops(system, &[point])?;
//! let found = Loops::new(&open, &["ems_01.voltage".to_owned()])?.analyse(false)?;
//! # Ok(())
//! # }
//! ```

#![expect(
    clippy::result_large_err,
    reason = "errors have the detailed one of the master; they end a command"
)]

pub mod breaking;
mod error;
mod evaluate;
pub mod grid;
pub mod locus;
mod loops;
mod model;
pub mod names;
pub mod sampled;
pub mod scalar;
mod search;
#[cfg(test)]
mod tests;
pub mod transfer;

pub use breaking::BreakPoint;
pub use error::ResponseError;
pub use evaluate::{Evaluator, Scratch, for_all};
pub use loops::Loops;
pub use model::{Domain, Model};
