//! Vehicles made by rule: trains of n cars, one bogie, one magnet.
//!
//! The paper's table 1 gives counts, masses and air-spring data but not what is connected to what.
//! The train built here reproduces every count of the table for two cars (105 bodies, 25 bracket,
//! 20 translational, 64 spherical and 12 revolute joints, 38,000 kg) without a redundant
//! constraint; geometry and stiffnesses beyond the table are plausible values of our own.
//!
//! Cars, bogies and stations are counted from the front, which is +x; magnets go car by car, bogie by
//! bogie, left side from front to back, then right side. x = 0 is the middle of the train.

use crate::description::{
    Body, Bushing, Description, Drive, GROUND, Inertia, Joint, JointForce, JointKind, Magnet,
    Observed,
};

const GRAVITY: f64 = 9.81;
/// c0, table 2.
const NOMINAL_GAP: f64 = 0.008;
/// Distance between the centres of neighbouring cars: 12 m long, 0.3 m apart.
const CAR_PITCH: f64 = 12.3;
/// Lateral distance of magnets, side frames and tables from the middle.
const HALF_GAUGE: f64 = 0.95;
const BOGIE_PITCH: f64 = 3.0;
const BOGIES: usize = 4;
const MAGNET_PITCH: f64 = 0.7;
const MAGNETS_PER_SIDE: usize = 4;
const MAGNET_HEIGHT: f64 = -0.2;
const CAR_BODY_MASS: f64 = 7700.0;
const CAR_BODY_HEIGHT: f64 = 1.6;
const EQUIPMENT_MASS: f64 = 600.0;
const TABLE_MASS: f64 = 70.0;
const TABLE_HEIGHT: f64 = 0.55;
const SIDE_FRAME_MASS: f64 = 600.0;
const MOTOR_MASS: f64 = 300.0;
const BEAM_MASS: f64 = 50.0;
const LINK_MASS: f64 = 40.0;
const LINKS: usize = 5;
/// Height of the cabin floor, where ride comfort is measured.
const FLOOR_HEIGHT: f64 = 1.0;
/// Half length of an anti-roll beam in y, and how much it slants in plan.
const BEAM_HALF_SPAN: f64 = HALF_GAUGE - 0.2;
const BEAM_SLANT_DEGREES: f64 = 8.0;

/// Table 1: air spring, (longitudinal, lateral, vertical).
const AIR_STIFFNESS: [f64; 3] = [140e3, 140e3, 62e3];
const AIR_DAMPING: [f64; 3] = [1300.0, 1300.0, 1600.0];
const TRACTION_STIFFNESS: f64 = 4e5;
const TRACTION_DAMPING: f64 = 4e3;
const BEAM_END_STIFFNESS: f64 = 2e4;
const BEAM_END_DAMPING: f64 = 60.0;
const TABLE_STIFFNESS: f64 = 5e4;
const TABLE_DAMPING: f64 = 2e3;
const HINGE_STIFFNESS: f64 = 5e3;
const HINGE_DAMPING: f64 = 100.0;
const DRIVE_STIFFNESS: f64 = 1e5;
const DRIVE_DAMPING: f64 = 2e4;

const SIDES: [(&str, f64); 2] = [("left", 1.0), ("right", -1.0)];
const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

/// Names that [`by_name`] knows, besides `<n>-cars`.
pub const NAMES: [&str; 4] = ["two-car", "one-car", "one-bogie", "one-magnet"];

