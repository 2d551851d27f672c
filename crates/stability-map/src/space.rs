//! The reduced loop: N(s) z = 0, whose size is the rank of the plant's response plus the attached states.
//!
//! Forces f of equal controllers act on the plant and on the attached part through few combinations Qᵀf only. As
//! equal controllers commute with the change of basis Q, the loop closes in these combinations alone:
//!
//! N(s) = [ I − Σᵢ kᵢ Qᵀ Vᵢ Q,  −Σᵢ kᵢ Qᵀ Wᵢ Y γ ; −β Zᵀ U Q,  sI − A_g − β Zᵀ T Y γ ]
//!
//! with the plant's responses Vᵢ, Wᵢ from forces and from the attached outputs to the measurements, and U, T to the
//! attached part, whose matrices are B = β Zᵀ and C = Y γ. The states of the system are in it as s with det N(s) = 0,
//! apart from those that no force reaches.

use faer::linalg::matmul::matmul;
use faer::prelude::c64;
use faer::{Accum, Mat, Par};

use crate::error::MapError;
use crate::gains::Gains;
use crate::modal::Modal;
use crate::system::{Attached, Controllers, Output, Plant, whole};

/// Singular values below this fraction of the largest count as zero.
const NOTHING: f64 = 1e-11;

/// The plant with its ports reduced. It serves all controllers, and all attached parts with the same spaces of inputs
/// and outputs.
#[derive(Debug, Clone)]
pub struct Space {
    pub(crate) modal: Modal,
    /// Loops after the reduction.
    pub(crate) ports: usize,
    /// Loops before it.
    pub(crate) loops: usize,
    pub(crate) channels: usize,
    /// Columns of Z and of Y.
    pub(crate) rows: usize,
    pub(crate) columns: usize,
    /// Modal inputs: ports, then columns of Y.
    into: Mat<f64>,
    /// Modal outputs: ports of each channel, then columns of Z.
    out: Mat<f64>,
    direct: Mat<f64>,
    /// Q, or none if the ports are the loops.
    q: Option<Mat<f64>>,
    z: Mat<f64>,
    y: Mat<f64>,
}

/// An attached part in the coordinates of a [`Space`].
#[derive(Debug, Clone)]
pub struct Level {
    /// A of the attached part.
    pub a: Mat<f64>,
    /// β: B = β Zᵀ.
    pub beta: Mat<f64>,
    /// γ: C = Y γ.
    pub gamma: Mat<f64>,
}

/// N(s) z and its derivative by s.
pub(crate) struct Applied {
    pub value: Vec<c64>,
    pub slope: Vec<c64>,
}

impl Space {
    /// Decomposes the plant and reduces its ports to what `attached` and the forces span. Ports are only reduced if
    /// the controllers are equal.
    ///
    /// # Errors
    /// See [`Modal::new`].
    pub fn new(plant: &Plant, attached: &Attached, equal: bool) -> Result<Self, MapError> {
        let modal = Modal::new(&plant.a)?;
        Self::with(modal, plant, attached, equal)
    }

    /// The same plant with the spaces of another attached part.
    ///
    /// # Errors
    /// The singular values cannot be found.
    pub fn again(&self, plant: &Plant, attached: &Attached) -> Result<Self, MapError> {
        Self::with(self.modal.clone(), plant, attached, self.q.is_some())
    }

    fn with(
        modal: Modal,
        plant: &Plant,
        attached: &Attached,
        equal: bool,
    ) -> Result<Self, MapError> {
        let loops = plant.by_force.ncols();
        let z = span(&attached.b.transpose().to_owned())?;
        let y = span(&attached.c)?;
        let to = &plant.to_attached;
        let by_force = z.transpose() * &to.by_force;
        let q = if equal {
            // blocks of different units of measure are scaled to the same size
            let mut blocks = vec![&plant.by_force, &by_force];
            blocks.extend(plant.channels.iter().map(|channel| &channel.by_force));
            Some(span(&stacked(&blocks).transpose().to_owned())?)
        } else {
            None
        };
        let ports = q.as_ref().map_or(loops, Mat::ncols);
        let right = |m: &Mat<f64>| q.as_ref().map_or_else(|| m.clone(), |q| m * q);
        let left = |m: &Mat<f64>| q.as_ref().map_or_else(|| m.clone(), |q| q.transpose() * m);
        let into = modal.inputs(&beside(&right(&plant.by_force), &(&plant.by_attached * &y)));
        let mut out = Vec::new();
        let mut direct = Vec::new();
        for channel in &plant.channels {
            out.push(left(&channel.by_state));
            direct.push(left(&beside(&right(&channel.by_force), &(&channel.by_attached * &y))));
        }
        out.push(z.transpose() * &to.by_state);
        direct.push(beside(&right(&by_force), &(z.transpose() * &to.by_attached * &y)));
        Ok(Self {
            out: modal.outputs(&below(&out)),
            direct: below(&direct),
            into,
            modal,
            ports,
            loops,
            channels: plant.channels.len(),
            rows: z.ncols(),
            columns: y.ncols(),
            q,
            z,
            y,
        })
    }

