//! Parameters that change the vehicle of the layout: masses, loads, stiffness, damping.

use std::hash::{DefaultHasher, Hash, Hasher};

use fmi2_export::{BooleanVar, Error, Interface, RealVar, UnitOfMeasure, Values, VariableRow};
use multibody::{Adjustable, Dimension, VehicleDescription, VehicleModel};

/// Key of the vehicle as in its file.
pub(crate) const AS_IN_FILE: u64 = 0;

/// The layout with the parameters that change it.
#[derive(Debug, Clone)]
pub(crate) struct Adjustments {
    layout: VehicleDescription,
    quantities: Vec<Adjustable>,
    parameters: Vec<RealVar>,
    /// `None` where nothing levels.
    levelling: Option<BooleanVar>,
    mass: RealVar,
}

const NEWTON_METRE_PER_RADIAN: UnitOfMeasure =
    UnitOfMeasure::new("N.m/rad").kg(1).m(2).s(-2).rad(-1);
const NEWTON_METRE_SECOND_PER_RADIAN: UnitOfMeasure =
    UnitOfMeasure::new("N.m.s/rad").kg(1).m(2).s(-1).rad(-1);

fn unit(dimension: Dimension) -> UnitOfMeasure {
    match dimension {
        Dimension::Mass => UnitOfMeasure::KILOGRAM,
        Dimension::Length => UnitOfMeasure::METRE,
        Dimension::Stiffness => UnitOfMeasure::NEWTON_PER_METRE,
        Dimension::Damping => UnitOfMeasure::NEWTON_SECOND_PER_METRE,
        Dimension::RotationalStiffness => NEWTON_METRE_PER_RADIAN,
        Dimension::RotationalDamping => NEWTON_METRE_SECOND_PER_RADIAN,
        Dimension::Factor => UnitOfMeasure::ONE,
    }
}

impl Adjustments {
    pub fn declare(interface: &mut Interface, layout: VehicleDescription) -> Result<Self, Error> {
        let quantities = layout.adjustables().map_err(|e| Error::caused(&e))?;
        let parameters = quantities
            .iter()
            .map(|quantity| {
                let mut declaration = interface
                    .real(&quantity.name)
                    .parameter(quantity.start)
                    .unit(unit(quantity.dimension))
                    .description(&quantity.description);
                if let Some(min) = quantity.min {
                    declaration = declaration.min(min);
                }
                declaration.done()
            })
            .collect();
        let levels = layout.observed.iter().any(|observed| !observed.levelled_by.is_empty());
        let levelling = levels.then(|| {
            interface
                .boolean("levelling")
                .parameter(true)
                .description(
                    "Whether the air springs have been levelled before the start: they carry other \
                     masses and loads at the same height; otherwise the car sinks on its springs",
                )
                .done()
        });
        let mass = interface
            .real("loaded_mass")
            .calculated_parameter()
            .unit(UnitOfMeasure::KILOGRAM)
            .description("Mass of the vehicle with its loads, which the magnets carry")
            .done();
        Ok(Self { layout, quantities, parameters, levelling, mass })
    }

    /// The parameters, on which the static equilibrium depends.
    pub fn rows(&self) -> impl Iterator<Item = VariableRow> {
        let levelling = self.levelling.map(BooleanVar::row);
        self.parameters.iter().map(|parameter| parameter.row()).chain(levelling)
    }

    /// The mass of the vehicle with its loads.
    pub fn mass(&self) -> RealVar {
        self.mass
    }

    /// Fingerprint of the parameters' values.
    pub fn key(&self, values: &Values) -> u64 {
        let changed = |(quantity, parameter): (&Adjustable, &RealVar)| {
            values.real(*parameter).to_bits() != quantity.start.to_bits()
        };
        if !self.quantities.iter().zip(&self.parameters).any(changed) {
            return AS_IN_FILE;
        }
        let mut hasher = DefaultHasher::new();
        self.levelling.map(|levelling| values.boolean(levelling)).hash(&mut hasher);
        for parameter in &self.parameters {
            values.real(*parameter).to_bits().hash(&mut hasher);
        }
        hasher.finish().max(AS_IN_FILE + 1)
    }

    /// The vehicle with these values of the parameters.
    pub fn build(&self, values: &Values) -> Result<VehicleModel, Error> {
        let numbers: Vec<f64> = self.parameters.iter().map(|p| values.real(*p)).collect();
        let levelling = self.levelling.is_some_and(|levelling| values.boolean(levelling));
        self.layout
            .adjusted(&self.quantities, &numbers, levelling)
            .and_then(|vehicle| VehicleModel::new(&vehicle))
            .map_err(|e| Error::caused(&e).context("the vehicle with its changed parameters"))
    }
}
