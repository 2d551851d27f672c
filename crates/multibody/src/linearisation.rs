//! The result of a linearisation: reduced matrices, eigenvalues and mode shapes.

use nalgebra::{Complex, DMatrix, DVector, Matrix6, Vector3, Vector6};

use crate::error::Error;

/// Inverse iterations; each gains as many digits as the eigenvalue has.
const SHAPE_ITERATIONS: usize = 3;

/// A body in a mode shape, up to the mode's common complex factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyShape {
    /// Of the centre of mass, world axes.
    pub displacement: Vector3<Complex<f64>>,
    /// Body axes.
    pub rotation: Vector3<Complex<f64>>,
    /// Fraction of yᴴ M_r y, which for a vibration about rest is the body's fraction of the kinetic
    /// energy.
    pub share: f64,
}

/// Small motions about a state.
#[derive(Debug, Clone)]
pub struct Linearisation {
    /// Rank of Φ_q at the state, after merging of fixed joints.
    pub rank: usize,
    /// N by columns: for each body a displacement in world axes and a rotation in body axes.
    pub basis: DMatrix<f64>,
    /// M_r, symmetric and positive definite.
    pub mass: DMatrix<f64>,
    /// C_r; its antisymmetric part is gyroscopic.
    pub damping: DMatrix<f64>,
    /// K_r; symmetric where all forces have a potential and the state is an equilibrium.
    pub stiffness: DMatrix<f64>,
    /// Eigenvalues in 1/s, slowest first, of a conjugate pair only the one with positive imaginary
    /// part.
    pub eigenvalues: Vec<Complex<f64>>,
    /// On a line: slopes of the magnets' inertial accelerations along the line's up axis with y and with ẏ,
    /// under held forces, one row per magnet. On a straight track they follow from the other matrices.
    pub magnet_accelerations: Option<[DMatrix<f64>; 2]>,
    /// Mass matrices of the bodies in the axes of `basis`.
    pub(crate) body_masses: Vec<Matrix6<f64>>,
}

/// |λ|, rad/s: for a pair the natural frequency.
#[must_use]
pub fn natural_frequency(eigenvalue: Complex<f64>) -> f64 {
    eigenvalue.re.hypot(eigenvalue.im)
}

/// ζ = −Re λ / |λ|, and 0 for λ = 0.
#[must_use]
pub fn damping_ratio(eigenvalue: Complex<f64>) -> f64 {
    let size = natural_frequency(eigenvalue);
    if size > 0.0 { -eigenvalue.re / size } else { 0.0 }
}

impl Linearisation {
    /// Number of reduced coordinates: 6 per body minus the rank.
    #[must_use]
    pub fn degrees_of_freedom(&self) -> usize {
        self.mass.nrows()
    }

    /// Shape of the mode with eigenvalue λ, by inverse iteration on λ² M_r + λ C_r + K_r. Where
    /// several modes share an eigenvalue to all digits, this is one of their combinations.
    ///
    /// # Errors
    /// [`Error::Eigenvalues`] if λ is not an eigenvalue.
    pub fn shape(&self, eigenvalue: Complex<f64>) -> Result<Vec<BodyShape>, Error> {
        let y = self.reduced_shape(eigenvalue)?;
        let motion = self.basis.map(Complex::from) * y;
        let twists: Vec<Vector6<Complex<f64>>> = motion
            .as_slice()
            .as_chunks::<6>()
            .0
            .iter()
            .map(|chunk| Vector6::from(*chunk))
            .collect();
        let energies: Vec<f64> = twists
            .iter()
            .zip(&self.body_masses)
            .map(|(twist, mass)| twist.dotc(&(mass.map(Complex::from) * twist)).re)
            .collect();
        let total: f64 = energies.iter().sum();
        Ok(twists
            .iter()
            .zip(energies)
            .map(|(twist, energy)| BodyShape {
                displacement: twist.fixed_rows::<3>(0).into_owned(),
                rotation: twist.fixed_rows::<3>(3).into_owned(),
                share: energy / total,
            })
            .collect())
    }

    /// y of a mode, of unit norm.
    fn reduced_shape(&self, eigenvalue: Complex<f64>) -> Result<DVector<Complex<f64>>, Error> {
        let failed = || Error::Eigenvalues { eigenvalue: Some((eigenvalue.re, eigenvalue.im)) };
        // slightly off the eigenvalue, so that the matrix is not singular
        let beside = eigenvalue + Complex::from(1e-9 * natural_frequency(eigenvalue).max(1e-3));
        let pencil = |at: Complex<f64>| {
            let (square, mut sum) = (at * at, self.stiffness.map(Complex::from));
            for ((s, m), c) in sum.iter_mut().zip(self.mass.iter()).zip(self.damping.iter()) {
                *s += square * *m + at * *c;
            }
            sum
        };
        let factors = pencil(beside).lu();
        // any start vector with a component of every mode works; this one is the same on every
        // machine
        let mut y = DVector::from_fn(self.degrees_of_freedom(), |k, _| {
            let t = k as f64 + 1.0;
            Complex::new((1.7 * t * t).sin(), (0.3 + 2.3 * t).cos())
        });
        for _ in 0..SHAPE_ITERATIONS {
            // the pencil is symmetric about rest: its left vector is y, whose product with the
            // conjugate of y cannot vanish
            y = factors.solve(&y.conjugate()).ok_or_else(failed)?;
            let size = y.norm();
            if !(size.is_finite() && size > 0.0) {
                return Err(failed());
            }
            y /= Complex::from(size);
        }
        // the phase of a complex vector is arbitrary: its largest component is made real
        let largest = y.iter().copied().max_by(|a, b| a.norm_sqr().total_cmp(&b.norm_sqr()));
        if let Some(largest) = largest {
            y *= largest.conj() / Complex::from(largest.norm_sqr().sqrt());
        }
        Ok(y)
    }
}
