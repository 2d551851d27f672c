//! Calls a unit through its C functions from safe Rust, for the tests of unit crates.
//!
//! ```
//! # use fmi2_export::{Error, Info, Interface, Model, RealVar, Resources, Step, Values};
//! # struct Clock(RealVar);
//! # impl Model for Clock {
//! #     type State = ();
//! #     fn declare(_: &Resources, table: &mut Interface) -> Result<Self, Error> {
//! #         table.describe(Info::new("clock", "Clock"));
//! #         Ok(Self(table.real("t").output().done()))
//! #     }
//! #     fn initialise(&mut self, _: &mut Values, _: f64) -> Result<(), Error> { Ok(()) }
//! #     fn outputs(&mut self, _: &(), values: &mut Values, time: f64) -> Result<(), Error> {
//! #         values.set_real(self.0, time);
//! #         Ok(())
//! #     }
//! #     fn step(&mut self, _: &mut (), _: &mut Values, _: Step) -> Result<(), Error> { Ok(()) }
//! # }
//! # fn main() -> Result<(), fmi2_export::testing::CallFailure> {
//! use fmi2_export::testing::TestInstance;
//!
//! let mut clock = TestInstance::new::<Clock>("resources")?;
//! clock.initialize(0.0)?;
//! clock.step(0.0, 0.1)?;
//! assert_eq!(clock.real("t")?, 0.1);
//! # Ok(())
//! # }
//! ```

mod derivatives;
mod instance;
mod log;
mod states;
mod variables;

pub use instance::TestInstance;
pub use log::{CallFailure, LoggedMessage};
