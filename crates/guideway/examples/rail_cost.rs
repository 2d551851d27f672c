//! What a step of 1 ms costs under 64 moving magnets, with what all of them meet afterwards:
//! `cargo run --release -p guideway --example rail_cost`

use std::error::Error;
use std::hint::black_box;
use std::io::Write;
use std::time::Instant;

use guideway::{Guideway, GuidewayDescription, Load, RailSurface, Workspace};

/// Nanoseconds of the fastest of many blocks, so that other programs disturb little.
fn cost(layout: &str) -> Result<(usize, f64), Box<dyn Error>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fmu-guideway/resources");
    let text = std::fs::read_to_string(format!("{folder}/{layout}/guideway.json"))?;
    let mut description = GuidewayDescription::from_json(&text)?;
    if let Some(rails) = &mut description.rails {
        rails.irregularity.on = true;
    }
    let guideway = Guideway::new(&description, None)?;
    let mut work = Workspace::new(&guideway);
    let loads: Vec<Load> = (0..64)
        .map(|k| Load {
            force: [5.8e3, 10.0, 0.0, 0.0],
            position: [25.0 + 0.4 * f64::from(k), 1.4, 0.0, 0.0],
            lateral: [50.0, 0.0, 0.0, 0.0],
            ..Load::default()
        })
        .collect();
    let mut state = guideway.initial_state(&mut work, &loads, 1.4, 0.0)?;
    let mut accelerations = vec![0.0; guideway.modes().len()];
    let mut seen = vec![RailSurface::default(); 64];
    let mut fastest = f64::INFINITY;
    for _ in 0..300 {
        let begin = Instant::now();
        for _ in 0..10 {
            guideway.step(&mut work, &mut state, &loads, 0.0, 1e-3)?;
            guideway.accelerations(&mut work, &state, &loads, 0.0, &mut accelerations);
            for (k, (surface, load)) in seen.iter_mut().zip(&loads).enumerate() {
                let x = load.position[0];
                *surface = guideway.rail(&mut work, &state, &accelerations, k, x);
            }
            black_box(&seen);
        }
        fastest = fastest.min(begin.elapsed().as_secs_f64() / 10.0 * 1e9);
    }
    Ok((guideway.modes().len() / guideway.spans().len(), fastest))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut out = std::io::stdout();
    let (_, line) = cost("three-spans")?;
    for layout in ["three-spans", "three-spans-3d"] {
        let (modes, fastest) = cost(layout)?;
        writeln!(
            out,
            "{layout}: {modes} modes a span, {fastest:.0} ns a step, {:.2} times",
            fastest / line
        )?;
    }
    Ok(())
}