/// The vehicle of that name: one of [`NAMES`], or `<n>-cars` such as `8-cars`.
#[must_use]
pub fn by_name(name: &str) -> Option<Description> {
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
pub fn two_car() -> Description {
    Description {
        name: "two-car".to_owned(),
        description: "Two-car low-speed Maglev train: 105 bodies, 38,000 kg, 64 magnets".to_owned(),
        ..cars(2)
    }
}

/// A single car: half of the paper's vehicle, without couplers.
#[must_use]
pub fn one_car() -> Description {
    Description {
        name: "one-car".to_owned(),
        description: "One car of the low-speed Maglev train: 18,800 kg, 32 magnets".to_owned(),
        ..cars(1)
    }
}

/// A train of n cars; n must be at least one to make a valid vehicle.
#[must_use]
pub fn cars(n: usize) -> Description {
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
pub fn one_bogie() -> Description {
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
    // the bogie stands between stations 1 and 2, so 4.5 m ahead of its car's centre
    builder.bogie(0, 0, -4.5, &preload);
    builder.description
}

/// One magnet on a mass of 250 kg that moves only vertically.
#[must_use]
pub fn one_magnet() -> Description {
    let mut builder = Builder::new("one-magnet", "One magnet on 250 kg that move only vertically");
    builder.body("mass", 250.0, [0.0; 3], [0.7, 0.3, 0.2]);
    builder.joint("guide", JointKind::Translational, GROUND, "mass", [0.0; 3], Some(Z));
    builder.magnet("mass", [0.0; 3]);
    builder.description
}

/// Air-spring preload along a car: level + slope·(x − centre), upward on the car, N.
struct Preload {
    level: f64,
    slope: f64,
}

impl Preload {
    /// Balances a car body with equipment, tables and its halves of the couplers at the given ends
    /// (+1 front, −1 rear, 0 none), in weight and in pitching moment.
    fn of_car(couplers: [f64; 2]) -> Self {
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
const AIR_SPRING_ENDS: [f64; 2] = [1.3, -1.3];

/// Place of bogie b (from 0, front first) from its car's centre.
fn bogie_offset(b: usize) -> f64 {
    BOGIE_PITCH * (0.5 * (BOGIES as f64 - 1.0) - b as f64)
}

/// Rounds to a nanometre, so that the file shows 0.95 and not 0.9500000000000001.
fn tidy(point: [f64; 3]) -> [f64; 3] {
    point.map(|x| (x * 1e9).round() / 1e9 + 0.0)
}

struct Builder {
    description: Description,
}

impl Builder {
    fn new(name: &str, text: &str) -> Self {
        Self {
            description: Description {
                name: name.to_owned(),
                description: text.to_owned(),
                gravity: [0.0, 0.0, -GRAVITY],
                nominal_gap: NOMINAL_GAP,
                bodies: Vec::new(),
                joints: Vec::new(),
                bushings: Vec::new(),
                springs: Vec::new(),
                joint_forces: Vec::new(),
                drive: None,
                magnets: Vec::new(),
                observed: Vec::new(),
            },
        }
    }

    /// A body with the inertia of a homogeneous box.
    fn body(&mut self, name: &str, mass: f64, position: [f64; 3], [a, b, c]: [f64; 3]) {
        let moment = |p: f64, q: f64| ((mass / 12.0 * (p * p + q * q)) * 1e9).round() / 1e9;
        self.description.bodies.push(Body {
            name: name.to_owned(),
            mass,
            inertia: Inertia::Principal([moment(b, c), moment(a, c), moment(a, b)]),
            position: tidy(position),
            orientation: None,
            reference: false,
        });
    }

    fn joint(
        &mut self,
        name: &str,
        kind: JointKind,
        a: &str,
        b: &str,
        position: [f64; 3],
        axis: Option<[f64; 3]>,
    ) {
        self.description.joints.push(Joint {
            name: name.to_owned(),
            kind,
            body_a: a.to_owned(),
            body_b: b.to_owned(),
            position: Some(tidy(position)),
            axis,
            local_a: None,
            local_b: None,
            local_axis_a: None,
            local_axis_b: None,
        });
    }

    fn bushing(&mut self, name: &str, a: &str, b: &str, position: [f64; 3]) -> &mut Bushing {
        let k = self.description.bushings.len();
        self.description.bushings.push(Bushing {
            name: name.to_owned(),
            body_a: a.to_owned(),
            body_b: b.to_owned(),
            position: tidy(position),
            orientation: None,
            translational_stiffness: [0.0; 3],
            translational_damping: [0.0; 3],
            rotational_stiffness: [0.0; 3],
            rotational_damping: [0.0; 3],
            preload: [0.0; 3],
        });
        &mut self.description.bushings[k]
    }

    fn magnet(&mut self, body: &str, position: [f64; 3]) {
        self.description.magnets.push(Magnet { body: body.to_owned(), position: tidy(position) });
    }

    fn car(&mut self, c: usize, x: f64) {
        let car = format!("car_{}", c + 1);
        self.body(&car, CAR_BODY_MASS, [x, 0.0, CAR_BODY_HEIGHT], [12.0, 2.7, 2.6]);
        for b in 0..BOGIES {
            let name = format!("{car}_equipment_{}", b + 1);
            let at = x + bogie_offset(b);
            self.body(&name, EQUIPMENT_MASS, [at, 0.0, 0.9], [1.2, 1.5, 0.4]);
            self.joint(&name, JointKind::Bracket, &car, &name, [at, 0.0, 1.0], None);
        }
        for k in 0..=BOGIES {
            self.station(c, k, x + BOGIE_PITCH * (0.5 * BOGIES as f64 - k as f64));
        }
        self.description.observed.push(Observed {
            name: car.clone(),
            body: car,
            points: (0..BOGIES).map(|b| tidy([x + bogie_offset(b), 0.0, FLOOR_HEIGHT])).collect(),
        });
    }

    /// The two sliding tables of a station, centred by springs.
    fn station(&mut self, c: usize, k: usize, x: f64) {
        for (side, sign) in SIDES {
            let car = format!("car_{}", c + 1);
            let name = table(c, k, side);
            let y = sign * HALF_GAUGE;
            self.body(&name, TABLE_MASS, [x, y, TABLE_HEIGHT], [0.6, 0.5, 0.1]);
            let slide = format!("{name}_slide");
            let point = [x, y, TABLE_HEIGHT + 0.1];
            self.joint(&slide, JointKind::Translational, &car, &name, point, Some(Y));
            self.description.joint_forces.push(JointForce {
                joint: slide,
                stiffness: TABLE_STIFFNESS,
                damping: TABLE_DAMPING,
                preload: 0.0,
            });
        }
    }

    fn bogie(&mut self, c: usize, b: usize, car_x: f64, preload: &Preload) {
        let x = car_x + bogie_offset(b);
        let bogie = format!("bogie_{}_{}", c + 1, b + 1);
        for (side, sign) in SIDES {
            let y = sign * HALF_GAUGE;
            let frame = format!("{bogie}_side_frame_{side}");
            self.body(&frame, SIDE_FRAME_MASS, [x, y, 0.0], [2.8, 0.4, 0.5]);
            let motor = format!("{bogie}_motor_{side}");
            self.body(&motor, MOTOR_MASS, [x, y, 0.2], [2.0, 0.3, 0.2]);
            self.joint(&motor, JointKind::Bracket, &frame, &motor, [x, y, 0.2], None);
        }
        self.beams(&bogie, x);
        for (side, sign) in SIDES {
            let frame = format!("{bogie}_side_frame_{side}");
            let y = sign * HALF_GAUGE;
            for (e, dx) in AIR_SPRING_ENDS.into_iter().enumerate() {
                let end = ["front", "rear"][e];
                let table = table(c, b + e, side);
                let name = format!("{bogie}_air_spring_{side}_{end}");
                let spring = self.bushing(&name, &frame, &table, [x + dx, y, 0.4]);
                spring.translational_stiffness = AIR_STIFFNESS;
                spring.translational_damping = AIR_DAMPING;
                // pushes the side frame down and the table up
                let push = preload.level + preload.slope * (x + dx - car_x);
                spring.preload = [0.0, 0.0, -(push * 1e6).round() / 1e6];
                let name = format!("{bogie}_traction_rod_{side}_{end}");
                let rod = self.bushing(&name, &frame, &table, [x + dx, y, 0.35]);
                rod.translational_stiffness = [TRACTION_STIFFNESS, 0.0, 0.0];
                rod.translational_damping = [TRACTION_DAMPING, 0.0, 0.0];
            }
            for k in 0..MAGNETS_PER_SIDE {
                let dx = MAGNET_PITCH * (0.5 * (MAGNETS_PER_SIDE as f64 - 1.0) - k as f64);
                self.magnet(&frame, [x + dx, y, MAGNET_HEIGHT]);
            }
        }
    }

    /// Anti-roll beams: the front-upper and rear-lower ones slant one way in plan, the other two
    /// the opposite way. Four parallel ones would be redundant.
    fn beams(&mut self, bogie: &str, x: f64) {
        let slant = BEAM_HALF_SPAN * BEAM_SLANT_DEGREES.to_radians().tan();
        for (place, px, h, sign) in [
            ("front_upper", 1.1, 0.15, 1.0),
            ("rear_upper", -1.1, 0.15, -1.0),
            ("front_lower", 1.1, -0.15, -1.0),
            ("rear_lower", -1.1, -0.15, 1.0),
        ] {
            let name = format!("{bogie}_beam_{place}");
            let size = [0.12, 2.0 * BEAM_HALF_SPAN, 0.12];
            self.body(&name, BEAM_MASS, [x + px, 0.0, h], size);
            for (side, y) in SIDES {
                let point = [x + px + y * sign * slant, y * BEAM_HALF_SPAN, h];
                let frame = format!("{bogie}_side_frame_{side}");
                let end = format!("{name}_{side}");
                self.joint(&end, JointKind::Spherical, &frame, &name, point, None);
                let bush = self.bushing(&end, &frame, &name, point);
                bush.rotational_stiffness = [BEAM_END_STIFFNESS; 3];
                bush.rotational_damping = [BEAM_END_DAMPING; 3];
            }
        }
    }

    /// Two chains of five links and six hinges, from car c (counted from 1) to the next.
    fn coupler(&mut self, c: usize, x: f64) {
        let points = [
            (0.15, 0.8, Z),
            (0.12, 0.8, Y),
            (0.05, 0.86, X),
            (0.0, 0.9, Y),
            (-0.12, 0.8, Y),
            (-0.15, 0.8, Z),
        ];
        for (side, sign) in SIDES {
            let y = 0.4 * sign;
            let mut previous = format!("car_{c}");
            for (k, (dx, z, axis)) in points.into_iter().enumerate() {
                let next = if k < LINKS {
                    let (dx2, z2, _) = points[k + 1];
                    let link = format!("coupler_{c}_{side}_link_{}", k + 1);
                    let middle = [x + 0.5 * (dx + dx2), y, 0.5 * (z + z2)];
                    self.body(&link, LINK_MASS, middle, [0.15; 3]);
                    link
                } else {
                    format!("car_{}", c + 1)
                };
                let hinge = format!("coupler_{c}_{side}_hinge_{}", k + 1);
                let at = [x + dx, y, z];
                self.joint(&hinge, JointKind::Revolute, &previous, &next, at, Some(axis));
                self.description.joint_forces.push(JointForce {
                    joint: hinge,
                    stiffness: HINGE_STIFFNESS,
                    damping: HINGE_DAMPING,
                    preload: 0.0,
                });
                previous = next;
            }
        }
    }
}

fn table(c: usize, k: usize, side: &str) -> String {
    format!("car_{}_table_{}_{side}", c + 1, k + 1)
}
