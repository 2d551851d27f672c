//! Block-sparse LDLᵀ: the symbolic part, done once when a model is assembled.
//!
//! Nodes are bodies and joints. Greedy minimum fill: of the nodes that may be eliminated, the one
//! that creates the least fill is next. A body may always be eliminated (its pivot is positive
//! definite). A joint may be eliminated only when its current pivot, the Schur complement of the
//! nodes eliminated so far, is safely nonsingular in the initial pose: before any of its bodies is
//! eliminated that pivot is zero, and a beam between two spherical joints can carry only one of
//! them. A joint whose pivot stays singular after everything else has been eliminated is redundant.

use crate::elimination::{Dependency, Elimination};
use crate::layout::{Analysis, layout};
use crate::sample::Sample;

/// Smallest eigenvalue of a joint's scaled pivot at which it may be eliminated early: safely away
/// from zero for a matrix that is used while the mechanism moves.
pub(crate) const SAFE_WHILE_MOVING: f64 = 1e-4;
/// The same for a matrix that is used only near the initial pose. Soft and stiff elements side by
/// side make pivots small there without making them uncertain.
pub(crate) const SAFE_AT_REST: f64 = 1e-7;
/// Why a matrix cannot be factored.
#[derive(Debug, Clone)]
pub(crate) enum AnalysisFailure {
    /// Equations that follow from others.
    Dependent(Vec<Dependency>),
    /// The numbers about this node differ too much in size, or overflow.
    Unusable(usize),
}

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

/// Finds elimination order and storage, or the dependencies among the joints. `safe` is the pivot
/// at which a joint may be eliminated before its bodies; `constant` means that the bodies' diagonal
/// blocks never change.
pub(crate) fn analyse(
    sample: Sample,
    safe: f64,
    constant: bool,
) -> Result<Analysis, AnalysisFailure> {
    let groups = components(&sample);
    let mut elimination = Elimination::new(sample);
    let mut left = Vec::new();
    for group in &groups {
        left.extend(elimination.run(group, safe));
    }
    if let Some(&first) = left.first() {
        // only joints may be left, and only with equations that depend on each other
        if let Some(&body) = left.iter().find(|k| **k < elimination.sample.bodies) {
            return Err(AnalysisFailure::Unusable(body));
        }
        let found = elimination.dependencies(&left);
        let none = found.is_empty();
        return Err(if none {
            AnalysisFailure::Unusable(first)
        } else {
            AnalysisFailure::Dependent(found)
        });
    }
    let mut components = vec![0; elimination.sample.sizes.len()];
    for (k, group) in groups.iter().enumerate() {
        for &node in group {
            components[node] = k;
        }
    }
    Ok(layout(&elimination, components, constant))
}
