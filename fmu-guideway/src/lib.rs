//! FMI 2.0 co-simulation unit `guideway`: flexible spans under moving magnets (eqs 6-8, 13).
//!
//! The physics is in the crate `guideway`; this crate is its FMI interface: `table` declares the
//! variables, `parameters` and `kinds` convert parameters to a description of the guideway, [`GuidewayFmu`]
//! maps inputs and outputs. The layout (spans, modes, number of magnets) is data, `guideway.json`
//! in the unit's resources.
//!
//! # Motion within a step
//! A magnet whose position comes with derivatives moves along that polynomial. One whose position
//! is held constant (no derivatives given) moves with the input `speed` and its derivatives, as
//! long as the parameter `position_from_speed` is on. The outputs at the end of a step are those at
//! the positions that the kit holds then; a position without derivatives is the old one until the
//! importer sets it. Rates are always those of a magnet that moves with the input `speed`.

#[cfg(test)]
mod allocation;
#[cfg(test)]
mod external_tests;
#[cfg(test)]
mod girder_tests;
mod kinds;
mod linear;
mod model;
mod parameters;
mod points;
mod rails;
#[cfg(test)]
mod rails_tests;
mod table;
#[cfg(test)]
mod tests;

pub use model::GuidewayFmu;

fmi2_export::export!(GuidewayFmu);
