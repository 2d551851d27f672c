//! Bodies, joints and elements of the vehicles, added part by part.

use super::description::TrainDescription;
use super::geometry::{LINKS, SIDES, X, Y, Z};
use super::preload::Preload;
use super::segments::{Segment, flexure, segment_at, segments};
use crate::description::{
    Body, Bushing, ElementGroup, Inertia, Joint, JointForce, JointKind, MagnetPoint, Observed,
    VehicleDescription,
};

/// Rounds to a nanometre, so that the file shows 0.95 and not 0.9500000000000001.
fn tidy(point: [f64; 3]) -> [f64; 3] {
    point.map(|x| (x * 1e9).round() / 1e9 + 0.0)
}

/// Collects a description part by part.
pub(super) struct Builder<'a> {
    pub train: &'a TrainDescription,
    pub description: VehicleDescription,
}

impl<'a> Builder<'a> {
    pub fn new(train: &'a TrainDescription, name: &str, text: &str) -> Self {
        Self {
            train,
            description: VehicleDescription {
                schema: None,
                name: name.to_owned(),
                description: text.to_owned(),
                gravity: [0.0, 0.0, -train.gravity],
                nominal_gap: train.nominal_gap,
                bodies: Vec::new(),
                joints: Vec::new(),
                bushings: Vec::new(),
                springs: Vec::new(),
                joint_forces: Vec::new(),
                drive: None,
                magnets: Vec::new(),
                observed: Vec::new(),
                contact: None,
                groups: Vec::new(),
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

    pub fn car(&mut self, c: usize) {
        let (train, x) = (self.train, self.train.car_centre(c));
        let car = format!("car_{}", c + 1);
        let segments = segments(train, c);
        self.car_body(c, x, &segments);
        for b in 0..train.bogies_per_car {
            let name = format!("{car}_equipment_{}", b + 1);
            let at = x + train.bogie_offset(b);
            let carrier = segment_at(&segments, train.bogie_offset(b));
            self.body(&name, train.masses.equipment, [at, 0.0, 0.9], [1.2, 1.5, 0.4]);
            self.joint(&name, JointKind::Bracket, carrier, &name, [at, 0.0, 1.0], None);
        }
        for k in 0..=train.bogies_per_car {
            let carrier = segment_at(&segments, train.station_offset(k));
            self.station(c, k, x + train.station_offset(k), carrier);
        }
        let others = segments.iter().filter(|s| s.name != car);
        let parts: Vec<String> = others.map(|s| s.name.clone()).collect();
        let offsets = (0..train.bogies_per_car).map(|b| train.bogie_offset(b));
        let point_bodies = offsets.clone().map(|x| segment_at(&segments, x).to_owned()).collect();
        let floor = train.dimensions.floor_height;
        self.description.observed.push(Observed {
            name: car.clone(),
            body: car,
            points: offsets.map(|offset| tidy([x + offset, 0.0, floor])).collect(),
            point_bodies: if parts.is_empty() { Vec::new() } else { point_bodies },
            parts,
            levelled_by: vec![format!("bogie_{}_*_air_spring_*", c + 1)],
        });
    }

    /// The car body: one body, or segments with elastic joints.
    fn car_body(&mut self, c: usize, x: f64, segments: &[Segment]) {
        let train = self.train;
        let d = &train.dimensions;
        let height = d.car_centre_height;
        // the middle first, which stands for the car
        let (middle, others): (Vec<_>, Vec<_>) =
            segments.iter().partition(|s| !s.name.contains("segment"));
        for segment in middle.into_iter().chain(others) {
            let whole = segments.len() == 1;
            let fraction = if whole { 1.0 } else { segment.length() / train.car_length() };
            let place = [x + segment.centre(), 0.0, height];
            let size = [segment.length(), d.car_width, d.car_height];
            self.body(&segment.name, train.masses.car_body * fraction, place, size);
        }
        let Some(flexible) = &train.flexible_body else { return };
        let joint = flexure(train, flexible, segments);
        for (k, pair) in segments.windows(2).enumerate() {
            let name = format!("car_{}_flexure_{}", c + 1, k + 1);
            let [front, rear] = [&pair[0].name, &pair[1].name];
            let point = [x + pair[1].front, 0.0, height];
            self.joint(&name, JointKind::Spherical, front, rear, point, None);
            let bush = self.bushing(&name, front, rear, point);
            bush.rotational_stiffness = joint.stiffness;
            bush.rotational_damping = joint.damping;
        }
    }

    /// The two sliding tables of a station, centred by springs.
    pub fn station(&mut self, c: usize, k: usize, x: f64, carrier: &str) {
        let train = self.train;
        let height = train.dimensions.table_height;
        for (side, sign) in SIDES {
            let name = table(c, k, side);
            let y = sign * train.dimensions.half_gauge;
            self.body(&name, train.masses.table, [x, y, height], [0.6, 0.5, 0.1]);
            let slide = format!("{name}_slide");
            let point = [x, y, height + 0.1];
            self.joint(&slide, JointKind::Translational, carrier, &name, point, Some(Y));
            self.description.joint_forces.push(JointForce {
                joint: slide,
                stiffness: train.table_centring.stiffness,
                damping: train.table_centring.damping,
                preload: 0.0,
            });
        }
    }

    pub fn bogie(&mut self, c: usize, b: usize, car_x: f64, preload: &Preload) {
        let train = self.train;
        let (d, masses) = (&train.dimensions, &train.masses);
        let x = car_x + train.bogie_offset(b);
        let bogie = format!("bogie_{}_{}", c + 1, b + 1);
        for (side, sign) in SIDES {
            let y = sign * d.half_gauge;
            let frame = format!("{bogie}_side_frame_{side}");
            self.body(&frame, masses.side_frame, [x, y, 0.0], [d.side_frame_length, 0.4, 0.5]);
            let motor = format!("{bogie}_motor_{side}");
            self.body(&motor, masses.motor, [x, y, 0.2], [2.0, 0.3, 0.2]);
            self.joint(&motor, JointKind::Bracket, &frame, &motor, [x, y, 0.2], None);
        }
        self.beams(&bogie, x);
        for (side, sign) in SIDES {
            let frame = format!("{bogie}_side_frame_{side}");
            let y = sign * d.half_gauge;
            for (e, dx) in train.corners().into_iter().enumerate() {
                let end = ["front", "rear"][e];
                let table = table(c, b + e, side);
                let corner = format!("{side}_{end}");
                for (k, more) in train.corner_springs().enumerate() {
                    let name = match train.air_springs_per_corner {
                        1 => format!("{bogie}_air_spring_{corner}"),
                        _ => format!("{bogie}_air_spring_{corner}_{}", k + 1),
                    };
                    let place = x + dx + more;
                    let spring = self.bushing(&name, &frame, &table, [place, y, 0.4]);
                    let air = &train.air_spring;
                    spring.translational_stiffness =
                        [air.longitudinal_stiffness, air.lateral_stiffness, air.vertical_stiffness];
                    spring.translational_damping =
                        [air.longitudinal_damping, air.lateral_damping, air.vertical_damping];
                    // pushes the side frame down and the table up
                    spring.preload = [0.0, 0.0, -preload.at(place - car_x)];
                }
                let name = format!("{bogie}_traction_rod_{corner}");
                let rod = self.bushing(&name, &frame, &table, [x + dx, y, 0.35]);
                rod.translational_stiffness = [train.traction_rod.longitudinal_stiffness, 0.0, 0.0];
                rod.translational_damping = [train.traction_rod.longitudinal_damping, 0.0, 0.0];
            }
            for k in 0..train.magnets_per_side {
                self.magnet(&frame, [x + train.magnet_offset(k), y, d.magnet_height]);
            }
        }
    }

    /// Anti-roll beams: the front-upper and rear-lower ones slant one way in plan, the other two
    /// the opposite way. Four parallel ones would be redundant.
    fn beams(&mut self, bogie: &str, x: f64) {
        let train = self.train;
        let (slant, half_span, at) =
            (train.beam_slant(), train.beam_half_span(), train.dimensions.beam_offset);
        for (place, px, h, sign) in [
            ("front_upper", at, 0.15, 1.0),
            ("rear_upper", -at, 0.15, -1.0),
            ("front_lower", at, -0.15, -1.0),
            ("rear_lower", -at, -0.15, 1.0),
        ] {
            let name = format!("{bogie}_beam_{place}");
            let size = [0.12, 2.0 * half_span, 0.12];
            self.body(&name, train.masses.beam, [x + px, 0.0, h], size);
            for (side, y) in SIDES {
                let point = [x + px + y * sign * slant, y * half_span, h];
                let frame = format!("{bogie}_side_frame_{side}");
                let end = format!("{name}_{side}");
                self.joint(&end, JointKind::Spherical, &frame, &name, point, None);
                let bush = self.bushing(&end, &frame, &name, point);
                bush.rotational_stiffness = [train.anti_roll_end.rotational_stiffness; 3];
                bush.rotational_damping = [train.anti_roll_end.rotational_damping; 3];
            }
        }
    }

    /// Two chains of five links and six hinges, from car c (counted from 1) to the next.
    pub fn coupler(&mut self, c: usize) {
        let train = self.train;
        let x = 0.5 * (train.car_centre(c - 1) + train.car_centre(c));
        // places for a gap of 0.3 m
        let scale = train.dimensions.car_gap / 0.3;
        let points = [
            (0.15, 0.8, Z),
            (0.12, 0.8, Y),
            (0.05, 0.86, X),
            (0.0, 0.9, Y),
            (-0.12, 0.8, Y),
            (-0.15, 0.8, Z),
        ]
        .map(|(dx, z, axis)| (dx * scale, z, axis));
        let half = 0.5 * train.car_length();
        let from = segment_at(&segments(train, c - 1), -half).to_owned();
        let to = segment_at(&segments(train, c), half).to_owned();
        for (side, sign) in SIDES {
            let y = 0.4 * sign;
            let mut previous = from.clone();
            for (k, (dx, z, axis)) in points.into_iter().enumerate() {
                let next = if k < LINKS {
                    let (dx2, z2, _) = points[k + 1];
                    let link = format!("coupler_{c}_{side}_link_{}", k + 1);
                    let middle = [x + 0.5 * (dx + dx2), y, 0.5 * (z + z2)];
                    self.body(&link, train.masses.coupler_link, middle, [0.15; 3]);
                    link
                } else {
                    to.clone()
                };
                let hinge = format!("coupler_{c}_{side}_hinge_{}", k + 1);
                let at = [x + dx, y, z];
                self.joint(&hinge, JointKind::Revolute, &previous, &next, at, Some(axis));
                self.description.joint_forces.push(JointForce {
                    joint: hinge,
                    stiffness: train.coupler_hinge.stiffness,
                    damping: train.coupler_hinge.damping,
                    preload: 0.0,
                });
                previous = next;
            }
        }
    }

    /// Groups of elements whose values are parameters of the vehicle unit, where there are any.
    pub fn groups(&mut self) {
        let bushings = [
            ("air_spring", "bogie_*_air_spring_*"),
            ("traction_rod", "bogie_*_traction_rod_*"),
            ("anti_roll_end", "bogie_*_beam_*"),
        ];
        let joint_forces =
            [("table_centring", "car_*_table_*_slide"), ("coupler_hinge", "coupler_*_hinge_*")];
        let description = &mut self.description;
        let has_coupler = description.joint_forces.iter().any(|f| f.joint.starts_with("coupler"));
        for (name, pattern) in bushings {
            description.groups.push(ElementGroup {
                name: name.to_owned(),
                bushings: vec![pattern.to_owned()],
                ..ElementGroup::default()
            });
        }
        for (name, pattern) in joint_forces.into_iter().take(1 + usize::from(has_coupler)) {
            description.groups.push(ElementGroup {
                name: name.to_owned(),
                joint_forces: vec![pattern.to_owned()],
                ..ElementGroup::default()
            });
        }
    }
}

fn table(c: usize, k: usize, side: &str) -> String {
    format!("car_{}_table_{}_{side}", c + 1, k + 1)
}
