//! Indices of instances and of their variables.

use coupling::index_types;

index_types! {
    /// Position of an instance in [`System::instances`](super::System::instances).
    InstanceIndex;
    /// Position of a variable in its unit's description.
    VariableIndex;
}

/// A variable of an instance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Port {
    /// The instance.
    pub instance: InstanceIndex,
    /// The variable.
    pub variable: VariableIndex,
}
