//! Flexible guideway under moving magnets.
//!
//! A row of spans between rigid ground, each described by its bending modes (eqs 6-8 of the paper),
//! which are given, or computed from a beam on elastic supports; loaded by magnets whose forces are
//! spread over their poles, with an irregular surface and, optionally, the chirp force of eq. 13:
//!
//! - deflection u(x, t) = Σ qₙ(t)·φₙ(x) (eq. 6), up positive;
//! - Mₙ·q̈ₙ + Cₙ·q̇ₙ + Kₙ·qₙ = φₙᵀP(x, t) (eq. 7), P the sum over magnets and the discrete forces
//!   of each, which act on the span below them; a positive (attracting) force pushes down;
//! - outputs at magnets and mid-spans (eq. 8): displacement, rate as the moving magnet sees it,
//!   acceleration.
//!
//! With [`Rails`] girders also bend laterally and twist, in modes of their own or in modes that do
//! several things at once: the displacement of a cross-section has the components (z, y, θ), each
//! magnet loads its own rail at ±half-gauge b and height h over the shear centre, and meets z ± b·θ
//! vertically and y − h·θ laterally ([`RailSurface`]).
//!
//! The modal equations are linear, and decoupled unless supports have dampers, hence solved exactly
//! over a step of any size for forces that vary as polynomials ([`Guideway::step`]). [`GuidewayDescription`] is the guideway as
//! data, [`Guideway`] the checked and immutable model, [`State`] everything that changes,
//! [`Workspace`] scratch memory.
//!
//! Results are bitwise equal on every machine with IEEE arithmetic: sine, cosine and power come
//! from a software library, not from the platform.
#![forbid(unsafe_code)]

mod beam;
mod block;
mod check;
mod chirp;
mod contradictions;
mod cubics;
/// The guideway as data.
pub mod description;
mod error;
mod girder;
mod girder_description;
mod guideway;
mod harmonics;
mod irregularity;
mod loads;
mod mode;
mod motion;
mod pole;
mod propagator;
mod rail_motion;
mod rails;
mod rails_description;
#[cfg(feature = "schema")]
mod schema;
mod shapes;
mod shapes_file;
mod space;
mod space_description;
mod spectrum;
mod spline;

pub use chirp::ChirpForce;
pub use description::{GuidewayDescription, InitialDeflection};
pub use error::Error;
pub use girder::{Girder, GirderPart, MAX_MODES};
pub use guideway::{Guideway, Span, TrackPoint};
pub use irregularity::{Profile, RUN_OUT};
pub use loads::{Load, LoadChange, PointForce};
pub use mode::GirderMode;
pub use motion::{SpanMotion, State, Surface, Workspace};
pub use pole::{MAX_FORCES, Pole};
pub use propagator::{NODES, SUBSTEP_PHASE, nodes};
pub use rail_motion::{JointMotion, RailSurface};
pub use rails::Rails;
pub use spline::Spline;

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
