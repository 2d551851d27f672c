//! The unit's variables, declared once: inputs, outputs, and their dependencies.

use controller_variables::estimates;
use fmi2_export::{Info, Interface, RealVar, UnitOfMeasure, VariableRow};

use crate::command::CommandHandles;
use crate::conditions::ConditionHandles;
use crate::lift::LiftHandles;
use crate::parameters::ParameterHandles;

/// Name, description and default experiment of the unit.
pub(crate) fn info() -> Info {
    Info::new("ems", "Levitation electromagnet with controller")
        .description(
            "One electromagnet of an EMS maglev vehicle with its five-state voltage controller and \
             dynamic filter: levitation and lateral force from gap, gap rate and acceleration.",
        )
        .version(env!("CARGO_PKG_VERSION"))
        .author(env!("CARGO_PKG_AUTHORS"))
        .license(env!("CARGO_PKG_LICENSE"))
        .experiment(0.0, 10.0, 1e-3)
}

/// Load of one of the 64 magnets that carry the paper's two cars of 38 t, in N.
const LOAD: f64 = 38_000.0 * 9.81 / 64.0;

/// Handles of the inputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InputHandles {
    pub gap: RealVar,
    pub gap_rate: RealVar,
    pub acceleration: RealVar,
    pub lateral_offset: RealVar,
    pub static_force: RealVar,
}

/// Handles of the outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OutputHandles {
    pub force: RealVar,
    pub lateral_force: RealVar,
    pub current: RealVar,
    pub voltage: RealVar,
    /// In eq. 5's order.
    pub estimates: [RealVar; 5],
}

/// Handles of the constants that are computed from the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DerivedHandles {
    pub inductance: RealVar,
    pub current_stiffness: RealVar,
    pub gap_stiffness: RealVar,
    pub nominal_force: RealVar,
}

impl InputHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        Self {
            gap: interface
                .real("gap")
                .input(0.008)
                .takes(5)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .min(0.0)
                .nominal(0.008)
                .description(
                    "Air gap between magnet and rail; grows as it opens. Zero means contact, which \
                     is refused",
                )
                .done(),
            gap_rate: interface
                .real("gap_rate")
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::METRE_PER_SECOND)
                .display("mm/s")
                .nominal(0.01)
                .description(
                    "Rate of the air gap, positive when it opens. It sets the filter's start and \
                     the derivative of the current; the force follows from the gap itself",
                )
                .done(),
            acceleration: interface
                .real("acceleration")
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::METRE_PER_SECOND_SQUARED)
                .description("Inertial acceleration of the magnet, positive downward")
                .done(),
            lateral_offset: interface
                .real("lateral_offset")
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::METRE)
                .display("mm")
                .nominal(0.001)
                .description("Displacement of the magnet to the left of its rail")
                .done(),
            static_force: interface
                .real("static_force")
                .input(LOAD)
                .takes(5)
                .unit(UnitOfMeasure::NEWTON)
                .display("kN")
                .nominal(5000.0)
                .description(
                    "Static force that the magnet carries at the nominal gap. At initialization it \
                     sets the operating point; afterwards the linear law adds it to the force, and \
                     the nonlinear law does not use it",
                )
                .done(),
        }
    }
}

impl OutputHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        // with the highest order of its time derivatives
        let mut output =
            |name: &'static str, order, unit: UnitOfMeasure, nominal: f64, text: &'static str| {
                // more than their cost is worth for extrapolation: those of the lateral force
                let output = interface.real(name).output().derivatives(order);
                let output = output.interpolated(if order == 0 { 2 } else { order });
                output.unit(unit).nominal(nominal).description(text).done()
            };
        let force = output(
            "force",
            2,
            UnitOfMeasure::NEWTON,
            5000.0,
            "Levitation force, attraction to the rail positive",
        );
        let lateral_force = output(
            "lateral_force",
            0,
            UnitOfMeasure::NEWTON,
            100.0,
            "Lateral force on the magnet, positive to the left; it restores",
        );
        let current = output(
            "current",
            1,
            UnitOfMeasure::AMPERE,
            10.0,
            "Coil current, operating point included",
        );
        let voltage = output(
            "voltage",
            1,
            UnitOfMeasure::VOLT,
            10.0,
            "Voltage applied by the controller, operating point included, within the voltage limits",
        );
        let estimates = estimates::declare(interface);
        Self { force, lateral_force, current, voltage, estimates }
    }
}

impl DerivedHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let mut derived = |name: &'static str, unit: UnitOfMeasure, text: &'static str| {
            interface.real(name).calculated_parameter().unit(unit).description(text).done()
        };
        Self {
            inductance: derived(
                "inductance",
                UnitOfMeasure::HENRY,
                "Inductance L0 at the nominal gap",
            ),
            current_stiffness: derived(
                "current_stiffness",
                UnitOfMeasure::NEWTON_PER_AMPERE,
                "Force per current ki at the operating current and the nominal gap",
            ),
            gap_stiffness: derived(
                "gap_stiffness",
                UnitOfMeasure::NEWTON_PER_METRE,
                "Loss of force per gap kc at the operating current and the nominal gap",
            ),
            nominal_force: derived(
                "nominal_force",
                UnitOfMeasure::NEWTON,
                "Force F0 of the nonlinear law at the operating current and the nominal gap",
            ),
        }
    }
}

