//! The linear, continuous, unlimited magnet: a linear system, integrated exactly.

use crate::{
    electromagnet::Electromagnet,
    inputs::{InputCourse, Taylor},
    state::State,
    step_map::MapCache,
};

/// z' = A·z + B·w with the state z = (x₁ … x₅, Δλ) and the inputs w = (Δc, q̈), and the force
/// deviation ΔF = force_by_state·z: eqs 1-5 with the controller closed.
///
/// For the nonlinear law it is the linearisation about a resting operating point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearSystem {
    /// A, row by row.
    pub a: [[f64; 6]; 6],
    /// B, row by row.
    pub b: [[f64; 2]; 6],
    /// Force per state, in N and N/Wb. No input feeds through to the force.
    pub force_by_state: [f64; 6],
}

/// Eqs 1 and 2 without a controller: Δλ' = a·Δλ + b·(Δc, Δv), ΔF = force_by_flux·Δλ.
///
/// For the nonlinear law it is the linearisation about a resting operating point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoilSystem {
    /// a = −R/L₀, in 1/s.
    pub a: f64,
    /// b = (−R·k_c/kᵢ in V/m, 1).
    pub b: [f64; 2],
    /// kᵢ/L₀, in N/Wb.
    pub force_by_flux: f64,
}

impl CoilSystem {
    /// Δλ' = Δv − R·Δi with Δi = Δλ/L₀ + (k_c/kᵢ)·Δc.
    pub(crate) fn new(magnet: &Electromagnet) -> Self {
        let current_by_gap = magnet.gap_stiffness / magnet.current_stiffness;
        Self {
            a: -magnet.resistance / magnet.inductance,
            b: [-magnet.resistance * current_by_gap, 1.0],
            force_by_flux: magnet.current_stiffness / magnet.inductance,
        }
    }

    fn key(&self) -> [f64; 2] {
        [self.a, self.b[0]]
    }
}

/// The numbers that determine a [`LinearSystem`]: cached maps are valid while they are equal.
pub(crate) type Key = [f64; 13];

/// The data of a magnet that the exact integration uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearMagnet {
    pub system: LinearSystem,
    pub coil: CoilSystem,
    pub key: Key,
    /// c₀, in m: the gap from which Δc counts.
    pub nominal_gap: f64,
}

/// Caches the maps of recent step sizes.
///
/// A cached map equals the newly computed one, so a workspace affects only the speed: it need not
/// be saved with a state, and may be shared between magnets.
#[derive(Debug, Clone, Default)]
pub struct Workspace {
    controlled: MapCache<13, 6, 14>,
    coil: MapCache<2, 1, 9>,
}

impl Workspace {
    /// Exact step of a magnet for which [`Magnet::is_exact`](crate::Magnet::is_exact) holds.
    #[inline]
    pub(crate) fn step(
        &mut self,
        magnet: &LinearMagnet,
        state: &mut State,
        course: &InputCourse,
        h: f64,
    ) {
        let x = &state.filter;
        let z = [x[0], x[1], x[2], x[3], x[4], state.flux_deviation];
        let gap = deviation(course, magnet.nominal_gap);
        let system = || (&magnet.system.a, &magnet.system.b);
        let inputs = [&gap, &course.acceleration];
        let further = [course.further.gap, course.further.acceleration];
        let z = self.controlled.step(&magnet.key, system, &z, (inputs, further), h);
        state.filter.copy_from_slice(&z[..5]);
        state.flux_deviation = z[5];
    }

    /// Exact step of a magnet whose controller is left out.
    #[inline]
    pub(crate) fn step_coil(
        &mut self,
        magnet: &LinearMagnet,
        state: &mut State,
        course: &InputCourse,
        h: f64,
    ) {
        let CoilSystem { a, b, .. } = magnet.coil;
        let (a, b) = ([[a]], [b]);
        let gap = deviation(course, magnet.nominal_gap);
        let inputs = [&gap, &course.voltage_command];
        let key = magnet.coil.key();
        let further = [course.further.gap, course.further.voltage_command];
        [state.flux_deviation] =
            self.coil.step(&key, || (&a, &b), &[state.flux_deviation], (inputs, further), h);
    }
}

/// Δc over the step.
#[inline]
fn deviation(course: &InputCourse, nominal_gap: f64) -> Taylor {
    let [gap, rate, second, third] = course.gap;
    [gap - nominal_gap, rate, second, third]
}
