//! Constrained rigid multibody dynamics in body coordinates with Lagrange multipliers (eqs 9-12).
//!
//! A vehicle is data ([`VehicleDescription`], JSON). [`VehicleModel::new`] checks it, merges fixed
//! joints, finds redundant ones and prepares the block-sparse solver; the [`VehicleModel`] never
//! changes afterwards. The [`State`] holds everything that changes; it is a plain value.
//! [`VehicleModel::step`] advances it under forces on the magnets, [`VehicleModel::equilibrium`]
//! finds its static equilibrium.
//!
//! # Coordinates
//! Each rigid body has the position r of its centre of mass and a unit quaternion p; velocities are
//! v (world axes) and ω (body axes), so the mass matrix diag(m I, J) is constant. x forward, y
//! left, z up, in a world frame that travels with the vehicle's nominal speed; where that changes, inertia and the
//! motor's force act ([`AppliedForces::acceleration`]). No small-angle approximation is made.
//!
//! | symbol | meaning | size | unit | in the code |
//! |---|---|---|---|---|
//! | r, p | place and attitude of a body | 3, 4 | m, – | [`BodyState::position`], [`BodyState::attitude`] |
//! | v, ω | velocities of a body | 3, 3 | m/s, rad/s | [`BodyState::velocity`], [`BodyState::angular_velocity`] |
//! | M | mass matrix | 6n × 6n | kg, kg·m² | by blocks; whole in [`VehicleModel::dense_system`] |
//! | Φ | constraints, eq. 10 | m | m, rad | [`VehicleModel::constraint_violation`] |
//! | Φ_q | their Jacobian, eq. 11 | m × 6n | 1, m | by blocks; whole in [`VehicleModel::dense_system`] |
//! | γ | right-hand side of eq. 12 | m | m/s², rad/s² | whole in [`VehicleModel::dense_system`] |
//! | Q | applied and gyroscopic forces | 6n | N, N·m | whole in [`VehicleModel::dense_system`] |
//! | λ | multipliers, the joints' reactions | m | N, N·m | [`Workspace::multipliers`] |
//!
//! # Equation 9
//! M q̈ + Φ_qᵀ λ = Q, Φ_q q̈ = γ. Bodies joined by brackets are merged first (two-car train: 105
//! bodies and 502 equations become 80 and 352). Force elements do not couple accelerations, so the
//! matrix separates into groups of jointed bodies: each bogie, and the cars. It is factored by
//! blocks, LDLᵀ on the graph of bodies (6×6) and joints (3×3, 5×5), in an order of least fill that
//! is determined once. A body may be eliminated at any time, a joint as soon as its pivot is
//! regular. Joints that repeat what others fix are found first, from geometry alone, and reported
//! with the direction ([`Error::Redundant`]). A pivot that vanishes during the simulation is
//! [`Error::Singular`] with time and joint.
//!
//! # Integration and drift
//! Classical Runge-Kutta of fourth order on (r, p, v, ω), in equal internal steps; loads are
//! polynomials in time. After every internal step poses and velocities are projected on the
//! constraints in the metric of M, by simplified Newton steps with the factors of the last
//! evaluation. Corrections continue until a violation is a hundredth of [`Tolerances`] (1e-11 m,
//! rad and per second) or at rounding; one beyond the tolerance is an error, so violations do not
//! accumulate. Measured over an hour of rough running of one bogie in steps of 1 ms: 1.3e-14 m or
//! rad and 1.0e-13 m/s or rad/s (`invariant_joints_stay_closed_over_an_hour`).
//!
//! `README.md` beside this crate's manifest has an example and the conventions.
//!
//! Nothing allocates while stepping: all memory is in a [`Workspace`], which never influences results.

#![forbid(unsafe_code)]

mod adjust;
mod anchor;
mod assembly;
mod attachments;
mod block;
mod carried;
mod check;
mod composite;
mod contact;
mod counts;
mod dense;
mod description;
mod dynamics;
mod elements;
mod elimination;
mod equilibrium;
mod error;
mod explain;
mod fastest;
mod file;
mod frame;
mod groups;
#[cfg(test)]
mod growth;
mod index;
mod integrate;
mod jerk;
mod joint;
mod kept;
mod kernels;
mod layout;
mod linearisation;
mod linearise;
mod loads;
pub mod math;
mod model;
mod motors;
mod names;
mod numbers;
mod observe;
mod ordering;
mod places;
mod rank;
mod rate;
mod reactions;
mod resolve;
mod saddle;
mod sample;
#[cfg(feature = "schema")]
mod schema;
mod scheme;
mod shapes;
mod sides;
mod state;
#[cfg(test)]
mod tests;
pub mod train;
mod turning;
mod way;
mod workspace;

pub use adjust::{Adjustable, Dimension};
pub use contact::{
    Contact, ContactDescription, ContactLaw, ContactPower, ContactSide, MAX_CONTACT_STIFFNESS,
    MIN_SLIP_SPEED, TrackContact, TrackCourse,
};
pub use counts::VehicleCounts;
pub use description::{
    Body, Bushing, Drive, ElementGroup, GROUND, Inertia, Joint, JointForce, JointKind, MagnetPoint,
    Observed, Spring, VehicleDescription,
};
pub use equilibrium::{Equilibrium, Guidance, Holding, Rails};
pub use error::{Error, Redundancy};
pub use index::{BodyIndex, ComponentIndex, MagnetIndex, ObservedIndex};
pub use jerk::MovingTrack;
pub use linearisation::{BodyShape, Linearisation, damping_ratio, natural_frequency};
pub use linearise::MagnetSprings;
pub use loads::{AppliedCourse, AppliedForces, ExternalLoad, FurtherCourse, LoadCourse, Loads};
pub use model::{Tolerances, VehicleModel};
pub use motors::{MotorControl, MotorCourse, MotorState};
pub use observe::{Energy, PointMotion};
pub use reactions::Reaction;
pub use scheme::Scheme;
pub use sides::MEETING_TOLERANCE;
pub use state::{BodyState, State};
pub use way::Travel;
pub use workspace::Workspace;

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
