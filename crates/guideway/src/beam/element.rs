//! One beam element with two nodes: deflection and rotation of the cross-section at each.

use crate::pole::gauss_legendre;

/// Freedoms of an element: deflection w₁ and rotation θ₁ at the left node, w₂ and θ₂ at the right one,
/// then three that are inside, if the element is soft in shear.
pub(super) const FREEDOMS: usize = 7;
/// Those of the nodes.
pub(super) const AT_NODES: usize = 4;

type Matrix = [[f64; FREEDOMS]; FREEDOMS];

/// A straight element with constant properties: w is cubic, θ = w′ − γ quadratic.
///
/// The functions of the nodes' freedoms solve the static equations of the Timoshenko beam without load
/// between the nodes, with a constant shear strain γ. So there is no shear locking, and rigid in shear
/// (Φ = 0) they are Hermite's cubics of the Euler-Bernoulli beam. Source: Friedman & Kosmatka,
/// *Computers & Structures* 47 (1993) 473. Inertia makes γ vary within an element: three functions that
/// vanish at the nodes complete the cubics and quadratics, and with them frequencies converge with the
/// fourth power of the length for every Φ. In energy they are orthogonal to the others, which are free
/// of load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Element {
    /// Length h (m).
    pub length: f64,
    /// Bending stiffness EI (N·m²).
    pub bending: f64,
    /// Mass per length ρA (kg/m).
    pub mass: f64,
    /// Rotary inertia per length ρI (kg·m).
    pub rotary: f64,
    /// Φ = 12·EI/(κGA·h²).
    pub shear: f64,
}

impl Element {
    /// Coefficients in powers of ξ = x/h of the deflection that each freedom at 1 gives.
    fn deflection_functions(&self) -> [[f64; 4]; FREEDOMS] {
        let (h, p) = (self.length, self.shear);
        let nodes = [
            [1.0 + p, -p, -3.0, 2.0],
            [0.0, h * (1.0 + 0.5 * p), -h * (2.0 + 0.5 * p), h],
            [0.0, p, 3.0, -2.0],
            [0.0, -0.5 * h * p, -h * (1.0 - 0.5 * p), h],
        ];
        let [a, b, c, d] = nodes.map(|row| row.map(|c| c / (1.0 + p)));
        [a, b, c, d, [0.0, h, -h, 0.0], [0.0, h, -3.0 * h, 2.0 * h], [0.0; 4]]
    }

    /// Coefficients in powers of ξ of the rotation that each freedom at 1 gives.
    fn rotation_functions(&self) -> [[f64; 3]; FREEDOMS] {
        let (h, p) = (self.length, self.shear);
        let nodes = [
            [0.0, -6.0 / h, 6.0 / h],
            [1.0 + p, -(4.0 + p), 3.0],
            [0.0, 6.0 / h, -6.0 / h],
            [0.0, -(2.0 - p), 3.0],
        ];
        let [a, b, c, d] = nodes.map(|row| row.map(|c| c / (1.0 + p)));
        [a, b, c, d, [0.0; 3], [0.0; 3], [0.0, 1.0, -1.0]]
    }

    /// Stiffness matrix.
    pub fn stiffness(&self) -> Matrix {
        let (h, p) = (self.length, self.shear);
        let k = self.bending / ((1.0 + p) * h * h * h);
        let (near, far) = ((4.0 + p) * h * h, (2.0 - p) * h * h);
        let mut matrix = [[0.0; FREEDOMS]; FREEDOMS];
        let nodes = [
            [12.0, 6.0 * h, -12.0, 6.0 * h],
            [6.0 * h, near, -6.0 * h, far],
            [-12.0, -6.0 * h, 12.0, -6.0 * h],
            [6.0 * h, far, -6.0 * h, near],
        ];
        for (row, node) in matrix.iter_mut().zip(nodes) {
            row[..AT_NODES].copy_from_slice(&node.map(|v| k * v));
        }
        if p == 0.0 {
            return matrix;
        }
        // inside: ∫EI·θ′² + κGA·(w′ − θ)² dx
        let shear = 12.0 * self.bending / (p * h * h);
        let (deflection, rotation) = (self.deflection_functions(), self.rotation_functions());
        self.integrate(&mut matrix, AT_NODES, |xi, i, j| {
            let turn = |n: usize| (rotation[n][1] + 2.0 * xi * rotation[n][2]) / h;
            let strain = |n: usize| {
                let (w, r) = (deflection[n], rotation[n]);
                let slope = (w[1] + xi * (2.0 * w[2] + 3.0 * xi * w[3])) / h;
                slope - r[0] - xi * (r[1] + xi * r[2])
            };
            self.bending * turn(i) * turn(j) + shear * strain(i) * strain(j)
        });
        matrix
    }

    /// Mass matrix ∫ρA·w² + ρI·θ² dx.
    pub fn mass(&self) -> Matrix {
        let (deflection, rotation) = (self.deflection_functions(), self.rotation_functions());
        let mut matrix = [[0.0; FREEDOMS]; FREEDOMS];
        self.integrate(&mut matrix, 0, |xi, i, j| {
            let w = |n: usize| {
                let c = deflection[n];
                c[0] + xi * (c[1] + xi * (c[2] + xi * c[3]))
            };
            let theta = |n: usize| {
                let c = rotation[n];
                c[0] + xi * (c[1] + xi * c[2])
            };
            self.mass * w(i) * w(j) + self.rotary * theta(i) * theta(j)
        });
        matrix
    }

