//! Outputs at the layout's named points.

use fmi2_export::{Interface, RealVar, UnitOfMeasure, Values, VariableRow};
use guideway::{Guideway, SpanMotion};

use crate::table::InputHandles;

/// Motion of one named point.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointHandles {
    pub displacement: RealVar,
    pub velocity: RealVar,
    pub acceleration: RealVar,
}

impl PointHandles {
    pub(crate) fn declare(
        interface: &mut Interface,
        guideway: &Guideway,
        inputs: &InputHandles,
    ) -> Vec<Self> {
        let declare = |point: &guideway::TrackPoint| {
            let place = format!("x = {} m of span {}", point.x, point.span + 1);
            let mut output = |name: &str, order, unit, nominal, text: String| {
                interface
                    .real(format!("{}_{name}", point.name))
                    .output()
                    .derivatives(order)
                    .unit(unit)
                    .nominal(nominal)
                    .description(text)
                    .done()
            };
            let handles = Self {
                displacement: output(
                    "displacement",
                    2,
                    UnitOfMeasure::METRE,
                    1e-3,
                    format!("Deflection at {place}, up positive"),
                ),
                velocity: output(
                    "velocity",
                    1,
                    UnitOfMeasure::METRE_PER_SECOND,
                    1e-2,
                    format!("Velocity at {place}"),
                ),
                acceleration: output(
                    "acceleration",
                    0,
                    UnitOfMeasure::METRE_PER_SECOND_SQUARED,
                    1.0,
                    format!("Acceleration at {place}"),
                ),
            };
            interface.independent(handles.displacement);
            interface.independent(handles.velocity);
            let knowns: [VariableRow; 2] = [inputs.force.row(), inputs.position.row()];
            interface.depends(handles.acceleration, &knowns);
            handles
        };
        guideway.points().iter().map(declare).collect()
    }

    /// Sets the outputs.
    pub(crate) fn write(&self, motion: &SpanMotion, values: &mut Values) {
        values.set_real(self.displacement, motion.displacement);
        values.set_real(self.velocity, motion.velocity);
        values.set_real(self.acceleration, motion.acceleration);
    }

    /// How many times an output is the derivative of the displacement; `None` for another variable.
    pub(crate) fn order_of(&self, output: RealVar) -> Option<u32> {
        let all = [self.displacement, self.velocity, self.acceleration];
        all.iter().zip(0..).find_map(|(own, order)| {
            (own.value_reference() == output.value_reference()).then_some(order)
        })
    }
}
