//! Named figures of recorded signals, limits with their sources, and the verdict on a run.
//!
//! A [`Metric`] is a figure with optional bounds: an entry of a scenario's `objectives` or `limits`, or of a
//! [`CriteriaFile`]. [`judge`] computes it from an [`Evidence`] of a run and gives a [`Verdict`].
//!
//! ```
//! use criteria::{CriteriaFile, Figure};
//!
//! let file = CriteriaFile::shipped("cjj-t-262").unwrap()?;
//! let deflection = &file.criteria["deflection_over_span"];
//! assert_eq!(deflection.figure, Some(Figure::MaxAbs));
//! assert_eq!(deflection.max.unwrap().value, 1.0 / 3800.0);
//! # Ok::<(), criteria::CriteriaError>(())
//! ```
#![forbid(unsafe_code)]

mod bound;
mod figure;
mod file;
mod judge;
mod metric;
mod verdict;

pub use bound::Bound;
pub use figure::{FigureError, Found, compute};
pub use file::{CriteriaError, CriteriaFile};
pub use judge::{Evidence, Finding, Place, judge, selected, unit_of};
pub use metric::{Figure, Metric, MetricError, Over, OverName, Quantity};
pub use verdict::{Outcome, Verdict, shown};
