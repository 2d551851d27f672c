//! The report `linear`: eqs 1-5 as a linear system about the operating point.

use fmi2_export::{Error, StateSpace};
use magnet::{AsideSystem, Magnet, MagnetParameters, State};

use crate::{
    command::CommandHandles,
    table::{InputHandles, OutputHandles},
};

/// x = (x₁ … x₅, Δλ), or Δλ alone with an external controller. Exact for the linear law; the
/// nonlinear one is linearised about its operating point, and with lift loss about its state, at its lateral
/// offset. The voltage is an output and also an input: what adds to it.
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
    let operating = MagnetParameters { operating_current: state.operating_current, ..*parameters };
    let magnet = Magnet::new(operating).map_err(|error| Error::caused(&error))?;
    let mut system = StateSpace::default();
    let gap = system.input(inputs.gap);
    let voltage = (system.input(outputs.voltage), system.output(outputs.voltage));
    let aside = magnet.aside(state, now);
    let mut force_by_state = if parameters.external_controller {
        coil(&magnet, aside.as_ref(), &mut system, gap, command, voltage)
    } else {
        controlled(&magnet, aside.as_ref(), &mut system, gap, inputs, voltage)
    };
    let partials = magnet.partials(state, now).map_err(|error| Error::caused(&error))?;
    let values = magnet.outputs(state, now).map_err(|error| Error::caused(&error))?;
    // the lateral force is proportional to the levitation force
    let share = values.lateral_force / values.force;
    let static_force = system.input(inputs.static_force);
    let lateral_offset = system.input(inputs.lateral_offset);
    let force = system.output(outputs.force);
    let lateral = system.output(outputs.lateral_force);
    let current = system.output(outputs.current);
    // the flux is the last state
    let flux = force_by_state.len() - 1;
    let mut lateral_by_state: Vec<f64> = force_by_state.iter().map(|it| share * it).collect();
    let mut current_by_flux = 1.0 / magnet.electromagnet().inductance;
    if let Some(aside) = aside {
        force_by_state[flux] = aside.force_by_flux;
        lateral_by_state[flux] = aside.lateral_by_flux;
        current_by_flux = aside.current_by_flux;
        system.b(flux, lateral_offset, aside.by_place[1]);
        system.d(force, gap, partials.force_by_gap);
        system.d(force, lateral_offset, partials.force_by_offset);
        system.d(current, lateral_offset, partials.current_by_offset);
    }
    for (j, (&by_state, &sideways)) in force_by_state.iter().zip(&lateral_by_state).enumerate() {
        system.c(force, j, by_state);
        system.c(lateral, j, sideways);
    }
    system.d(force, static_force, partials.force_by_static_force);
    system.d(lateral, static_force, partials.lateral_force_by_static_force);
    system.d(lateral, gap, partials.lateral_force_by_gap);
    system.d(lateral, lateral_offset, partials.lateral_force_by_offset);
    system.c(current, flux, current_by_flux);
    system.d(current, gap, partials.current_by_gap);
    system.to_json()
}

/// States, A and B of eqs 1-5, and the voltage (its input and output); returns the force per state.
fn controlled(
    magnet: &Magnet,
    aside: Option<&AsideSystem>,
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
    // the flux is the integral of the voltage
    let flux = linear.a.len() - 1;
    for (i, (a, b)) in linear.a.iter().zip(&linear.b).enumerate() {
        let aside = aside.filter(|_| i == flux);
        for (j, &value) in a.iter().enumerate() {
            system.a(i, j, aside.filter(|_| j == flux).map_or(value, |aside| aside.by_flux));
        }
        system.b(i, gap, aside.map_or(b[0], |aside| aside.by_place[0]));
        system.b(i, acceleration, b[1]);
    }
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
    aside: Option<&AsideSystem>,
    system: &mut StateSpace,
    gap: usize,
    command: &CommandHandles,
    (added, voltage): (usize, usize),
) -> Vec<f64> {
    let linear = magnet.coil_system();
    let flux = system.state("flux_deviation");
    let commanded = system.input(command.voltage_command);
    system.a(flux, flux, aside.map_or(linear.a, |aside| aside.by_flux));
    system.b(flux, gap, aside.map_or(linear.b[0], |aside| aside.by_place[0]));
    system.b(flux, commanded, linear.b[1]);
    system.b(flux, added, linear.b[1]);
    system.d(voltage, commanded, 1.0);
    vec![linear.force_by_flux]
}
