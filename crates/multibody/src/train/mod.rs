//! Generated vehicles: trains by a few numbers ([`TrainDescription`]), one bogie, one magnet.
//!
//! The paper's table 1 gives counts, masses and air-spring data but not the connections. The
//! default train reproduces every count of the table for two cars (105 bodies, 25 bracket, 20
//! translational, 64 spherical and 12 revolute joints, 38,000 kg) without a redundant constraint;
//! geometry and stiffnesses beyond the table are plausible values of our own.
//!
//! Cars, bogies and stations are counted from the front, which is +x; magnets go car by car, bogie by
//! bogie, left side from front to back, then right side. x = 0 is the middle of the train.

mod builder;
mod check;
mod description;
mod geometry;
mod preload;
mod segments;

use builder::Builder;
pub(crate) use check::KEY;
pub use description::{
    AirSpring, AntiRollEnd, CouplerHinge, FlexibleBody, TableCentring, TractionRod,
    TrainDescription, TrainDimensions, TrainDrive, TrainMasses,
};
use geometry::Z;
use preload::Preload;

use crate::description::{Drive, GROUND, JointKind, Observed, VehicleDescription};
use crate::error::Error;

/// Names that [`by_name`] knows, besides `<n>-cars`.
pub const NAMES: [&str; 4] = ["two-car", "one-car", "one-bogie", "one-magnet"];

/// The vehicle of that name: one of [`NAMES`], or `<n>-cars` such as `8-cars`, up to 100.
#[must_use]
pub fn by_name(name: &str) -> Option<VehicleDescription> {
    match name {
        "two-car" => Some(two_car()),
        "one-car" => Some(one_car()),
        "one-bogie" => Some(one_bogie()),
        "one-magnet" => Some(one_magnet()),
        _ => {
            let cars = name.strip_suffix("-cars")?.parse().ok()?;
            TrainDescription { cars, ..TrainDescription::default() }.expand().ok()
        }
    }
}

/// The paper's vehicle.
#[must_use]
pub fn two_car() -> VehicleDescription {
    cars(2)
}

/// A single car: half of the paper's vehicle, without couplers.
#[must_use]
pub fn one_car() -> VehicleDescription {
    cars(1)
}

/// A train of n cars; n must be at least one to make a valid vehicle.
#[must_use]
pub fn cars(n: usize) -> VehicleDescription {
    TrainDescription { cars: n, ..TrainDescription::default() }.build()
}

impl TrainDescription {
    /// The train's bodies, joints and elements.
    ///
    /// # Errors
    /// Those of [`TrainDescription::check`].
    pub fn expand(&self) -> Result<VehicleDescription, Error> {
        self.check()?;
        Ok(self.build())
    }

    fn build(&self) -> VehicleDescription {
        let n = self.cars;
        let mut builder = Builder::new(self, "", "");
        builder.body("guideway", 1.0, [0.0, 0.0, -2.0], [0.3; 3]);
        if let Some(body) = builder.description.bodies.last_mut() {
            body.reference = true;
        }
        builder.joint("guideway", JointKind::Bracket, GROUND, "guideway", [0.0, 0.0, -2.0], None);
        // front car first
        for c in 0..n {
            builder.car(c);
            let couplers = [(c > 0, 1.0), (c + 1 < n, -1.0)];
            let ends = couplers.map(|(there, side)| f64::from(u8::from(there)) * side);
            let preload = Preload::of_car(self, ends);
            for b in 0..self.bogies_per_car {
                builder.bogie(c, b, self.car_centre(c), &preload);
            }
        }
        for c in 1..n {
            builder.coupler(c);
        }
        builder.groups();
        let mut description = builder.description;
        description.drive = Some(Drive {
            bodies: (1..=n).map(|c| format!("car_{c}")).collect(),
            stiffness: self.drive.stiffness,
            damping: self.drive.damping,
        });
        (description.name, description.description) = named(n, &description);
        description
    }
}

/// Name and description of a train of n cars.
fn named(n: usize, train: &VehicleDescription) -> (String, String) {
    let mass: f64 = train.bodies.iter().filter(|b| !b.reference).map(|b| b.mass).sum();
    let (mass, magnets) = (with_commas(mass), train.magnets.len());
    let (name, text) = match n {
        1 => (
            "one-car".to_owned(),
            format!("One car of the low-speed Maglev train: {mass} kg, {magnets} magnets"),
        ),
        2 => (
            "two-car".to_owned(),
            format!(
                "Two-car low-speed Maglev train: {} bodies, {mass} kg, {magnets} magnets",
                train.bodies.len()
            ),
        ),
        _ => (format!("{n}-cars"), format!("Maglev train of {n} cars")),
    };
    (name, text)
}

/// A number without its fraction, with a comma before each three digits.
fn with_commas(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// One bogie that carries a quarter of a car, guided vertically: 593.75 kg per magnet as in the
/// two-car train.
#[must_use]
pub fn one_bogie() -> VehicleDescription {
    let train = TrainDescription::default();
    let mut builder = Builder::new(
        &train,
        "one-bogie",
        "One bogie under a quarter of a car (2,750 kg) that moves only vertically: 8 magnets",
    );
    let carried = 11_000.0 / 4.0;
    let upper = [0.0, 0.0, train.dimensions.car_centre_height];
    builder.body("car_1", carried - 4.0 * train.masses.table, upper, [3.0, 2.7, 2.6]);
    builder.joint("guide", JointKind::Translational, GROUND, "car_1", upper, Some(Z));
    for k in 0..2 {
        builder.station(0, k, 1.5 - train.dimensions.bogie_pitch * k as f64, "car_1");
    }
    builder.description.observed.push(Observed {
        name: "car_1".to_owned(),
        body: "car_1".to_owned(),
        points: vec![[0.0, 0.0, train.dimensions.floor_height]],
        point_bodies: Vec::new(),
        parts: Vec::new(),
        levelled_by: vec!["bogie_1_1_air_spring_*".to_owned()],
    });
    let preload = Preload { level: carried * train.gravity / 4.0, slope: 0.0 };
    // the bogie is between stations 1 and 2, so 4.5 m ahead of its car's centre
    builder.bogie(0, 0, -4.5, &preload);
    builder.groups();
    builder.description
}

/// One magnet on a mass of 250 kg that moves only vertically.
#[must_use]
pub fn one_magnet() -> VehicleDescription {
    let train = TrainDescription::default();
    let text = "One magnet on 250 kg that move only vertically";
    let mut builder = Builder::new(&train, "one-magnet", text);
    builder.body("mass", 250.0, [0.0; 3], [0.7, 0.3, 0.2]);
    builder.joint("guide", JointKind::Translational, GROUND, "mass", [0.0; 3], Some(Z));
    builder.magnet("mass", [0.0; 3]);
    builder.description
}
