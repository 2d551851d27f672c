//! Stability of a linear system with periodic coefficients, as a train that moves at constant speed over an
//! endless row of equal spans.
//!
//! The system has a part with constant coefficients, such as the vehicle with its controllers,
//!
//! ```text
//! ż = A z + B u,    y = C z + D u,                 [`Modal`]
//! ```
//!
//! and girders whose connection with it depends on the place x of the train,
//!
//! ```text
//! ẋ = A_g x + B_g f,    u = P(x) η,    f = Q(x) y,   [`Girders`], [`Passage`]
//! ```
//!
//! with η some of the girders' states. After the train has moved by one period of the row, the spans are numbered
//! anew: what a girder does that the train has left no longer acts on the train and is dropped, and the train enters
//! a fresh span, which is at rest. The map of the states from one period to the next is the monodromy
//! ([`Monodromy`]). Its eigenvalues are the Floquet multipliers μ ([`multipliers`]). A motion grows by |μ| per period.
//!
//! [`Monodromy`] integrates with exponential collocation of order 6. [`reduced`] replaces a large constant part by a
//! smaller one. [`MovingTrain`] reads all this from a scenario.

#![expect(
    clippy::result_large_err,
    reason = "errors have the detailed one of the master; they end a command"
)]

mod balance;
pub mod collocation;
mod error;
mod girders;
mod modal;
mod monodromy;
mod moving;
mod multipliers;
mod passage;
mod reduction;
mod row;
mod shapes;
#[cfg(test)]
mod tests;
mod train;

pub use error::FloquetError;
pub use girders::Girders;
pub use modal::Modal;
pub use monodromy::Monodromy;
pub use moving::{Accuracy, Motion, MovingTrain, Place, map};
pub use multipliers::{Multiplier, Multipliers, multipliers};
pub use passage::Passage;
pub use reduction::{Reduction, directions, reduced};
pub use row::Row;
pub use train::Train;
