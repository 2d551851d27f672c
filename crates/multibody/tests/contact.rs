//! Stops and skids: impacts against closed forms, energy, order across an impact, rest on the skids.
#![allow(clippy::unwrap_used)] // helpers outside the test functions

mod common;

use common::{G, body, empty, joint, tracer};
use multibody::math::Vec3;
use multibody::{
    Contact, ContactLaw, Equilibrium, GROUND, Holding, JointKind, LoadCourse, Loads, MagnetIndex,
    MagnetSprings, MovingTrack, State, TrackContact, TrackCourse, VehicleDescription, VehicleModel,
    Workspace, train,
};

const SKID: ContactLaw = ContactLaw { gap: 0.016, stiffness: 2e7, damping: 10.0, friction: 0.3 };
const STOP: ContactLaw = ContactLaw { gap: 0.001, stiffness: 1e8, damping: 10.0, friction: 0.3 };
const BOTH: Contact = Contact { stop: Some(STOP), skid: Some(SKID), slip_speed: 0.01 };
const FIRST: MagnetIndex = MagnetIndex(0);

/// The same laws without any loss.
fn elastic() -> Contact {
    let plain = |law| ContactLaw { damping: 0.0, friction: 0.0, ..law };
    Contact { stop: Some(plain(STOP)), skid: Some(plain(SKID)), slip_speed: 0.01 }
}

/// 250 kg that move only vertically, with one magnet.
fn mass(gravity: f64) -> VehicleModel {
    let mut d = train::one_magnet();
    d.gravity = [0.0, 0.0, -gravity];
    VehicleModel::new(&d).unwrap()
}

/// A run over a flat track that moves with a given height and rate, under constant loads.
struct Run<'a> {
    model: &'a VehicleModel,
    contact: Contact,
    speed: f64,
    vertical: Vec<[f64; 4]>,
    track: Vec<[f64; 4]>,
    track_rate: Vec<[f64; 4]>,
    ws: Workspace,
}

impl<'a> Run<'a> {
    fn new(model: &'a VehicleModel, contact: Contact) -> Self {
        let zero = vec![[0.0; 4]; model.counts().magnets];
        Self {
            model,
            contact,
            speed: 0.0,
            vertical: zero.clone(),
            track: zero.clone(),
            track_rate: zero,
            ws: model.workspace(),
        }
    }

    fn step(&mut self, state: &mut State, h: f64, max_step: f64) {
        let zero = vec![[0.0; 4]; self.vertical.len()];
        let loads = LoadCourse { vertical: &self.vertical, lateral: &zero };
        let (contact, speed) = (self.contact, [self.speed, 0.0, 0.0, 0.0]);
        let track = TrackCourse {
            contact,
            speed,
            height: &self.track,
            rate: &self.track_rate,
            side_rate: &[],
        };
        self.model.step_in_contact(state, h, max_step, &loads, Some(&track), &mut self.ws).unwrap();
    }
}

/// A free mass that hits a skid or a stop leaves with the speed of Hunt's and Crossley's law, whatever
/// the step: χ v − ln(1 + χ v) = −χ u − ln(1 − χ u).
#[test]
fn analytic_rebound_of_an_impact() {
    let model = mass(0.0);
    for (speed, damping, way) in
        [(0.1, 10.0, -1.0), (0.1, 1.0, -1.0), (0.3, 10.0, 1.0), (0.05, 40.0, 1.0), (0.2, 0.0, -1.0)]
    {
        let law = |law| ContactLaw { damping, ..law };
        let contact = Contact { stop: Some(law(STOP)), skid: Some(law(SKID)), slip_speed: 0.01 };
        let mut run = Run::new(&model, contact);
        let mut state = model.initial_state();
        state.bodies[0].velocity.z = way * speed;
        let mut steps = 0;
        while model.magnet(&state, FIRST).velocity.z * way > 0.0
            || touching(&model, &state, &contact)
        {
            run.step(&mut state, 1e-3, 1e-3);
            steps += 1;
            assert!(steps < 1000);
        }
        let rebound = -model.magnet(&state, FIRST).velocity.z * way;
        let (v, u) = (damping * speed, damping * rebound);
        if damping > 0.0 {
            let (before, after) = (v - v.ln_1p(), -u - (-u).ln_1p());
            // steps of 0.2 rad lose 1e-6 of the energy, which u/(1 − u) up to 10 magnifies
            assert!((before - after).abs() < 1e-4 * before, "{speed} {damping}: {before} {after}");
        }
        let restitution = law(SKID).restitution(speed);
        println!("{speed} m/s, {damping} s/m: {rebound} m/s, restitution {restitution}");
        assert!((rebound - restitution * speed).abs() < 1e-5 * speed, "{rebound} {restitution}");
    }
}

