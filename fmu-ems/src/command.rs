//! The magnet without its controller: the switch, and the inputs that take the controller's place.

use fmi2_export::{BooleanVar, Interface, RealVar, UnitOfMeasure};

/// Handles of the switch and of its inputs. They are declared last, so that the value references of
/// all other variables stay what they were.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CommandHandles {
    pub external_controller: BooleanVar,
    pub voltage_command: RealVar,
    pub transient_voltage: RealVar,
}

impl CommandHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        Self {
            external_controller: interface
                .boolean("external_controller")
                .parameter(false)
                .description(
                    "Leaves the controller out: the voltage is the operating point's plus \
                     voltage_command. Gains and filter are then not used, the estimates are zero, \
                     and sample_time must be 0",
                )
                .done(),
            voltage_command: interface
                .real("voltage_command")
                .input(0.0)
                .takes(5)
                .unit(UnitOfMeasure::VOLT)
                .nominal(10.0)
                .description(
                    "Voltage beyond the operating point's that an external controller asks for: \
                     the left side of eq. 3. Used with external_controller only",
                )
                .done(),
            transient_voltage: interface
                .real("transient_voltage")
                .input(0.0)
                .unit(UnitOfMeasure::VOLT)
                .nominal(10.0)
                .description(
                    "Part of voltage_command at initialization that does not last, such as that \
                     of the gap's rate: the coil starts at the current of the rest. Used with \
                     external_controller only",
                )
                .done(),
        }
    }
}
