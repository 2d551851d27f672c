//! The line of a track in space: plan, elevation and cant as data, and its frames.
//!
//! The line is the middle between the rails, in the plane of their surfaces. Along its arc length s its
//! direction has the heading ψ (turning left positive) and the slope θ (rising positive), and the plane
//! of the rails has the cant φ (left side up positive). With x forward, y left and z up, the axes
//! (t, n, b) of the track are the columns of R = R_z(ψ)·R_y(−θ)·R_x(φ), and
//!
//! dp/ds = t,   dR/ds = R·\[κ\]ₓ,   κ = (φ' + ψ' sin θ,  −θ' cos φ + ψ' cos θ sin φ,  θ' sin φ + ψ' cos θ cos φ).
//!
//! ψ' is linear by pieces (straight, clothoid, circle), θ' likewise (crest and sag), φ a polynomial by
//! pieces. The position is integrated by power series on short cells, to rounding ([`Line`]). A
//! [`LineDescription`] is the line as data (JSON), checked for continuity of position, direction,
//! curvature and cant.
#![forbid(unsafe_code)]

mod cell;
mod check;
mod description;
mod error;
mod frame;
mod line;
mod profile;
#[cfg(feature = "schema")]
mod schema;

pub use description::{CantPiece, CantShape, Kind, LineDescription, Piece};
pub use error::Error;
pub use frame::{Frame, Meeting};
pub use line::Line;

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
