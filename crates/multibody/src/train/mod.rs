//! Generated vehicles: trains of n cars, one bogie, one magnet.
//!
//! The paper's table 1 gives counts, masses and air-spring data but not the connections. The train
//! built here reproduces every count of the table for two cars (105 bodies, 25 bracket, 20
//! translational, 64 spherical and 12 revolute joints, 38,000 kg) without a redundant constraint;
//! geometry and stiffnesses beyond the table are plausible values of our own.
//!
//! Cars, bogies and stations are counted from the front, which is +x; magnets go car by car, bogie by
//! bogie, left side from front to back, then right side. x = 0 is the middle of the train.

mod builder;
mod dimensions;

use builder::Builder;
use dimensions::*;

use crate::description::{Drive, GROUND, JointKind, Observed, VehicleDescription};

/// Names that [`by_name`] knows, besides `<n>-cars`.
pub const NAMES: [&str; 4] = ["two-car", "one-car", "one-bogie", "one-magnet"];

/// The vehicle of that name: one of [`NAMES`], or `<n>-cars` such as `8-cars`.
#[must_use]
pub fn by_name(name: &str) -> Option<VehicleDescription> {
    match name {
        "two-car" => Some(two_car()),
        "one-car" => Some(one_car()),
        "one-bogie" => Some(one_bogie()),
        "one-magnet" => Some(one_magnet()),
        _ => name.strip_suffix("-cars")?.parse().ok().filter(|n| *n > 0).map(cars),
    }
}

/// The paper's vehicle.
#[must_use]
pub fn two_car() -> VehicleDescription {
    VehicleDescription {
        name: "two-car".to_owned(),
        description: "Two-car low-speed Maglev train: 105 bodies, 38,000 kg, 64 magnets".to_owned(),
        ..cars(2)
    }
}

/// A single car: half of the paper's vehicle, without couplers.
#[must_use]
pub fn one_car() -> VehicleDescription {
    VehicleDescription {
        name: "one-car".to_owned(),
        description: "One car of the low-speed Maglev train: 18,800 kg, 32 magnets".to_owned(),
        ..cars(1)
    }
}

/// A train of n cars; n must be at least one to make a valid vehicle.
#[must_use]
pub fn cars(n: usize) -> VehicleDescription {
    let mut builder = Builder::new(&format!("{n}-cars"), &format!("Maglev train of {n} cars"));
    builder.body("guideway", 1.0, [0.0, 0.0, -2.0], [0.3; 3]);
    if let Some(body) = builder.description.bodies.last_mut() {
        body.reference = true;
    }
    builder.joint("guideway", JointKind::Bracket, GROUND, "guideway", [0.0, 0.0, -2.0], None);
    // front car first
    let centre = |c: usize| (0.5 * (n as f64 - 1.0) - c as f64) * CAR_PITCH;
    for c in 0..n {
        builder.car(c, centre(c));
        let couplers = [(c > 0, 1.0), (c + 1 < n, -1.0)];
        let preload =
            Preload::of_car(couplers.map(|(there, side)| f64::from(u8::from(there)) * side));
        for b in 0..BOGIES {
            builder.bogie(c, b, centre(c), &preload);
        }
    }
    for c in 1..n {
        builder.coupler(c, 0.5 * (centre(c - 1) + centre(c)));
    }
    builder.description.drive = Some(Drive {
        bodies: (1..=n).map(|c| format!("car_{c}")).collect(),
        stiffness: DRIVE_STIFFNESS,
        damping: DRIVE_DAMPING,
    });
    builder.description
}

/// One bogie that carries a quarter of a car, guided vertically: 593.75 kg per magnet as in the
/// two-car train.
#[must_use]
pub fn one_bogie() -> VehicleDescription {
    let mut builder = Builder::new(
        "one-bogie",
        "One bogie under a quarter of a car (2,750 kg) that moves only vertically: 8 magnets",
    );
    let carried = 11_000.0 / 4.0;
    let upper = [0.0, 0.0, CAR_BODY_HEIGHT];
    builder.body("car_1", carried - 4.0 * TABLE_MASS, upper, [3.0, 2.7, 2.6]);
    builder.joint("guide", JointKind::Translational, GROUND, "car_1", upper, Some(Z));
    for k in 0..2 {
        builder.station(0, k, 1.5 - BOGIE_PITCH * k as f64);
    }
    builder.description.observed.push(Observed {
        name: "car_1".to_owned(),
        body: "car_1".to_owned(),
        points: vec![[0.0, 0.0, FLOOR_HEIGHT]],
    });
    let preload = Preload { level: carried * GRAVITY / 4.0, slope: 0.0 };
    // the bogie is between stations 1 and 2, so 4.5 m ahead of its car's centre
    builder.bogie(0, 0, -4.5, &preload);
    builder.description
}

/// One magnet on a mass of 250 kg that moves only vertically.
#[must_use]
pub fn one_magnet() -> VehicleDescription {
    let mut builder = Builder::new("one-magnet", "One magnet on 250 kg that move only vertically");
    builder.body("mass", 250.0, [0.0; 3], [0.7, 0.3, 0.2]);
    builder.joint("guide", JointKind::Translational, GROUND, "mass", [0.0; 3], Some(Z));
    builder.magnet("mass", [0.0; 3]);
    builder.description
}
