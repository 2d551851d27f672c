//! The report `linear`: eqs 1-5 as a linear system about the operating point.

use fmi2_export::{Error, StateSpace};
use magnet::{Magnet, MagnetParameters, State};

use crate::{
    command::CommandHandles,
    table::{InputHandles, OutputHandles},
};

/// Largest offset, by the gap, at which lift loss is left out of the linearisation: force per offset and
/// lateral force per gap grow with the offset, from 0, and are then below 4·10⁻³ of the force by the width
/// of a pole.
const CENTRED: f64 = 1e-2;

/// x = (x₁ … x₅, Δλ), or Δλ alone with an external controller. Exact for the linear law; the
/// nonlinear one is linearised about its operating point. The voltage is an output and also an input:
/// what adds to it.
pub(crate) fn report(
    parameters: &MagnetParameters,
    state: &State,
    now: &magnet::MagnetInputs,
    inputs: &InputHandles,
    outputs: &OutputHandles,
    command: &CommandHandles,
) -> Result<String, Error> {
    if parameters.control.sampling.is_some() {
        return Err(Error::invalid(
            "a sampled controller has no linear differential equation; set sample_time to 0",
        ));
    }
    if parameters.conditions.sequence.is_some_and(|it| it.lift_off.is_some()) {
        return Err(Error::invalid(
            "a magnet that starts without current has no operating point about which it is linear; \
             set start_without_current to false",
        ));
    }
    if state.condition.has_failure() {
        return Err(Error::invalid(
            "a magnet with a failed supply or sensor has no resting operating point; set its \
             failures to false",
        ));
    }
    if parameters.lift_loss && now.lateral_offset.abs() > CENTRED * now.gap {
        return Err(Error::invalid(format!(
            "with lift_loss, the linearisation holds for a magnet below its rail: the lateral offset is {} m, \
             more than {CENTRED} of the gap",
            now.lateral_offset
        )));
    }
    let operating = MagnetParameters { operating_current: state.operating_current, ..*parameters };
    let magnet = Magnet::new(operating).map_err(|error| Error::caused(&error))?;
    let mut system = StateSpace::default();
    let gap = system.input(inputs.gap);
    let voltage = (system.input(outputs.voltage), system.output(outputs.voltage));
    let force_by_state = if parameters.external_controller {
        coil(&magnet, &mut system, gap, command, voltage)
    } else {
        controlled(&magnet, &mut system, gap, inputs, voltage)
    };
    let partials = magnet.partials(state, now).map_err(|error| Error::caused(&error))?;
    let values = magnet.outputs(state, now).map_err(|error| Error::caused(&error))?;
    // the lateral force is proportional to the levitation force
    let share = values.lateral_force / values.force;
    let static_force = system.input(inputs.static_force);
    let lateral_offset = system.input(inputs.lateral_offset);
    let force = system.output(outputs.force);
    let lateral = system.output(outputs.lateral_force);
    for (j, &by_state) in force_by_state.iter().enumerate() {
        system.c(force, j, by_state);
        system.c(lateral, j, share * by_state);
    }
    system.d(force, static_force, partials.force_by_static_force);
    system.d(lateral, static_force, partials.lateral_force_by_static_force);
    system.d(lateral, gap, partials.lateral_force_by_gap);
    system.d(lateral, lateral_offset, partials.lateral_force_by_offset);
    let current = system.output(outputs.current);
    // the flux is the last state
    system.c(current, force_by_state.len() - 1, 1.0 / magnet.electromagnet().inductance);
    system.d(current, gap, partials.current_by_gap);
    system.to_json()
}

/// States, A and B of eqs 1-5, and the voltage (its input and output); returns the force per state.
fn controlled(
    magnet: &Magnet,
    system: &mut StateSpace,
    gap: usize,
    inputs: &InputHandles,
    (added, voltage): (usize, usize),
) -> Vec<f64> {
    for name in ["x1", "x2", "x3", "x4", "x5", "flux_deviation"] {
        system.state(name);
    }
    let acceleration = system.input(inputs.acceleration);
    let linear = magnet.linear_system();
    for (i, (a, b)) in linear.a.iter().zip(&linear.b).enumerate() {
        for (j, &value) in a.iter().enumerate() {
            system.a(i, j, value);
        }
        system.b(i, gap, b[0]);
        system.b(i, acceleration, b[1]);
    }
    // the flux is the integral of the voltage
    let flux = linear.a.len() - 1;
    system.b(flux, added, 1.0);
    for (j, &by_state) in linear.a[flux][..flux].iter().enumerate() {
        system.c(voltage, j, by_state);
    }
    system.d(voltage, acceleration, linear.b[flux][1]);
    linear.force_by_state.to_vec()
}

/// State, A and B of eqs 1 and 2 alone, and the voltage; returns the force per state.
fn coil(
    magnet: &Magnet,
    system: &mut StateSpace,
    gap: usize,
    command: &CommandHandles,
    (added, voltage): (usize, usize),
) -> Vec<f64> {
    let linear = magnet.coil_system();
    let flux = system.state("flux_deviation");
    let commanded = system.input(command.voltage_command);
    system.a(flux, flux, linear.a);
    system.b(flux, gap, linear.b[0]);
    system.b(flux, commanded, linear.b[1]);
    system.b(flux, added, linear.b[1]);
    system.d(voltage, commanded, 1.0);
    vec![linear.force_by_flux]
}
