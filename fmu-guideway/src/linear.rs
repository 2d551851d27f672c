//! The report `linear`: modes with the magnets at their current positions.

use fmi2_export::{Error, Motions, RealVar, StateSpace, Values};
use guideway::{Guideway, Load, LoadChange, RailSurface, SpanMotion, State, Workspace};

use crate::points::PointHandles;
use crate::table::{InputHandles, OutputHandles};

/// A point whose motion is an output, with those of displacement, velocity and acceleration that are.
struct Observed {
    outputs: [Option<RealVar>; 3],
    /// Mode shapes there.
    shape: Vec<f64>,
}

/// x = (q, q̇) of all modes. For moving magnets it is the system of the instant. The chirp force, with
/// where it acts (m), is an input too, whether it is on or not: what adds to it. The external force acts there as well.
pub(crate) fn report(
    guideway: &Guideway,
    work: &mut Workspace,
    loads: &[Load],
    now: &[RailSurface],
    values: &Values,
    (inputs, outputs, points): (&InputHandles, &OutputHandles, &[PointHandles]),
    (chirp_force, chirp_position): (RealVar, f64),
) -> Result<String, Error> {
    let speed = values.real(inputs.speed);
    let mut system = StateSpace::default();
    let modes = guideway.modes().len();
    for kind in ["mode", "rate of mode"] {
        for (k, span) in guideway.spans().iter().enumerate() {
            let girder = &guideway.girders()[span.girder];
            for n in 0..girder.modes().len() {
                let (part, number) = girder.place_of(n);
                let kind = kind.replace("mode", &format!("{}mode", part.prefix()));
                system.state(format!("span {}, {kind} {number}", k + 1));
            }
        }
    }
    let force = system.inputs(inputs.force);
    let position = system.inputs(inputs.position);
    let speed_input = system.input(inputs.speed);
    let lateral = inputs.lateral.map(|row| system.inputs(row));
    // q̈ as entries (mode, column, value): columns of A, and of B
    let (mut of_state, mut of_input) = (Vec::new(), Vec::new());
    for span in guideway.spans() {
        let girder = &guideway.girders()[span.girder];
        for (n, mode) in girder.modes().iter().enumerate() {
            let i = span.first_mode + n;
            system.a(i, modes + i, 1.0);
            of_state.push((i, i, -mode.omega * mode.omega));
            for (other, rate) in girder.damping_rates(n) {
                of_state.push((span.first_mode + other, modes + i, rate));
            }
        }
    }
    let mut change = vec![0.0; modes];
    for k in 0..loads.len() {
        let none = LoadChange::default();
        let own = [
            Some((force + k, LoadChange { force: 1.0, ..none })),
            Some((position + k, LoadChange { place: 1.0, ..none })),
            lateral.map(|lateral| (lateral + k, LoadChange { lateral: 1.0, ..none })),
        ];
        for (input, by) in own.into_iter().flatten() {
            let changes = (0..loads.len()).map(|j| if j == k { by } else { none });
            guideway.acceleration_change(work, loads, changes, &mut change);
            of_input.extend(change.iter().enumerate().map(|(i, &value)| (i, input, value)));
        }
    }
    guideway.acceleration_under(work, chirp_position, 1.0, &mut change);
    for force in [Some(chirp_force), inputs.external].into_iter().flatten() {
        let input = system.input(force);
        of_input.extend(change.iter().enumerate().map(|(i, &value)| (i, input, value)));
    }
    for &(i, column, value) in &of_state {
        system.a(modes + i, column, value);
    }
    for &(i, input, value) in &of_input {
        system.b(modes + i, input, value);
    }
    let displacement = system.outputs(outputs.displacement);
    let rate = system.outputs(outputs.rate);
    let sideways = outputs.rails.map(|rails| {
        (system.outputs(rails.lateral_displacement), system.outputs(rails.lateral_rate))
    });
    for (k, rail) in now.iter().enumerate() {
        let vertical = Some((displacement, rate)).map(|rows| (rows, &rail.vertical));
        let lateral = sideways.map(|rows| (rows, &rail.lateral));
        for ((displacement, rate), surface) in vertical.into_iter().chain(lateral) {
            system.d(displacement + k, position + k, surface.slope());
            system.d(rate + k, position + k, surface.rate_slope(speed));
            system.d(rate + k, speed_input, surface.slope());
        }
    }
    // what one mode alone shows
    let still = vec![0.0; modes];
    let mut alone = State { q: still.clone(), v: still.clone() };
    for i in 0..modes {
        alone.q[i] = 1.0;
        for (k, load) in loads.iter().enumerate() {
            let rail = guideway.rail(work, &alone, &still, k, load.position[0]);
            let vertical = Some((displacement, rate)).map(|rows| (rows, rail.vertical));
            let lateral = sideways.map(|rows| (rows, rail.lateral));
            for ((displacement, rate), surface) in vertical.into_iter().chain(lateral) {
                system.c(displacement + k, i, surface.u);
                system.c(rate + k, i, speed * surface.u_x);
                system.c(rate + k, modes + i, surface.u);
            }
        }
        alone.q[i] = 0.0;
    }
    joints(guideway, work, outputs, &mut system);
    for point in observed(guideway, work, outputs, points) {
        let [displacement, velocity, acceleration] = point.outputs;
        if let Some(y) = displacement.map(|output| system.output(output)) {
            point.shape.iter().enumerate().for_each(|(i, &phi)| system.c(y, i, phi));
        }
        if let Some(y) = velocity.map(|output| system.output(output)) {
            point.shape.iter().enumerate().for_each(|(i, &phi)| system.c(y, modes + i, phi));
        }
        if let Some(y) = acceleration.map(|output| system.output(output)) {
            of_state.iter().for_each(|&(i, k, value)| system.c(y, k, point.shape[i] * value));
            of_input.iter().for_each(|&(i, k, value)| system.d(y, k, point.shape[i] * value));
        }
    }
    system.to_json()
}