/// Declares the dependencies. After initialization flux and filter are states, so only direct
/// feed-through counts: the force does not depend directly on the acceleration, and on the gap only
/// while a current limit holds the current instead of the flux.
pub(crate) fn depend(
    interface: &mut Interface,
    inputs: &InputHandles,
    outputs: &OutputHandles,
    derived: &DerivedHandles,
    parameters: &ParameterHandles,
    command: &CommandHandles,
    conditions: &ConditionHandles,
) {
    let InputHandles { gap, gap_rate, acceleration, lateral_offset, static_force } = *inputs;
    let [y1, y2, y3, y4, y5] = outputs.estimates;
    interface.depends(outputs.force, &[gap, static_force]);
    interface.depends(outputs.lateral_force, &[gap, lateral_offset, static_force]);
    interface.depends(outputs.voltage, &[acceleration, command.voltage_command]);
    interface.depends(y3, &[acceleration]);
    interface.depends(outputs.current, &[gap]);
    for unknown in [y1, y2, y4, y5] {
        interface.independent(unknown);
    }

    interface.depends(conditions.measured_gap, &[gap]);
    interface.depends(conditions.measured_acceleration, &[acceleration]);
    interface.independent(conditions.reference_gap);

    let at_rest = parameters.of_controller();
    for unknown in [outputs.force, outputs.lateral_force, outputs.current, outputs.voltage] {
        interface.initially_depends(unknown, &[gap, static_force]);
        interface.initially_depends(unknown, &at_rest);
        interface.initially_depends(unknown, &[command.external_controller]);
        interface.initially_depends(unknown, &[command.voltage_command]);
    }
    for unknown in [outputs.force, outputs.lateral_force, outputs.current] {
        interface.initially_depends(unknown, &[command.transient_voltage]);
    }
    interface.initially_depends(outputs.voltage, &[gap_rate]);
    interface.initially_depends(outputs.lateral_force, &[lateral_offset, parameters.pole_width]);
    interface.initially_depends(outputs.lateral_force, &[parameters.lateral_guidance]);
    interface.initially_depends(y1, &[gap, parameters.nominal_gap]);
    interface.initially_depends(y2, &[gap_rate]);
    interface.initially_depends(y4, &[gap_rate]);
    interface.initially_depends(y5, &[gap, gap_rate, parameters.nominal_gap, parameters.filter[4]]);
    for unknown in [y1, y2, y4, y5] {
        interface.initially_depends(unknown, &[command.external_controller]);
    }
    depend_on_conditions(interface, inputs, outputs, parameters, conditions);
    interface.initially_depends(derived.inductance, &parameters.of_coil()[..3]);
    for unknown in [derived.current_stiffness, derived.gap_stiffness, derived.nominal_force] {
        interface.initially_depends(unknown, &parameters.of_coil());
    }
}

/// Dependencies on the lateral offset, which moves force and current with lift loss only.
pub(crate) fn depend_on_offset(
    interface: &mut Interface,
    inputs: &InputHandles,
    outputs: &OutputHandles,
    parameters: &ParameterHandles,
    lift: &LiftHandles,
) {
    let InputHandles { gap, lateral_offset, .. } = *inputs;
    interface.depends(outputs.force, &[lateral_offset]);
    interface.depends(outputs.current, &[lateral_offset]);
    interface.depends(lift.lost_lift, &[gap, lateral_offset]);
    let shape = [parameters.pole_width.into(), parameters.lateral_guidance.into()];
    let law: Vec<VariableRow> = [&shape[..], &[lift.lift_loss.into()]].concat();
    for unknown in [outputs.force, outputs.lateral_force, outputs.current, outputs.voltage] {
        interface.initially_depends(unknown, &[lateral_offset]);
        interface.initially_depends(unknown, &law);
    }
    interface.initially_depends(lift.lost_lift, &[gap, lateral_offset]);
    interface.initially_depends(lift.lost_lift, &shape);
}

/// Dependencies at the start of what sensors, failures, lift-off and set-down add.
fn depend_on_conditions(
    interface: &mut Interface,
    inputs: &InputHandles,
    outputs: &OutputHandles,
    parameters: &ParameterHandles,
    conditions: &ConditionHandles,
) {
    let (of_readings, of_start) = (conditions.of_readings(), conditions.of_start());
    let ConditionHandles { measured_gap, measured_acceleration, reference_gap, .. } = *conditions;
    for unknown in [outputs.force, outputs.lateral_force, outputs.current, outputs.voltage]
        .into_iter()
        .chain(outputs.estimates)
    {
        interface.initially_depends(unknown, &of_readings);
        interface.initially_depends(unknown, &of_start);
    }
    for (reading, input) in
        [(measured_gap, inputs.gap), (measured_acceleration, inputs.acceleration)]
    {
        interface.initially_depends(reading, &[input]);
        interface.initially_depends(reading, &of_readings);
    }
    interface.initially_depends(reference_gap, &[inputs.gap, parameters.nominal_gap]);
    interface.initially_depends(reference_gap, &of_start);
}
