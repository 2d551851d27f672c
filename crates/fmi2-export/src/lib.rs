//! Export a Rust model as an FMI 2.0 co-simulation unit.
#![doc = include_str!("../README.md")]

mod derivative;
mod description;
mod error;
mod export;
pub mod ffi;
mod guard;
mod instance;
mod interface;
mod location;
mod logger;
mod model;
mod resources;
mod snapshot;
mod state;
mod state_space;
mod table;
pub mod testing;
mod unit;
mod values;

pub use description::describe;
pub use error::{Error, Kind};
pub use fmi2_sys as sys;
pub use interface::{Declaration, DisplayUnit, Experiment, Info, Interface, Row, Unit};
pub use model::{Model, Seed, Sensitivity, Step};
pub use resources::Resources;
pub use state_space::StateSpace;
pub use values::{
    Boolean, BooleanVar, BooleanVars, Integer, IntegerVar, IntegerVars, Real, RealVar, RealVars,
    StringVar, StringVars, Text, Values, Var, Vars,
};
