//! The system in three parts: a plant, equal or different controllers in its loops, and a small attached part.

use faer::Mat;
use faer::linalg::solvers::{PartialPivLu, Solve};

use crate::error::MapError;

/// Outputs of the plant: y = C x + D f + E γ.
#[derive(Debug, Clone)]
pub struct Output {
    /// C: by the plant's states.
    pub by_state: Mat<f64>,
    /// D: by the controllers' outputs f.
    pub by_force: Mat<f64>,
    /// E: by the attached part's outputs γ.
    pub by_attached: Mat<f64>,
}

/// Everything that is neither a controller nor attached: ẋ = A x + B f + G γ, where f has one value per controller.
#[derive(Debug, Clone)]
pub struct Plant {
    /// A.
    pub a: Mat<f64>,
    /// B.
    pub by_force: Mat<f64>,
    /// G.
    pub by_attached: Mat<f64>,
    /// What the controllers measure. Row j of each belongs to controller j.
    pub channels: Vec<Output>,
    /// What acts on the attached part.
    pub to_attached: Output,
}

/// A part of few states: ẋ = A x + B u, γ = C x.
#[derive(Debug, Clone)]
pub struct Attached {
    /// A.
    pub a: Mat<f64>,
    /// B.
    pub b: Mat<f64>,
    /// C.
    pub c: Mat<f64>,
}

impl Attached {
    /// No states, between that many inputs and outputs.
    #[must_use]
    pub fn none(inputs: usize, outputs: usize) -> Self {
        Self { a: Mat::zeros(0, 0), b: Mat::zeros(0, inputs), c: Mat::zeros(outputs, 0) }
    }
}

/// A controller with one output: ẋ = A x + B e, f = C x + D e, with one measurement e per channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Controller {
    /// A.
    pub a: Mat<f64>,
    /// B, one column per channel.
    pub b: Mat<f64>,
    /// C.
    pub c: Vec<f64>,
    /// D.
    pub d: Vec<f64>,
}

/// The controllers of all loops.
#[derive(Debug, Clone, PartialEq)]
pub enum Controllers {
    /// The same in that many loops.
    Equal(Controller, usize),
    /// One per loop.
    Each(Vec<Controller>),
}

impl Controllers {
    /// Number of loops.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Equal(_, count) => *count,
            Self::Each(all) => all.len(),
        }
    }

    /// Whether there are no loops.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The controller of a loop.
    #[must_use]
    pub fn get(&self, k: usize) -> &Controller {
        match self {
            Self::Equal(one, _) => one,
            Self::Each(all) => &all[k],
        }
    }
}

/// The matrix of the whole system: states of the plant, of the attached part, and of the controllers.
///
/// # Errors
/// [`MapError::Loop`]: controllers with feedthrough form a loop that cannot be solved.
pub fn whole(
    plant: &Plant,
    attached: &Attached,
    controllers: &Controllers,
) -> Result<Mat<f64>, MapError> {
    let (n, g, m) = (plant.a.nrows(), attached.a.nrows(), controllers.len());
    let starts: Vec<usize> = (0..m)
        .scan(n + g, |sum, k| {
            let start = *sum;
            *sum += controllers.get(k).a.nrows();
            Some(start)
        })
        .collect();
    let total = starts.last().map_or(n + g, |s| s + controllers.get(m - 1).a.nrows());
    // rows over all states: f, γ
    let mut force = Mat::<f64>::zeros(m, total);
    let mut gamma = Mat::<f64>::zeros(attached.c.nrows(), total);
    gamma.as_mut().submatrix_mut(0, n, attached.c.nrows(), g).copy_from(&attached.c);
    let mut own = Mat::<f64>::identity(m, m);
    for k in 0..m {
        let controller = controllers.get(k);
        for (j, c) in controller.c.iter().enumerate() {
            force[(k, starts[k] + j)] += c;
        }
    }
    for (i, channel) in plant.channels.iter().enumerate() {
        let seen = &channel.by_attached * &gamma;
        for k in 0..m {
            let d = controllers.get(k).d[i];
            if d == 0.0 {
                continue;
            }
            for j in 0..n {
                force[(k, j)] += d * channel.by_state[(k, j)];
            }
            for j in 0..total {
                force[(k, j)] += d * seen[(k, j)];
            }
            for j in 0..m {
                own[(k, j)] -= d * channel.by_force[(k, j)];
            }
        }
    }
    let force = PartialPivLu::new(own.as_ref()).solve(&force);
    if !force.col_iter().all(|column| column.iter().all(|x| x.is_finite())) {
        return Err(MapError::Loop);
    }
    let output = |it: &Output| {
        let mut y = &it.by_force * &force + &it.by_attached * &gamma;
        for i in 0..y.nrows() {
            for j in 0..n {
                y[(i, j)] += it.by_state[(i, j)];
            }
        }
        y
    };
    let mut a = Mat::<f64>::zeros(total, total);
    let mut add = |row: usize, block: &Mat<f64>| {
        for j in 0..block.ncols() {
            for i in 0..block.nrows() {
                a[(row + i, j)] += block[(i, j)];
            }
        }
    };
    add(0, &(&plant.by_force * &force + &plant.by_attached * &gamma));
    add(0, &plant.a);
    add(n, &(&attached.b * &output(&plant.to_attached)));
    for i in 0..g {
        for j in 0..g {
            a[(n + i, n + j)] += attached.a[(i, j)];
        }
    }
    let seen: Vec<Mat<f64>> = plant.channels.iter().map(output).collect();
    for k in 0..m {
        let controller = controllers.get(k);
        for i in 0..controller.a.nrows() {
            for j in 0..controller.a.ncols() {
                a[(starts[k] + i, starts[k] + j)] += controller.a[(i, j)];
            }
            for (channel, e) in seen.iter().enumerate() {
                let b = controller.b[(i, channel)];
                for j in 0..total {
                    a[(starts[k] + i, j)] += b * e[(k, j)];
                }
            }
        }
    }
    Ok(a)
}
