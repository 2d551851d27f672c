//! Everything but the controllers, split into parts that do not see each other.
//!
//! Equal controllers commute with an orthogonal change of basis of their forces. In a suitable one the rest of the
//! system is block-diagonal: the magnets of a train act on a girder by few patterns, and a pattern with opposite forces
//! on both sides does not reach it. The basis is the eigenvectors of a random combination of the (symmetric parts of
//! the) transfer functions at real points; two of them belong to one block if any transfer function couples them
//! (Murota, Kanno, Kojima and Kojima 2010, "A numerical algorithm for block-diagonal decomposition of matrix
//! *-algebras"). Nothing is left out but couplings below 10⁻⁹ of the largest.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;
use faer::{Mat, Side};
use linear::StateSpace;
use stability_map::{MapError, Modal};

use crate::error::TuneError;
use crate::modes::{Modes, scale};

/// Singular values and couplings below this fraction of the largest count as zero.
const NOTHING: f64 = 1e-9;
/// Real points (1/s) at which transfer functions are looked at, and their weights in the combination.
const POINTS: [(f64, f64); 4] = [(4.7, 1.0), (23.0, 0.618), (61.0, 0.443), (190.0, 0.271)];

/// What some ports see of the rest of the system.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Forces of the loops from those of the ports: orthonormal columns.
    pub ports: Mat<f64>,
    /// From the ports' forces to their measurements, channel by channel.
    pub modes: Modes,
    /// A, B, C of the same, real.
    pub space: [Mat<f64>; 3],
}

/// The rest of the system.
#[derive(Debug, Clone)]
pub(crate) struct Core {
    pub blocks: Vec<Block>,
    pub loops: usize,
    pub channels: usize,
    /// From further inputs to all measurements.
    disturbed: Modes,
}

impl Core {
    /// Splits a system from `loops` forces (and further inputs) to their measurements, channel by channel. Ports are
    /// only changed if the controllers are equal.
    pub fn new(rest: &StateSpace, loops: usize, equal: bool) -> Result<Self, TuneError> {
        let (n, channels) = (rest.a.nrows(), rest.c.nrows() / loops.max(1));
        let b = rest.b.subcols(0, loops).to_owned();
        let d = rest.d.subcols(0, loops).to_owned();
        let modal = Modal::new(&rest.a)?;
        let lambda = modal.matrix();
        let c = modal.outputs(&rest.c);
        let ports = if equal { patterns(&rest.a, &b, &rest.c, &d, loops)? } else { vec![Mat::identity(loops, loops)] };
        let inputs = modal.inputs(&b);
        let largest = scale(&lambda, &inputs, &c);
        let mut blocks = Vec::new();
        for ports in ports {
            let p = ports.ncols();
            let seen = |m: &Mat<f64>| {
                let mut all = Mat::zeros(channels * p, m.ncols());
                for i in 0..channels {
                    let rows = ports.transpose() * m.subrows(i * loops, loops);
                    all.as_mut().submatrix_mut(i * p, 0, p, m.ncols()).copy_from(&rows);
                }
                all
            };
            let modes = Modes::new(&lambda, &(&inputs * &ports), &seen(&c), seen(&d) * &ports, largest)?;
            let space = modes.real();
            blocks.push(Block { ports, modes, space });
        }
        let further = rest.b.ncols() - loops;
        let into = modal.inputs(&rest.b.subcols(loops, further).to_owned());
        let direct = rest.d.subcols(loops, further).to_owned();
        // nothing is left out here: rows of states that further inputs do not reach cost little
        let disturbed = Modes::new(&lambda, &into, &c, direct, scale(&lambda, &into, &c))?;
        debug_assert_eq!(lambda.nrows(), n);
        Ok(Self { blocks, loops, channels, disturbed })
    }

    /// Measurements without the controllers' answer, from further inputs.
    pub fn disturbed(&self, s: c64, inputs: &[c64]) -> Vec<c64> {
        self.disturbed.apply(s, inputs)
    }

    /// Number of states of all blocks.
    pub fn states(&self) -> usize {
        self.blocks.iter().map(|it| it.modes.len()).sum()
    }

    /// Ports of the largest block.
    pub fn widest(&self) -> usize {
        self.blocks.iter().map(|it| it.ports.ncols()).max().unwrap_or(0)
    }
}

/// Patterns of forces in groups that do not see each other. Forces without any effect are in none.
fn patterns(
    a: &Mat<f64>,
    b: &Mat<f64>,
    c: &Mat<f64>,
    d: &Mat<f64>,
    loops: usize,
) -> Result<Vec<Mat<f64>>, TuneError> {
    let (n, channels) = (a.nrows(), c.nrows() / loops);
    let mut seen: Vec<Mat<f64>> = Vec::new();
    for (s, _) in POINTS {
        let pencil = Mat::from_fn(n, n, |i, j| if i == j { s - a[(i, j)] } else { -a[(i, j)] });
        let y = c * PartialPivLu::new(pencil.as_ref()).solve(b) + d;
        for i in 0..channels {
            let one = y.subrows(i * loops, loops).to_owned();
            let size = one.norm_l2();
            if size > 0.0 {
                seen.push(Mat::from_fn(loops, loops, |r, c| one[(r, c)] / size));
            }
        }
    }
    let weight = |k: usize| POINTS[(k / channels.max(1)) % POINTS.len()].1 / (1.0 + 0.37 * (k % channels.max(1)) as f64);
    let mut mean = Mat::<f64>::zeros(loops, loops);
    for (k, it) in seen.iter().enumerate() {
        let w = weight(k);
        for j in 0..loops {
            for i in 0..loops {
                mean[(i, j)] += 0.5 * w * (it[(i, j)] + it[(j, i)]);
            }
        }
    }
    let failed = |_| MapError::Eigenvalues { what: "the patterns of forces" };
    let eigen = mean.self_adjoint_eigen(Side::Lower).map_err(failed)?;
    let basis = eigen.U();
    let turned: Vec<Mat<f64>> = seen.iter().map(|it| basis.transpose() * it * basis).collect();
    let linked = |i: usize, j: usize| turned.iter().any(|it| it[(i, j)].abs().max(it[(j, i)].abs()) > NOTHING);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in (0..loops).filter(|&k| (0..loops).any(|j| linked(k, j))) {
        let (mine, others): (Vec<Vec<usize>>, Vec<Vec<usize>>) =
            groups.into_iter().partition(|group| group.iter().any(|&j| linked(k, j)));
        groups = others;
        let mut joined: Vec<usize> = mine.concat();
        joined.push(k);
        joined.sort_unstable();
        groups.push(joined);
    }
    groups.sort();
    Ok(groups.iter().map(|group| Mat::from_fn(loops, group.len(), |i, j| basis[(i, group[j])])).collect())
}
