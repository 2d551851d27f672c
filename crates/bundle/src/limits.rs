//! What a bundle cannot do, because a unit inside cannot.

use bundle_table::Limits;
use fmi2_import::description::CoSimulation;
use master::system::{InstanceSetup, System};

/// Finds the first unit that lacks each capability.
pub(crate) fn limits(system: &System) -> Limits {
    let reason = |lacks: &dyn Fn(&CoSimulation) -> bool, why: &str| {
        let found = system.instances.iter().find(|it| lacks(&it.description().co_simulation))?;
        Some(format!("{} (unit {}) {why}", found.name, found.description().model_name))
    };
    let slow = |it: &&InstanceSetup| it.every > 1;
    let slow = system.instances.iter().find(slow);
    let slow =
        slow.map(|it| format!("{} steps in every {}th communication step only", it.name, it.every));
    Limits {
        variable_step: slow.or_else(|| {
            reason(
                &|it| !it.can_handle_variable_communication_step_size,
                "cannot vary its step (canHandleVariableCommunicationStepSize)",
            )
        }),
        states: reason(
            &|it| !(it.can_get_and_set_fmu_state && it.can_serialize_fmu_state),
            "cannot save and serialize its state (canGetAndSetFMUstate, canSerializeFMUstate)",
        ),
        instances: reason(
            &|it| it.can_be_instantiated_only_once_per_process,
            "can have one instance in a process only (canBeInstantiatedOnlyOncePerProcess)",
        ),
        alone: reason(&|it| it.needs_execution_tool, "needs another program (needsExecutionTool)"),
    }
}
