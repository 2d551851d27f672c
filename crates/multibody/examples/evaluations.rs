//! Nothing but evaluations of eq. 9, for counting what one does by a simulator of the processor:
//!
//! ```sh
//! cargo build --release -p multibody --example evaluations
//! for n in 5 105; do valgrind --tool=cachegrind --cache-sim=yes --cachegrind-out-file=/dev/null \
//!   --D1=49152,12,64 --LL=2097152,16,64 target/release/examples/evaluations 32 $n; done
//! ```
//!
//! The difference of two runs is free of what the start of the program and the model take.

use multibody::{Loads, VehicleModel, train};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut numbers = std::env::args().skip(1).map(|text| text.parse::<usize>());
    let (Some(cars), Some(evaluations)) = (numbers.next(), numbers.next()) else {
        return Err("usage: evaluations CARS EVALUATIONS".into());
    };
    let (cars, evaluations) = (cars?, evaluations?);
    let model = VehicleModel::new(&train::cars(cars))?;
    let mut ws = model.workspace();
    let mut state = model.initial_state();
    let flat = vec![0.0; model.counts().magnets];
    let loads = Loads { vertical: &flat, lateral: &flat };
    for _ in 0..evaluations {
        // another pose each time, so that nothing remembered is used
        state.bodies[0].position.z += 1e-12;
        model.accelerations(&state, &loads, &mut ws)?;
    }
    Ok(())
}
