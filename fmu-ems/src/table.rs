//! The unit's variables, declared once: inputs, outputs, parameters, and what depends on what.

use fmi2_export::{BooleanVar, Info, Interface, RealVar, Row, Unit, Values};
use magnet::{
    Control, FilterDesign, Gains, Law, Limits, Parameters, Range, Sampling, filter_design_of_eq_4,
};

/// What the unit says of itself.
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
pub(crate) struct Inputs {
    pub gap: RealVar,
    pub gap_rate: RealVar,
    pub acceleration: RealVar,
    pub lateral_offset: RealVar,
    pub static_force: RealVar,
}

/// Handles of the outputs.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Outputs {
    pub force: RealVar,
    pub lateral_force: RealVar,
    pub current: RealVar,
    pub voltage: RealVar,
    /// In eq. 5's order.
    pub estimates: [RealVar; 5],
}

/// Handles of the constants that follow from the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Derived {
    pub inductance: RealVar,
    pub current_stiffness: RealVar,
    pub gap_stiffness: RealVar,
    pub nominal_force: RealVar,
}

/// Handles of the parameters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Handles {
    turns: RealVar,
    pole_area: RealVar,
    resistance: RealVar,
    nominal_gap: RealVar,
    operating_current: RealVar,
    nonlinear: BooleanVar,
    /// k₁ … k₅.
    gains: [RealVar; 5],
    /// Gap cut-off and damping, velocity cut-off and damping, position cut-off.
    filter: [RealVar; 5],
    limit_voltage: BooleanVar,
    voltage: [RealVar; 2],
    limit_current: BooleanVar,
    current: [RealVar; 2],
    sample_time: RealVar,
    sample_delay: BooleanVar,
    lateral_guidance: BooleanVar,
    pole_width: RealVar,
    integration_step: RealVar,
}

impl Inputs {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        Self {
            gap: interface
                .real("gap")
                .input(0.008)
                .unit(Unit::METRE)
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
                .unit(Unit::METRE_PER_SECOND)
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
                .unit(Unit::METRE_PER_SECOND_SQUARED)
                .description("Inertial acceleration of the magnet, positive downward")
                .done(),
            lateral_offset: interface
                .real("lateral_offset")
                .input(0.0)
                .unit(Unit::METRE)
                .display("mm")
                .nominal(0.001)
                .description("Displacement of the magnet to the left of its rail")
                .done(),
            static_force: interface
                .real("static_force")
                .input(LOAD)
                .unit(Unit::NEWTON)
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

impl Outputs {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        // with the order up to which its time derivatives are on offer
        let mut output =
            |name: &'static str, order, unit: Unit, nominal: f64, text: &'static str| {
                let output = interface.real(name).output().derivatives(order);
                output.unit(unit).nominal(nominal).description(text).done()
            };
        let force = output(
            "force",
            2,
            Unit::NEWTON,
            5000.0,
            "Levitation force, attraction to the rail positive",
        );
        let lateral_force = output(
            "lateral_force",
            0,
            Unit::NEWTON,
            100.0,
            "Lateral force on the magnet, positive to the left; it restores",
        );
        let current =
            output("current", 1, Unit::AMPERE, 10.0, "Coil current, operating point included");
        let voltage = output(
            "voltage",
            1,
            Unit::VOLT,
            10.0,
            "Voltage applied by the controller, operating point included, within the voltage limits",
        );
        let mut estimate = |name, text| output(name, 1, Unit::ONE, 0.1, text);
        let estimates = [
            estimate("estimate_gap", "Estimate y1 of eq. 5: 250/m times the gap's deviation"),
            estimate("estimate_gap_velocity", "Estimate y2 of eq. 5: 2.5 s/m times the gap's rate"),
            estimate(
                "estimate_acceleration",
                "Estimate y3 of eq. 5: 0.25 s2/m times the magnet's acceleration, positive downward",
            ),
            estimate(
                "estimate_velocity",
                "Estimate y4 of eq. 5: 2.5 s/m times the magnet's velocity, positive downward",
            ),
            estimate(
                "estimate_position",
                "Estimate y5 of eq. 5: 250/m times the magnet's position, positive downward",
            ),
        ];
        Self { force, lateral_force, current, voltage, estimates }
    }
}

impl Derived {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let mut derived = |name: &'static str, unit: Unit, text: &'static str| {
            interface.real(name).calculated_parameter().unit(unit).description(text).done()
        };
        Self {
            inductance: derived("inductance", Unit::HENRY, "Inductance L0 at the nominal gap"),
            current_stiffness: derived(
                "current_stiffness",
                Unit::NEWTON_PER_AMPERE,
                "Force per current ki at the operating current and the nominal gap",
            ),
            gap_stiffness: derived(
                "gap_stiffness",
                Unit::NEWTON_PER_METRE,
                "Loss of force per gap kc at the operating current and the nominal gap",
            ),
            nominal_force: derived(
                "nominal_force",
                Unit::NEWTON,
                "Force F0 of the nonlinear law at the operating current and the nominal gap",
            ),
        }
    }
}

