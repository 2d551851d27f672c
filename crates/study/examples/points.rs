//! Computes the first points of a study in this process and prints what they cost.
//!
//! `cargo run --release -p study --example points -- STUDY.json [COUNT]`

#![allow(clippy::print_stdout, clippy::result_large_err, reason = "an example")]

use std::ops::ControlFlow;
use std::path::Path;
use std::time::{Duration, Instant};

use study::{Runner, Study};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("give the path of a study")?;
    let count = arguments.next().map_or(Ok(10), |text| text.parse::<u64>())?;
    let study = Study::load(Path::new(&path))?;
    let mut runner = Runner::new(&study)?;
    for reset in runner.prove_resets()? {
        println!(
            "{}: instances {} used again",
            reset.fmu.display(),
            if reset.renewed { "are" } else { "are not" }
        );
    }
    let begin = Instant::now();
    let mut steps = Duration::ZERO;
    let count = count.min(study.count());
    for number in 1..=count {
        let point = runner.compute(number, &mut |_| ControlFlow::Continue(()))?;
        steps += point.step_time;
        if number <= 5 {
            println!(
                "{number}: {:?} {:?} in {:?}",
                point.row.status, point.row.metrics, point.time
            );
        }
    }
    let (all, n) = (begin.elapsed(), f64::from(u32::try_from(count)?));
    println!("{count} points: {:?} a point, of which steps {:?}", all.div_f64(n), steps.div_f64(n));
    Ok(())
}
