//! Solutions of the coupled equations: over time, and their eigenvalues.

use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};
use faer::Mat;
use nalgebra::Complex;

use super::equations::{BODY, MAGNET};
use super::{Instant, MonolithicSystem};

/// Eigenvalues below are those of coordinates without motion, 1/s: double zeros, which differences of
/// 1e-9 move by the root of that times the equations' size.
pub const STATIC: f64 = 0.5;

/// Signals at the requested times.
#[derive(Debug, Clone, Default)]
pub struct Trajectory {
    /// Times (s).
    pub time: Vec<f64>,
    /// Every magnet, at every time.
    pub magnets: Vec<Vec<Instant>>,
    /// Vertical and lateral displacement (m) and twist (rad) of the middle of each span, at every time.
    pub midspan: Vec<Vec<[f64; 3]>>,
    /// Largest violation of a joint at the end (m or rad).
    pub opening: f64,
    /// Evaluations of the right-hand side.
    pub evaluations: usize,
}

impl MonolithicSystem {
    /// Solves from t = 0 to each of `times` (s, ascending, the first may be 0) with relative
    /// tolerance `tolerance`; the absolute tolerances are derived from it and the size of each kind
    /// of state.
    ///
    /// # Errors
    /// A gap closed, a joint became singular, or the integrator failed.
    pub fn solve(&self, times: &[f64], tolerance: f64) -> Result<Trajectory, String> {
        let stop = times.last().copied().unwrap_or(0.0);
        let method = ExplicitRungeKutta::dop853()
            .rtol(tolerance)
            .atol(self.absolute_tolerances(tolerance))
            .h_max(2e-3)
            .max_steps(usize::MAX);
        let solution = IVP::ode(self, 0.0, stop, self.start.clone())
            .t_eval(times)
            .method(method)
            .solve()
            .map_err(|e| self.failure().unwrap_or_else(|| format!("{e:?}")))?;
        let mut trajectory =
            Trajectory { evaluations: solution.evals.function, ..Trajectory::default() };
        let mut scratch = self.scratch.borrow_mut();
        let scratch = &mut *scratch;
        for (&t, y) in solution.t.iter().zip(&solution.y) {
            self.unpack(t, y, scratch);
            self.evaluate(t, scratch)?;
            trajectory.time.push(t);
            trajectory.magnets.push(scratch.at.clone());
            trajectory.midspan.push(scratch.track.midspans());
        }
        trajectory.opening =
            self.vehicle.constraint_violation(&scratch.bodies, &mut scratch.vehicle).0;
        Ok(trajectory)
    }

    /// Eigenvalues (1/s) of the equations linearised about the start by central differences,
    /// largest magnitude first. Those near zero come from coordinates without motion: violated
    /// joints, lengths of quaternions; only |λ| > [`STATIC`] is returned.
    ///
    /// # Errors
    /// A state near the initial state cannot be evaluated.
    pub fn eigenvalues(&self) -> Result<Vec<Complex<f64>>, String> {
        let n = self.start.len();
        let mut jacobian = Mat::zeros(n, n);
        let (mut y, mut above, mut below) = (self.start.clone(), vec![0.0; n], vec![0.0; n]);
        for (k, size) in self.absolute_tolerances(1.0).into_iter().enumerate() {
            // a thousandth of the usual size of the state: forces are nonlinear over millimetres
            let by = 1e-3 * size;
            y[k] = self.start[k] + by;
            self.rates(0.0, &y, &mut above)?;
            y[k] = self.start[k] - by;
            self.rates(0.0, &y, &mut below)?;
            y[k] = self.start[k];
            for (i, (a, b)) in above.iter().zip(&below).enumerate() {
                jacobian[(i, k)] = (a - b) / (2.0 * by);
            }
        }
        let mut values = jacobian.eigenvalues().map_err(|e| format!("{e:?}"))?;
        values.retain(|value| value.norm() > STATIC);
        values.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
        Ok(values)
    }

    fn failure(&self) -> Option<String> {
        self.scratch.borrow_mut().failure.take()
    }

    /// Sizes that the tolerance is relative to, for states near zero: 1 mm, 1 mm/s, 1e-3 rad; the
    /// filter's states and the flux as they answer to a gap that is 0.1 mm off.
    fn absolute_tolerances(&self, tolerance: f64) -> Vec<f64> {
        let scratch = self.scratch.borrow();
        let mut sizes = vec![1e-3; BODY * scratch.bodies.bodies.len()];
        let inputs = magnet::MagnetInputs {
            gap: self.vehicle.nominal_gap() + 1e-4,
            static_force: self.loads[0],
            ..magnet::MagnetInputs::default()
        };
        let size = self.magnet.initialise(&inputs, 0.0).map_or(1e-3, |state| {
            state.filter.iter().chain([&state.flux_deviation]).fold(0.0_f64, |m, x| m.max(x.abs()))
        });
        sizes.extend(std::iter::repeat_n(size, MAGNET * self.loads.len()));
        sizes.extend(std::iter::repeat_n(1e-3, 2 * scratch.track.modes()));
        sizes.iter().map(|size| size * tolerance).collect()
    }
}

impl ODE<f64, Vec<f64>> for MonolithicSystem {
    fn diff(&self, t: f64, y: &Vec<f64>, rates: &mut Vec<f64>) {
        if let Err(message) = self.rates(t, y, rates) {
            self.scratch.borrow_mut().failure.get_or_insert(message);
            rates.fill(f64::NAN);
        }
    }
}
