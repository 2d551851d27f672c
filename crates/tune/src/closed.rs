//! The closed loop of one block: its matrix, and what its ports answer at a frequency.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::core::Block;
use crate::split::Law;

/// The laws of all loops.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "one for each condition")]
pub(crate) enum Laws {
    /// The same in all.
    Equal(Law),
    /// One per loop; then the ports are the loops.
    Each(Vec<Law>),
}

impl Laws {
    pub fn of(&self, port: usize) -> &Law {
        match self {
            Self::Equal(law) => law,
            Self::Each(all) => &all[port],
        }
    }
}

/// Transfer functions of a law at a point: per channel to the force and to the broken signal, and from what adds to the
/// signal to both.
#[derive(Debug, Clone)]
pub(crate) struct At {
    pub force: Vec<c64>,
    /// From what only the controller reads, such as noise of a sensor, to the force.
    pub force_read: Vec<c64>,
    pub signal: Vec<c64>,
    pub force_added: c64,
    pub signal_added: c64,
}

impl At {
    pub fn new(law: &Law, s: c64) -> Self {
        let (n, channels) = (law.a.nrows(), law.b.ncols());
        let pencil = Mat::from_fn(n, n, |i, j| {
            let value = c64::new(-law.a[(i, j)], 0.0);
            if i == j { s + value } else { value }
        });
        let right = Mat::from_fn(n, channels + 1, |i, j| {
            c64::new(if j < channels { law.b[(i, j)] } else { law.added[i] }, 0.0)
        });
        let x = PartialPivLu::new(pencil.as_ref()).solve(&right);
        let by = |row: &[f64], j: usize| {
            row.iter().enumerate().map(|(i, c)| x[(i, j)] * *c).sum::<c64>()
        };
        Self {
            force: (0..channels).map(|j| by(&law.force, j) + law.force_change[j]).collect(),
            force_read: (0..channels).map(|j| by(&law.force, j) + law.force_direct[j]).collect(),
            signal: (0..channels).map(|j| by(&law.signal, j) + law.direct[j]).collect(),
            force_added: by(&law.force, channels) + law.force_added,
            signal_added: by(&law.signal, channels) + law.added_direct,
        }
    }
}

/// Forces of the ports of a block by its states and by those of the controllers: with the controllers' states x, the states
/// z of the block and the measurements C z + D f, f = F_x x + Δ (C z + D f).
fn forces(block: &Block, laws: &Laws) -> [Mat<f64>; 2] {
    let c = &block.space[2];
    let d = &block.modes.direct;
    let (n, p) = (c.ncols(), block.ports.ncols());
    let k = laws.of(0).a.nrows();
    let mut by_law = Mat::<f64>::zeros(p, p * k);
    for j in 0..p {
        for (l, &force) in laws.of(j).force.iter().enumerate() {
            by_law[(j, j * k + l)] = force;
        }
    }
    if (0..p).all(|j| laws.of(j).force_change.iter().all(|it| *it == 0.0)) {
        return [Mat::zeros(p, n), by_law];
    }
    let passed = |m: &Mat<f64>| {
        Mat::from_fn(p, m.ncols(), |j, column| {
            let change = laws.of(j).force_change.iter().enumerate();
            change.map(|(channel, by)| by * m[(channel * p + j, column)]).sum::<f64>()
        })
    };
    let loops = PartialPivLu::new((Mat::<f64>::identity(p, p) - passed(d)).as_ref());
    [loops.solve(passed(c)), loops.solve(by_law)]
}

/// The matrix of the closed loop: states of the block, then of the controllers of its ports.
pub(crate) fn matrix(block: &Block, laws: &Laws) -> Mat<f64> {
    let [a, b, c] = &block.space;
    let (n, p) = (a.nrows(), block.ports.ncols());
    let k = laws.of(0).a.nrows();
    let [by_block, by_law] = forces(block, laws);
    let mut all = Mat::<f64>::zeros(n + p * k, n + p * k);
    all.as_mut().submatrix_mut(0, 0, n, n).copy_from(a + b * &by_block);
    all.as_mut().submatrix_mut(0, n, n, p * k).copy_from(b * &by_law);
    let d = &block.modes.direct;
    let seen = c + d * &by_block;
    for j in 0..p {
        let law = laws.of(j);
        let first = n + j * k;
        for r in 0..k {
            for l in 0..k {
                all[(first + r, first + l)] += law.a[(r, l)];
            }
            for channel in 0..law.b.ncols() {
                let gain = law.b[(r, channel)];
                if gain == 0.0 {
                    continue;
                }
                let row = channel * p + j;
                for i in 0..n {
                    all[(first + r, i)] += gain * seen[(row, i)];
                }
                for port in (0..p).filter(|&port| d[(row, port)] != 0.0) {
                    let direct = gain * d[(row, port)];
                    for l in 0..p * k {
                        all[(first + r, n + l)] += direct * by_law[(port, l)];
                    }
                }
            }
        }
    }
    all
}

/// What the ports of a block answer at a frequency, in the ports' coordinates.
pub(crate) struct Answer {
    /// Y: the broken signal by what the loops' forces see, (Σ cᵢ Pᵢ)(I − Σ kᵢ Pᵢ)⁻¹.
    pub by_force: Mat<c64>,
    /// S: what acts at the broken signal by what adds to it.
    pub sensitivity: Mat<c64>,
}

/// The answer of a block.
pub(crate) fn answer(block: &Block, at: &dyn Fn(usize) -> At, s: c64, equal: bool) -> Answer {
    let p = block.ports.ncols();
    let response = block.modes.at(s);
    let laws: Vec<At> = if equal { vec![at(0)] } else { (0..p).map(at).collect() };
    let law = |j: usize| &laws[if equal { 0 } else { j }];
    let channels = laws[0].force.len();
    let mut loops = Mat::<c64>::identity(p, p);
    let mut signal = Mat::<c64>::zeros(p, p);
    for channel in 0..channels {
        for j in 0..p {
            for i in 0..p {
                let y = response[(channel * p + i, j)];
                loops[(i, j)] -= law(i).force[channel] * y;
                signal[(i, j)] += law(i).signal[channel] * y;
            }
        }
    }
    // Y = signal · loops⁻¹ from loopsᵀ Yᵀ = signalᵀ
    let turned = PartialPivLu::new(loops.transpose()).solve(signal.transpose());
    let by_force = turned.transpose().to_owned();
    let sensitivity = Mat::from_fn(p, p, |i, j| {
        let own = if i == j { 1.0 + law(i).signal_added } else { c64::new(0.0, 0.0) };
        own + by_force[(i, j)] * law(j).force_added
    });
    Answer { by_force, sensitivity }
}
