//! Dependencies of the outputs, in initialization mode and afterwards.

use fmi2_export::{Interface, VariableRow};
use multibody::{ComponentIndex, MagnetIndex, ObservedIndex, VehicleModel};

use crate::adjustments::Adjustments;
use crate::contact::ContactHandles;
use crate::external::ExternalHandles;
use crate::journey::JourneyHandles;
use crate::line::LineHandles;
use crate::motors::MotorHandles;
use crate::table::{InputHandles, OutputHandles, ParameterHandles, SidewaysHandles};

/// Handles of all variables that depend on others, or others on them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Handles<'a> {
    pub inputs: &'a InputHandles,
    pub outputs: &'a OutputHandles,
    pub parameters: &'a ParameterHandles,
    pub contact: &'a ContactHandles,
    pub external: &'a ExternalHandles,
    pub journey: &'a JourneyHandles,
    pub sideways: &'a SidewaysHandles,
    pub line: Option<&'a LineHandles>,
    pub motors: Option<&'a MotorHandles>,
    pub adjustments: &'a Adjustments,
}

/// Declares the direct dependencies of outputs on inputs.
pub(crate) fn depend(interface: &mut Interface, model: &VehicleModel, handles: &Handles) {
    let Handles { inputs, outputs, parameters, contact, external, .. } = *handles;
    let Handles { journey, sideways, adjustments, motors, .. } = *handles;
    interface.depends_elementwise(outputs.gap, inputs.track_displacement);
    interface.depends_elementwise(outputs.gap_rate, inputs.track_rate);
    let magnets = model.counts().magnets;
    // forces act directly only on bodies joined to their magnet: force elements do not transmit
    // accelerations; so do those of stops and skids, which depend on the track
    let forces_on = |component: Option<ComponentIndex>| -> Vec<VariableRow> {
        let bodies = external.bodies().enumerate();
        let pushed = bodies
            .filter(|(k, _)| model.observed_component(ObservedIndex(*k)) == component)
            .flat_map(|(_, inputs)| inputs.iter().map(|input| input.row()));
        (0..magnets)
            .filter(|&k| Some(model.magnet_component(MagnetIndex(k))) == component)
            .flat_map(|k| {
                let rail = [inputs.track_displacement, inputs.track_rate, sideways.rate];
                [inputs.force, inputs.lateral_force]
                    .into_iter()
                    .chain(rail)
                    .map(move |input| input.get(k).row())
            })
            .chain(pushed)
            .chain(motors.into_iter().flat_map(|it| it.acting_on(model, component)))
            .collect()
    };
    let track = inputs.track_displacement.row();
    // what the static equilibrium depends on
    let side = sideways.displacement.row();
    let mut rest = vec![track, side, sideways.lift_loss.row()];
    rest.extend([parameters.lateral_guidance.row(), parameters.pole_width.row()]);
    rest.extend(contact.rows());
    // on skids, it may not move along the track
    rest.extend(journey.speed_rows());
    rest.extend(external.rows());
    rest.extend(adjustments.rows());
    if handles.line.is_some() {
        rest.push(parameters.initial_position.row());
    }
    let rest_and = |more: &[VariableRow]| -> Vec<VariableRow> { [&rest[..], more].concat() };
    for k in 0..magnets {
        let forces = forces_on(Some(model.magnet_component(MagnetIndex(k))));
        interface.depends(outputs.acceleration.get(k), &forces);
        interface.initially_depends(outputs.acceleration.get(k), &rest_and(&forces));
    }
    for (k, body) in outputs.observed.iter().enumerate() {
        let forces = forces_on(model.observed_component(ObservedIndex(k)));
        for row in body.accelerations() {
            interface.depends(row, &forces);
            interface.initially_depends(row, &rest_and(&forces));
        }
        for row in body.places() {
            interface.independent(row);
            interface.initially_depends(row, &rest);
        }
    }
    interface.depends_elementwise(contact.force, inputs.track_displacement);
    interface.depends_elementwise(contact.force, inputs.track_rate);
    interface.initially_depends(contact.force, &rest_and(&[inputs.track_rate.row()]));
    // the initial pose is the equilibrium below the whole track, at rest
    interface.initially_depends(outputs.gap, &rest);
    interface.depends_elementwise(outputs.lateral_offset, sideways.displacement);
    interface.initially_depends(outputs.lateral_offset, &rest);
    for row in [outputs.static_load.row(), outputs.joint_opening.row()] {
        interface.independent(row);
        interface.initially_depends(row, &rest);
    }
    interface.initially_depends(adjustments.mass(), &adjustments.rows().collect::<Vec<_>>());
    for output in handles.line.into_iter().flat_map(LineHandles::rows) {
        interface.independent(output);
        interface.initially_depends(output, &[parameters.initial_position.row()]);
    }
    interface.independent(outputs.position);
    interface.initially_depends(outputs.position, &rest_and(&[parameters.initial_position.row()]));
    if let Some(motors) = motors {
        motors.depend(interface, &rest, &journey.speed_rows());
        let place = [parameters.initial_position.row()];
        interface.initially_depends(motors.position(), &rest_and(&place));
    }
    interface.independent(outputs.speed);
    for row in [outputs.joint_opening_rate, outputs.kinetic_energy] {
        interface.independent(row);
    }
    if handles.line.is_some() {
        // in a curve, bodies move relative to the frame, and in a transition relative to the rails
        interface.initially_depends(outputs.gap_rate, &rest_and(&[inputs.track_rate.row()]));
        for row in [outputs.speed, outputs.joint_opening_rate, outputs.kinetic_energy] {
            interface.initially_depends(row, &rest);
        }
        return;
    }
    interface.initially_depends_elementwise(outputs.gap_rate, inputs.track_rate);
    interface.initially_depends(outputs.speed, &journey.speed_rows());
    for row in [outputs.joint_opening_rate, outputs.kinetic_energy] {
        interface.initially_independent(row);
    }
}
