//! Vertical bending modes of a girder from its properties and supports, by beam elements.
//!
//! K·φ = ω²·M·φ with the stiffness K and the mass M of elements, bearings and piers. Rigid supports
//! are freedoms left out, elastic ones springs. The frequency of mode n of a girder of N elements has
//! a relative error of about (πn/N)⁴/1440.

mod element;
mod mesh;
mod rigid;
mod twist;

use std::f64::consts::PI;

use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

use crate::Error;
use crate::cubics::PiecewiseCubics;
use crate::description::GirderDescription;
use mesh::{Mesh, Spring};
pub(crate) use twist::TwistModes;

/// Largest relative error of the lowest ω² that rounding may cause.
const ROUNDING: f64 = 1e-3;

/// Modes whose deflection has less than this share of the kinetic energy are left out: a beam with rotary
/// inertia has one in which only its cross-sections turn, and no magnet can excite it.
const UNMOVED: f64 = 1e-12;

/// Modes of a beam, the lowest first.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct BeamModes {
    /// Shapes, scaled so that the largest deflection of girder and piers is 1.
    pub shapes: PiecewiseCubics,
    /// Modal masses (kg), with piers.
    pub masses: Vec<f64>,
    /// Undamped natural frequencies (Hz).
    pub frequencies: Vec<f64>,
    /// Modal damping matrix of bearings and piers (N·s/m), row by row.
    pub damping: Vec<f64>,
    /// Largest wavenumber (rad/m) of free bending waves at the highest frequency.
    pub wavenumber: f64,
}

impl BeamModes {
    /// Computes `count` modes; `path` names the girder in errors.
    ///
    /// # Errors
    /// An invalid property, a girder that its supports do not hold, or numbers so far apart that
    /// rounding would spoil the result.
    pub fn new(given: &GirderDescription, count: usize, path: &str) -> Result<Self, Error> {
        let mesh = Mesh::new(given, path)?;
        let (stiffness, mass) = assemble(&mesh);
        let (vectors, squares) = eigen(stiffness, &mass).ok_or_else(|| {
            Error::invalid(
                path,
                "the modes cannot be computed: the stiffnesses of beam and supports, or the \
                 masses, are too far apart for double precision",
                "check their units (N·m², N/m, kg/m)",
            )
        })?;
        check_rounding(&mesh, squares[0], path)?;
        let total: f64 = mesh.elements.iter().map(|e| e.mass * e.length).sum();
        let moves = |n: &usize| {
            // φᵀKφ = 1
            let mass = 1.0 / squares[*n];
            total * largest(&mesh, vectors.column(*n).as_slice()).powi(2) > UNMOVED * mass
        };
        let chosen: Vec<usize> = (0..mesh.size).filter(moves).take(count).collect();
        if chosen.len() < count {
            return Err(Error::invalid(
                format!("{path}.modes"),
                format!("{count} modes of a mesh that has {}", chosen.len()),
                "give fewer modes or more `elements`",
            ));
        }
        let squares: Vec<f64> = chosen.iter().map(|&n| squares[n]).collect();
        let mut shapes = DMatrix::zeros(mesh.size, count);
        let mut masses = Vec::new();
        for (n, &k) in chosen.iter().enumerate() {
            let vector = vectors.column(k);
            let scale = scale(&mesh, vector.as_slice());
            shapes.set_column(n, &(vector * scale));
            masses.push(scale * scale / squares[n]);
        }
        let frequencies = squares.iter().map(|w| w.sqrt() / (2.0 * PI)).collect();
        let waves =
            mesh.elements.iter().map(|e| (squares[count - 1] * e.mass / e.bending).sqrt().sqrt());
        Ok(Self {
            shapes: polynomials(&mesh, &shapes),
            masses,
            frequencies,
            damping: damping_of(&mesh.springs, &shapes),
            wavenumber: waves.fold(0.0, f64::max),
        })
    }
}

