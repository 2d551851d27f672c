//! The report `linear`: modes with the magnets at their current positions.

use fmi2_export::{Error, StateSpace, Values};
use guideway::{Guideway, Load, State, Surface, Workspace};

use crate::table::{InputHandles, OutputHandles};

/// x = (q, q̇) of all modes. For moving magnets it is the system of the instant.
pub(crate) fn report(
    guideway: &Guideway,
    work: &mut Workspace,
    loads: &[Load],
    now: &[Surface],
    values: &Values,
    (inputs, outputs): (&InputHandles, &OutputHandles),
) -> Result<String, Error> {
    let speed = values.real(inputs.speed);
    let mut system = StateSpace::default();
    let modes = guideway.modes();
    for kind in ["mode", "rate of mode"] {
        for k in 1..=modes.len() {
            system.state(format!("{kind} {k}"));
        }
    }
    let force = system.inputs(inputs.force);
    let position = system.inputs(inputs.position);
    let speed_input = system.input(inputs.speed);
    for (i, mode) in modes.iter().enumerate() {
        let rate = modes.len() + i;
        system.a(i, rate, 1.0);
        system.a(rate, i, -mode.omega * mode.omega);
        system.a(rate, rate, -2.0 * mode.zeta * mode.omega);
    }
    let mut change = vec![0.0; modes.len()];
    for k in 0..loads.len() {
        for (input, by) in [(force + k, (1.0, 0.0)), (position + k, (0.0, 1.0))] {
            let changes = (0..loads.len()).map(|j| if j == k { by } else { (0.0, 0.0) });
            guideway.acceleration_change(work, loads, changes, &mut change);
            for (i, &value) in change.iter().enumerate() {
                system.b(modes.len() + i, input, value);
            }
        }
    }
    let displacement = system.outputs(outputs.displacement);
    let rate = system.outputs(outputs.rate);
    let middle = system.outputs(outputs.midspan_displacement);
    let quarter = system.outputs(outputs.quarter_displacement);
    for (k, surface) in now.iter().enumerate() {
        system.d(displacement + k, position + k, surface.slope());
        system.d(rate + k, position + k, surface.rate_slope(speed));
        system.d(rate + k, speed_input, surface.slope());
    }
    // what one mode alone shows
    let still = vec![0.0; modes.len()];
    let mut alone = State { q: still.clone(), v: still.clone() };
    for i in 0..modes.len() {
        alone.q[i] = 1.0;
        for (k, load) in loads.iter().enumerate() {
            let surface = guideway.surface(work, &alone, &still, load.position[0]);
            system.c(displacement + k, i, surface.u);
            system.c(rate + k, i, speed * surface.u_x);
            system.c(rate + k, modes.len() + i, surface.u);
        }
        for span in 0..guideway.spans().len() {
            let y = guideway.mid_span(work, &alone, &still, span);
            system.c(middle + span, i, y.displacement);
            let y = guideway.span_motion(work, &alone, &still, span, 0.25);
            system.c(quarter + span, i, y.displacement);
        }
        alone.q[i] = 0.0;
    }
    system.to_json()
}
