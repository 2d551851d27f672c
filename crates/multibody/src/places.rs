//! Where the blocks of the saddle-point matrix are stored.

use crate::block::{BlockPlace, CompactIndex};

/// Where a joint's blocks for a and for b are stored.
pub(crate) type JointPlaces = [Option<BlockPlace>; 2];

/// Where the blocks of the saddle-point matrix are stored.
#[derive(Debug, Clone)]
pub(crate) struct BlockPlaces {
    /// Diagonal block of each body; `None` where its factor is constant.
    pub bodies: Vec<Option<CompactIndex>>,
    /// Blocks (joint, a) and (joint, b); `None` for the ground.
    pub joints: Vec<JointPlaces>,
}
