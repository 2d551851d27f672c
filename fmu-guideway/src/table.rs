//! The unit's inputs and outputs, declared once, and their dependencies.

use fmi2_export::{Info, IntegerVar, Interface, RealVar, RealVars, UnitOfMeasure};
use guideway::{Guideway, GuidewayDescription};

use crate::kinds::DerivedKind;
use crate::parameters::ParameterHandles;
use crate::points::PointHandles;
use crate::rails::{JointOutputs, RailOutputs};

/// Name, description and default experiment of the unit.
pub(crate) fn info() -> Info {
    Info::new("guideway", "Flexible guideway")
        .description(
            "Row of flexible spans under moving magnets: modal superposition, irregularity, and \
             the chirp force for frequency responses.",
        )
        .version(env!("CARGO_PKG_VERSION"))
        .author(env!("CARGO_PKG_AUTHORS"))
        .license(env!("CARGO_PKG_LICENSE"))
        .experiment(0.0, 10.0, 1e-3)
}

/// Handles of the inputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InputHandles {
    pub force: RealVars,
    pub position: RealVars,
    pub speed: RealVar,
    /// Of a layout with rails.
    pub lateral: Option<RealVars>,
    /// At the place of the chirp; declared by [`InputHandles::declare_external`].
    pub external: Option<RealVar>,
}

impl InputHandles {
    pub(crate) fn declare(interface: &mut Interface, magnets: usize) -> Self {
        Self {
            force: interface
                .reals("force", magnets)
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::NEWTON)
                .nominal(1e4)
                .description("Levitation force of magnet {k}; attraction is positive, it pushes the guideway down")
                .done(),
            position: interface
                .reals("position", magnets)
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::METRE)
                .nominal(10.0)
                .description("Centre of magnet {k} along the track")
                .done(),
            speed: interface
                .real("speed")
                .input(0.0)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .display("km/h")
                .nominal(10.0)
                .description("Speed of the magnets along the track")
                .done(),
            lateral: None,
            external: None,
        }
    }

    /// Declares the external force, and what depends on it: as late as possible, so that the variables before it keep
    /// their value references.
    pub(crate) fn declare_external(
        &mut self,
        interface: &mut Interface,
        outputs: &OutputHandles,
        points: &[PointHandles],
    ) {
        let external = interface
            .real("external_force")
            .input(0.0)
            .unit(UnitOfMeasure::NEWTON)
            .nominal(1e4)
            .description("External force on the girder at chirp_position, down positive; it adds to the chirp")
            .done();
        interface.depends(outputs.midspan_acceleration, &[external]);
        for point in points {
            interface.depends(point.acceleration, &[external]);
        }
        self.external = Some(external);
    }
}

/// Handles of the outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputHandles {
    pub displacement: RealVars,
    pub rate: RealVars,
    pub deflection: RealVars,
    pub irregularity: RealVars,
    pub midspan_displacement: RealVars,
    pub midspan_velocity: RealVars,
    pub midspan_acceleration: RealVars,
    pub quarter_displacement: RealVars,
    /// Of a layout with rails.
    pub rails: Option<RailOutputs>,
    /// Of a layout that asks for them.
    pub joints: Option<JointOutputs>,
}