fn touching(model: &VehicleModel, state: &State, contact: &Contact) -> bool {
    let zero = vec![0.0; model.counts().magnets];
    let track =
        TrackContact { contact: *contact, speed: 0.0, height: &zero, rate: &zero, side_rate: &[] };
    model.magnets().any(|k| model.contact_force(state, k, &track) != Vec3::zeros())
}

/// Halving the internal step divides the error by 16, across falls, impacts on the skid and rebounds:
/// touching and leaving the rail are located.
#[test]
fn order_across_impacts_is_four() {
    let model = mass(G);
    let end = |max_step: f64| {
        let mut run = Run::new(&model, BOTH);
        let mut state = model.initial_state();
        for _ in 0..20 {
            run.step(&mut state, 0.01, max_step);
        }
        let motion = model.magnet(&state, FIRST);
        [motion.displacement.z, motion.velocity.z]
    };
    let exact = end(0.01 / 1024.0);
    let errors = [64.0, 128.0, 256.0].map(|n| {
        let found = end(0.01 / n);
        (found[0] - exact[0]).abs().max((found[1] - exact[1]).abs() / 300.0)
    });
    println!("{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((order - 4.0).abs() < 0.5, "{order}: {errors:?}");
    }
}

/// A mass that bounces without loss between skid and stop for 5 s keeps its energy.
#[test]
fn invariant_elastic_bouncing_keeps_the_energy() {
    let model = mass(G);
    let mut run = Run::new(&model, elastic());
    let mut state = model.initial_state();
    state.bodies[0].velocity.z = 0.5;
    let energy = |state: &State, ws: &mut Workspace| {
        let track = TrackContact {
            contact: elastic(),
            speed: 0.0,
            height: &[0.0],
            rate: &[0.0],
            side_rate: &[],
        };
        model.energy(state, ws).total() + model.contact_power(state, &track).stored
    };
    let begin = energy(&state, &mut model.workspace());
    let (mut highest, mut lowest, mut most) = (f64::MIN, f64::MAX, 0.0_f64);
    for _ in 0..5000 {
        run.step(&mut state, 1e-3, 1e-3);
        let z = model.magnet(&state, FIRST).displacement.z;
        (highest, lowest) = (highest.max(z), lowest.min(z));
        let now = energy(&state, &mut model.workspace());
        most = most.max((now - begin).abs());
    }
    println!("z from {lowest} to {highest} m, energy off by {most} J");
    assert!(highest > 0.007 && lowest < -0.008);
    // 31 J of motion; an impact of 15 steps of 0.2 rad costs some 1e-6 of it, and there are 330
    assert!(most < 5e-4 * 31.0, "{most}");
}

/// One bogie without dampers.
fn undamped_bogie() -> VehicleDescription {
    let mut d = train::one_bogie();
    for bushing in &mut d.bushings {
        bushing.translational_damping = [0.0; 3];
        bushing.rotational_damping = [0.0; 3];
    }
    for force in &mut d.joint_forces {
        force.damping = 0.0;
    }
    d
}

