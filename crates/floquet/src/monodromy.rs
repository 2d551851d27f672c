//! The map of all states from the beginning of one period to the beginning of the next.

use faer::linalg::matmul::matmul;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Accum, Mat, MatRef, Par};

use crate::collocation::{Coefficients, NODES, nodes};
use crate::girders::GirderStep;
use crate::{FloquetError, Girders, Modal, Passage};

/// The monodromy matrix over the states z and the girders' carried states, and what the girders felt meanwhile.
#[derive(Debug, Clone)]
pub struct Monodromy {
    /// Time of a period (s).
    pub period: f64,
    /// Steps of the integration.
    pub steps: usize,
    /// The map. Rows and columns: Re z, Im z, carried states of the girders.
    pub matrix: Mat<f64>,
    /// Watched sums of outputs of the constant part in the middle of each step, per state at the beginning.
    pub watched: Vec<Mat<f64>>,
}

/// dst = lhs · rhs, or added to it.
fn product(dst: &mut Mat<f64>, add: bool, lhs: MatRef<'_, f64>, rhs: MatRef<'_, f64>) {
    let accumulate = if add { Accum::Add } else { Accum::Replace };
    matmul(dst.as_mut(), accumulate, lhs, rhs, 1.0, Par::Seq);
}

impl Monodromy {
    /// Integrates over one period at constant speed (m/s) with equal steps.
    ///
    /// In each step the constant part and the girders are exact for what acts on them, taken as polynomials through
    /// the values at the Gauss nodes. The forces at the nodes follow from one small linear system, which is the same
    /// for all columns. `watch` (sums × outputs of the constant part) shows how the motion turns.
    ///
    /// # Errors
    /// The motion overflows.
    pub fn new(
        train: &Modal,
        girders: &Girders,
        passage: &dyn Passage,
        watch: &Mat<f64>,
        speed: f64,
        steps: usize,
    ) -> Result<Self, FloquetError> {
        let period = passage.period() / speed;
        let mut machine = Machine::new(train, girders, watch, period / steps as f64);
        let (n2, carried) = (2 * train.modes(), &girders.carried);
        let columns = n2 + carried.len();
        let mut z = Mat::from_fn(n2, columns, |i, j| f64::from(u8::from(i == j)));
        let mut x = Mat::zeros(girders.states(), columns);
        for (k, &(start, _)) in carried.iter().enumerate() {
            x[(start, n2 + k)] = 1.0;
        }
        let mut watched = Vec::with_capacity(steps);
        let length = passage.period() / steps as f64;
        for step in 0..steps {
            for (k, c) in nodes().into_iter().enumerate() {
                let place = (step as f64 + c) * length;
                passage.at(place, &mut machine.see[k], &mut machine.press[k]);
            }
            watched.push(machine.step(&mut z, &mut x));
        }
        let matrix = Mat::from_fn(columns, columns, |i, j| {
            if i < n2 { z[(i, j)] } else { x[(carried[i - n2].1, j)] }
        });
        if !matrix.col_iter().all(|column| column.iter().all(|value| value.is_finite())) {
            return Err(FloquetError::Overflow { period });
        }
        Ok(Self { period, steps, matrix, watched })
    }
}

/// The node in the middle of a step.
const MIDDLE: usize = NODES / 2;

/// Everything that is constant for one step size, and room for one step.
struct Machine<'a> {
    train: &'a Modal,
    coefficients: Vec<Coefficients>,
    girders: GirderStep,
    /// P and Q at the nodes.
    see: [Mat<f64>; NODES],
    press: [Mat<f64>; NODES],
    /// Forces on the girders, and states seen.
    forces: usize,
    seen: usize,
    /// What the seen states at the nodes do to the end of the step.
    weights: Mat<f64>,
    /// The same to the constant part at one node.
    inner: Mat<f64>,
    /// K: forces at the nodes per seen states at the nodes.
    stiffness: Mat<f64>,
    /// Forces at the nodes per state of the constant part, and per state of the girders.
    by_train: Mat<f64>,
    by_girders: Mat<f64>,
    /// Watched sums at the middle node per state of the constant part, and per input at each node.
    watch_train: Mat<f64>,
    watch_input: [Mat<f64>; NODES],
}

impl<'a> Machine<'a> {
    fn new(train: &'a Modal, girders: &Girders, watch: &Mat<f64>, h: f64) -> Self {
        let (n2, forces, seen) = (2 * train.modes(), girders.forces(), girders.seen());
        let coefficients: Vec<Coefficients> =
            train.values.iter().map(|&value| Coefficients::new(value, h)).collect();
        let (output, mut turned_g) = (watch * &train.h, Mat::zeros(n2, train.inputs()));
        let mut watch_train = Mat::zeros(watch.nrows(), n2);
        decayed(&mut watch_train, 0, &output, &coefficients, MIDDLE);
        let watch_input = std::array::from_fn(|j| {
            turned(&mut turned_g, 0, &train.g, &coefficients, |it| it.inner[MIDDLE][j]);
            let through = &output * &turned_g;
            let direct = watch * &train.d;
            if j == MIDDLE { through + direct } else { through }
        });
        let see = || Mat::zeros(train.inputs(), seen);
        let press = || Mat::zeros(forces, train.outputs());
        Self {
            train,
            coefficients,
            girders: GirderStep::new(girders, h),
            see: std::array::from_fn(|_| see()),
            press: std::array::from_fn(|_| press()),
            forces,
            seen,
            weights: Mat::zeros(n2, NODES * seen),
            inner: Mat::zeros(n2, NODES * seen),
            stiffness: Mat::zeros(NODES * forces, NODES * seen),
            by_train: Mat::zeros(NODES * forces, n2),
            by_girders: Mat::zeros(NODES * forces, girders.states()),
            watch_train,
            watch_input,
        }
    }