    /// Adds ∫f(ξ, i, j) dx for the freedoms from `first` on; exact for polynomials of order 7.
    fn integrate(&self, matrix: &mut Matrix, first: usize, f: impl Fn(f64, usize, usize) -> f64) {
        for (point, weight) in gauss_legendre(4) {
            let xi = 0.5 * (1.0 + point);
            for (i, row) in matrix.iter_mut().enumerate().skip(first) {
                for (j, entry) in row.iter_mut().enumerate().skip(first) {
                    *entry += 0.5 * weight * self.length * f(xi, i, j);
                }
            }
        }
    }

    /// Coefficients of the deflection in powers of the distance (m) from the left node.
    pub fn deflection(&self, freedoms: [f64; FREEDOMS]) -> [f64; 4] {
        let functions = self.deflection_functions();
        let mut sum = [0.0; 4];
        for (function, freedom) in functions.iter().zip(freedoms) {
            for (s, c) in sum.iter_mut().zip(function) {
                *s += c * freedom;
            }
        }
        let h = self.length;
        [sum[0], sum[1] / h, sum[2] / (h * h), sum[3] / (h * h * h)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [(f64, f64); 3] = [(0.0, 0.0), (0.0, 30.0), (0.7, 30.0)];

    fn element((shear, rotary): (f64, f64)) -> Element {
        Element { length: 2.0, bending: 5e6, mass: 100.0, rotary, shear }
    }

    fn form(matrix: Matrix, d: [f64; 4]) -> f64 {
        (0..4).flat_map(|i| (0..4).map(move |j| d[i] * matrix[i][j] * d[j])).sum()
    }

    #[test]
    fn analytic_rigid_motion_has_its_inertia_and_no_strain() {
        for kind in SHAPES {
            let e = element(kind);
            // w = 1, and w = x with θ = 1: mass mh; mh³/3 about the left node plus ρI·h
            for (d, inertia) in [
                ([1.0, 0.0, 1.0, 0.0], 200.0),
                ([0.0, 1.0, 2.0, 1.0], 100.0 * 8.0 / 3.0 + kind.1 * 2.0),
            ] {
                assert!((form(e.mass(), d) - inertia).abs() < 1e-12 * inertia, "{kind:?}");
                // rounding of terms of 12·EI/h³·4
                assert!(form(e.stiffness(), d).abs() < 1e-14 * 4.0 * 12.0 * 5e6 / 8.0);
            }
        }
    }

    #[test]
    fn analytic_a_cantilever_of_one_element_has_the_textbook_deflection() {
        for kind in SHAPES {
            let e = element(kind);
            let k = e.stiffness();
            // tip freedoms under a force of 1 N: PL³/3EI + PL/κGA, PL²/2EI
            let determinant = k[2][2] * k[3][3] - k[2][3] * k[3][2];
            let tip = [k[3][3] / determinant, -k[3][2] / determinant];
            let flexibility = 8.0 / (3.0 * 5e6) + kind.0 * 4.0 / (12.0 * 5e6) * 2.0;
            assert!((tip[0] / flexibility - 1.0).abs() < 1e-13, "{kind:?}");
            assert!((tip[1] / (4.0 / (2.0 * 5e6)) - 1.0).abs() < 1e-13);
            // between the nodes: P(3Lx² − x³)/6EI + Px/κGA
            let c = e.deflection([0.0, 0.0, tip[0], tip[1], 0.0, 0.0, 0.0]);
            for x in [0.3f64, 1.0, 1.9] {
                let exact = (6.0 * x * x - x.powi(3)) / (6.0 * 5e6) + kind.0 * 4.0 / 6e7 * x;
                let w = c[0] + x * (c[1] + x * (c[2] + x * c[3]));
                assert!((w / exact - 1.0).abs() < 1e-12, "{kind:?} {x}: {w} {exact}");
            }
        }
    }

    /// ρA·h/420·[156, 22h, 54, −13h; …]: the mass matrix that books print.
    #[test]
    fn analytic_mass_matrix_is_the_one_of_the_books() {
        let m = element((0.0, 0.0)).mass();
        let unit = 100.0 * 2.0 / 420.0;
        let first = [156.0, 44.0, 54.0, -26.0];
        let second = [44.0, 16.0, 26.0, -12.0];
        for j in 0..4 {
            assert!((m[0][j] - unit * first[j]).abs() < 1e-13 * 156.0 * unit);
            assert!((m[1][j] - unit * second[j]).abs() < 1e-13 * 156.0 * unit);
        }
    }

    /// The functions inside are orthogonal in energy to those of the nodes: the stiffness matrix in
    /// closed form leaves no coupling out.
    #[test]
    fn invariant_functions_inside_do_no_work_on_the_others() {
        let e = element((0.7, 30.0));
        let mut full = [[0.0; FREEDOMS]; FREEDOMS];
        let (w, r) = (e.deflection_functions(), e.rotation_functions());
        let shear = 12.0 * 5e6 / (0.7 * 4.0);
        e.integrate(&mut full, 0, |xi, i, j| {
            let turn = |n: usize| (r[n][1] + 2.0 * xi * r[n][2]) / 2.0;
            let strain = |n: usize| {
                let slope = (w[n][1] + xi * (2.0 * w[n][2] + 3.0 * xi * w[n][3])) / 2.0;
                slope - r[n][0] - xi * (r[n][1] + xi * r[n][2])
            };
            5e6 * turn(i) * turn(j) + shear * strain(i) * strain(j)
        });
        for (a, b) in full.iter().flatten().zip(e.stiffness().iter().flatten()) {
            assert!((a - b).abs() < 1e-8, "{a} {b}");
        }
    }
}