/// One bogie falls on its skids, sliding, on a moving track and under magnet forces: what the magnets
/// and the track supply is kinetic, potential and elastic energy, and what the contacts turn into heat.
#[test]
fn invariant_energy_balance_of_a_landing_bogie() {
    let model = VehicleModel::new(&undamped_bogie()).unwrap();
    let n = model.counts().magnets;
    let mut run = Run::new(&model, BOTH);
    run.speed = 0.2;
    let flat = vec![0.0; n];
    let mut ws = model.workspace();
    let rest = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap();
    let mut state = rest.state;
    for (k, load) in rest.loads.iter().enumerate() {
        // uneven, so that the bogie tilts
        run.vertical[k][0] = load * (0.3 + 0.02 * k as f64);
        run.track_rate[k][0] = 0.03;
    }
    let (h, steps) = (2e-5, 10_000);
    let mut work = 0.0;
    let mut heat = 0.0;
    let mut before: Option<[f64; 2]> = None;
    let mut first = None;
    let mut most = (0.0_f64, 0.0_f64);
    for step in 0..=steps {
        let height: Vec<f64> = run.track.iter().map(|h| h[0]).collect();
        let rate: Vec<f64> = run.track_rate.iter().map(|r| r[0]).collect();
        let track = TrackContact {
            contact: BOTH,
            speed: run.speed,
            height: &height,
            rate: &rate,
            side_rate: &[],
        };
        let power = model.contact_power(&state, &track);
        let magnets: f64 = model
            .magnets()
            .map(|k| run.vertical[k.0][0] * model.magnet(&state, k).velocity.z)
            .sum();
        let now = [magnets + power.supplied, power.dissipated];
        assert!(power.dissipated > -1e-9, "{}", power.dissipated);
        if let Some(last) = before {
            work += 0.5 * h * (now[0] + last[0]);
            heat += 0.5 * h * (now[1] + last[1]);
        }
        before = Some(now);
        let energy = model.energy(&state, &mut ws).total() + power.stored;
        let begin = *first.get_or_insert(energy);
        most.0 = most.0.max((energy - begin + heat - work).abs());
        most.1 = most.1.max(heat);
        if step < steps {
            run.step(&mut state, h, h);
            for height in &mut run.track {
                height[0] += 0.03 * h;
            }
        }
    }
    println!("work {work} J, heat {heat} J, unbalanced {} J", most.0);
    assert!(heat > 10.0 && work.abs() > 10.0);
    // the sums over steps of 2e-5 s: kinks of power of 1e9 W/s² at some ten impacts, h²/12 each
    assert!(most.0 < 1e-5 * heat, "{most:?}");
}

/// Off the rail, a step is that without contact, to the last bit.
#[test]
fn invariant_off_the_rail_nothing_changes() {
    let model = VehicleModel::new(&train::one_bogie()).unwrap();
    let n = model.counts().magnets;
    let (mut ws, zero) = (model.workspace(), vec![0.0; n]);
    let rest = model.equilibrium(&zero, &Holding::default(), &mut ws).unwrap();
    let mut run = Run::new(&model, BOTH);
    for (k, load) in rest.loads.iter().enumerate() {
        run.vertical[k] = [load * 1.01, 10.0 * k as f64, 0.0, 0.0];
    }
    let (mut plain, mut near) = (rest.state.clone(), rest.state);
    let still = vec![[0.0; 4]; n];
    for _ in 0..50 {
        let loads = LoadCourse { vertical: &run.vertical, lateral: &still };
        model.step(&mut plain, 1e-3, 0.4e-3, &loads, &mut ws).unwrap();
        run.step(&mut near, 1e-3, 0.4e-3);
        assert_eq!(plain, near);
    }
    assert!(model.magnet(&plain, FIRST).displacement.z > 1e-5);
}

fn landed(model: &VehicleModel, contact: &Contact) -> Equilibrium {
    let flat = vec![0.0; model.counts().magnets];
    let mut ws = model.workspace();
    let levitated = model.equilibrium(&flat, &Holding::default(), &mut ws).unwrap();
    model.skid_equilibrium(&flat, contact, &Holding::default(), &levitated, &mut ws).unwrap()
}

