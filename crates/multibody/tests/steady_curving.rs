//! Steady curving of whole vehicles against statics written apart: the circle, the magnets' law, the air
//! springs and the balance of each free body.
#![allow(clippy::panic, clippy::unwrap_used, reason = "a test program")]

use std::f64::consts::FRAC_2_PI;

use multibody::math::{Mat3, Vec3, conjugate, multiply, rotation_matrix};
use multibody::{
    AppliedForces, Equilibrium, Error, Holding, Inertia, Loads, MagnetIndex, Rails, State, Travel,
    VehicleDescription, VehicleModel, train,
};
use track_line::{Line, LineDescription};

const G: f64 = 9.81;
const POLE: f64 = 0.028;
const PLACE: f64 = 200.0;

fn line(radius: f64, cant: f64) -> Line {
    let text = format!(
        r#"{{ "name": "circle", "plan": [ {{ "kind": "clothoid", "length": 100, "to_radius": {radius} }},
        {{ "kind": "circle", "length": 200, "radius": {radius} }}, {{ "kind": "clothoid", "length": 100 }} ],
        "cant": [ {{ "length": 100, "to": {cant} }} ] }}"#
    );
    Line::new(&LineDescription::from_json(&text).unwrap()).unwrap()
}

/// Lateral force of a magnet that lifts `lift`, with lift loss.
fn pull(lift: f64, gap: f64, y: f64) -> f64 {
    let angle = FRAC_2_PI * (y / gap).atan() / POLE;
    if y.abs() >= POLE || y * angle >= 1.0 {
        f64::NAN
    } else {
        -lift * gap * angle / (1.0 - y * angle)
    }
}

fn law(lift: f64, gap: f64, y: f64) -> [f64; 2] {
    let d = 1e-7;
    let slope = (pull(lift, gap, y + d) - pull(lift, gap, y - d)) / (2.0 * d);
    [pull(lift, gap, y), -slope]
}

fn found(model: &VehicleModel, speed: f64) -> Result<Equilibrium, Error> {
    let heights = vec![0.0; model.counts().magnets];
    let travel = Some(Travel { place: PLACE, speed });
    let rails = Rails { height: &heights, side: &[] };
    let mut work = model.workspace();
    model.carried_equilibrium(travel, &rails, &Holding::default(), &law, &[], &mut work)
}

/// A circle about a vertical axis, in the axes of the travelling frame on it; left positive.
struct Circle {
    radius: f64,
    cant: f64,
    up: Vec3,
    /// Level and to the left.
    left: Vec3,
}

impl Circle {
    fn new(radius: f64, cant: f64) -> Self {
        let (s, c) = cant.sin_cos();
        Self { radius, cant, up: Vec3::new(0.0, s, c), left: Vec3::new(0.0, c, -s) }
    }

    /// From the axis to a point, across it.
    fn out(&self, point: &Vec3) -> Vec3 {
        let from = point - self.left * self.radius;
        from - self.up * from.dot(&self.up)
    }

    /// Way along the circle, axes (along, left, up) there, and coordinates (left, up) of a point.
    fn at(&self, point: &Vec3) -> (f64, Mat3, [f64; 2]) {
        let (s, c) = self.cant.sin_cos();
        let out = self.out(point);
        let level = -out.normalize() * self.radius.signum();
        let (left, above) = (level * c + self.up * s, self.up * c - level * s);
        let along = left.cross(&above);
        let apart = level * (self.radius - out.norm() * self.radius.signum())
            + self.up * point.dot(&self.up);
        let turned = along.dot(&self.left).atan2(along.x);
        let axes = Mat3::from_columns(&[along, left, above]);
        (turned * self.radius, axes, [apart.dot(&left), apart.dot(&above)])
    }
}

/// Pose of the described bodies: what a point of the description has become.
struct Poses<'a> {
    model: &'a VehicleModel,
    start: State,
    state: &'a State,
}

impl Poses<'_> {
    fn turn(&self, body: &str) -> Mat3 {
        let k = self.model.body_index(body).unwrap().0;
        let (from, to) = (self.start.bodies[k].attitude, self.state.bodies[k].attitude);
        rotation_matrix(multiply(to, conjugate(from)))
    }

    fn point(&self, body: &str, place: [f64; 3]) -> Vec3 {
        let k = self.model.body_index(body).unwrap().0;
        let arm = Vec3::from(place) - self.start.bodies[k].position;
        self.state.bodies[k].position + self.turn(body) * arm
    }
}

/// A free body: the sum of forces, and of moments about the frame's origin, less its inertia.
struct Free {
    name: String,
    force: Vec3,
    moment: Vec3,
    weight: f64,
    /// Sum of the lateral forces of its magnets.
    sideways: f64,
}

impl Free {
    fn add(&mut self, force: &Vec3, at: &Vec3) {
        self.force += force;
        self.moment += at.cross(force);
    }
}

/// The bogie or the upper part (cars, tables, couplers) that a body belongs to.
fn part(body: &str) -> &str {
    let end = body.match_indices('_').nth(2).map_or(body.len(), |(at, _)| at);
    if body.starts_with("bogie_") && !body.ends_with("_lever") { &body[..end] } else { "cars" }
}