/// Kinks and steps at joints.
fn joints(
    guideway: &Guideway,
    work: &mut Workspace,
    outputs: &OutputHandles,
    system: &mut StateSpace,
) {
    let Some(joints) = outputs.joints else { return };
    let still = vec![0.0; guideway.modes().len()];
    let mut alone = State { q: still.clone(), v: still };
    for k in 0..=guideway.spans().len() {
        let nothing = guideway.joint(work, &alone, k);
        let rows: Vec<usize> =
            joints.of(k, &nothing).map(|(output, _)| system.output(output)).collect();
        for i in 0..alone.q.len() {
            alone.q[i] = 1.0;
            let motion = guideway.joint(work, &alone, k);
            alone.q[i] = 0.0;
            for (&row, (_, value)) in rows.iter().zip(joints.of(k, &motion)) {
                system.c(row, i, value);
            }
        }
    }
}

/// Parts of a span whose deflection is in the report `motions`.
const EIGHTHS: usize = 8;

/// The report `motions`: the modal coordinates of every span, and its deflection at eighths of its length, with
/// lateral deflection and twist if it has them.
pub(crate) fn motions(guideway: &Guideway, work: &mut Workspace) -> Result<String, Error> {
    let mut motions = Motions::default();
    let still = vec![0.0; guideway.modes().len()];
    let mut alone = State { q: still.clone(), v: still.clone() };
    for (k, span) in guideway.spans().iter().enumerate() {
        let part = format!("span {}", k + 1);
        let modes = guideway.girders()[span.girder].modes().len();
        let girder = &guideway.girders()[span.girder];
        for n in 0..modes {
            let (kind, number) = girder.place_of(n);
            let name = format!("{}mode {number}", kind.prefix());
            let motion = motions.motion(part.as_str(), name, None, "");
            motions.by(motion, span.first_mode + n, 1.0);
        }
        let all = [("z", "m"), ("y", "m"), ("rx", "rad")];
        let components = if girder.is_spatial() { &all[..] } else { &all[..1] };
        for (component, (direction, unit)) in components.iter().enumerate() {
            for eighth in 0..=EIGHTHS {
                let at = eighth as f64 / EIGHTHS as f64;
                let motion = motions.motion(part.as_str(), *direction, Some(at), unit);
                for i in span.first_mode..span.first_mode + modes {
                    alone.q[i] = 1.0;
                    let x = at * girder.length();
                    let y = guideway.section_motion(work, &alone, &still, k, x)[component];
                    alone.q[i] = 0.0;
                    motions.by(motion, i, y.displacement);
                }
            }
        }
    }
    motions.to_json()
}

/// Middle and quarter of every span, and the named points.
fn observed(
    guideway: &Guideway,
    work: &mut Workspace,
    outputs: &OutputHandles,
    points: &[PointHandles],
) -> Vec<Observed> {
    let modes = guideway.modes().len();
    let still = vec![0.0; modes];
    let mut alone = State { q: still.clone(), v: still.clone() };
    let mut shape = |motion: &mut dyn FnMut(&State, &[f64]) -> SpanMotion| {
        let mut value = |i: usize| {
            alone.q[i] = 1.0;
            let y = motion(&alone, &still).displacement;
            alone.q[i] = 0.0;
            y
        };
        (0..modes).map(&mut value).collect::<Vec<f64>>()
    };
    let mut all = Vec::new();
    for k in 0..guideway.spans().len() {
        let motion = outputs.midspan(k);
        all.push(Observed {
            outputs: motion.map(Some),
            shape: shape(&mut |state, still| guideway.mid_span(work, state, still, k)),
        });
        all.push(Observed {
            outputs: [Some(outputs.quarter_displacement.get(k)), None, None],
            shape: shape(&mut |state, still| guideway.span_motion(work, state, still, k, 0.25)),
        });
    }
    for (row, component) in outputs.rails.iter().flat_map(|rails| rails.of_spans()) {
        for (k, span) in guideway.spans().iter().enumerate() {
            let x = 0.5 * guideway.girders()[span.girder].length();
            all.push(Observed {
                outputs: [Some(row.get(k)), None, None],
                shape: shape(&mut |state, still| {
                    guideway.section_motion(work, state, still, k, x)[component]
                }),
            });
        }
    }
    for (k, point) in points.iter().enumerate() {
        all.push(Observed {
            outputs: [point.displacement, point.velocity, point.acceleration].map(Some),
            shape: shape(&mut |state, still| guideway.point(work, state, still, k)),
        });
    }
    all
}
