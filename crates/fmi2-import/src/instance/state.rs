//! Saving and restoring the state of an instance, and its derivatives with respect to inputs.

use super::{Backend, FmuError, FmuFault, Instance, fail};
use crate::component::{Data, Request};

/// A saved state of one instance, which owns it: valid until freed or until the instance is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateId(usize);

impl StateId {
    pub(super) fn slot(self) -> usize {
        self.0
    }
}

impl Instance {
    /// Whether the unit says that its state can be saved and restored.
    #[must_use]
    pub fn can_save_state(&self) -> bool {
        self.package.description().co_simulation.can_get_and_set_fmu_state
    }

    /// Whether the unit says that its state can be written as bytes.
    #[must_use]
    pub fn can_serialize_state(&self) -> bool {
        self.can_save_state() && self.package.description().co_simulation.can_serialize_fmu_state
    }

    /// Saves the state (`fmi2GetFMUstate`), into an earlier saved one if given, whose memory the
    /// unit uses again.
    ///
    /// # Errors
    /// The unit's.
    pub fn save_state(&mut self, into: Option<StateId>) -> Result<StateId, FmuError> {
        match self.ask(&Request::SaveState(into.map(StateId::slot)), &[])? {
            Data::Slot(slot) => Ok(StateId(slot)),
            other => self.no_state(&other),
        }
    }

    /// Returns to a saved state (`fmi2SetFMUstate`); it stays saved.
    ///
    /// # Errors
    /// The unit's, or the state has been freed.
    pub fn restore_state(&mut self, id: StateId) -> Result<(), FmuError> {
        match self.ask(&Request::RestoreState(id.0), &[])? {
            Data::None => Ok(()),
            other => self.no_state(&other),
        }
    }

    /// Frees a saved state (`fmi2FreeFMUstate`).
    ///
    /// # Errors
    /// The unit's.
    pub fn free_state(&mut self, id: StateId) -> Result<(), FmuError> {
        match self.ask(&Request::FreeState(id.0), &[])? {
            Data::None => Ok(()),
            other => self.no_state(&other),
        }
    }

    /// A saved state as bytes (`fmi2SerializeFMUstate`), for another process or another day.
    ///
    /// # Errors
    /// The unit's.
    pub fn serialize_state(&mut self, id: StateId) -> Result<Vec<u8>, FmuError> {
        match self.ask(&Request::SerializeState(id.0), &[])? {
            Data::Bytes(bytes) => Ok(bytes),
            other => self.no_state(&other),
        }
    }

    /// A saved state made of bytes (`fmi2DeSerializeFMUstate`); restore it to use it.
    ///
    /// # Errors
    /// The unit's: the bytes are not of this unit, for instance.
    pub fn deserialize_state(&mut self, bytes: &[u8]) -> Result<StateId, FmuError> {
        match self.ask(&Request::DeserializeState(bytes.to_vec()), &[])? {
            Data::Slot(slot) => Ok(StateId(slot)),
            other => self.no_state(&other),
        }
    }

    /// Derivative of unknowns along a direction of knowns (`fmi2GetDirectionalDerivative`):
    /// `out = ∂unknowns/∂knowns · seed`.
    ///
    /// # Errors
    /// The unit's.
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