/// Balances of all bogies and of the cars above them, and the magnets' offsets.
fn balances(
    description: &VehicleDescription,
    model: &VehicleModel,
    found: &Equilibrium,
    circle: &Circle,
    speed: f64,
) -> (Vec<Free>, Vec<f64>) {
    let poses = Poses { model, start: model.initial_state(), state: &found.state };
    let mut parts: Vec<Free> = Vec::new();
    let mut add = |body: &str, force: Vec3, at: Vec3, weight: f64, sideways: f64, moment: Vec3| {
        let name = part(body);
        let k = parts.iter().position(|it| it.name == name).unwrap_or_else(|| {
            let zero = Vec3::zeros();
            let name = name.to_owned();
            parts.push(Free { name, force: zero, moment: zero, weight: 0.0, sideways: 0.0 });
            parts.len() - 1
        });
        parts[k].add(&force, &at);
        parts[k].moment += moment;
        parts[k].weight += weight;
        parts[k].sideways += sideways;
    };
    let rate = speed / circle.radius;
    for body in description.bodies.iter().filter(|body| !body.reference) {
        let (at, turn) = (poses.point(&body.name, body.position), poses.turn(&body.name));
        let centripetal = -circle.out(&at) * (rate * rate);
        let force = (-circle.up * G - centripetal) * body.mass;
        let Inertia::Principal(moments) = body.inertia else { panic!("full inertia") };
        let inertia = turn * Mat3::from_diagonal(&Vec3::from(moments)) * turn.transpose();
        let spin = circle.up * rate;
        let gyroscopic = -spin.cross(&(inertia * spin));
        add(&body.name, force, at, body.mass * G, 0.0, gyroscopic);
    }
    for spring in &description.bushings {
        let (a, b) = (&spring.body_a, &spring.body_b);
        if part(a) == part(b) {
            continue;
        }
        let (at, axes) = (poses.point(b, spring.position), poses.turn(a));
        let apart = axes.transpose() * (at - poses.point(a, spring.position));
        let stiffness = Vec3::from(spring.translational_stiffness);
        let on_a = axes * (Vec3::from(spring.preload) + stiffness.component_mul(&apart));
        add(a, on_a, at, 0.0, 0.0, Vec3::zeros());
        add(b, -on_a, at, 0.0, 0.0, Vec3::zeros());
    }
    let drive = description.drive.as_ref().unwrap();
    for name in &drive.bodies {
        let start = description.bodies.iter().find(|it| it.name == *name).unwrap().position;
        let at = poses.point(name, start);
        let (way, axes, _) = circle.at(&at);
        add(
            name,
            axes.column(0) * -drive.stiffness * (way - start[0]),
            at,
            0.0,
            0.0,
            Vec3::zeros(),
        );
    }
    let mut offsets = Vec::new();
    for (k, magnet) in description.magnets.iter().enumerate() {
        let at = poses.point(&magnet.body, magnet.position);
        let (_, axes, [y, z]) = circle.at(&at);
        let (offset, gap) = (y - magnet.position[1], 0.008 - (z - magnet.position[2]));
        let side = pull(found.loads[k], gap, offset);
        let force = axes.column(1) * side + axes.column(2) * found.loads[k];
        add(&magnet.body, force, at, 0.0, side, Vec3::zeros());
        offsets.push(offset);
        // the nominal gap, as far as a rigid bogie can keep it
        assert!((gap - 0.008).abs() < 3e-4, "{k}: {gap}");
        let own = model.magnet(&found.state, MagnetIndex(k)).displacement;
        assert!((own.y - offset).abs() < 1e-12 && (found.lateral[k] / side - 1.0).abs() < 1e-6);
    }
    (parts, offsets)
}

