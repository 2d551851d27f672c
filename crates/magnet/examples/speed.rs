//! Prints what a step of the magnet costs: `cargo run --release -p magnet --example speed`.
#![allow(clippy::print_stdout)]

use std::{hint::black_box, time::Instant};

use magnet::{
    Error, InputCourse, Law, Magnet, MagnetInputs, MagnetParameters, Sampling, Workspace,
};

const STEPS: u32 = 200_000;

fn main() -> Result<(), Error> {
    let nonlinear = MagnetParameters { law: Law::Nonlinear, ..MagnetParameters::default() };
    let mut sampled = MagnetParameters::default();
    sampled.control.sampling = Some(Sampling { period: 5e-4, delay: 0 });
    for (name, parameters) in [
        ("linear, exact", MagnetParameters::default()),
        ("nonlinear", nonlinear),
        ("sampled at 0.5 ms", sampled),
    ] {
        println!("{name}: {:.0} ns per step of 1 ms with its outputs", time(parameters)?);
    }
    Ok(())
}

fn time(parameters: MagnetParameters) -> Result<f64, Error> {
    let magnet = Magnet::new(parameters)?;
    let inputs = MagnetInputs { gap: 0.008, static_force: 5824.69, ..MagnetInputs::default() };
    let mut state = magnet.initialise(&inputs, 0.0)?;
    let mut workspace = Workspace::default();
    let begin = Instant::now();
    for n in 0..STEPS {
        let course = black_box(InputCourse {
            gap: [0.008, 0.01, 0.0, 0.0],
            acceleration: [0.1, 0.0, 0.0, 0.0],
            ..InputCourse::default()
        });
        magnet.step(&mut state, &course, f64::from(n) * 1e-3, 1e-3, &mut workspace)?;
        black_box(magnet.outputs(&state, &inputs)?);
    }
    Ok(begin.elapsed().as_secs_f64() * 1e9 / f64::from(STEPS))
}
