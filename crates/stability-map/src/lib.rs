//! Stability of a coupled linear system over many values of its parameters.
//!
//! A plant carries loads in many loops, each closed by a controller; a part of few states is attached to it (a train
//! with magnets on a girder). The whole has hundreds of states, but its loop closes through a matrix N(s) as small as
//! the rank of the plant's response ([`Space`]). Zeros of det N are the modes:
//!
//! - [`Branch`] refines one by Newton's method and follows it from one value of a parameter to the next;
//! - [`Contour`] counts them in a [`Region`] by the argument principle, with the zeros that are known divided out, so
//!   that what remains must be zero. For equal controllers with proportional measurements, the response is
//!   diagonalised once per point of the boundary, and a new set of gains costs divisions only;
//! - a [`Ladder`] of such regions, one inside the other, so that only the least damped zeros have to be known;
//! - [`survey`] does both for every point of a grid. Where the count is not what it must be, all eigenvalues are
//!   computed.
//!
//! The crate knows no files, no units and no trains: plain matrices only.

mod branch;
mod contour;
mod elimination;
mod error;
mod explore;
mod gains;
mod ladder;
mod modal;
mod node;
mod region;
mod space;
mod survey;
mod system;
#[cfg(test)]
mod tests;
mod turns;

pub use branch::{Branch, Point, damping};
pub use contour::{Contour, Count};
pub use error::MapError;
pub use explore::{Cell, Evidence, Followed, MARGIN};
pub use gains::Gains;
pub use ladder::Ladder;
pub use modal::Modal;
pub use region::Region;
pub use space::{Level, Space};
pub use survey::{Grid, survey};
pub use system::{Attached, Controller, Controllers, Output, Plant, whole};
