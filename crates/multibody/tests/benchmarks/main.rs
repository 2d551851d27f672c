//! Published benchmarks and closed forms of large motions, with the observed order of convergence.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

#[path = "../common/mod.rs"]
mod common;

mod elements;
mod four_bars;
mod free_bodies;
mod governor;
mod slider_crank;
mod squeezer;
mod support;
