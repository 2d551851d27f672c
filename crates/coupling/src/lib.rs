//! How units are stepped together. One file per algorithm, each an [`Algorithm`].
//!
//! An algorithm sees units through [`Unit`] and signals through [`Exchange`]. Neither knows FMI, so
//! algorithms are tested on plain functions. FMI 2.0 forbids reading an output after an input was
//! set without a step in between. The outputs at a communication point are therefore those that the
//! unit returns at the end of its step.
//!
//! A [`Schedule`] says which algorithm steps which units. A [`Coupling`] runs these algorithms one after
//! the other, and a [`Control`] chooses the size of its steps.

#[macro_use]
mod index_types;

pub mod acceleration;
mod algorithm;
mod bracket;
mod control;
mod coupled;
mod exchange;
mod gauss_seidel;
mod index;
mod iterated;
mod jacobi;
mod links;
mod mark;
mod newton;
mod outside;
mod power;
mod schedule;
pub mod signal;
mod sweeps;
mod taylor;
mod unit;
mod workers;

pub use algorithm::Algorithm;
pub use bracket::Bracket;
pub use control::Control;
pub use coupled::Coupling;
pub use exchange::{Course, Exchange, ExchangeState};
pub use gauss_seidel::GaussSeidel;
pub use index::{InputIndex, OutputIndex, SignalIndex, UnitIndex};
pub use iterated::Iterated;
pub use jacobi::Jacobi;
pub use links::{
    BooleanLink, HeldLink, Input, IntegerLink, Links, RealLink, Size, UnitValues, Whole, WholeLink,
    WholeOutput,
};
pub use mark::Mark;
pub use newton::Newton;
pub use outside::Outside;
pub use power::PowerMeter;
pub use schedule::{Schedule, StepGroup};
pub use taylor::{COEFFICIENTS, Taylor};
pub use unit::{Capabilities, PLACES, Unit};
pub use workers::Workers;
