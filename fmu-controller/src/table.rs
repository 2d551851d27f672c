//! The unit's variables, declared once, and their dependencies.

use controller_variables::{estimates, filter, gains};
use fmi2_export::{Info, IntegerVar, Interface, RealVar, UnitOfMeasure, Values, VariableRow};
use magnet::{Controller, ControllerParameters, MAX_DELAY, Sampling};

/// Name, description and default experiment of the unit.
pub(crate) fn info() -> Info {
    Info::new("controller", "Controller of a levitation electromagnet")
        .description(
            "The voltage controller of one electromagnet of an EMS maglev vehicle, with its \
             dynamic filter: voltage from gap and acceleration, for the unit ems with \
             external_controller.",
        )
        .version(env!("CARGO_PKG_VERSION"))
        .author(env!("CARGO_PKG_AUTHORS"))
        .license(env!("CARGO_PKG_LICENSE"))
        .experiment(0.0, 10.0, 1e-3)
}

/// Handles of the inputs and outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Signals {
    pub gap: RealVar,
    pub gap_rate: RealVar,
    pub acceleration: RealVar,
    pub voltage: RealVar,
    pub held_voltage: RealVar,
    pub transient_voltage: RealVar,
    /// In eq. 5's order.
    pub estimates: [RealVar; 5],
}

/// Handles of the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ParameterHandles {
    nominal_gap: RealVar,
    gains: [RealVar; 5],
    filter: [RealVar; 5],
    sample_time: RealVar,
    delay_samples: IntegerVar,
}

impl Signals {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let gap = interface
            .real("gap")
            .input(0.008)
            .unit(UnitOfMeasure::METRE)
            .display("mm")
            .nominal(0.008)
            .description("Measured air gap between magnet and rail; grows as it opens")
            .done();
        let gap_rate = interface
            .real("gap_rate")
            .input(0.0)
            .unit(UnitOfMeasure::METRE_PER_SECOND)
            .display("mm/s")
            .nominal(0.01)
            .description(
                "Rate of the air gap, positive when it opens. It sets the filter's start and is not \
                 used afterwards",
            )
            .done();
        let acceleration = interface
            .real("acceleration")
            .input(0.0)
            .unit(UnitOfMeasure::METRE_PER_SECOND_SQUARED)
            .description("Measured inertial acceleration of the magnet, positive downward")
            .done();
        let voltage = interface
            .real("voltage")
            .output()
            .derivatives(1)
            .unit(UnitOfMeasure::VOLT)
            .nominal(10.0)
            .description(
                "Voltage beyond the magnet's operating point: the left side of eq. 3. Connect it to \
                 voltage_command of ems",
            )
            .done();
        let held_voltage = interface
            .real("held_voltage")
            .output()
            .discrete()
            .unit(UnitOfMeasure::VOLT)
            .nominal(10.0)
            .description(
                "The same voltage as a discrete signal, which masters hold over a step. Connect this \
                 one to voltage_command of ems if sample_time is a multiple of the communication \
                 step: put through a polynomial, the samples would come half a step late",
            )
            .done();
        let transient_voltage = interface
            .real("transient_voltage")
            .output()
            .derivatives(1)
            .unit(UnitOfMeasure::VOLT)
            .nominal(10.0)
            .description(
                "Part of the voltage at initialization that the gap's rate causes and that does not \
                 last; stays constant. Connect it to transient_voltage of ems",
            )
            .done();
        let estimates = estimates::declare(interface);
        Self { gap, gap_rate, acceleration, voltage, held_voltage, transient_voltage, estimates }
    }

    /// Declares the dependencies. After initialization the filter holds states, so only direct
    /// feed-through counts: that of the acceleration.
    pub(crate) fn depend(&self, interface: &mut Interface, parameters: &ParameterHandles) {
        let Self {
            gap,
            gap_rate,
            acceleration,
            voltage,
            held_voltage,
            transient_voltage,
            estimates,
        } = *self;
        let [y1, y2, y3, y4, y5] = estimates;
        let ParameterHandles { nominal_gap, gains, filter: [.., position_cutoff], .. } =
            *parameters;
        for unknown in [voltage, held_voltage] {
            interface.depends(unknown, &[acceleration]);
        }
        interface.depends(y3, &[acceleration]);
        for unknown in [transient_voltage, y1, y2, y4, y5] {
            interface.independent(unknown);
        }
        // all but the gain on the acceleration, which is estimated as zero at rest
        let [_, lasting @ ..] = gains;
        for unknown in [voltage, held_voltage] {
            interface.initially_depends(unknown, &lasting);
            interface.initially_depends(unknown, &[gap, gap_rate, nominal_gap, position_cutoff]);
        }
        interface.initially_depends(transient_voltage, &lasting[..3]);
        interface.initially_depends(transient_voltage, &[gap_rate, position_cutoff]);
        interface.initially_depends(y1, &[gap, nominal_gap]);
        interface.initially_depends(y2, &[gap_rate]);
        interface.initially_independent(y3);
        interface.initially_depends(y4, &[gap_rate]);
        interface.initially_depends::<VariableRow>(
            y5,
            &[gap.row(), gap_rate.row(), nominal_gap.row(), position_cutoff.row()],
        );
    }
}

impl ParameterHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let paper = ControllerParameters::default();
        Self {
            nominal_gap: interface
                .real("nominal_gap")
                .parameter(paper.nominal_gap)
                .unit(UnitOfMeasure::METRE)
                .min(0.0)
                .description("Nominal gap c0, the set point")
                .done(),
            gains: gains::declare(interface, &paper.control.gains),
            filter: filter::declare(interface, &paper.filter),
            sample_time: interface
                .real("sample_time")
                .parameter(0.0)
                .unit(UnitOfMeasure::SECOND)
                .display("ms")
                .min(0.0)
                .description(
                    "Sample time of the control law, counted from initialization, its voltage held \
                     in between; 0 means a continuous controller",
                )
                .done(),
            delay_samples: interface
                .integer("delay_samples")
                .parameter(0)
                .min(0)
                .max(MAX_DELAY as i32)
                .description("Samples after which a sampled controller applies a voltage")
                .done(),
        }
    }

    /// The parameters of the physics, from the values of the variables.
    pub(crate) fn read(&self, values: &Values) -> Result<ControllerParameters, magnet::Error> {
        let period = values.real(self.sample_time);
        let delay = usize::try_from(values.integer(self.delay_samples)).unwrap_or(0);
        Ok(ControllerParameters {
            nominal_gap: values.real(self.nominal_gap),
            control: Controller {
                gains: gains::read(values, &self.gains),
                sampling: Sampling::if_any(period, delay)?,
            },
            filter: filter::read(values, &self.filter),
        })
    }
}