impl Handles {
    pub(crate) fn declare(interface: &mut Interface) -> Self {
        let paper = Parameters::default();
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
        let gains = declare_gains(interface, &paper.control.gains);
        let filter = declare_filter(interface, &filter_design_of_eq_4());
        let (limit_voltage, voltage) =
            declare_limit(interface, "voltage", Unit::VOLT, Range { min: -200.0, max: 200.0 });
        let (limit_current, current) =
            declare_limit(interface, "current", Unit::AMPERE, Range { min: 0.0, max: 60.0 });
        let sample_time = interface
            .real("sample_time")
            .parameter(0.0)
            .unit(Unit::SECOND)
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
            .unit(Unit::SECOND)
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

    /// The physics' parameters out of the variables' values.
    pub(crate) fn read(&self, values: &Values) -> Parameters {
        let [k1, k2, k3, k4, k5] = self.gains.map(|gain| values.real(gain));
        let [gap_cutoff, gap_damping, velocity_cutoff, velocity_damping, position_cutoff] =
            self.filter.map(|variable| values.real(variable));
        let range = |on: BooleanVar, [min, max]: [RealVar; 2]| {
            let range = Range { min: values.real(min), max: values.real(max) };
            values.boolean(on).then_some(range)
        };
        let period = values.real(self.sample_time);
        let delayed = values.boolean(self.sample_delay);
        Parameters {
            turns: values.real(self.turns),
            pole_area: values.real(self.pole_area),
            resistance: values.real(self.resistance),
            nominal_gap: values.real(self.nominal_gap),
            operating_current: values.real(self.operating_current),
            law: if values.boolean(self.nonlinear) { Law::Nonlinear } else { Law::Linear },
            control: Control {
                gains: Gains {
                    acceleration: k1,
                    velocity: k2,
                    position: k3,
                    gap_velocity: k4,
                    gap: k5,
                },
                sampling: (period != 0.0).then_some(Sampling { period, delayed }),
            },
            filter: FilterDesign {
                gap_cutoff,
                gap_damping,
                velocity_cutoff,
                velocity_damping,
                position_cutoff,
            },
            limits: Limits {
                voltage: range(self.limit_voltage, self.voltage),
                current: range(self.limit_current, self.current),
            },
            pole_width: values
                .boolean(self.lateral_guidance)
                .then_some(values.real(self.pole_width)),
            integration_step: values.real(self.integration_step),
        }
    }

    /// What the constants of force and coil follow from.
    fn of_coil(&self) -> [Row; 4] {
        [self.turns, self.pole_area, self.nominal_gap, self.operating_current].map(Row::from)
    }

    /// What current and voltage at rest follow from.
    fn of_controller(&self) -> Vec<Row> {
        let mut rows = self.of_coil().to_vec();
        rows.extend([self.resistance, self.filter[4], self.sample_time].map(Row::from));
        rows.extend(self.gains[1..].iter().map(|&gain| Row::from(gain)));
        rows.extend(self.voltage.iter().chain(&self.current).map(|&limit| Row::from(limit)));
        rows.extend([self.nonlinear, self.limit_voltage, self.limit_current].map(Row::from));
        rows
    }
}

fn declare_coil(interface: &mut Interface, paper: &Parameters) -> [RealVar; 5] {
    let mut coil = |name: &'static str, start: f64, unit: Unit, text: &'static str| {
        interface.real(name).parameter(start).unit(unit).min(0.0).description(text).done()
    };
    [
        coil("turns", paper.turns, Unit::ONE, "Number of turns N of the coil"),
        coil("pole_area", paper.pole_area, Unit::SQUARE_METRE, "Area A of one pole face"),
        coil("resistance", paper.resistance, Unit::OHM, "Resistance R of the coil"),
        coil("nominal_gap", paper.nominal_gap, Unit::METRE, "Nominal gap c0"),
        coil(
            "operating_current",
            paper.operating_current,
            Unit::AMPERE,
            "Current i0 about which the linear law is taken",
        ),
    ]
}

fn declare_gains(interface: &mut Interface, paper: &Gains) -> [RealVar; 5] {
    let mut gain = |name: &'static str, start: f64, text: &'static str| {
        interface.real(name).tunable(start).unit(Unit::VOLT).description(text).done()
    };
    [
        gain("gain_acceleration", paper.acceleration, "Gain k1 on the estimated acceleration y3"),
        gain("gain_velocity", paper.velocity, "Gain k2 on the estimated velocity y4"),
        gain("gain_position", paper.position, "Gain k3 on the estimated position y5"),
        gain("gain_gap_velocity", paper.gap_velocity, "Gain k4 on the estimated gap velocity y2"),
        gain("gain_gap", paper.gap, "Gain k5 on the estimated gap y1"),
    ]
}

fn declare_filter(interface: &mut Interface, paper: &FilterDesign) -> [RealVar; 5] {
    let mut design = |name: &'static str, start: f64, unit: Unit, text: &'static str| {
        interface.real(name).parameter(start).unit(unit).min(0.0).description(text).done()
    };
    let rate = Unit::RADIAN_PER_SECOND;
    [
        design(
            "filter_gap_cutoff",
            paper.gap_cutoff,
            rate,
            "Cut-off frequency of the low-pass on the gap (eq. 4: 1000 rad/s)",
        ),
        design(
            "filter_gap_damping",
            paper.gap_damping,
            Unit::ONE,
            "Damping ratio of the low-pass on the gap (eq. 4: 0.5)",
        ),
        design(
            "filter_velocity_cutoff",
            paper.velocity_cutoff,
            rate,
            "Frequency above which the velocity is integrated from the acceleration and below \
             which it is the gap's rate (eq. 4: 10 rad/s)",
        ),
        design(
            "filter_velocity_damping",
            paper.velocity_damping,
            Unit::ONE,
            "Damping ratio of the velocity filter (eq. 4: 0.5)",
        ),
        design(
            "filter_position_cutoff",
            paper.position_cutoff,
            rate,
            "Frequency above which the position is integrated from the velocity and below which it \
             is the gap (eq. 4: 10 rad/s)",
        ),
    ]
}

fn declare_limit(
    interface: &mut Interface,
    quantity: &str,
    unit: Unit,
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

fn declare_lateral(interface: &mut Interface, paper: &Parameters) -> (BooleanVar, RealVar) {
    let on = interface
        .boolean("lateral_guidance")
        .parameter(paper.pole_width.is_some())
        .description("A magnet displaced sideways is pulled back under its rail")
        .done();
    let width = interface
        .real("pole_width")
        .parameter(paper.pole_width.unwrap_or(0.028))
        .unit(Unit::METRE)
        .display("mm")
        .min(0.0)
        .description("Width of one pole, for the lateral force")
        .done();
    (on, width)
}

/// What depends on what. After initialization flux and filter are states, so only what is fed
/// through counts: there is no way from the acceleration to the force, and one from the gap only
/// while a current limit holds the current instead of the flux.
pub(crate) fn depend(
    interface: &mut Interface,
    inputs: &Inputs,
    outputs: &Outputs,
    derived: &Derived,
    parameters: &Handles,
) {
    let Inputs { gap, gap_rate, acceleration, lateral_offset, static_force } = *inputs;
    let [y1, y2, y3, y4, y5] = outputs.estimates;
    interface.depends(outputs.force, &[gap, static_force]);
    interface.depends(outputs.lateral_force, &[gap, lateral_offset, static_force]);
    interface.depends(outputs.voltage, &[acceleration]);
    interface.depends(y3, &[acceleration]);
    interface.depends(outputs.current, &[gap]);
    for unknown in [y1, y2, y4, y5] {
        interface.independent(unknown);
    }

    let at_rest = parameters.of_controller();
    for unknown in [outputs.force, outputs.lateral_force, outputs.current, outputs.voltage] {
        interface.initially_depends(unknown, &[gap, static_force]);
        interface.initially_depends(unknown, &at_rest);
    }
    interface.initially_depends(outputs.voltage, &[gap_rate]);
    interface.initially_depends(outputs.lateral_force, &[lateral_offset, parameters.pole_width]);
    interface.initially_depends(outputs.lateral_force, &[parameters.lateral_guidance]);
    interface.initially_depends(y1, &[gap, parameters.nominal_gap]);
    interface.initially_depends(y2, &[gap_rate]);
    interface.initially_independent(y3);
    interface.initially_depends(y4, &[gap_rate]);
    interface.initially_depends(y5, &[gap, gap_rate, parameters.nominal_gap, parameters.filter[4]]);
    interface.initially_depends(derived.inductance, &parameters.of_coil()[..3]);
    for unknown in [derived.current_stiffness, derived.gap_stiffness, derived.nominal_force] {
        interface.initially_depends(unknown, &parameters.of_coil());
    }
}
