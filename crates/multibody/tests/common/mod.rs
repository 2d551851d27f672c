//! Small mechanisms and runs that several tests use.
#![allow(dead_code, clippy::unwrap_used)]

use multibody::{
    Body, Inertia, Joint, JointKind, LoadCourse, MagnetIndex, MagnetPoint, State,
    VehicleDescription, VehicleModel, Workspace,
};

pub const G: f64 = 9.81;

/// A description without anything in it.
pub fn empty(name: &str) -> VehicleDescription {
    VehicleDescription {
        schema: None,
        name: name.to_owned(),
        description: String::new(),
        gravity: [0.0, 0.0, -G],
        nominal_gap: 0.0,
        bodies: vec![],
        joints: vec![],
        bushings: vec![],
        springs: vec![],
        joint_forces: vec![],
        drive: None,
        magnets: vec![],
        observed: vec![],
        contact: None,
        groups: vec![],
    }
}

pub fn body(name: &str, mass: f64, inertia: [f64; 3], position: [f64; 3]) -> Body {
    Body {
        name: name.to_owned(),
        mass,
        inertia: Inertia::Principal(inertia),
        position,
        orientation: None,
        reference: false,
    }
}

pub fn joint(
    name: &str,
    kind: JointKind,
    [a, b]: [&str; 2],
    position: [f64; 3],
    axis: Option<[f64; 3]>,
) -> Joint {
    Joint {
        name: name.to_owned(),
        kind,
        body_a: a.to_owned(),
        body_b: b.to_owned(),
        position: Some(position),
        axis,
        local_a: None,
        local_b: None,
        local_axis_a: None,
        local_axis_b: None,
    }
}

/// A point whose motion is wanted.
pub fn tracer(body: &str, position: [f64; 3]) -> MagnetPoint {
    MagnetPoint { body: body.to_owned(), position }
}

/// Steps with constant loads.
pub fn run(model: &VehicleModel, state: &mut State, h: f64, steps: usize, loads: [&[f64]; 2]) {
    let mut ws = model.workspace();
    let [vertical, lateral] =
        loads.map(|l| l.iter().map(|f| [*f, 0.0, 0.0, 0.0]).collect::<Vec<_>>());
    let course = LoadCourse { vertical: &vertical, lateral: &lateral };
    for _ in 0..steps {
        model.step(state, h, h, &course, &mut ws).unwrap();
    }
}

/// Steps without any load.
pub fn run_free(model: &VehicleModel, state: &mut State, h: f64, steps: usize) {
    let zero = vec![0.0; model.counts().magnets];
    run(model, state, h, steps, [&zero, &zero]);
}

/// Numbers in [−1, 1) from a linear congruential generator: the same on every machine.
pub struct Noise(pub u64);

impl Noise {
    pub fn next(&mut self) -> f64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A magnet controller's stand-in: spring and damper of 7e5 N/m, 8e3 N·s/m about the static load,
/// evaluated at the beginning of each step, with a disturbance on top.
pub struct Levitation {
    pub loads: Vec<f64>,
    pub vertical: Vec<[f64; 4]>,
    pub lateral: Vec<[f64; 4]>,
}

impl Levitation {
    pub fn new(loads: &[f64]) -> Self {
        let n = loads.len();
        Self { loads: loads.to_vec(), vertical: vec![[0.0; 4]; n], lateral: vec![[0.0; 4]; n] }
    }

    pub fn step(
        &mut self,
        model: &VehicleModel,
        state: &mut State,
        h: f64,
        disturbance: impl Fn(usize) -> f64,
        ws: &mut Workspace,
    ) {
        for k in 0..self.loads.len() {
            let motion = model.magnet(state, MagnetIndex(k));
            let (d, v) = (motion.displacement, motion.velocity);
            self.vertical[k][0] = self.loads[k] - 7e5 * d.z - 8e3 * v.z + disturbance(k);
            self.lateral[k][0] = -1e5 * d.y - 1e3 * v.y + 0.1 * disturbance(k);
        }
        let course = LoadCourse { vertical: &self.vertical, lateral: &self.lateral };
        model.step(state, h, 1e-3, &course, ws).unwrap();
    }
    /// The same with lateral forces by a law of guidance (load, gap, offset), undamped.
    pub fn step_guided(
        &mut self,
        model: &VehicleModel,
        state: &mut State,
        h: f64,
        guidance: &dyn Fn(f64, f64, f64) -> [f64; 2],
        ws: &mut Workspace,
    ) {
        for k in 0..self.loads.len() {
            let motion = model.magnet(state, MagnetIndex(k));
            let (d, v) = (motion.displacement, motion.velocity);
            let force = self.loads[k] - 7e5 * d.z - 8e3 * v.z;
            self.vertical[k][0] = force;
            self.lateral[k][0] = guidance(force, model.nominal_gap() - d.z, d.y)[0];
        }
        let course = LoadCourse { vertical: &self.vertical, lateral: &self.lateral };
        model.step(state, h, 1e-3, &course, ws).unwrap();
    }
}
