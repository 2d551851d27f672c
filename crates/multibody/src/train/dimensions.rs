//! Dimensions, masses and stiffnesses of the train, and the preload of its air springs.

pub(super) const GRAVITY: f64 = 9.81;
/// c0, table 2.
pub(super) const NOMINAL_GAP: f64 = 0.008;
/// Distance between the centres of neighbouring cars: 12 m long, 0.3 m apart.
pub(super) const CAR_PITCH: f64 = 12.3;
/// Lateral distance of magnets, side frames and tables from the middle.
pub(super) const HALF_GAUGE: f64 = 0.95;
pub(super) const BOGIE_PITCH: f64 = 3.0;
pub(super) const BOGIES: usize = 4;
pub(super) const MAGNET_PITCH: f64 = 0.7;
pub(super) const MAGNETS_PER_SIDE: usize = 4;
pub(super) const MAGNET_HEIGHT: f64 = -0.2;
pub(super) const CAR_BODY_MASS: f64 = 7700.0;
pub(super) const CAR_BODY_HEIGHT: f64 = 1.6;
pub(super) const EQUIPMENT_MASS: f64 = 600.0;
pub(super) const TABLE_MASS: f64 = 70.0;
pub(super) const TABLE_HEIGHT: f64 = 0.55;
pub(super) const SIDE_FRAME_MASS: f64 = 600.0;
pub(super) const MOTOR_MASS: f64 = 300.0;
pub(super) const BEAM_MASS: f64 = 50.0;
pub(super) const LINK_MASS: f64 = 40.0;
pub(super) const LINKS: usize = 5;
/// Height of the cabin floor, where ride comfort is measured.
pub(super) const FLOOR_HEIGHT: f64 = 1.0;
/// Half length of an anti-roll beam in y, and how much it slants in plan.
pub(super) const BEAM_HALF_SPAN: f64 = HALF_GAUGE - 0.2;
pub(super) const BEAM_SLANT_DEGREES: f64 = 8.0;

/// Table 1: air spring, (longitudinal, lateral, vertical).
pub(super) const AIR_STIFFNESS: [f64; 3] = [140e3, 140e3, 62e3];
pub(super) const AIR_DAMPING: [f64; 3] = [1300.0, 1300.0, 1600.0];
pub(super) const TRACTION_STIFFNESS: f64 = 4e5;
pub(super) const TRACTION_DAMPING: f64 = 4e3;
pub(super) const BEAM_END_STIFFNESS: f64 = 2e4;
pub(super) const BEAM_END_DAMPING: f64 = 60.0;
pub(super) const TABLE_STIFFNESS: f64 = 5e4;
pub(super) const TABLE_DAMPING: f64 = 2e3;
pub(super) const HINGE_STIFFNESS: f64 = 5e3;
pub(super) const HINGE_DAMPING: f64 = 100.0;
pub(super) const DRIVE_STIFFNESS: f64 = 1e5;
pub(super) const DRIVE_DAMPING: f64 = 2e4;

pub(super) const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];
pub(super) const X: [f64; 3] = [1.0, 0.0, 0.0];
pub(super) const Y: [f64; 3] = [0.0, 1.0, 0.0];
pub(super) const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Air-spring preload along a car: level + slope·(x − centre), upward on the car, N.
pub(super) struct Preload {
    pub level: f64,
    pub slope: f64,
}

impl Preload {
    /// Balances a car body with equipment, tables and its halves of the couplers at the given ends
    /// (+1 front, −1 rear, 0 none), in weight and in pitching moment.
    pub fn of_car(couplers: [f64; 2]) -> Self {
        let half_coupler = (2 * LINKS) as f64 * LINK_MASS / 2.0;
        let own = CAR_BODY_MASS + 4.0 * EQUIPMENT_MASS + 10.0 * TABLE_MASS;
        let mass = own + half_coupler * couplers.iter().map(|s: &f64| s.abs()).sum::<f64>();
        let moment = half_coupler * GRAVITY * couplers.iter().sum::<f64>() * 0.5 * CAR_PITCH;
        let springs = || {
            (0..BOGIES)
                .flat_map(|b| AIR_SPRING_ENDS.map(|dx| bogie_offset(b) + dx))
                .flat_map(|x| [x; 2])
        };
        Self {
            level: mass * GRAVITY / springs().count() as f64,
            slope: moment / springs().map(|x| x * x).sum::<f64>(),
        }
    }
}

/// Places of a bogie's air springs from its centre, front first.
pub(super) const AIR_SPRING_ENDS: [f64; 2] = [1.3, -1.3];

/// Place of bogie b (from 0, front first) from its car's centre.
pub(super) fn bogie_offset(b: usize) -> f64 {
    BOGIE_PITCH * (0.5 * (BOGIES as f64 - 1.0) - b as f64)
}
