//! Force elements. Each acts on two bodies with exactly opposite resultants about any point, so
//! that no element creates momentum.

mod bushing;
mod elastic;
mod joint_force;
mod spring;

pub(crate) use bushing::{BushingElement, Rotation, Translation};
pub(crate) use elastic::ElasticRow;
pub(crate) use joint_force::JointForceElement;
pub(crate) use spring::SpringElement;