    /// An attached part in the coordinates of this space, or none if it needs another one.
    #[must_use]
    pub fn level(&self, attached: &Attached) -> Option<Level> {
        let beta = &attached.b * &self.z;
        let gamma = self.y.transpose() * &attached.c;
        let fits = |whole: &Mat<f64>, again: Mat<f64>| {
            let difference = (whole - again).norm_max();
            difference <= 1e3 * NOTHING * whole.norm_max()
        };
        let fit =
            fits(&attached.b, &beta * self.z.transpose()) && fits(&attached.c, &self.y * &gamma);
        fit.then(|| Level { a: attached.a.clone(), beta, gamma })
    }

    /// The controllers of the ports.
    #[must_use]
    pub fn controllers(&self, controllers: &Controllers) -> Controllers {
        match controllers {
            Controllers::Equal(one, _) => Controllers::Equal(one.clone(), self.ports),
            Controllers::Each(all) => Controllers::Each(all.clone()),
        }
    }

    /// Size of N(s).
    #[must_use]
    pub fn size(&self, level: &Level) -> usize {
        self.ports + level.a.nrows()
    }

    /// Forces of the loops from those of the ports.
    #[must_use]
    pub fn forces(&self, z: &[c64]) -> Vec<c64> {
        let Some(q) = &self.q else { return z[..self.ports].to_vec() };
        (0..self.loops).map(|i| (0..self.ports).map(|j| z[j] * q[(i, j)]).sum()).collect()
    }

    /// N(s) z with its derivative.
    pub(crate) fn apply(&self, s: c64, gains: &Gains, level: &Level, z: &[c64]) -> Applied {
        let g = level.a.nrows();
        let (f, x) = z.split_at(self.ports);
        let u = self.inputs(level, f, x);
        let mut h = self.modal_inputs(&u);
        let n = h.len();
        self.modal.resolve(s, &mut h);
        // response and derivative at once
        let mut both = Mat::<f64>::zeros(n, 4);
        for (first, negative) in [(0, false), (2, true)] {
            if negative {
                self.modal.resolve(s, &mut h);
            }
            for (k, h) in h.iter().enumerate() {
                both[(k, first)] = h.re;
                both[(k, first + 1)] = h.im;
            }
        }
        let mut out = Mat::<f64>::zeros(self.out.nrows(), 4);
        matmul(&mut out, Accum::Replace, &self.out, &both, 1.0, Par::Seq);
        let column = |first: usize| -> Vec<c64> {
            (0..out.nrows()).map(|k| c64::new(out[(k, first)], out[(k, first + 1)])).collect()
        };
        let (mut y, slope_y) = (column(0), column(2));
        add_times(&mut y, &self.direct, &u);
        let (mut value, mut slope) = (f.to_vec(), vec![c64::new(0.0, 0.0); self.ports]);
        for i in 0..self.channels {
            for j in 0..self.ports {
                let (k, dk) = (gains.of(i, j), gains.slope_of(i, j));
                let row = i * self.ports + j;
                value[j] -= k * y[row];
                slope[j] -= dk * y[row] - k * slope_y[row];
            }
        }
        let rows = self.channels * self.ports..;
        for r in 0..g {
            let mut sum = s * x[r];
            let mut by_s = x[r];
            (0..g).for_each(|c| sum -= x[c] * level.a[(r, c)]);
            for (b, row) in rows.clone().take(self.rows).enumerate() {
                sum -= y[row] * level.beta[(r, b)];
                by_s += slope_y[row] * level.beta[(r, b)];
            }
            value.push(sum);
            slope.push(by_s);
        }
        Applied { value, slope }
    }

