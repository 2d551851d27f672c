//! The unit's parameters: their handles, and the magnet that their values describe.

use controller_variables::{filter, gains};
use fmi2_export::{BooleanVar, Interface, RealVar, UnitOfMeasure, Values, VariableRow};
use magnet::{
    Controller, Law, MagnetParameters, PowerLimits, Range, Sampling, filter_design_of_eq_4,
};

use crate::command::CommandHandles;
use crate::conditions::ConditionHandles;

/// Handles of the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ParameterHandles {
    turns: RealVar,
    pole_area: RealVar,
    resistance: RealVar,
    pub nominal_gap: RealVar,
    operating_current: RealVar,
    nonlinear: BooleanVar,
    /// k₁ … k₅.
    gains: [RealVar; 5],
    /// Gap cut-off and damping, velocity cut-off and damping, position cut-off.
    pub filter: [RealVar; 5],
    limit_voltage: BooleanVar,
    voltage: [RealVar; 2],
    limit_current: BooleanVar,
    current: [RealVar; 2],
    sample_time: RealVar,
    sample_delay: BooleanVar,
    pub lateral_guidance: BooleanVar,
    pub pole_width: RealVar,
    integration_step: RealVar,
}

impl ParameterHandles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let paper = MagnetParameters::default();
        let [turns, pole_area, resistance, nominal_gap, operating_current] =
            declare_coil(interface, &paper);
        let nonlinear = interface
            .boolean("nonlinear")
            .parameter(false)
            .description(
                "Force and coil by the nonlinear law, about the current that carries the static \
                 force, instead of the linear one about operating_current",
            )
            .done();
        let gains = gains::declare(interface, &paper.control.gains);
        let filter = filter::declare(interface, &filter_design_of_eq_4());
        let (limit_voltage, voltage) = declare_limit(
            interface,
            "voltage",
            UnitOfMeasure::VOLT,
            Range { min: -200.0, max: 200.0 },
        );
        let (limit_current, current) = declare_limit(
            interface,
            "current",
            UnitOfMeasure::AMPERE,
            Range { min: 0.0, max: 60.0 },
        );
        let sample_time = interface
            .real("sample_time")
            .parameter(0.0)
            .unit(UnitOfMeasure::SECOND)
            .display("ms")
            .min(0.0)
            .description(
                "Sample time of the controller, counted from initialization, its voltage held in \
                 between; 0 means a continuous controller",
            )
            .done();
        let sample_delay = interface
            .boolean("sample_delay")
            .parameter(false)
            .description("A sampled controller applies each voltage one sample later")
            .done();
        let (lateral_guidance, pole_width) = declare_lateral(interface, &paper);
        let integration_step = interface
            .real("integration_step")
            .parameter(paper.integration_step)
            .unit(UnitOfMeasure::SECOND)
            .display("ms")
            .min(0.0)
            .description(
                "Longest step of the fourth-order integration used with the nonlinear law, limits \
                 or a sampled controller; the linear continuous case is integrated exactly",
            )
            .done();
        Self {
            turns,
            pole_area,
            resistance,
            nominal_gap,
            operating_current,
            nonlinear,
            gains,
            filter,
            limit_voltage,
            voltage,
            limit_current,
            current,
            sample_time,
            sample_delay,
            lateral_guidance,
            pole_width,
            integration_step,
        }
    }

    /// The parameters of the physics, from the values of the variables.
    pub(crate) fn read(
        &self,
        values: &Values,
        command: &CommandHandles,
        conditions: &ConditionHandles,
        salt: u64,
    ) -> Result<MagnetParameters, magnet::Error> {
        let range = |on: BooleanVar, [min, max]: [RealVar; 2]| {
            let range = Range { min: values.real(min), max: values.real(max) };
            values.boolean(on).then_some(range)
        };
        let period = values.real(self.sample_time);
        let samples = values.integer(conditions.delay_samples).unsigned_abs() as usize;
        let delay = samples.max(usize::from(values.boolean(self.sample_delay)));
        Ok(MagnetParameters {
            turns: values.real(self.turns),
            pole_area: values.real(self.pole_area),
            resistance: values.real(self.resistance),
            nominal_gap: values.real(self.nominal_gap),
            operating_current: values.real(self.operating_current),
            law: if values.boolean(self.nonlinear) { Law::Nonlinear } else { Law::Linear },
            control: Controller {
                gains: gains::read(values, &self.gains),
                sampling: Sampling::if_any(period, delay)?,
            },
            external_controller: values.boolean(command.external_controller),
            filter: filter::read(values, &self.filter),
            limits: PowerLimits {
                voltage: range(self.limit_voltage, self.voltage),
                current: range(self.limit_current, self.current),
            },
            pole_width: values
                .boolean(self.lateral_guidance)
                .then_some(values.real(self.pole_width)),
            lift_loss: false,
            integration_step: values.real(self.integration_step),
            conditions: conditions.read(values, salt)?,
        })
    }

    /// Parameters that determine the constants of force and coil.
    pub(crate) fn of_coil(&self) -> [VariableRow; 4] {
        [self.turns, self.pole_area, self.nominal_gap, self.operating_current]
            .map(VariableRow::from)
    }

    /// Parameters that determine current and voltage at rest.
    pub(crate) fn of_controller(&self) -> Vec<VariableRow> {
        let mut rows = self.of_coil().to_vec();
        rows.extend([self.resistance, self.filter[4], self.sample_time].map(VariableRow::from));
        rows.extend(self.gains[1..].iter().map(|&gain| VariableRow::from(gain)));
        rows.extend(
            self.voltage.iter().chain(&self.current).map(|&limit| VariableRow::from(limit)),
        );
        rows.extend(
            [self.nonlinear, self.limit_voltage, self.limit_current].map(VariableRow::from),
        );
        rows
    }
}

