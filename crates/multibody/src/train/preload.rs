//! Load of the air springs that balances a car.

use super::description::TrainDescription;
use super::geometry::LINKS;

/// Air-spring preload along a car: level + slope·(x − centre), upward on the car, N.
pub(super) struct Preload {
    pub level: f64,
    pub slope: f64,
}

impl Preload {
    /// Balances a car body with equipment, tables and its halves of the couplers at the given ends
    /// (+1 front, −1 rear, 0 none), in weight and in pitching moment.
    pub fn of_car(train: &TrainDescription, couplers: [f64; 2]) -> Self {
        let masses = &train.masses;
        let half_coupler = (2 * LINKS) as f64 * masses.coupler_link / 2.0;
        let tables = 2 * (train.bogies_per_car + 1);
        let own = masses.car_body
            + train.bogies_per_car as f64 * masses.equipment
            + tables as f64 * masses.table;
        let mass = own + half_coupler * couplers.iter().map(|s: &f64| s.abs()).sum::<f64>();
        let moment =
            half_coupler * train.gravity * couplers.iter().sum::<f64>() * 0.5 * train.car_pitch();
        let springs = || {
            (0..train.bogies_per_car)
                .flat_map(|b| train.corners().map(|dx| train.bogie_offset(b) + dx))
                .flat_map(|x| train.corner_springs().map(move |dx| x + dx))
                .flat_map(|x| [x; 2])
        };
        Self {
            level: mass * train.gravity / springs().count() as f64,
            slope: moment / springs().map(|x| x * x).sum::<f64>(),
        }
    }

    /// Load of an air spring, to a millionth of a newton.
    pub fn at(&self, from_centre: f64) -> f64 {
        ((self.level + self.slope * from_centre) * 1e6).round() / 1e6
    }
}