/// Eigenvectors with φᵀKφ = 1 and ω² (1/s²), lowest first; `None` if K is not positive definite in
/// double precision.
///
/// With K = LLᵀ the eigenvalues of L⁻¹ML⁻ᵀ are 1/ω². Taking the Cholesky factor of K instead of M
/// makes the low modes the large eigenvalues, which the algorithm computes most accurately: errors are
/// relative to the largest one, and ω² of the highest mode of a mesh is 10⁸ times that of the first.
/// Only additions, multiplications, divisions and roots occur, so the bits do not depend on the
/// machine.
fn eigen(stiffness: DMatrix<f64>, mass: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let size = stiffness.nrows();
    let factor = Cholesky::new(stiffness)?.unpack();
    let half = factor.solve_lower_triangular(mass)?;
    let mut inverse = factor.solve_lower_triangular(&half.transpose())?;
    inverse.fill_upper_triangle_with_lower_triangle();
    let eigen = SymmetricEigen::try_new(inverse, f64::EPSILON, 1000 * size)?;
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let mut vectors = factor.tr_solve_lower_triangular(&eigen.eigenvectors)?;
    let sorted: Vec<_> = order.iter().map(|&k| vectors.column(k).into_owned()).collect();
    for (k, column) in sorted.iter().enumerate() {
        vectors.set_column(k, column);
    }
    let squares: Vec<f64> = order.iter().map(|&k| 1.0 / eigen.eigenvalues[k]).collect();
    let sound = vectors.iter().all(|v| v.is_finite()) && squares[0] > 0.0;
    sound.then_some((vectors, squares))
}

fn assemble(mesh: &Mesh) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut stiffness = DMatrix::zeros(mesh.size, mesh.size);
    let mut mass = DMatrix::zeros(mesh.size, mesh.size);
    for (e, element) in mesh.elements.iter().enumerate() {
        let at = mesh.of_element(e);
        for (whole, part) in [(&mut stiffness, element.stiffness()), (&mut mass, element.mass())] {
            for (i, row) in at.iter().zip(&part) {
                for (j, value) in at.iter().zip(row) {
                    if let (Some(i), Some(j)) = (*i, *j) {
                        whole[(i, j)] += value;
                    }
                }
            }
        }
    }
    for spring in &mesh.springs {
        let (from, k) = (spring.from, spring.stiffness);
        stiffness[(from, from)] += k;
        if let Some(to) = spring.to {
            stiffness[(to, to)] += k;
            stiffness[(from, to)] -= k;
            stiffness[(to, from)] -= k;
        }
    }
    for &(freedom, value) in &mesh.masses {
        mass[(freedom, freedom)] += value;
    }
    (stiffness, mass)
}

/// Refuses supports so soft that rounding in the beam's stiffness would show in the lowest mode.
fn check_rounding(mesh: &Mesh, lowest: f64, path: &str) -> Result<(), Error> {
    let stiffest = mesh.elements.iter().map(|e| e.bending / (e.mass * e.length.powi(4)));
    let rounding = 12.0 * f64::EPSILON * stiffest.fold(0.0, f64::max);
    if rounding <= ROUNDING * lowest {
        return Ok(());
    }
    Err(Error::invalid(
        format!("{path}.supports"),
        format!(
            "the lowest mode, {:.3e} Hz, is too low for the beam's stiffness in double precision",
            lowest.sqrt() / (2.0 * PI)
        ),
        "check the units of stiffnesses and masses, or give fewer `elements`",
    ))
}

/// The largest deflection.
fn largest(mesh: &Mesh, vector: &[f64]) -> f64 {
    mesh.deflections.iter().fold(0.0, |m: f64, &i| m.max(vector[i].abs()))
}

/// The factor that makes the largest deflection 1, positive where the shape first exceeds half of it.
fn scale(mesh: &Mesh, vector: &[f64]) -> f64 {
    let largest = largest(mesh, vector);
    let clear = mesh.deflections.iter().map(|&i| vector[i]).find(|v| v.abs() > 0.5 * largest);
    clear.map_or(1.0, f64::signum) / largest
}

fn polynomials(mesh: &Mesh, shapes: &DMatrix<f64>) -> PiecewiseCubics {
    let mut coefficients = Vec::new();
    for (e, element) in mesh.elements.iter().enumerate() {
        let at = mesh.of_element(e);
        for n in 0..shapes.ncols() {
            let values = at.map(|i| i.map_or(0.0, |i| shapes[(i, n)]));
            coefficients.push(element.deflection(values));
        }
    }
    PiecewiseCubics::new(mesh.nodes.clone(), coefficients, shapes.ncols())
}

/// φᵢᵀCφⱼ of the dampers.
fn damping_of(springs: &[Spring], shapes: &DMatrix<f64>) -> Vec<f64> {
    let count = shapes.ncols();
    let mut matrix = vec![0.0; count * count];
    for spring in springs.iter().filter(|s| s.damping > 0.0) {
        let stretch = |n| shapes[(spring.from, n)] - spring.to.map_or(0.0, |to| shapes[(to, n)]);
        for i in 0..count {
            for j in 0..count {
                matrix[i * count + j] += spring.damping * stretch(i) * stretch(j);
            }
        }
    }
    matrix
}

#[cfg(test)]
mod tests;
