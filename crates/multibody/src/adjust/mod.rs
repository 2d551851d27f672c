//! Quantities of a vehicle that can be changed without editing its file: masses and loads of observed
//! bodies, stiffness and damping of groups of elements.

mod levelling;
mod loads;
mod quantities;

use self::loads::{LoadPart, PlacedLoads};
use crate::description::VehicleDescription;
use crate::error::Error;
use crate::index::ObservedIndex;

/// What a quantity measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dimension {
    /// kg.
    Mass,
    /// m.
    Length,
    /// N/m.
    Stiffness,
    /// N·s/m.
    Damping,
    /// N·m/rad.
    RotationalStiffness,
    /// N·m·s/rad.
    RotationalDamping,
    /// A factor on values that differ.
    Factor,
}

/// A quantity that can be changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Adjustable {
    /// Name, such as `air_spring_vertical_stiffness`.
    pub name: String,
    /// What it is, for users.
    pub description: String,
    /// What it measures.
    pub dimension: Dimension,
    /// Value in the vehicle file.
    pub start: f64,
    /// Smallest value.
    pub min: Option<f64>,
    target: Target,
}

/// What a quantity changes.
#[derive(Debug, Clone, PartialEq)]
enum Target {
    /// Mass of an observed body with its parts.
    Mass(ObservedIndex),
    /// A load on an observed body.
    Load(ObservedIndex, LoadPart),
    /// Values of elements: these, or their factor.
    Elements { slots: Vec<Slot>, factor: bool },
}

/// One number of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Slot {
    /// Bushing, coefficient, axis.
    Bushing(usize, Coefficient, usize),
    Spring(usize, Coefficient),
    JointForce(usize, Coefficient),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coefficient {
    Stiffness,
    Damping,
    RotationalStiffness,
    RotationalDamping,
}

impl VehicleDescription {
    /// The quantities of this vehicle that can be changed, with their values.
    ///
    /// # Errors
    /// [`Error::Invalid`] where a group matches no elements.
    pub fn adjustables(&self) -> Result<Vec<Adjustable>, Error> {
        let mut all = loads::adjustables(self);
        all.extend(quantities::adjustables(self)?);
        Ok(all)
    }

    /// The vehicle with other values of its quantities, which come from [`VehicleDescription::adjustables`]
    /// and are given in their order. Quantities that keep their value change no bit.
    ///
    /// A change of stiffness keeps the load that an element carries in the initial pose. Where masses and
    /// loads change, `levelling` makes the bushings under `levelled_by` carry the difference, so that the
    /// body keeps its height and attitude; otherwise it sinks on its springs.
    ///
    /// # Errors
    /// [`Error::Argument`] for a wrong number of values, [`Error::Invalid`] where values are not possible.
    pub fn adjusted(
        &self,
        quantities: &[Adjustable],
        values: &[f64],
        levelling: bool,
    ) -> Result<Self, Error> {
        if quantities.len() != values.len() {
            return Err(Error::Argument {
                what: "values of quantities",
                expected: quantities.len().to_string(),
                found: values.len().to_string(),
            });
        }
        let mut changed = self.clone();
        let mut placed = PlacedLoads::new(self);
        for (quantity, &value) in quantities.iter().zip(values) {
            if !value.is_finite() {
                let what = quantity.name.clone();
                return Err(Error::NotFinite { what, time: 0.0 });
            }
            if value.to_bits() == quantity.start.to_bits() {
                continue;
            }
            match &quantity.target {
                Target::Mass(k) => placed.scale(*k, value / quantity.start, &mut changed),
                Target::Load(k, part) => placed.set(*k, *part, value),
                Target::Elements { slots, factor } => {
                    let named = |e: Error| e.caused_by(&quantity.name);
                    quantities::apply(&mut changed, slots, value, *factor).map_err(named)?;
                }
            }
        }
        placed.add(&mut changed);
        if levelling {
            for (k, weights) in placed.weights.iter().enumerate() {
                levelling::level(&mut changed, k, weights)?;
            }
        }
        changed.check()?;
        Ok(changed)
    }
}
