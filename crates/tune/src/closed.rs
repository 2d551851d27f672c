//! The closed loop of one block: its matrix, and what its ports answer at a frequency.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;

use crate::core::Block;
use crate::split::Law;

/// The laws of all loops.
#[derive(Debug, Clone)]
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
            force: (0..channels).map(|j| by(&law.force, j)).collect(),
            signal: (0..channels).map(|j| by(&law.signal, j) + law.direct[j]).collect(),
            force_added: by(&law.force, channels),
            signal_added: by(&law.signal, channels) + law.added_direct,
        }
    }
}

/// The matrix of the closed loop: states of the block, then of the controllers of its ports.
pub(crate) fn matrix(block: &Block, laws: &Laws) -> Mat<f64> {
    let [a, b, c] = &block.space;
    let (n, p) = (a.nrows(), block.ports.ncols());
    let k = laws.of(0).a.nrows();
    let channels = laws.of(0).b.ncols();
    let d = &block.modes.direct;
    let mut all = Mat::<f64>::zeros(n + p * k, n + p * k);
    all.as_mut().submatrix_mut(0, 0, n, n).copy_from(a);
    for j in 0..p {
        let law = laws.of(j);
        let first = n + j * k;
        for (l, &force) in law.force.iter().enumerate() {
            for i in 0..n {
                all[(i, first + l)] += b[(i, j)] * force;
            }
        }
        for r in 0..k {
            for l in 0..k {
                all[(first + r, first + l)] += law.a[(r, l)];
            }
        }
    }
    for row in 0..p {
        let law = laws.of(row);
        let first = n + row * k;
        for r in 0..k {
            for channel in 0..channels {
                let gain = law.b[(r, channel)];
                if gain == 0.0 {
                    continue;
                }
                let seen = channel * p + row;
                for i in 0..n {
                    all[(first + r, i)] += gain * c[(seen, i)];
                }
                for j in 0..p {
                    let direct = gain * d[(seen, j)];
                    if direct != 0.0 {
                        for (l, &force) in laws.of(j).force.iter().enumerate() {
                            all[(first + r, n + j * k + l)] += direct * force;
                        }
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
