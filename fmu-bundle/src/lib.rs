//! The library of bundles: a whole co-simulation as one FMI 2.0 co-simulation unit.
#![doc = include_str!("../README.md")]

mod declare;
mod linear_report;
mod measures;
mod model;
mod running;
mod state;

fmi2_export::export!(model::Bundle);
