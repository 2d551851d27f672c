//! Exact steps of a linear system whose inputs are polynomials.

use nalgebra::{Const, DMatrix, DimMin, SMatrix};

use crate::inputs::{Further, Taylor};

/// Inputs of every system here.
const INPUTS: usize = 2;

/// One step's map: z(h) = Φ(h)·z(0) + Σₖ Γₖ(h)·w⁽ᵏ⁾(0), k = 0 … 3, stored by columns, for
/// z' = A·z + B·w with `S` states and two inputs; `C` = `S` + 4·2 columns.
///
/// It is exact for inputs that are polynomials of third order (of fifth with [`further`]), for any h: with the input's
/// derivatives as further states the system is homogeneous, and exp([[A, B, 0], [0, 0, I], …]·h)
/// holds Φ and all Γ. The derivatives are scaled by hᵏ (time counted in steps) so that the
/// exponential's entries stay of one size.
#[derive(Debug, Clone, PartialEq)]
struct StepMap<const S: usize, const C: usize> {
    columns: [[f64; S]; C],
    /// Γ₄ and Γ₅; computed when first needed, so that inputs of third order cost nothing more.
    further: Option<[[f64; S]; 2 * INPUTS]>,
}

impl<const S: usize, const C: usize> StepMap<S, C>
where
    Const<C>: DimMin<Const<C>, Output = Const<C>>,
{
    fn new(a: &[[f64; S]; S], b: &[[f64; INPUTS]; S], h: f64) -> Self {
        const { assert!(C == S + 4 * INPUTS) };
        let mut m = SMatrix::<f64, C, C>::zeros();
        for i in 0..S {
            for j in 0..S {
                m[(i, j)] = h * a[i][j];
            }
            for j in 0..INPUTS {
                m[(i, S + j)] = h * b[i][j];
            }
        }
        for k in S..C - INPUTS {
            m[(k, k + INPUTS)] = 1.0;
        }
        let exponential = m.exp();
        let mut columns = [[0.0; S]; C];
        let mut scale = 1.0;
        for (j, column) in columns.iter_mut().enumerate() {
            if j > S && (j - S).is_multiple_of(INPUTS) {
                scale *= h;
            }
            for (i, value) in column.iter_mut().enumerate() {
                *value = scale * exponential[(i, j)];
            }
        }
        Self { columns, further: None }
    }

    /// z(h) from z(0); derivatives of the inputs above the `order`-th are zero.
    #[inline]
    fn apply(&self, state: &[f64; S], inputs: [&Taylor; INPUTS], order: usize) -> [f64; S] {
        let mut z = [0.0; S];
        add(&mut z, &self.columns[..S], state);
        for k in 0..=order {
            let [u, w] = inputs;
            add(&mut z, &self.columns[S + k * INPUTS..], &[u[k], w[k]]);
        }
        z
    }
}

/// Γ₄ and Γ₅ by columns, from the exponential with two more derivatives of the inputs.
fn further<const S: usize>(
    a: &[[f64; S]; S],
    b: &[[f64; INPUTS]; S],
    h: f64,
) -> [[f64; S]; 2 * INPUTS] {
    let all = S + 6 * INPUTS;
    let mut m = DMatrix::<f64>::zeros(all, all);
    for i in 0..S {
        for j in 0..S {
            m[(i, j)] = h * a[i][j];
        }
        for j in 0..INPUTS {
            m[(i, S + j)] = h * b[i][j];
        }
    }
    for k in S..all - INPUTS {
        m[(k, k + INPUTS)] = 1.0;
    }
    let exponential = m.exp();
    let first = S + 4 * INPUTS;
    std::array::from_fn(|j| {
        let scale = h * h * h * h * if j < INPUTS { 1.0 } else { h };
        std::array::from_fn(|i| scale * exponential[(i, first + j)])
    })
}

/// z += Σⱼ columnⱼ·valueⱼ.
#[inline]
fn add<const S: usize>(z: &mut [f64; S], columns: &[[f64; S]], values: &[f64]) {
    for (column, value) in columns.iter().zip(values) {
        for (z, entry) in z.iter_mut().zip(column) {
            *z += entry * value;
        }
    }
}

/// Highest derivative of two inputs that is not zero.
#[inline]
pub(crate) fn order(inputs: [&Taylor; INPUTS]) -> usize {
    let [u, w] = inputs;
    (1..4).rev().find(|&k| u[k] != 0.0 || w[k] != 0.0).unwrap_or(0)
}

/// Number of step sizes in the cache. A caller that computes its steps as differences of times uses
/// a few sizes that differ in their last bits.
const REMEMBERED: usize = 8;

/// Caches the maps of recent step sizes, for the system that a key of `K` numbers determines.
///
/// A cached map equals the newly computed one, so a cache affects only the speed.
#[derive(Debug, Clone)]
pub(crate) struct MapCache<const K: usize, const S: usize, const C: usize> {
    key: [f64; K],
    maps: [Option<(f64, StepMap<S, C>)>; REMEMBERED],
    /// Indices of the map used last and of the map to replace next.
    last: usize,
    oldest: usize,
}

impl<const K: usize, const S: usize, const C: usize> Default for MapCache<K, S, C> {
    fn default() -> Self {
        Self { key: [f64::NAN; K], maps: [const { None }; REMEMBERED], last: 0, oldest: 0 }
    }
}

impl<const K: usize, const S: usize, const C: usize> MapCache<K, S, C>
where
    Const<C>: DimMin<Const<C>, Output = Const<C>>,
{
    /// The state after a step of size `h`. `system` gives A and B; only a new step size or key asks
    /// for them.
    #[inline]
    pub(crate) fn step<'a>(
        &mut self,
        key: &[f64; K],
        system: impl Fn() -> (&'a [[f64; S]; S], &'a [[f64; INPUTS]; S]),
        state: &[f64; S],
        (inputs, beyond): ([&Taylor; INPUTS], [Further; INPUTS]),
        h: f64,
    ) -> [f64; S] {
        let order = order(inputs);
        if self.key != *key {
            *self = Self { key: *key, ..Self::default() };
        }
        if let Some((size, map)) = &self.maps[self.last]
            && *size == h
            && beyond == [[0.0; 2]; INPUTS]
        {
            return map.apply(state, inputs, order);
        }
        let (a, b) = system();
        let map = self.find(a, b, h);
        let mut z = map.apply(state, inputs, order);
        if beyond != [[0.0; 2]; INPUTS] {
            let columns = map.further.get_or_insert_with(|| further(a, b, h));
            let [[u4, u5], [w4, w5]] = beyond;
            add(&mut z, &columns[..], &[u4, w4, u5, w5]);
        }
        z
    }

    #[cold]
    fn find(&mut self, a: &[[f64; S]; S], b: &[[f64; INPUTS]; S], h: f64) -> &mut StepMap<S, C> {
        let known =
            |map: &Option<(f64, StepMap<S, C>)>| map.as_ref().is_some_and(|(size, _)| *size == h);
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
        &mut slot.get_or_insert_with(|| (h, StepMap::new(a, b, h))).1
    }
}