    /// What the controllers of the ports measure: all ports of each channel.
    pub(crate) fn measured(&self, s: c64, level: &Level, z: &[c64]) -> Vec<c64> {
        let (f, x) = z.split_at(self.ports);
        let u = self.inputs(level, f, x);
        let mut h = times(&self.into, &u);
        self.modal.resolve(s, &mut h);
        let mut y = times(&self.out, &h);
        add_times(&mut y, &self.direct, &u);
        y.truncate(self.channels * self.ports);
        y
    }

    /// The matrix of the whole reduced system, with the plant in modal coordinates.
    ///
    /// # Errors
    /// See [`whole`](crate::whole).
    pub fn whole(&self, level: &Level, controllers: &Controllers) -> Result<Mat<f64>, MapError> {
        let p = self.ports;
        let columns = |m: &Mat<f64>, first: usize, count: usize| m.subcols(first, count).to_owned();
        let output = |first: usize, count: usize| {
            let rows = |m: &Mat<f64>| m.subrows(first, count).to_owned();
            let direct = rows(&self.direct);
            Output {
                by_state: rows(&self.out),
                by_force: columns(&direct, 0, p),
                by_attached: columns(&direct, p, self.columns),
            }
        };
        let plant = Plant {
            a: self.modal.matrix(),
            by_force: columns(&self.into, 0, p),
            by_attached: columns(&self.into, p, self.columns),
            channels: (0..self.channels).map(|i| output(i * p, p)).collect(),
            to_attached: output(self.channels * p, self.rows),
        };
        let attached =
            Attached { a: level.a.clone(), b: level.beta.clone(), c: level.gamma.clone() };
        whole(&plant, &attached, controllers)
    }

    fn modal_inputs(&self, u: &[c64]) -> Vec<c64> {
        let parts = Mat::from_fn(u.len(), 2, |i, part| if part == 0 { u[i].re } else { u[i].im });
        let mut h = Mat::<f64>::zeros(self.into.nrows(), 2);
        matmul(&mut h, Accum::Replace, &self.into, &parts, 1.0, Par::Seq);
        (0..h.nrows()).map(|k| c64::new(h[(k, 0)], h[(k, 1)])).collect()
    }

    fn inputs(&self, level: &Level, f: &[c64], x: &[c64]) -> Vec<c64> {
        let mut u = f.to_vec();
        for c in 0..self.columns {
            u.push(x.iter().enumerate().map(|(j, x)| *x * level.gamma[(c, j)]).sum());
        }
        u
    }

    /// States of the plant, in modal coordinates, from z; and the left ones from w.
    pub(crate) fn plant_states(
        &self,
        s: c64,
        gains: &Gains,
        level: &Level,
        (w, z): (&[c64], &[c64]),
    ) -> (Vec<c64>, Vec<c64>) {
        let (f, x) = z.split_at(self.ports);
        let mut right = times(&self.into, &self.inputs(level, f, x));
        self.modal.resolve(s, &mut right);
        let mut weights = Vec::with_capacity(self.out.nrows());
        for i in 0..self.channels {
            weights.extend((0..self.ports).map(|j| gains.of(i, j) * w[j]));
        }
        for b in 0..self.rows {
            let x = &w[self.ports..];
            weights.push(x.iter().enumerate().map(|(r, x)| *x * level.beta[(r, b)]).sum());
        }
        let mut left = vec![c64::new(0.0, 0.0); self.modal.len()];
        for (k, left) in left.iter_mut().enumerate() {
            *left = weights.iter().enumerate().map(|(i, it)| *it * self.out[(i, k)]).sum();
        }
        self.modal.resolve_transposed(s, &mut left);
        (left, right)
    }

    /// Responses from ports and columns of Y to the measurements and columns of Z.
    pub(crate) fn response(&self, s: c64) -> Mat<c64> {
        let (n, columns) = (self.modal.len(), self.into.ncols());
        let (mut re, mut im) = (Mat::<f64>::zeros(n, columns), Mat::<f64>::zeros(n, columns));
        let mut h = vec![c64::new(0.0, 0.0); n];
        for c in 0..columns {
            for (i, h) in h.iter_mut().enumerate() {
                *h = c64::new(self.into[(i, c)], 0.0);
            }
            self.modal.resolve(s, &mut h);
            for (i, h) in h.iter().enumerate() {
                re[(i, c)] = h.re;
                im[(i, c)] = h.im;
            }
        }
        let rows = self.out.nrows();
        let (mut y_re, mut y_im) = (self.direct.clone(), Mat::<f64>::zeros(rows, columns));
        matmul(&mut y_re, Accum::Add, &self.out, &re, 1.0, Par::Seq);
        matmul(&mut y_im, Accum::Replace, &self.out, &im, 1.0, Par::Seq);
        Mat::from_fn(rows, columns, |i, j| c64::new(y_re[(i, j)], y_im[(i, j)]))
    }