fn declare_coil(interface: &mut Interface, paper: &MagnetParameters) -> [RealVar; 5] {
    let mut coil = |name: &'static str, start: f64, unit: UnitOfMeasure, text: &'static str| {
        let variable = interface.real(name).parameter(start).unit(unit).min(0.0);
        // a larger one is in millimetres
        let variable = if name == "nominal_gap" { variable.max(0.1) } else { variable };
        variable.description(text).done()
    };
    [
        coil("turns", paper.turns, UnitOfMeasure::ONE, "Number of turns N of the coil"),
        coil("pole_area", paper.pole_area, UnitOfMeasure::SQUARE_METRE, "Area A of one pole face"),
        coil("resistance", paper.resistance, UnitOfMeasure::OHM, "Resistance R of the coil"),
        coil("nominal_gap", paper.nominal_gap, UnitOfMeasure::METRE, "Nominal gap c0"),
        coil(
            "operating_current",
            paper.operating_current,
            UnitOfMeasure::AMPERE,
            "Current i0 about which the linear law is taken",
        ),
    ]
}

fn declare_limit(
    interface: &mut Interface,
    quantity: &str,
    unit: UnitOfMeasure,
    range: Range,
) -> (BooleanVar, [RealVar; 2]) {
    let on = interface
        .boolean(format!("limit_{quantity}"))
        .tunable(false)
        .description(format!("Limits the coil's {quantity} to {quantity}_min ... {quantity}_max"))
        .done();
    let mut bound = |side: &str, word: &str, start: f64| {
        interface
            .real(format!("{quantity}_{side}"))
            .tunable(start)
            .unit(unit)
            .description(format!("{word} limit of the coil's {quantity}"))
            .done()
    };
    (on, [bound("min", "Lower", range.min), bound("max", "Upper", range.max)])
}

fn declare_lateral(interface: &mut Interface, paper: &MagnetParameters) -> (BooleanVar, RealVar) {
    let on = interface
        .boolean("lateral_guidance")
        .parameter(paper.pole_width.is_some())
        .description("A magnet displaced sideways is pulled back under its rail")
        .done();
    let width = interface
        .real("pole_width")
        .parameter(paper.pole_width.unwrap_or(0.028))
        .unit(UnitOfMeasure::METRE)
        .display("mm")
        .min(0.0)
        .description("Width of one pole, for the lateral force")
        .done();
    (on, width)
}
