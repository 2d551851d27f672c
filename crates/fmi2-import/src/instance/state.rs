//! Saved states and directional derivatives.

use super::{Backend, FmuError, FmuFault, Instance};
use crate::fault::fail;
use crate::request::{Data, Request};

/// A saved state of one instance. It is valid until it is freed or the instance is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateId(usize);

impl StateId {
    pub(super) fn slot(self) -> usize {
        self.0
    }
}

impl Instance {
    /// Whether the FMU declares that its state can be saved and restored.
    pub(super) fn can_save_state(&self) -> bool {
        self.package.description().co_simulation.can_get_and_set_fmu_state
    }

    /// Saves the state (`fmi2GetFMUstate`). The memory of an earlier saved state can be reused.
    ///
    /// # Errors
    /// The call fails.
    pub fn save_state(&mut self, into: Option<StateId>) -> Result<StateId, FmuError> {
        match self.ask(&Request::SaveState(into.map(StateId::slot)), &[])? {
            Data::Slot(slot) => Ok(StateId(slot)),
            other => self.no_state(&other),
        }
    }

    /// Restores a saved state (`fmi2SetFMUstate`), which remains saved.
    ///
    /// # Errors
    /// The call fails, or the state has been freed.
    pub fn restore_state(&mut self, id: StateId) -> Result<(), FmuError> {
        match self.ask(&Request::RestoreState(id.0), &[])? {
            Data::None => Ok(()),
            other => self.no_state(&other),
        }
    }

    /// Frees a saved state (`fmi2FreeFMUstate`).
    ///
    /// # Errors
    /// The call fails.
    pub fn free_state(&mut self, id: StateId) -> Result<(), FmuError> {
        match self.ask(&Request::FreeState(id.0), &[])? {
            Data::None => Ok(()),
            other => self.no_state(&other),
        }
    }

    /// The bytes of a saved state (`fmi2SerializeFMUstate`), for another process.
    ///
    /// # Errors
    /// The call fails.
    pub fn serialize_state(&mut self, id: StateId) -> Result<Vec<u8>, FmuError> {
        match self.ask(&Request::SerializeState(id.0), &[])? {
            Data::Bytes(bytes) => Ok(bytes),
            other => self.no_state(&other),
        }
    }

    /// Makes a saved state from bytes (`fmi2DeSerializeFMUstate`). Restore it to use it.
    ///
    /// # Errors
    /// The call fails, for instance because the bytes are of another FMU.
    pub fn deserialize_state(&mut self, bytes: &[u8]) -> Result<StateId, FmuError> {
        match self.ask(&Request::DeserializeState(bytes.to_vec()), &[])? {
            Data::Slot(slot) => Ok(StateId(slot)),
            other => self.no_state(&other),
        }
    }

    /// Directional derivative (`fmi2GetDirectionalDerivative`):
    /// `out = ∂unknowns/∂knowns · seed`.
    ///
    /// # Errors
    /// The call fails.
    pub fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result<(), FmuError> {
        self.alive()?;
        let answer = match &mut self.backend {
            Backend::Here { component, .. } => {
                component.directional_derivative(unknowns, knowns, seed, out)
            }
            Backend::Elsewhere(worker) => {
                let reply = worker.perform(&Request::GetDirectionalDerivative {
                    unknowns: unknowns.to_vec(),
                    knowns: knowns.to_vec(),
                    seed: seed.to_vec(),
                });
                reply.data.copy_reals(out);
                reply.answer
            }
        };
        self.check(answer, unknowns)
    }

    fn no_state<T>(&self, data: &Data) -> Result<T, FmuError> {
        let instance = self.name.clone();
        fail(match data {
            Data::TooLarge(size) => FmuFault::StateTooLarge { instance, size: *size },
            _ => FmuFault::NoState { instance },
        })
    }
}
