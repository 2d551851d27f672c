//! Which reading of the paper agrees with most of it.
//!
//! The paper leaves choices open. Each [`Reading`] makes them; `cases` are the runs that it takes, the points of the
//! studies `examples/studies/readings*.json`. `Row` is what is measured of a run, [`judge`] turns rows into
//! verdicts by the criteria of the page.

#[cfg(test)]
mod beam;
mod case;
mod catalogue;
mod dataset;
mod judge;
mod list;
mod picture;
mod run;
mod text;

pub use catalogue::Reading;
pub use dataset::Dataset;
pub use picture::{girders as girders_picture, overview};
pub use run::{run_all, write_tables};
pub use text::{holds, judged, section};
