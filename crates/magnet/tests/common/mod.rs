//! What several test programs share.
#![allow(dead_code)]

use magnet::{InputCourse, Magnet, MagnetInputs, MagnetParameters, State, Workspace};

/// Load per magnet of the paper's vehicle: 64 magnets carry 38 t.
pub const LOAD: f64 = 38_000.0 * 9.81 / 64.0;

pub fn paper() -> Magnet {
    Magnet::new(MagnetParameters::default()).unwrap()
}

pub fn nominal() -> MagnetInputs {
    MagnetInputs { gap: 0.008, static_force: LOAD, ..MagnetInputs::default() }
}

/// A lively course: 0.3 mm, 20 mm/s, 1 m/s², 0.5 V and derivatives that change them visibly in a few
/// ms. Only a magnet with an external controller uses the voltage.
pub fn lively() -> InputCourse {
    InputCourse {
        gap: [0.0083, 0.02, -3.0, 400.0],
        acceleration: [1.0, 300.0, -4e4, 3e6],
        voltage_command: [0.5, 300.0, -2e4, 1e6],
        ..InputCourse::default()
    }
}

/// The inputs that a course has after `time`.
pub fn at(course: &InputCourse, time: f64) -> MagnetInputs {
    let later = course.after(time);
    MagnetInputs {
        gap: later.gap[0],
        gap_rate: later.gap[1],
        acceleration: later.acceleration[0],
        voltage_command: later.voltage_command[0],
        ..nominal()
    }
}

pub fn vector(state: &State) -> [f64; 6] {
    let x = state.filter;
    [x[0], x[1], x[2], x[3], x[4], state.flux_deviation]
}

/// Largest deviation between two states, relative to the size of the first; filter states and
/// flux are of one magnitude.
pub fn distance(a: &State, b: &State) -> f64 {
    let (a, b) = (vector(a), vector(b));
    let scale = a.iter().fold(1e-3_f64, |m, v| m.max(v.abs()));
    a.iter().zip(&b).fold(0.0_f64, |m, (a, b)| m.max((a - b).abs())) / scale
}

pub fn stepped(
    magnet: &Magnet,
    start: &State,
    course: &InputCourse,
    time: f64,
    size: f64,
) -> State {
    let mut state = *start;
    magnet.step(&mut state, course, time, size, &mut Workspace::default()).unwrap();
    state
}
