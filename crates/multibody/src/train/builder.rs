//! Bodies, joints and elements of the vehicles, added part by part.

use super::dimensions::*;
use crate::description::{
    Body, Bushing, Inertia, Joint, JointForce, JointKind, MagnetPoint, Observed, VehicleDescription,
};

/// Rounds to a nanometre, so that the file shows 0.95 and not 0.9500000000000001.
fn tidy(point: [f64; 3]) -> [f64; 3] {
    point.map(|x| (x * 1e9).round() / 1e9 + 0.0)
}

/// Collects a description part by part.
pub(super) struct Builder {
    pub description: VehicleDescription,
}

impl Builder {
    pub fn new(name: &str, text: &str) -> Self {
        Self {
            description: VehicleDescription {
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
                contact: None,
            },
        }
    }

    /// A body with the inertia of a homogeneous box.
    pub fn body(&mut self, name: &str, mass: f64, position: [f64; 3], [a, b, c]: [f64; 3]) {
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

    pub fn joint(
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

    pub fn magnet(&mut self, body: &str, position: [f64; 3]) {
        self.description
            .magnets
            .push(MagnetPoint { body: body.to_owned(), position: tidy(position) });
    }

    pub fn car(&mut self, c: usize, x: f64) {
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
    pub fn station(&mut self, c: usize, k: usize, x: f64) {
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

    pub fn bogie(&mut self, c: usize, b: usize, car_x: f64, preload: &Preload) {
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
    pub fn coupler(&mut self, c: usize, x: f64) {
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
