//! The unit's variables, declared once: inputs, outputs, parameters, constants.

use fmi2_export::{
    BooleanVar, Info, Interface, RealVar, RealVars, UnitOfMeasure, Values, VariableRow,
};
use multibody::{JointKind, Loads, VehicleModel};

/// Name, description and default experiment of the unit.
pub(crate) fn info(model: &VehicleModel) -> Info {
    Info::new("vehicle", format!("Maglev vehicle: {}", model.name()))
        .description(
            "Maglev vehicle as a constrained system of rigid bodies: motion of the magnets and the \
             car bodies under levitation and guidance forces, starting in static equilibrium.",
        )
        .version(env!("CARGO_PKG_VERSION"))
        .author(env!("CARGO_PKG_AUTHORS"))
        .license(env!("CARGO_PKG_LICENSE"))
        .experiment(0.0, 36.0, 1e-3)
}

/// Handles of the inputs, one per magnet each.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InputHandles {
    pub force: RealVars,
    pub lateral_force: RealVars,
    pub track_displacement: RealVars,
    pub track_rate: RealVars,
}

/// Handles of the inputs that displace the rails sideways, one per magnet each, and of the law that the
/// magnets' guidance follows in equilibrium. They are declared last, so that the value references of all other variables stay what they were.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SidewaysHandles {
    pub displacement: RealVars,
    pub rate: RealVars,
    pub lift_loss: BooleanVar,
}

/// Handles of the outputs.
#[derive(Debug, Clone)]
pub(crate) struct OutputHandles {
    pub gap: RealVars,
    pub gap_rate: RealVars,
    pub acceleration: RealVars,
    pub lateral_offset: RealVars,
    pub static_load: RealVars,
    pub position: RealVars,
    pub speed: RealVar,
    pub observed: Vec<ObservedHandles>,
    pub joint_opening: RealVar,
    pub joint_opening_rate: RealVar,
    pub kinetic_energy: RealVar,
}

/// Handles of one observed body's outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ObservedHandles {
    pub lateral_displacement: RealVar,
    pub vertical_displacement: RealVar,
    /// Roll, pitch, yaw.
    pub attitude: [RealVar; 3],
    /// Longitudinal, lateral, vertical.
    pub acceleration: [RealVar; 3],
    pub point_lateral: RealVars,
    pub point_vertical: RealVars,
}

/// Handles of the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ParameterHandles {
    pub travel_speed: RealVar,
    pub initial_position: RealVar,
    pub max_step: RealVar,
    pub holding_stiffness: RealVar,
    pub lateral_guidance: BooleanVar,
    pub pole_width: RealVar,
}

impl InputHandles {
    pub(crate) fn declare(interface: &mut Interface, magnets: usize) -> Self {
        Self {
            force: interface
                .reals("force", magnets)
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::NEWTON)
                .nominal(5e3)
                .description("Levitation force that pulls magnet {k} up")
                .done(),
            lateral_force: interface
                .reals("lateral_force", magnets)
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::NEWTON)
                .nominal(1e3)
                .description("Guidance force on magnet {k}, to the left")
                .done(),
            track_displacement: interface
                .reals("track_displacement", magnets)
                .input(0.0)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(1e-3)
                .description("Height of the track's surface at magnet {k}, up positive")
                .done(),
            track_rate: interface
                .reals("track_rate", magnets)
                .input(0.0)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .nominal(1e-2)
                .description(
                    "Rate of the track's height as the moving magnet {k} sees it, up positive",
                )
                .done(),
        }
    }

    /// The current forces on the magnets.
    pub(crate) fn loads<'a>(&self, values: &'a Values) -> Loads<'a> {
        Loads { vertical: values.reals(self.force), lateral: values.reals(self.lateral_force) }
    }
}

impl SidewaysHandles {
    pub(crate) fn declare(interface: &mut Interface, magnets: usize) -> Self {
        Self {
            displacement: interface
                .reals("track_lateral_displacement", magnets)
                .input(0.0)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(1e-3)
                .description("Lateral displacement of the rail that magnet {k} meets, left positive")
                .done(),
            rate: interface
                .reals("track_lateral_rate", magnets)
                .input(0.0)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .nominal(1e-2)
                .description(
                    "Rate of the rail's lateral displacement as the moving magnet {k} sees it, left \
                     positive",
                )
                .done(),
            lift_loss: interface
                .boolean("lift_loss")
                .parameter(false)
                .description(
                    "Whether the magnets' lateral force in static equilibrium is that with lift loss; \
                     set it as in the ems unit",
                )
                .done(),
        }
    }
}

