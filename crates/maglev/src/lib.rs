//! # Maglev co-simulation: the crates
//!
//! FMUs of a maglev train, and a master that steps FMI 2.0 co-simulation FMUs of any make. This page lists the crates. The
//! guide for users is `docs/index.md`, the floor plan with two walks through the code is `ARCHITECTURE.md`.
//!
//! Where to start:
//!
//! - **to run FMUs from a program of your own**: [`master`](../master/index.html), with its example `by_hand.rs`;
//! - **to open, inspect or drive one FMU**: [`fmi2_import`](../fmi2_import/index.html);
//! - **to check an FMU**: [`fmi2_conformance`](../fmi2_conformance/index.html);
//! - **to make an FMU of a Rust model**: [`fmi2_export`](../fmi2_export/index.html), a complete FMU on one page;
//! - **for the physics without FMI**: [`magnet`](../magnet/index.html), [`guideway`](../guideway/index.html),
//!   [`multibody`](../multibody/index.html).
//!
//! | layer | crate | what it does |
//! |---|---|---|
//! | command | [`maglev`](../maglev/index.html) | subcommands; a run with everything it writes (`Job`, `resume`) |
//! | stepping | [`master`](../master/index.html) | system, initialization, simulation |
//! | | [`in_memory`](../in_memory/index.html) | a run without files, and its figures |
//! | | [`study`](../study/index.html) | many variants of a scenario |
//! | | [`fit`](../fit/index.html) | parameters from a measured record |
//! | | [`linear`](../linear/index.html) | state-space models of coupled systems, their modes |
//! | | [`maps`](../maps/index.html) | stability maps over two parameters |
//! | | [`response`](../response/index.html) | frequency responses, margins, root loci |
//! | | [`tune`](../tune/index.html) | gains that maximise damping within limits of margins and voltage |
//! | | [`floquet`](../floquet/index.html) | stability of a moving train by Floquet multipliers |
//! | | [`coupling`](../coupling/index.html) | coupling algorithms, signals between FMUs |
//! | files | [`scenario`](../scenario/index.html) | scenario files, their check and schema |
//! | | [`ssp`](../ssp/index.html) | systems as SSP archives, from other tools and for them |
//! | | [`results`](../results/index.html) | the results folder: tables, events, summary |
//! | | [`report`](../report/index.html) | `report.html` and pictures of results |
//! | | [`measured`](../measured/index.html) | measured time series beside a run |
//! | | [`study_report`](../study_report/index.html) | `report.html` of a study: maps, effects, Sobol indices |
//! | importing | [`fmi2_import`](../fmi2_import/index.html) | archive, description, binary, instances, isolation |
//! | | [`fmi2_conformance`](../fmi2_conformance/index.html) | rules, checks of behaviour, reference results |
//! | exporting | [`fmi2_export`](../fmi2_export/index.html) | a Rust model as an FMU |
//! | | [`fmi2_package`](../fmi2_package/index.html) | packs the library into an .fmu |
//! | | [`fmi2_derive`](../fmi2_derive/index.html) | an FMU with other resources |
//! | | [`bundle`](../bundle/index.html) | a whole co-simulation as one FMU |
//! | | [`bundle_table`](../bundle_table/index.html) | the table of variables in such an FMU |
//! | both | [`fmi2_sys`](../fmi2_sys/index.html) | the C interface of FMI 2.0 |
//! | physics | [`magnet`](../magnet/index.html) | electromagnet, filter and controller (eqs 1-5) |
//! | | [`guideway`](../guideway/index.html) | girders by modal superposition (eqs 6-8, 13) |
//! | | [`multibody`](../multibody/index.html) | rigid bodies with joints and force elements (eqs 9-12) |
//! | | [`track_line`](../track_line/index.html) | curves, crests, sags and cant of a track |
//! | | [`linear_motor`](../linear_motor/index.html) | thrust and normal force of an induction motor |
//! | tools | [`analysis`](../analysis/index.html) | spectra, peaks, ride quality |
//! | | [`figure`](../figure/index.html) | curves as SVG |
//! | | [`patterns`](../patterns/index.html) | names with ranges and stars |
//! | | [`strict_json`](../strict_json/index.html) | JSON whose errors name their place |
//!
//! The FMUs themselves (`fmu_ems`, `fmu_guideway`, `fmu_vehicle`) are C libraries without a Rust interface. Equation
//! numbers are those of Kim, Han, Han and Yang, Vehicle System Dynamics 53 (2015) 587-601.
//!
//! # This crate
//!
//! Runs of scenarios with everything that they write: the library behind the command `maglev`.
//!
//! ```no_run
//! use std::path::Path;
//! use maglev::run::{Job, Unobserved};
//! use scenario::Scenario;
//!
//! let scenario = Scenario::load(Path::new("scenario.json"))?;
//! let job = Job { scenario: &scenario, name: "scenario", folder: Path::new("results") };
//! let summary = job.run(&mut Unobserved)?;
//! println!("{} steps, {} times real time", summary.steps, summary.real_time_factor);
//! # Ok::<(), maglev::Error>(())
//! ```
//!
//! A program that steps by hand only needs the crate [`master`].

#![expect(clippy::result_large_err, reason = "an error ends the command")]

pub mod error;
pub mod run;

pub use error::Error;