/// On the skids nothing accelerates, they carry the weight, and nothing moves by 1e-6 m in a second.
#[test]
fn invariant_all_vehicles_rest_on_their_skids() {
    for (name, seconds) in
        [("one-magnet", 1.0), ("one-bogie", 1.0), ("one-car", 0.2), ("two-car", 0.1)]
    {
        let model = VehicleModel::new(&train::by_name(name).unwrap()).unwrap();
        let rest = landed(&model, &BOTH);
        let weight = G * model.total_mass();
        assert!((rest.loads.iter().sum::<f64>() - weight).abs() < 1e-7 * weight, "{name}");
        assert!(rest.acceleration < 1e-8, "{name}: {}", rest.acceleration);
        let mut run = Run::new(&model, BOTH);
        let mut state = rest.state.clone();
        let mut moved = 0.0_f64;
        let steps = (seconds / 1e-3) as usize;
        for _ in 0..steps {
            run.step(&mut state, 1e-3, 1e-3);
            for k in model.magnets() {
                let way = model.magnet(&state, k).displacement
                    - model.magnet(&rest.state, k).displacement;
                moved = moved.max(way.amax());
            }
        }
        let depth = -model.magnet(&rest.state, FIRST).displacement.z - 0.008;
        println!(
            "{name}: {} iterations, first skid {depth} m deep, moved {moved} m",
            rest.iterations
        );
        assert!((1e-4..1e-3).contains(&depth), "{name}: {depth}");
        assert!(moved < 1e-6, "{name}: {moved}");
    }
}

/// A mass that rests on a skid at the depth d is the oscillator λ² + k χ d/m λ + k/m = 0, and its jerk
/// is that of the next small steps.
#[test]
fn analytic_small_motions_on_a_skid() {
    let model = mass(G);
    let rest = landed(&model, &BOTH);
    let mut ws = model.workspace();
    let track =
        TrackContact { contact: BOTH, speed: 0.0, height: &[0.0], rate: &[0.0], side_rate: &[] };
    let none = Loads { vertical: &[0.0], lateral: &[0.0] };
    let springs = MagnetSprings::default();
    let linear =
        model.linearise_in_contact(&rest.state, &none, &springs, Some(&track), &mut ws).unwrap();
    let depth = 250.0 * G / SKID.stiffness;
    let (stiffness, damping) = (SKID.stiffness, SKID.stiffness * SKID.damping * depth);
    let value = linear.eigenvalues[0];
    assert!((value.re + 0.5 * damping / 250.0).abs() < 1e-4, "{value}");
    assert!((value.norm_sqr() - stiffness / 250.0).abs() < 1e-3, "{value}");
    assert!(model.near_touch(&rest.state, &track, 0.9 * depth).is_none());
    assert_eq!(model.near_touch(&rest.state, &track, 1.1 * depth), Some(FIRST));

    let mut state = rest.state;
    state.bodies[0].velocity.z = -0.02;
    let mut run = Run::new(&model, BOTH);
    run.step(&mut state, 1e-3, 1e-3);
    let mut probe = model.workspace();
    model
        .jerks_in_contact(
            &state,
            &none,
            &none,
            Some(MovingTrack {
                track: &track,
                acceleration: &[0.0],
                side_acceleration: &[0.0],
                jerk: &[],
                side_jerk: &[],
            }),
            [&mut ws, &mut probe],
        )
        .unwrap();
    let jerk = model.magnet_jerk(&ws, &probe, FIRST).z;
    let mut values = Vec::new();
    for _ in 0..3 {
        model.accelerations_in_contact(&state, &none, Some(&track), &mut ws).unwrap();
        values.push(model.magnet_acceleration(&ws, FIRST).z);
        run.step(&mut state, 1e-6, 1e-6);
    }
    let slope = (-3.0 * values[0] + 4.0 * values[1] - values[2]) / 2e-6;
    assert!(jerk.abs() > 100.0 && (slope - jerk).abs() < 1e-4 * jerk.abs(), "{slope} {jerk}");
}

