//! The saddle-point matrix of eq. 9 as a graph of blocks: sizes, sample in the initial pose, places.

use nalgebra::DMatrix;

use crate::composite::{Composite, mass_block};
use crate::description::JointKind;
use crate::joint::{JacobianRow, JointConstraint};
use crate::kernels::BlockSize;
use crate::layout::Analysis;
use crate::places::BlockPlaces;
use crate::sample::Sample;
use crate::state::Kinematics;

/// The nodes' sizes: bodies, then joints.
pub(crate) fn sizes(bodies: usize, joints: &[JointConstraint]) -> Vec<BlockSize> {
    let joint = |j: &JointConstraint| {
        if j.kind == JointKind::Spherical { BlockSize::Three } else { BlockSize::Five }
    };
    std::iter::repeat_n(BlockSize::Six, bodies).chain(joints.iter().map(joint)).collect()
}

/// Adds the joints' Jacobians to a matrix for the analysis.
pub(crate) fn add_jacobians(sample: &mut Sample, joints: &[JointConstraint], kin: &[Kinematics]) {
    let bodies = sample.bodies;
    for (k, joint) in joints.iter().enumerate() {
        let n = joint.equations();
        let (mut rows_a, mut rows_b) = ([JacobianRow::default(); 6], [JacobianRow::default(); 6]);
        joint.jacobian(kin, &mut rows_a[..n], &mut rows_b[..n]);
        for (body, rows) in [(joint.a, rows_a), (joint.b, rows_b)] {
            if body.0 < bodies {
                let block = DMatrix::from_fn(n, 6, |r, c| rows[r][c]);
                sample.couple(bodies + k, body.0, &block);
            }
        }
    }
}

/// The matrix of eq. 9 in the initial pose.
pub(crate) fn sample(
    composites: &[Composite],
    joints: &[JointConstraint],
    kin: &[Kinematics],
) -> Sample {
    let mut sample = Sample::new(sizes(composites.len(), joints), composites.len());
    for (diagonal, composite) in sample.diagonal.iter_mut().zip(composites) {
        diagonal.copy_from(&mass_block(composite));
    }
    add_jacobians(&mut sample, joints, kin);
    sample
}

/// Where the blocks of bodies and joints are stored.
pub(crate) fn places(
    analysis: &Analysis,
    bodies: usize,
    joints: &[JointConstraint],
) -> BlockPlaces {
    BlockPlaces {
        bodies: (0..bodies).map(|k| analysis.place(k, k).map(|place| place.offset)).collect(),
        joints: joints
            .iter()
            .enumerate()
            .map(|(k, j)| {
                // the ground is not a node
                [j.a, j.b]
                    .map(|b| (b.0 < bodies).then(|| analysis.place(bodies + k, b.0)).flatten())
            })
            .collect(),
    }
}
