//! The linear, continuous, unlimited magnet: a linear system, integrated exactly.

use nalgebra::SMatrix;

use crate::{inputs::InputCourse, state::State};

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

/// Numbers of states, of inputs, and of what a step depends on: the state, and each input with
/// three derivatives.
const STATES: usize = 6;
const INPUTS: usize = 2;
const COLUMNS: usize = STATES + 4 * INPUTS;

/// One step's map: z(h) = Φ(h)·z(0) + Σₖ Γₖ(h)·w⁽ᵏ⁾(0), k = 0 … 3, stored by columns.
///
/// It is exact for inputs that are polynomials of third order, for any h: with the input's
/// derivatives as further states the system is homogeneous, and exp([[A, B, 0], [0, 0, I], …]·h)
/// holds Φ and all Γ. The derivatives are scaled by hᵏ (time counted in steps) so that the
/// exponential's entries stay of one size.
#[derive(Debug, Clone, PartialEq)]
struct StepMap {
    columns: [[f64; STATES]; COLUMNS],
}

impl StepMap {
    fn new(system: &LinearSystem, h: f64) -> Self {
        let mut m = SMatrix::<f64, COLUMNS, COLUMNS>::zeros();
        for i in 0..STATES {
            for j in 0..STATES {
                m[(i, j)] = h * system.a[i][j];
            }
            for j in 0..INPUTS {
                m[(i, STATES + j)] = h * system.b[i][j];
            }
        }
        for k in STATES..COLUMNS - INPUTS {
            m[(k, k + INPUTS)] = 1.0;
        }
        let exponential = m.exp();
        let mut columns = [[0.0; STATES]; COLUMNS];
        let mut scale = 1.0;
        for (j, column) in columns.iter_mut().enumerate() {
            if j > STATES && (j - STATES).is_multiple_of(INPUTS) {
                scale *= h;
            }
            for (i, value) in column.iter_mut().enumerate() {
                *value = scale * exponential[(i, j)];
            }
        }
        Self { columns }
    }

    #[inline]
    fn apply(&self, state: &mut State, course: &InputCourse, nominal_gap: f64) {
        let mut z = [0.0; STATES];
        let x = &state.filter;
        let states = [x[0], x[1], x[2], x[3], x[4], state.flux_deviation];
        add(&mut z, &self.columns[..STATES], &states);
        let (c, a) = (&course.gap, &course.acceleration);
        add(&mut z, &self.columns[STATES..], &[c[0] - nominal_gap, a[0]]);
        for k in 1..=course.order() {
            add(&mut z, &self.columns[STATES + k * INPUTS..], &[c[k], a[k]]);
        }
        state.filter.copy_from_slice(&z[..5]);
        state.flux_deviation = z[5];
    }
}

/// z += Σⱼ columnⱼ·valueⱼ.
#[inline]
fn add(z: &mut [f64; STATES], columns: &[[f64; STATES]], values: &[f64]) {
    for (column, value) in columns.iter().zip(values) {
        for (z, entry) in z.iter_mut().zip(column) {
            *z += entry * value;
        }
    }
}

/// The numbers that determine a [`LinearSystem`]: cached maps are valid while they are equal.
pub(crate) type Key = [f64; 13];

/// The data of a magnet that the exact integration uses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LinearMagnet {
    pub system: LinearSystem,
    pub key: Key,
    /// c₀, in m: the gap from which Δc counts.
    pub nominal_gap: f64,
}

/// Number of step sizes in the cache. A caller that computes its steps as differences of times uses
/// a few sizes that differ in their last bits.
const REMEMBERED: usize = 8;

/// Caches the maps of recent step sizes.
///
/// A cached map equals the newly computed one, so a workspace affects only the speed: it need not
/// be saved with a state, and may be shared between magnets.
#[derive(Debug, Clone)]
pub struct Workspace {
    key: Key,
    maps: [Option<(f64, StepMap)>; REMEMBERED],
    /// Indices of the map used last and of the map to replace next.
    last: usize,
    oldest: usize,
}

impl Default for Workspace {
    fn default() -> Self {
        Self { key: [f64::NAN; 13], maps: [const { None }; REMEMBERED], last: 0, oldest: 0 }
    }
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
        let nominal_gap = magnet.nominal_gap;
        if self.key != magnet.key {
            *self = Self { key: magnet.key, ..Self::default() };
        }
        if let Some((size, map)) = &self.maps[self.last]
            && *size == h
        {
            map.apply(state, course, nominal_gap);
        } else {
            self.find(magnet, h).apply(state, course, nominal_gap);
        }
    }

    #[cold]
    fn find(&mut self, magnet: &LinearMagnet, h: f64) -> &StepMap {
        let known = |map: &Option<(f64, StepMap)>| map.as_ref().is_some_and(|(size, _)| *size == h);
        match self.maps.iter().position(known) {
            Some(place) => self.last = place,
            None => {
                self.last = self.oldest;
                self.oldest = (self.oldest + 1) % REMEMBERED;
            }
        }
        let slot = &mut self.maps[self.last];
        if !known(slot) {
            *slot = None;
        }
        &slot.get_or_insert_with(|| (h, StepMap::new(&magnet.system, h))).1
    }
}
