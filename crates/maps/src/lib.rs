//! Stability maps of scenarios: the least damped mode over one or two parameters.
//!
//! The scenario starts once. Its units report their linearisations (`linear`), which are split into controllers, a plant
//! and an attached part (`stability-map`). A parameter that enters only controllers or the attached part is changed in
//! that unit alone: it is instantiated once more with the same inputs, and asked for its linearisation. Parameters that
//! enter the plant need another start of the system for each value. Systems that cannot be split are computed by all
//! eigenvalues at every point.

#![expect(
    clippy::result_large_err,
    reason = "errors have the detailed one of the master; they end a command"
)]

mod axis;
mod boundary;
mod check;
mod error;
mod journal;
mod model;
mod parts;
mod picture;
mod result;
mod run;
mod scene;
mod table;
mod twin;

pub use axis::Axis;
pub use error::Error;
pub use parts::{factor, largest};
pub use picture::picture;
pub use result::{BoundaryPoint, Check, Known, MapAxis, MapCell, ModeKind, StabilityMap};
pub use run::{Request, Watch, map};
pub use table::write_parquet;
pub use twin::{Given, Twin, changed, twins};
