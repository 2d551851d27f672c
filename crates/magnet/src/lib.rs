//! One levitation electromagnet with its five-state controller and dynamic filter.
//!
//! The model is the electromagnetic suspension of Kim, Han, Han and Yang, *Coupled vibration
//! analysis of Maglev vehicle-guideway while standing still or moving at low speeds* (equations
//! 1-5 and table 2; cited as "eq. n" throughout): a U-shaped magnet under a rail, fed by a voltage
//! that a controller derives from the air gap and the magnet's acceleration.
//!
//! # Signs and units
//! SI units. The gap c is positive when open; it opens when the magnet moves down, so the magnet's
//! displacement q, velocity q̇ and acceleration q̈ are positive downward. The force F is positive
//! when it attracts the magnet to the rail. Δ marks the deviation from the operating point:
//! Δc = c − c₀, Δi = i − i_op, Δv = v − R·i_op.
//!
//! # Parts
//! - [`MagnetParameters`] and its parts: the description of a magnet, checked by [`Magnet::new`].
//! - [`Electromagnet`]: force laws, inductance and coil (eqs 1 and 2).
//! - [`Filter`]: the dynamic filter (eqs 4 and 5).
//! - [`Conditions`]: sensors with faults, failure of the supply, lift-off and set-down; none by default.
//! - [`lateral_force`]: the restoring force of a magnet displaced sideways.
//! - [`Magnet`]: all of it together: initialise, step, outputs, derivatives. It can leave its
//!   controller out, and [`VoltageController`] is that controller alone.
//!
//! A [`Magnet`] never changes while stepping; everything that changes is in the small `Copy` value
//! [`State`]. [`Workspace`] only caches matrices and never influences a result.
//!
//! ```
//! use magnet::{InputCourse, MagnetInputs, Magnet, MagnetParameters, Workspace};
//!
//! let magnet = Magnet::new(MagnetParameters::default())?;
//! let load = 38_000.0 * 9.81 / 64.0;
//! let inputs = MagnetInputs { gap: 0.008, static_force: load, ..MagnetInputs::default() };
//! let mut state = magnet.initialise(&inputs, 0.0)?;
//! let mut workspace = Workspace::default();
//! magnet.step(&mut state, &InputCourse::constant(&inputs), 0.0, 1e-3, &mut workspace)?;
//! assert_eq!(magnet.outputs(&state, &inputs)?.force, load);
//! # Ok::<(), magnet::Error>(())
//! ```
#![forbid(unsafe_code)]

mod aside;
mod conditions;
mod control_law;
mod controller;
mod electromagnet;
mod error;
mod events;
mod exact;
mod filter;
mod inputs;
mod jet;
mod lateral;
mod lift_loss;
mod limiter;
mod limits;
mod noise;
mod outputs;
mod parameters;
mod runge_kutta;
mod sampling;
mod sensors;
mod sequence;
mod state;
mod step;
mod step_map;
mod system;

pub use aside::AsideSystem;
pub use conditions::{Condition, Conditions, SupplyFailure};
pub use controller::{
    ControllerInputs, ControllerOutputs, ControllerParameters, ControllerRates, ControllerState,
    ControllerWorkspace, VoltageController,
};
pub use electromagnet::{Electromagnet, MU_0};
pub use error::Error;
pub use exact::{CoilSystem, LinearSystem, Workspace};
pub use filter::{ACCELERATION_SCALE, Filter, POSITION_SCALE, VELOCITY_SCALE};
pub use inputs::{Further, FurtherCourse, InputCourse, MagnetInputs, Taylor};
pub use lateral::{lateral_force, lateral_stiffness};
pub use lift_loss::{LiftLoss, Place, Slopes, lateral_force_with_loss, lost_lift};
pub use limits::LimitsAtWork;
pub use noise::Noise;
pub use outputs::{InputRates, MagnetOutputs, OutputRates, Partials};
pub use parameters::{
    Controller, FilterDesign, Gains, Law, MagnetParameters, PowerLimits, Range, Sampling,
    filter_design_of_eq_4,
};
pub use sensors::{FailedReading, Readings, Sensor, SensorFailure, Sensors};
pub use sequence::{Phase, Sequence};
pub use state::{Hold, MAX_DELAY, State};
pub use system::Magnet;
