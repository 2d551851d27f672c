//! No code: only dependencies with features.
//!
//! Cargo compiles a dependency once for each set of features. The units, the command and xtask are built
//! by separate calls of cargo, and without this crate each call would turn on other features of `serde`,
//! `num-traits` and others, and compile most dependencies again. Units, command and
//! xtask depend on this crate, which lists what any of them, or a test, turns on.
//!
//! `crates/xtask/tests/shared_builds.rs` fails if the sets of features differ, and names what to add.
