//! Indices of bodies, joints, magnets and observed bodies. Each has a type of its own, so that they
//! cannot be mixed up: a described body and the composite that it belongs to have different
//! numbers.

use std::ops::{Index, IndexMut};

macro_rules! index_types {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub usize);

        impl<T> Index<$name> for [T] {
            type Output = T;
            #[inline]
            fn index(&self, k: $name) -> &T {
                &self[k.0]
            }
        }

        impl<T> IndexMut<$name> for [T] {
            #[inline]
            fn index_mut(&mut self, k: $name) -> &mut T {
                &mut self[k.0]
            }
        }

        impl<T> Index<$name> for Vec<T> {
            type Output = T;
            #[inline]
            fn index(&self, k: $name) -> &T {
                &self[k.0]
            }
        }

        impl<T> IndexMut<$name> for Vec<T> {
            #[inline]
            fn index_mut(&mut self, k: $name) -> &mut T {
                &mut self[k.0]
            }
        }
    )*};
}

index_types! {
    /// A composite body: index into [`State::bodies`](crate::State::bodies). Inside this crate the
    /// index after the last body is the ground.
    BodyIndex
    /// A body of the description, before fixed joints are merged.
    MemberIndex
    /// A joint that is left after merging, in the order of
    /// [`VehicleModel::joint_names`](crate::VehicleModel::joint_names).
    JointIndex
    /// A group of jointed bodies. Accelerations depend directly only on forces on the same group.
    ComponentIndex
    /// A magnet, in the order of the description.
    MagnetIndex
    /// An observed body, in the order of the description.
    ObservedIndex
}

impl BodyIndex {
    /// The body's six rows in a vector of velocities or accelerations.
    pub(crate) fn rows(self) -> std::ops::Range<usize> {
        6 * self.0..6 * self.0 + 6
    }
}
