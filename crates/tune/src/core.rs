//! Everything but the controllers, split into parts that do not see each other.
//!
//! Equal controllers commute with an orthogonal change of basis of their forces. In a suitable one the rest of the
//! system is block-diagonal: the magnets of a train act on a girder by few patterns, and a pattern with opposite forces
//! on both sides does not reach it. The basis is the eigenvectors of a random combination of the (symmetric parts of
//! the) transfer functions at real points; two of them belong to one block if any transfer function couples them
//! (Murota, Kanno, Kojima and Kojima 2010, "A numerical algorithm for block-diagonal decomposition of matrix
//! *-algebras"). Couplings below a tolerance are left out: a train whose two sides differ by 10⁻⁴ falls into parts for
//! the search, and is one part for the figures that are shown.

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::prelude::c64;
use faer::{Mat, Side};
use linear::StateSpace;
use stability_map::{MapError, Modal};

use crate::error::TuneError;
use crate::modes::{Modes, scale};

/// Singular values below this fraction of the largest count as zero.
const NOTHING: f64 = 1e-10;
/// Couplings of patterns that the search leaves out, as a fraction of the whole transfer function.
pub(crate) const SEARCH: f64 = 1e-3;
/// Those that are rounding errors.
pub(crate) const EXACT: f64 = 1e-9;
/// Residues that are rounding errors, as a fraction of the largest. Poles that a part sees by couplings that are left out
/// have residues of the square of these.
const RESIDUE: f64 = 1e-10;
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
    /// Splits a system from `loops` forces (and further inputs) to their measurements, channel by channel: once for each
    /// tolerance. Ports are only changed if the controllers are equal.
    pub fn with<const N: usize>(
        rest: &StateSpace,
        loops: usize,
        equal: bool,
        tolerances: [f64; N],
    ) -> Result<[Self; N], TuneError> {
        let channels = rest.c.nrows() / loops.max(1);
        let b = rest.b.subcols(0, loops).to_owned();
        let d = rest.d.subcols(0, loops).to_owned();
        let modal = Modal::new(&rest.a)?;
        let lambda = modal.matrix();
        let c = modal.outputs(&rest.c);
        let inputs = modal.inputs(&b);
        let largest = scale(&lambda, &inputs, &c);
        let split = |ports: Vec<Mat<f64>>, nothing: f64| -> Result<Vec<Block>, TuneError> {
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
                let direct = seen(&d) * &ports;
                let modes = Modes::new(&lambda, &(&inputs * &ports), &seen(&c), direct, nothing)?;
                let space = modes.real();
                blocks.push(Block { ports, modes, space });
            }
            Ok(blocks)
        };
        let further = rest.b.ncols() - loops;
        let into = modal.inputs(&rest.b.subcols(loops, further).to_owned());
        let direct = rest.d.subcols(loops, further).to_owned();
        // nothing is left out here: rows of states that further inputs do not reach cost little
        let disturbed =
            Modes::new(&lambda, &into, &c, direct, RESIDUE * scale(&lambda, &into, &c))?;
        let seen = if equal { Some(Seen::new(&rest.a, &b, &rest.c, &d, loops)?) } else { None };
        let mut all = Vec::new();
        for tolerance in tolerances {
            let ports = match &seen {
                Some(seen) => seen.patterns(tolerance),
                None => vec![Mat::identity(loops, loops)],
            };
            let nothing = RESIDUE.max(tolerance * tolerance) * largest;
            all.push(Self {
                blocks: split(ports, nothing)?,
                loops,
                channels,
                disturbed: disturbed.clone(),
            });
        }
        let failed = |_| TuneError::Numerics(MapError::Loop);
        all.try_into().map_err(failed)
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

/// Transfer functions at real points, in a basis of patterns of forces in which few of them see each other.
struct Seen {
    /// Forces of the loops from the patterns.
    basis: Mat<f64>,
    all: Vec<Mat<f64>>,
}

impl Seen {
    fn new(
        a: &Mat<f64>,
        b: &Mat<f64>,
        c: &Mat<f64>,
        d: &Mat<f64>,
        loops: usize,
    ) -> Result<Self, TuneError> {
        let (n, channels) = (a.nrows(), c.nrows() / loops);
        let ports = reaching(b, d)?;
        let r = ports.ncols();
        let mut seen: Vec<(f64, Mat<f64>)> = Vec::new();
        for (s, weight) in POINTS {
            let pencil = Mat::from_fn(n, n, |i, j| if i == j { s - a[(i, j)] } else { -a[(i, j)] });
            let y = c * PartialPivLu::new(pencil.as_ref()).solve(b) + d;
            for i in 0..channels {
                let one = ports.transpose() * y.subrows(i * loops, loops) * &ports;
                let size = one.norm_l2();
                if size > 0.0 {
                    let one = Mat::from_fn(r, r, |i, j| one[(i, j)] / size);
                    seen.push((weight / (1.0 + 0.37 * i as f64), one));
                }
            }
        }
        let half = |i: usize, j: usize| -> f64 {
            seen.iter().map(|(weight, it)| 0.5 * weight * (it[(i, j)] + it[(j, i)])).sum()
        };
        let mean = Mat::from_fn(r, r, half);
        let failed = |_| MapError::Eigenvalues { what: "the patterns of forces" };
        let eigen = mean.self_adjoint_eigen(Side::Lower).map_err(failed)?;
        let turn = eigen.U();
        let all = seen.iter().map(|(_, it)| turn.transpose() * it * turn).collect();
        Ok(Self { basis: ports * turn, all })
    }

    /// Patterns in groups that see each other by no more than the tolerance.
    fn patterns(&self, tolerance: f64) -> Vec<Mat<f64>> {
        let linked = |i: usize, j: usize| {
            self.all.iter().any(|it| it[(i, j)].abs().max(it[(j, i)].abs()) > tolerance)
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for k in 0..self.basis.ncols() {
            let (mine, others): (Vec<Vec<usize>>, Vec<Vec<usize>>) =
                groups.into_iter().partition(|group| group.iter().any(|&j| linked(k, j)));
            groups = others;
            let mut joined: Vec<usize> = mine.concat();
            joined.push(k);
            joined.sort_unstable();
            groups.push(joined);
        }
        groups.sort();
        let columns = |group: &Vec<usize>| {
            Mat::from_fn(self.basis.nrows(), group.len(), |i, j| self.basis[(i, group[j])])
        };
        groups.iter().map(columns).collect()
    }
}

/// An orthonormal basis of the forces that have an effect.
fn reaching(b: &Mat<f64>, d: &Mat<f64>) -> Result<Mat<f64>, TuneError> {
    let scaled = |m: &Mat<f64>| {
        let size = m.norm_max();
        Mat::from_fn(m.nrows(), m.ncols(), |i, j| if size > 0.0 { m[(i, j)] / size } else { 0.0 })
    };
    let (b, d) = (scaled(b), scaled(d));
    let rows = b.nrows();
    let all = Mat::from_fn(b.ncols(), rows + d.nrows(), |j, i| {
        if i < rows { b[(i, j)] } else { d[(i - rows, j)] }
    });
    let failed = |_| MapError::Eigenvalues { what: "the patterns of forces" };
    let svd = all.thin_svd().map_err(failed)?;
    let rank = (0..svd.U().ncols()).take_while(|&k| svd.S()[k] > NOTHING * svd.S()[0]).count();
    Ok(svd.U().subcols(0, rank).to_owned())
}
