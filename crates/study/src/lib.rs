//! Studies: many variants of one scenario, computed one by one or by many processes, and collected in one dataset.
//!
//! A [`Study`] is a checked study file. It has [points](Study::point): the values of its factors, from a grid, a table or a
//! sample. A [`Runner`] computes points in this process; each gives a [`Row`]. [`coordinate`]
//! lets worker processes compute them and writes the results folder.
//!
//! ```no_run
//! use std::path::Path;
//! use study::{Runner, Study};
//!
//! let study = Study::load(Path::new("study.json"))?;
//! let mut runner = Runner::new(&study)?;
//! for number in 1..=study.count() {
//!     let row = runner.run(number)?;
//!     println!("{number}: {:?} {:?}", row.status, row.metrics);
//! }
//! # Ok::<(), study::StudyError>(())
//! ```

#![expect(clippy::result_large_err, reason = "detailed errors are large; they end a study")]

mod chosen;
mod content;
pub mod coordinator;
mod design;
mod distribution;
mod error;
mod factor;
mod file;
mod folder;
mod journal;
mod parquet_file;
mod plan;
mod queue;
mod row;
mod runner;
mod sample;
mod study;
mod table;
mod target;
pub mod worker;

pub use chosen::ChosenStep;
pub use coordinator::{Order, Outcome, Watcher, coordinate, merge};
pub use design::Design;
pub use distribution::Distribution;
pub use error::StudyError;
pub use factor::{Factor, FactorValue, Range, Spacing};
pub use file::{Keep, KeepRuns, StudyFile};
pub use folder::{Counts, FAILURES, METRICS};
pub use row::{Limits, Row, Status};
pub use runner::{Computed, Runner};
pub use study::{Column, Point, Study};
pub use target::{Target, Targets};