    /// One step of all columns; returns the watched sums at the middle node.
    fn step(&mut self, z: &mut Mat<f64>, x: &mut Mat<f64>) -> Mat<f64> {
        self.connect();
        let (nf, columns) = (self.forces, z.ncols());
        // (I − K S) f = by_train z + K E x
        let girders = &self.girders;
        let mut matrix = Mat::<f64>::identity(NODES * nf, NODES * nf);
        let shift = &self.stiffness * &girders.seen_by_force;
        matrix -= &shift;
        product(
            &mut self.by_girders,
            false,
            self.stiffness.as_ref(),
            girders.seen_by_state.as_ref(),
        );
        let mut forces = Mat::zeros(NODES * nf, columns);
        product(&mut forces, false, self.by_train.as_ref(), z.as_ref());
        product(&mut forces, true, self.by_girders.as_ref(), x.as_ref());
        let forces = PartialPivLu::new(matrix.as_ref()).solve(forces);
        let mut seen = Mat::zeros(NODES * self.seen, columns);
        product(&mut seen, false, girders.seen_by_state.as_ref(), x.as_ref());
        product(&mut seen, true, girders.seen_by_force.as_ref(), forces.as_ref());
        let mut watched = &self.watch_train * &*z;
        for (j, by_input) in self.watch_input.iter().enumerate() {
            let by_seen = by_input * &self.see[j];
            let now = seen.get(j * self.seen..(j + 1) * self.seen, ..);
            product(&mut watched, true, by_seen.as_ref(), now);
        }
        let mut end = Mat::zeros(x.nrows(), columns);
        product(&mut end, false, girders.end_by_state.as_ref(), x.as_ref());
        product(&mut end, true, girders.end_by_force.as_ref(), forces.as_ref());
        *x = end;
        let n = self.train.modes();
        for mut column in z.col_iter_mut() {
            for (k, it) in self.coefficients.iter().enumerate() {
                let (re, im) = (column[k], column[n + k]);
                column[k] = it.end.re * re - it.end.im * im;
                column[n + k] = it.end.im * re + it.end.re * im;
            }
        }
        product(z, true, self.weights.as_ref(), seen.as_ref());
        watched
    }

    /// The matrices of one step from P and Q at its nodes.
    fn connect(&mut self) {
        let (nf, ns) = (self.forces, self.seen);
        let pressed: [Mat<f64>; NODES] = std::array::from_fn(|i| &self.press[i] * &self.train.h);
        let moved: [Mat<f64>; NODES] = std::array::from_fn(|j| &self.train.g * &self.see[j]);
        for (j, moved) in moved.iter().enumerate() {
            let weight = |it: &Coefficients| it.weights[j];
            turned(&mut self.weights, j * ns, moved, &self.coefficients, weight);
        }
        for (i, pressed) in pressed.iter().enumerate() {
            for (j, moved) in moved.iter().enumerate() {
                let weight = |it: &Coefficients| it.inner[i][j];
                turned(&mut self.inner, j * ns, moved, &self.coefficients, weight);
            }
            let rows = i * nf..(i + 1) * nf;
            matmul(
                self.stiffness.get_mut(rows.clone(), ..),
                Accum::Replace,
                pressed.as_ref(),
                self.inner.as_ref(),
                1.0,
                Par::Seq,
            );
            let direct = &self.press[i] * &self.train.d;
            matmul(
                self.stiffness.get_mut(rows.clone(), i * ns..(i + 1) * ns),
                Accum::Add,
                direct.as_ref(),
                self.see[i].as_ref(),
                1.0,
                Par::Seq,
            );
            decayed(&mut self.by_train, rows.start, pressed, &self.coefficients, i);
        }
    }
}

/// Rows of `into` from `first` on: outputs at a node per state at the beginning of the step.
fn decayed(
    into: &mut Mat<f64>,
    first: usize,
    outputs: &Mat<f64>,
    coefficients: &[Coefficients],
    node: usize,
) {
    let n = coefficients.len();
    for (k, it) in coefficients.iter().enumerate() {
        let e = it.decay[node];
        for row in 0..outputs.nrows() {
            let (re, im) = (outputs[(row, k)], outputs[(row, n + k)]);
            into[(first + row, k)] = re * e.re + im * e.im;
            into[(first + row, n + k)] = im * e.re - re * e.im;
        }
    }
}

/// Columns of `into` from `first` on: `moved`, each mode multiplied by its complex weight.
fn turned(
    into: &mut Mat<f64>,
    first: usize,
    moved: &Mat<f64>,
    coefficients: &[Coefficients],
    weight: impl Fn(&Coefficients) -> faer::prelude::c64,
) {
    let n = coefficients.len();
    for j in 0..moved.ncols() {
        for (k, it) in coefficients.iter().enumerate() {
            let (w, re, im) = (weight(it), moved[(k, j)], moved[(n + k, j)]);
            into[(k, first + j)] = w.re * re - w.im * im;
            into[(n + k, first + j)] = w.im * re + w.re * im;
        }
    }
}
