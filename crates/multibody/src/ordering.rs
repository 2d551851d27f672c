//! Block-sparse LDLᵀ: the symbolic part, done once when a model is assembled.
//!
//! Nodes are bodies and joints. Greedy minimum fill: of the nodes that may be eliminated, the one
//! that creates the least fill is next. A body may always be eliminated (its pivot is positive
//! definite). A joint may be eliminated only when its current pivot, the Schur complement of the
//! nodes eliminated so far, is safely nonsingular in the initial pose: before any of its bodies is
//! eliminated that pivot is zero, and a beam between two spherical joints can carry only one of
//! them. Redundant joints, whose pivot would stay singular, have been refused before: see `rank`.

use crate::elimination::Elimination;
use crate::layout::{Analysis, layout};
use crate::sample::Sample;

/// Smallest eigenvalue of a joint's scaled pivot at which it may be eliminated early: safely away
/// from zero for a matrix that is used while the mechanism moves.
pub(crate) const SAFE_WHILE_MOVING: f64 = 1e-4;
/// The same for a matrix that is used only near the initial pose. Soft and stiff elements side by
/// side make pivots small there without making them uncertain.
pub(crate) const SAFE_AT_REST: f64 = 1e-7;

/// The numbers about this node differ too much in size to be factored, or overflow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unusable(pub usize);

/// The connected groups of nodes, each in ascending order.
fn components(sample: &Sample) -> Vec<Vec<usize>> {
    let n = sample.sizes.len();
    let mut seen = vec![false; n];
    let mut groups = Vec::new();
    for start in 0..n {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let mut group = vec![start];
        let mut next = 0;
        while next < group.len() {
            for &neighbour in sample.coupling[group[next]].keys() {
                if !seen[neighbour] {
                    seen[neighbour] = true;
                    group.push(neighbour);
                }
            }
            next += 1;
        }
        group.sort_unstable();
        groups.push(group);
    }
    groups
}

/// Finds elimination order and storage. `safe` is the pivot at which a joint may be eliminated before
/// its bodies; `constant` means that the bodies' diagonal blocks never change.
pub(crate) fn analyse(sample: Sample, safe: f64, constant: bool) -> Result<Analysis, Unusable> {
    let groups = components(&sample);
    let mut elimination = Elimination::new(sample);
    for group in &groups {
        if let Some(&first) = elimination.run(group, safe).first() {
            return Err(Unusable(first));
        }
    }
    let mut components = vec![0; elimination.sample.sizes.len()];
    for (k, group) in groups.iter().enumerate() {
        for &node in group {
            components[node] = k;
        }
    }
    Ok(layout(&elimination, components, constant))
}
