//! Indices of units, their inputs and outputs, and the signals between them.

index_types! {
    /// Position of a unit in the list of all units.
    UnitIndex;
    /// Position among a unit's inputs of one type.
    InputIndex;
    /// Position among a unit's outputs of one type.
    OutputIndex;
    /// Number of a signal: there is one per Real output and way to represent it over a step.
    SignalIndex;
}