/// One car and the two-car train at 20 km/h at R = 200 m, the curve's cant balancing the speed, none, and
/// too much; a curve to the right; one car at 60 km/h. Every bogie and the cars above them are in balance
/// as free bodies, in all six components, to 1e-6 of their weight; so are the sums over the train.
#[test]
fn analytic_steady_curving_of_whole_vehicles_is_in_balance() {
    for (name, radius, cant, speed) in [
        ("one-car", 200.0, -0.0157, 20.0 / 3.6),
        ("one-car", -200.0, 0.0157, 20.0 / 3.6),
        ("one-car", 300.0, -0.05, 60.0 / 3.6),
        ("two-car", 200.0, -0.0157, 20.0 / 3.6),
        ("two-car", 250.0, 0.0, 20.0 / 3.6),
    ] {
        let description = train::by_name(name).unwrap();
        let line = line(radius, cant);
        let model = VehicleModel::new(&description).unwrap().with_line(line).unwrap();
        let found = found(&model, speed).unwrap();
        let circle = Circle::new(radius, cant);
        let (parts, offsets) = balances(&description, &model, &found, &circle, speed);
        assert_eq!(parts.len(), if name == "one-car" { 5 } else { 9 });
        let (mut force, mut moment, mut sideways) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for free in &parts {
            let small = 1e-6 * free.weight;
            // moments about the origin have arms of a train's length
            assert!(free.force.amax() < small && free.moment.amax() < small, "{}", free.name);
            force += free.force;
            moment += free.moment;
            sideways += free.sideways;
        }
        let mass = model.total_mass();
        assert!(force.amax() < 1e-7 * mass * G && moment.amax() < 1e-6 * mass * G);
        // the sum in axes that turn by 0.12 rad to either end of the train
        let (s, c) = cant.sin_cos();
        let needed = mass * (speed * speed / radius * c + G * s);
        let turn = 12.0 / radius;
        assert!(
            (sideways - needed).abs() < turn * turn * mass * G * 0.05 + 1e-3 * needed.abs(),
            "{name}: {sideways} {needed}"
        );
        let most = offsets.iter().fold(0.0_f64, |most, y| most.max(y.abs()));
        assert!(most > 5e-3 && most < POLE, "{most}");
        // nothing moves relative to the travelling frame
        let turning = Vec3::new(0.0, s, c) * (speed / radius);
        let magnets = Loads { vertical: &found.loads, lateral: &found.lateral };
        let forces = AppliedForces { magnets, external: &[], acceleration: 0.0 };
        let mut work = model.workspace();
        model.accelerations(&found.state, forces, &mut work).unwrap();
        for (k, body) in found.state.bodies.iter().enumerate() {
            let (linear, angular) = work.acceleration(multibody::BodyIndex(k));
            let moving = body.velocity - turning.cross(&body.position);
            let carried = body.velocity + Vec3::new(speed, 0.0, 0.0);
            let left = linear - turning.cross(&carried);
            assert!(moving.amax() < 1e-10 && left.amax() < 1e-7 && angular.amax() < 1e-7, "{k}");
        }
    }
}

/// The train of curve-50: levers let the bogies turn, so that it takes R = 50 m with offsets well within the poles,
/// and pass braking, to which the cars yield by m·a over the stiffness of links, rods and air springs.
#[test]
fn analytic_turning_bogies_take_50_metres_and_pass_braking() {
    let path =
        concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/lines/turning-bogies.vehicle.json");
    let description =
        VehicleDescription::from_json(&std::fs::read_to_string(path).unwrap()).unwrap();
    let straight = VehicleModel::new(&description).unwrap();
    assert!((straight.total_mass() - 38_000.0).abs() < 1.0, "{}", straight.total_mass());
    let model = straight.clone().with_line(line(50.0, -0.0628)).unwrap();
    let found = found(&model, 20.0 / 3.6).unwrap();
    let offsets = model.magnets().map(|k| model.magnet(&found.state, k).displacement.y.abs());
    let most = offsets.fold(0.0, f64::max);
    assert!(most < 0.021, "{most}");
    // braking at 1 m/s², on straight track, until it is steady
    let mut work = straight.workspace();
    let rest = straight.equilibrium(&[0.0; 64], &Holding::default(), &mut work).unwrap();
    let (mut state, hold) = (rest.state, |value: f64| [value, 0.0, 0.0, 0.0]);
    for _ in 0..1000 {
        let motions: Vec<_> = straight.magnets().map(|k| straight.magnet(&state, k)).collect();
        let up = motions.iter().zip(&rest.loads);
        let up = up.map(|(it, load)| load - 4e5 * it.displacement.z - 2e4 * it.velocity.z);
        let up: Vec<_> = up.map(hold).collect();
        let left = motions.iter().map(|it| -2e5 * it.displacement.y - 5e3 * it.velocity.y);
        let left: Vec<_> = left.map(hold).collect();
        let magnets = multibody::LoadCourse { vertical: &up, lateral: &left };
        let acceleration = [-1.0, 0.0, 0.0, 0.0];
        let course = multibody::AppliedCourse {
            magnets,
            further: multibody::FurtherCourse::default(),
            external: &[],
            acceleration,
        };
        straight.step(&mut state, 1e-3, 1e-3, course, &mut work).unwrap();
    }
    // the links' mean extension, where they are, with the inertia of all that is above the bogies
    let poses = Poses { model: &straight, start: straight.initial_state(), state: &state };
    let links: Vec<_> =
        description.bushings.iter().filter(|it| it.name.contains("_link_")).collect();
    let extension = links
        .iter()
        .map(|it| (poses.point(&it.body_b, it.position) - poses.point(&it.body_a, it.position)).x);
    let mean = extension.sum::<f64>() / 16.0;
    let upper = description.bodies.iter().filter(|it| !it.reference && part(&it.name) == "cars");
    let mass: f64 = upper.map(|it| it.mass).sum();
    let expected = mass / (8.0 * (2.0 * 8e5 + 8.0 * 5e3));
    assert!((mean / expected - 1.0).abs() < 0.02, "{mean} {expected}");
}

#[test]
fn refusal_of_a_curve_that_is_too_tight() {
    let model = VehicleModel::new(&train::by_name("two-car").unwrap()).unwrap();
    let model = model.with_line(line(110.0, 0.0)).unwrap();
    let text = found(&model, 5.0).unwrap_err().to_string();
    assert!(text.contains("too tight"), "{text}");
}