    /// N(s) from the plant's response.
    pub(crate) fn matrix(&self, s: c64, gains: &Gains, level: &Level, y: &Mat<c64>) -> Mat<c64> {
        let (p, g) = (self.ports, level.a.nrows());
        let mut n = Mat::<c64>::zeros(p + g, p + g);
        // columns of the attached states: responses to columns of Y times γ
        let at = |row: usize, x: usize| -> c64 {
            (0..self.columns).map(|c| y[(row, p + c)] * level.gamma[(c, x)]).sum()
        };
        for i in 0..self.channels {
            for r in 0..p {
                let (k, row) = (gains.of(i, r), i * p + r);
                for c in 0..p {
                    n[(r, c)] -= k * y[(row, c)];
                }
                for x in 0..g {
                    n[(r, p + x)] -= k * at(row, x);
                }
            }
        }
        for r in 0..p {
            n[(r, r)] += 1.0;
        }
        let first = self.channels * p;
        for r in 0..g {
            n[(p + r, p + r)] += s;
            for x in 0..g {
                n[(p + r, p + x)] -= level.a[(r, x)];
            }
            for b in 0..self.rows {
                let beta = level.beta[(r, b)];
                for c in 0..p {
                    n[(p + r, c)] -= y[(first + b, c)] * beta;
                }
                for x in 0..g {
                    n[(p + r, p + x)] -= at(first + b, x) * beta;
                }
            }
        }
        n
    }
}

/// Orthonormal columns with the span of a matrix.
fn span(matrix: &Mat<f64>) -> Result<Mat<f64>, MapError> {
    if matrix.nrows() == 0 || matrix.ncols() == 0 || matrix.norm_max() == 0.0 {
        return Ok(Mat::zeros(matrix.nrows(), 0));
    }
    let failed = |_| MapError::Eigenvalues { what: "the ports" };
    let svd = matrix.thin_svd().map_err(failed)?;
    let largest = svd.S()[0];
    let rank = (0..svd.U().ncols()).take_while(|&k| svd.S()[k] > NOTHING * largest).count();
    Ok(svd.U().subcols(0, rank).to_owned())
}

/// Matrices one below the other, each scaled to a largest entry of 1. Zero ones are left out.
fn stacked(blocks: &[&Mat<f64>]) -> Mat<f64> {
    let kept = blocks.iter().filter(|it| it.nrows() > 0 && it.norm_max() > 0.0);
    let scaled: Vec<Mat<f64>> = kept
        .map(|it| {
            let size = it.norm_max();
            Mat::from_fn(it.nrows(), it.ncols(), |i, j| it[(i, j)] / size)
        })
        .collect();
    if scaled.is_empty() {
        return Mat::zeros(0, blocks.first().map_or(0, |it| it.ncols()));
    }
    below(&scaled)
}

fn below(blocks: &[Mat<f64>]) -> Mat<f64> {
    let rows = blocks.iter().map(Mat::nrows).sum();
    let mut all = Mat::zeros(rows, blocks.first().map_or(0, Mat::ncols));
    let mut first = 0;
    for block in blocks {
        let part = all.as_mut().submatrix_mut(first, 0, block.nrows(), block.ncols());
        { part }.copy_from(block);
        first += block.nrows();
    }
    all
}

fn beside(left: &Mat<f64>, right: &Mat<f64>) -> Mat<f64> {
    let split = left.ncols();
    Mat::from_fn(left.nrows(), split + right.ncols(), |i, j| {
        if j < split { left[(i, j)] } else { right[(i, j - split)] }
    })
}

/// Real matrix times complex vector.
fn times(matrix: &Mat<f64>, x: &[c64]) -> Vec<c64> {
    let mut y = vec![c64::new(0.0, 0.0); matrix.nrows()];
    add_times(&mut y, matrix, x);
    y
}

fn add_times(y: &mut [c64], matrix: &Mat<f64>, x: &[c64]) {
    for (j, x) in x.iter().enumerate() {
        let column = matrix.col(j);
        if let Some(column) = column.try_as_col_major() {
            for (y, &a) in y.iter_mut().zip(column.as_slice()) {
                *y += *x * a;
            }
        }
    }
}