impl OutputHandles {
    pub(crate) fn declare(interface: &mut Interface, magnets: usize, spans: usize) -> Self {
        // with the highest order of its time derivatives
        let mut row = |name, count, order, unit, nominal, text: &str| {
            interface
                .reals(name, count)
                .output()
                .derivatives(order)
                .unit(unit)
                .nominal(nominal)
                .description(text)
                .done()
        };
        Self {
            displacement: row(
                "displacement",
                magnets,
                2,
                UnitOfMeasure::METRE,
                1e-3,
                "Track surface at magnet {k}: deflection plus irregularity, up positive",
            ),
            rate: row(
                "rate",
                magnets,
                1,
                UnitOfMeasure::METRE_PER_SECOND,
                1e-2,
                "Rate of the track surface as magnet {k}, moving over it, sees it; up positive",
            ),
            deflection: row(
                "deflection",
                magnets,
                2,
                UnitOfMeasure::METRE,
                1e-3,
                "Deflection of the guideway at magnet {k}, mean over its forces, up positive",
            ),
            irregularity: row(
                "irregularity",
                magnets,
                2,
                UnitOfMeasure::METRE,
                1e-3,
                "Irregularity of the track as magnet {k} feels it, up positive",
            ),
            midspan_displacement: row(
                "midspan_displacement",
                spans,
                2,
                UnitOfMeasure::METRE,
                1e-3,
                "Deflection in the middle of span {k}, up positive",
            ),
            midspan_velocity: row(
                "midspan_velocity",
                spans,
                1,
                UnitOfMeasure::METRE_PER_SECOND,
                1e-2,
                "Velocity of the middle of span {k}",
            ),
            midspan_acceleration: row(
                "midspan_acceleration",
                spans,
                0,
                UnitOfMeasure::METRE_PER_SECOND_SQUARED,
                1.0,
                "Acceleration of the middle of span {k}",
            ),
            quarter_displacement: row(
                "quarter_displacement",
                spans,
                2,
                UnitOfMeasure::METRE,
                1e-3,
                "Deflection at a quarter of span {k} from its start, up positive; the second mode shows here",
            ),
            rails: None,
            joints: None,
        }
    }

    /// Displacement, velocity and acceleration in the middle of span `k` (from 0).
    pub(crate) fn midspan(&self, k: usize) -> [RealVar; 3] {
        [self.midspan_displacement, self.midspan_velocity, self.midspan_acceleration]
            .map(|row| row.get(k))
    }

    /// Between steps the deflection is a state: forces act directly only on accelerations.
    /// Initially it is the static deflection, which depends on everything; no dependencies are
    /// declared for it, which means exactly that.
    pub(crate) fn declare_dependencies(
        &self,
        interface: &mut Interface,
        inputs: &InputHandles,
        parameters: &ParameterHandles,
    ) {
        for at_magnet in [self.displacement, self.rate, self.deflection, self.irregularity] {
            interface.depends_elementwise(at_magnet, inputs.position);
        }
        interface.depends(self.rate, &[inputs.speed]);
        interface.independent(self.midspan_displacement);
        interface.independent(self.midspan_velocity);
        interface.independent(self.quarter_displacement);
        interface.depends(self.midspan_acceleration, &[inputs.force, inputs.position]);
        interface.initially_depends_elementwise(self.irregularity, inputs.position);
        interface.initially_depends(self.irregularity, &parameters.of_irregularity());
    }
}

/// Handles of constants and of values computed from parameters.
#[derive(Debug, Clone)]
pub(crate) struct DerivedHandles {
    /// Of each kind of span.
    pub kinds: Vec<DerivedKind>,
}

impl DerivedHandles {
    pub(crate) fn declare(
        interface: &mut Interface,
        layout: &GuidewayDescription,
        guideway: &Guideway,
        prefixes: &[String],
        parameters: &ParameterHandles,
    ) -> Self {
        let (start, end) = guideway.track();
        let spans = i32::try_from(guideway.spans().len()).unwrap_or(i32::MAX);
        let _: IntegerVar =
            interface.integer("span_count").constant(spans).description("Number of spans").done();
        for (name, value, text) in [
            ("track_start", start, "Where the first span begins"),
            ("track_length", end - start, "Length of all spans together"),
        ] {
            let _: RealVar = interface
                .real(name)
                .constant(value)
                .unit(UnitOfMeasure::METRE)
                .description(text)
                .done();
        }
        let girders = layout.girders.values().zip(guideway.girders()).zip(prefixes).enumerate();
        let kinds = girders
            .map(|(k, ((given, girder), prefix))| {
                let knowns = parameters.of_modal_mass(k);
                DerivedKind::declare(interface, given, girder, prefix, &knowns)
            })
            .collect();
        Self { kinds }
    }
}
