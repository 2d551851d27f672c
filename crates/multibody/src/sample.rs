//! The block matrix in the initial pose, as the analysis eliminates it.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use crate::kernels::BlockSize;

/// A symmetric block matrix in the initial pose, for the analysis.
pub(crate) struct Sample {
    pub sizes: Vec<BlockSize>,
    /// Nodes below this are bodies, the rest joints.
    pub bodies: usize,
    pub diagonal: Vec<DMatrix<f64>>,
    /// Block (i, j) for every coupled pair, in both directions.
    pub coupling: Vec<BTreeMap<usize, DMatrix<f64>>>,
}

impl Sample {
    pub fn new(sizes: Vec<BlockSize>, bodies: usize) -> Self {
        let diagonal = sizes.iter().map(|s| DMatrix::zeros(s.get(), s.get())).collect();
        let coupling = vec![BTreeMap::new(); sizes.len()];
        Self { sizes, bodies, diagonal, coupling }
    }

    /// Adds to the block (i, j), i ≠ j, and its transpose.
    pub fn couple(&mut self, i: usize, j: usize, block: &DMatrix<f64>) {
        let (rows, cols) = (self.sizes[i].get(), self.sizes[j].get());
        *self.coupling[i].entry(j).or_insert_with(|| DMatrix::zeros(rows, cols)) += block;
        *self.coupling[j].entry(i).or_insert_with(|| DMatrix::zeros(cols, rows)) +=
            block.transpose();
    }
}