impl OutputHandles {
    pub(crate) fn declare(interface: &mut Interface, model: &VehicleModel) -> Self {
        let magnets = model.counts().magnets;
        // along a line the axes of the outputs turn, and motors know no second derivatives of their feed
        let straight = model.line().is_none() && model.motor_count() == 0;
        let most = if straight { 2 } else { 1 };
        Self {
            gap: interface
                .reals("gap", magnets)
                .output()
                .derivatives(2)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(8e-3)
                .description("Air gap of magnet {k}, opening positive")
                .done(),
            gap_rate: interface
                .reals("gap_rate", magnets)
                .output()
                .derivatives(1)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .nominal(1e-2)
                .description("Rate of the air gap of magnet {k}, opening positive")
                .done(),
            acceleration: interface
                .reals("acceleration", magnets)
                .output()
                .derivatives(1)
                .interpolated(most)
                .unit(UnitOfMeasure::METRE_PER_SECOND_SQUARED)
                .nominal(1.0)
                .description("Inertial acceleration of magnet {k}, down positive")
                .done(),
            lateral_offset: interface
                .reals("lateral_offset", magnets)
                .output()
                .derivatives(1)
                .interpolated(most)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(1e-3)
                .description("Lateral place of magnet {k} relative to its rail, left positive")
                .done(),
            static_load: interface
                .reals("static_load", magnets)
                .output()
                .derivatives(1)
                .interpolated(most)
                .unit(UnitOfMeasure::NEWTON)
                .nominal(5e3)
                .description("Force that holds magnet {k} in static equilibrium; constant")
                .done(),
            position: interface
                .reals("position", magnets)
                .output()
                .derivatives(1)
                .interpolated(most)
                .unit(UnitOfMeasure::METRE)
                .nominal(10.0)
                .description("Place of magnet {k} along the track")
                .done(),
            speed: interface
                .real("speed")
                .output()
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .display("km/h")
                .nominal(1.0)
                .description("Speed of the vehicle along the track")
                .done(),
            observed: model
                .observed()
                .map(|(name, points)| ObservedHandles::declare(interface, name, points))
                .collect(),
            joint_opening: interface
                .real("joint_opening")
                .output()
                .nominal(1e-8)
                .description(
                    "Largest violation of a joint's position equation, in m or rad (accuracy check)",
                )
                .done(),
            joint_opening_rate: interface
                .real("joint_opening_rate")
                .output()
                .nominal(1e-8)
                .description(
                    "Largest violation of a joint's velocity equation, in m/s or rad/s (accuracy \
                     check)",
                )
                .done(),
            kinetic_energy: interface
                .real("kinetic_energy")
                .output()
                .unit(UnitOfMeasure::JOULE)
                .nominal(1.0)
                .description("Kinetic energy in the frame that travels with the nominal speed")
                .done(),
        }
    }
}

impl ObservedHandles {
    fn declare(interface: &mut Interface, name: &str, points: usize) -> Self {
        let displacement = |interface: &mut Interface, way: &str, sign: &str| {
            interface
                .real(format!("{name}_{way}_displacement"))
                .output()
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(1e-3)
                .description(format!(
                    "{name}: {way} displacement of the centre of mass from its place in the vehicle \
                     file, {sign} positive"
                ))
                .done()
        };
        let angle = |interface: &mut Interface, what: &str, sign: &str| {
            interface
                .real(format!("{name}_{what}"))
                .output()
                .unit(UnitOfMeasure::RADIAN)
                .display("deg")
                .nominal(1e-3)
                .description(format!("{name}: {what} angle, positive {sign}"))
                .done()
        };
        let acceleration = |interface: &mut Interface, way: &str, sign: &str| {
            interface
                .real(format!("{name}_{way}_acceleration"))
                .output()
                .unit(UnitOfMeasure::METRE_PER_SECOND_SQUARED)
                .nominal(0.1)
                .description(format!(
                    "{name}: {way} acceleration of the centre of mass, {sign} positive"
                ))
                .done()
        };
        let at_points = |interface: &mut Interface, way: &str, sign: &str| {
            interface
                .reals(format!("{name}_{way}_acceleration"), points)
                .output()
                .unit(UnitOfMeasure::METRE_PER_SECOND_SQUARED)
                .nominal(0.1)
                .description(format!(
                    "{name}: {way} acceleration at ride comfort point {{k}}, {sign} positive"
                ))
                .done()
        };
        Self {
            lateral_displacement: displacement(interface, "lateral", "left"),
            vertical_displacement: displacement(interface, "vertical", "up"),
            attitude: [
                angle(interface, "roll", "with the left side up"),
                angle(interface, "pitch", "with the nose down"),
                angle(interface, "yaw", "turning left"),
            ],
            acceleration: [
                acceleration(interface, "longitudinal", "forward"),
                acceleration(interface, "lateral", "left"),
                acceleration(interface, "vertical", "up"),
            ],
            point_lateral: at_points(interface, "lateral", "left"),
            point_vertical: at_points(interface, "vertical", "up"),
        }
    }

