//! Export a Rust model as an FMI 2.0 co-simulation unit.
#![doc = include_str!("../README.md")]

mod access;
mod derivatives;
mod describe;
mod description;
mod directional;
mod erased;
mod error;
mod export;
pub mod ffi;
mod guard;
mod instance;
mod interface;
mod location;
mod logger;
mod model;
mod motions;
mod panics;
mod per_type;
mod resources;
mod scratch;
mod shared;
mod snapshot;
mod state;
mod state_space;
mod step;
mod table;
pub mod testing;
mod values;

pub use describe::describe;
pub use error::{Error, ErrorKind};
pub use fmi2_sys as sys;
pub use interface::{
    Declaration, DefaultExperiment, DisplayUnit, Info, Interface, Limits, UnitOfMeasure,
    VariableRow,
};
pub use model::{Model, Seed, Sensitivity, Step};
pub use motions::Motions;
pub use resources::Resources;
pub use state_space::StateSpace;
pub use values::{
    Boolean, BooleanVar, BooleanVars, Integer, IntegerVar, IntegerVars, Real, RealVar, RealVars,
    StringVar, StringVars, Text, Values, Var, Vars,
};