/// A skid under a bracket: the bracket carries what is above it.
#[test]
fn analytic_reaction_of_a_bracket_above_a_skid() {
    let mut d = empty("stack");
    d.nominal_gap = 0.008;
    d.bodies.push(body("lower", 100.0, [1.0; 3], [0.0; 3]));
    d.bodies.push(body("upper", 60.0, [1.0; 3], [0.0, 0.0, 1.0]));
    let up = Some([0.0, 0.0, 1.0]);
    d.joints.push(joint("guide", JointKind::Translational, [GROUND, "lower"], [0.0; 3], up));
    d.joints.push(joint("fix", JointKind::Bracket, ["upper", "lower"], [0.0, 0.0, 0.5], None));
    d.magnets.push(tracer("lower", [0.0; 3]));
    let model = VehicleModel::new(&d).unwrap();
    let rest = landed(&model, &BOTH);
    let track =
        TrackContact { contact: BOTH, speed: 0.0, height: &[0.0], rate: &[0.0], side_rate: &[] };
    let none = Loads { vertical: &[0.0], lateral: &[0.0] };
    let found = model
        .reaction_in_contact("fix", &rest.state, &none, Some(&track), &mut model.workspace())
        .unwrap();
    assert!((found.force.z + 60.0 * G).abs() < 1e-6, "{:?}", found.force);
}

/// Forces of skid and stop never pull, and friction stays below μ N and opposes sliding.
#[test]
fn invariant_contact_neither_pulls_nor_drives() {
    let mut noise = common::Noise(3);
    for _ in 0..10_000 {
        let law = ContactLaw {
            gap: 0.016,
            stiffness: 1e7 * (1.0 + noise.next()),
            damping: 20.0 * (1.0 + noise.next()),
            friction: 0.5,
        };
        let (depth, rate) = (1e-3 * noise.next(), noise.next());
        let normal = law.normal(depth, rate);
        assert!(normal >= 0.0 && (depth > 0.0 || normal == 0.0));
        // against the rate, at least the spring's force
        assert!((normal - law.stiffness * depth.max(0.0)) * rate >= 0.0);
        let [by_depth, by_rate] = law.slopes(depth, rate);
        assert!(by_depth >= 0.0 && by_rate >= 0.0);
    }
}

#[test]
fn refusal_of_bad_contact_data() {
    let with = |text: &str| {
        let json = train::one_magnet().to_json().unwrap();
        let json =
            json.replacen("\"observed\": []", &format!("\"observed\": [], \"contact\": {text}"), 1);
        VehicleModel::from_json(&json).map(|_| ()).unwrap_err().to_string()
    };
    for (text, words) in [
        (r#"{"stop": {"gap": 0.009, "stiffness": 1e8}}"#, "contact.stop.gap"),
        (r#"{"stop": {"gap": -0.001, "stiffness": 1e8}}"#, "contact.stop.gap"),
        (r#"{"skid": {"gap": 0.007, "stiffness": 1e8}}"#, "contact.skid.gap"),
        (r#"{"skid": {"gap": 0.016, "stiffness": 0}}"#, "contact.skid.stiffness"),
        (r#"{"skid": {"gap": 0.016, "stiffness": 1e15}}"#, "contact.skid.stiffness"),
        (r#"{"skid": {"gap": 0.016, "stiffness": 1e8, "damping": -1}}"#, "contact.skid.damping"),
        (r#"{"skid": {"gap": 0.016, "stiffness": 1e8, "friction": -1}}"#, "contact.skid.friction"),
        (r#"{"slip_speed": 0}"#, "contact.slip_speed"),
        (r#"{"skid": {"stiffness": 1e8}}"#, "gap"),
        (r#"{"skids": {"gap": 0.016, "stiffness": 1e8}}"#, "skids"),
    ] {
        let error = with(text);
        assert!(error.contains(words), "{text}: {error}");
    }
    let mut d = train::one_magnet();
    d.contact = Some(multibody::ContactDescription::default());
    let read = VehicleDescription::from_json(&d.to_json().unwrap()).unwrap();
    assert_eq!(read, d);
    let model = mass(G);
    let mut ws = model.workspace();
    let levitated = model.equilibrium(&[0.0], &Holding::default(), &mut ws).unwrap();
    let none = Contact { skid: None, ..BOTH };
    let error = model
        .skid_equilibrium(&[0.0], &none, &Holding::default(), &levitated, &mut ws)
        .unwrap_err();
    assert!(error.to_string().contains("skids in force"), "{error}");
}