    pub(crate) fn accelerations(&self) -> impl Iterator<Item = VariableRow> {
        self.acceleration
            .into_iter()
            .map(RealVar::row)
            .chain([self.point_lateral.row(), self.point_vertical.row()])
    }

    pub(crate) fn places(&self) -> impl Iterator<Item = VariableRow> {
        [self.lateral_displacement, self.vertical_displacement]
            .into_iter()
            .chain(self.attitude)
            .map(RealVar::row)
    }
}

impl ParameterHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        Self {
            travel_speed: interface
                .real("travel_speed")
                .parameter(0.0)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .display("km/h")
                .description("Nominal speed along the track, held by the drive")
                .done(),
            initial_position: interface
                .real("initial_position")
                .parameter(12.5)
                .unit(UnitOfMeasure::METRE)
                .description(
                    "Where x = 0 of the vehicle file (the middle of a train) stands along the track \
                     at the start; 12.5 m is the middle of a first span of 25 m",
                )
                .done(),
            max_step: interface
                .real("max_step")
                .parameter(5e-3)
                .unit(UnitOfMeasure::SECOND)
                .display("ms")
                .min(1e-7)
                .max(0.1)
                .description(
                    "Largest internal step; a communication step is split in equal internal steps, \
                     which are shorter where the stiffest part of the vehicle needs it",
                )
                .done(),
            holding_stiffness: interface
                .real("holding_stiffness")
                .parameter(1e7)
                .unit(UnitOfMeasure::NEWTON_PER_METRE)
                .min(1e3)
                .max(1e12)
                .description(
                    "Stiffness that holds each magnet while the static equilibrium is sought; \
                     speeds the search without changing its result",
                )
                .done(),
            lateral_guidance: interface
                .boolean("lateral_guidance")
                .parameter(true)
                .description(
                    "Whether the magnets hold the vehicle sideways in its static equilibrium, by the \
                     law of the ems unit; set it as there",
                )
                .done(),
            pole_width: interface
                .real("pole_width")
                .parameter(0.028)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .min(1e-6)
                .description(
                    "Width of one pole, for the lateral force in static equilibrium; set it as in the \
                     ems unit",
                )
                .done(),
        }
    }
}

/// Declares constants with the counts of the vehicle's parts, for display.
pub(crate) fn declare_constants(interface: &mut Interface, model: &VehicleModel) {
    let counts = model.counts();
    let joints = |kind| counts.joints.get(&kind).copied().unwrap_or(0);
    for (name, value, text) in [
        ("body_count", counts.bodies, "Rigid bodies, before fixed joints are merged"),
        ("bracket_joint_count", joints(JointKind::Bracket), "Bracket (fixed) joints"),
        ("translational_joint_count", joints(JointKind::Translational), "Translational joints"),
        ("spherical_joint_count", joints(JointKind::Spherical), "Spherical joints"),
        ("revolute_joint_count", joints(JointKind::Revolute), "Revolute joints"),
        ("constraint_count", counts.equations, "Constraint equations of all joints"),
        ("constraint_rank", counts.rank, "Independent constraint equations"),
        ("degrees_of_freedom", counts.degrees_of_freedom, "Degrees of freedom"),
        ("magnet_count", counts.magnets, "Magnets"),
        ("merged_body_count", counts.composites, "Rigid bodies after merging fixed joints"),
        ("component_count", counts.components, "Groups of jointed bodies, solved separately"),
        ("force_element_count", counts.force_elements, "Bushings, springs and joint springs"),
    ] {
        let Ok(value) = i32::try_from(value) else {
            interface.fault(format!("{name} exceeds what an FMI integer holds"));
            continue;
        };
        interface.integer(name).constant(value).description(text).done();
    }
    interface
        .real("total_mass")
        .constant(model.total_mass())
        .unit(UnitOfMeasure::KILOGRAM)
        .description("Mass of the vehicle")
        .done();
    interface
        .real("nominal_gap")
        .constant(model.nominal_gap())
        .unit(UnitOfMeasure::METRE)
        .display("mm")
        .description("Air gap of every magnet in static equilibrium on a flat track")
        .done();
}
