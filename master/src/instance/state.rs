//! Saving and restoring the state of an instance, and its derivatives with respect to inputs.

use fmi2_sys as sys;

use super::{Instance, UnitError, UnitFault, call, fail};

/// A saved state of one instance, which owns it: valid until freed or until the instance is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StateId(usize);

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
    pub fn save_state(&mut self, into: Option<StateId>) -> Result<StateId, UnitError> {
        let slot = into.map_or(self.states.len(), |id| id.0);
        let mut state = self.states.get(slot).copied().unwrap_or(std::ptr::null_mut());
        let status = call!(self, get_fmu_state, "fmi2GetFMUstate", &raw mut state);
        self.check(status, "fmi2GetFMUstate", &[])?;
        match self.states.get_mut(slot) {
            Some(place) => *place = state,
            None => self.states.push(state),
        }
        Ok(StateId(slot))
    }

    /// Returns to a saved state (`fmi2SetFMUstate`); it stays saved.
    ///
    /// # Errors
    /// The unit's, or the state has been freed.
    pub fn restore_state(&mut self, id: StateId) -> Result<(), UnitError> {
        let state = self.state(id)?;
        let status = call!(self, set_fmu_state, "fmi2SetFMUstate", state);
        self.check(status, "fmi2SetFMUstate", &[])
    }

    /// Frees a saved state (`fmi2FreeFMUstate`).
    ///
    /// # Errors
    /// The unit's.
    pub fn free_state(&mut self, id: StateId) -> Result<(), UnitError> {
        let mut state = self.state(id)?;
        self.states[id.0] = std::ptr::null_mut();
        let status = call!(self, free_fmu_state, "fmi2FreeFMUstate", &raw mut state);
        self.check(status, "fmi2FreeFMUstate", &[])
    }

    /// A saved state as bytes (`fmi2SerializeFMUstate`), for another process or another day.
    ///
    /// # Errors
    /// The unit's.
    pub fn serialize_state(&mut self, id: StateId) -> Result<Vec<u8>, UnitError> {
        let state = self.state(id)?;
        let mut size = 0;
        let status = call!(
            self,
            serialized_fmu_state_size,
            "fmi2SerializedFMUstateSize",
            state,
            &raw mut size
        );
        self.check(status, "fmi2SerializedFMUstateSize", &[])?;
        let mut bytes = vec![0_u8; size];
        let place = bytes.as_mut_ptr().cast();
        let status = call!(self, serialize_fmu_state, "fmi2SerializeFMUstate", state, place, size);
        self.check(status, "fmi2SerializeFMUstate", &[])?;
        Ok(bytes)
    }

    /// A saved state made of bytes (`fmi2DeSerializeFMUstate`); restore it to use it.
    ///
    /// # Errors
    /// The unit's: the bytes are not of this unit, for instance.
    pub fn deserialize_state(&mut self, bytes: &[u8]) -> Result<StateId, UnitError> {
        let mut state = std::ptr::null_mut();
        let status = call!(
            self,
            deserialize_fmu_state,
            "fmi2DeSerializeFMUstate",
            bytes.as_ptr().cast(),
            bytes.len(),
            &raw mut state
        );
        self.check(status, "fmi2DeSerializeFMUstate", &[])?;
        self.states.push(state);
        Ok(StateId(self.states.len() - 1))
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
    ) -> Result<(), UnitError> {
        let status = call!(
            self,
            get_directional_derivative,
            "fmi2GetDirectionalDerivative",
            unknowns.as_ptr(),
            unknowns.len().min(out.len()),
            knowns.as_ptr(),
            knowns.len().min(seed.len()),
            seed.as_ptr(),
            out.as_mut_ptr()
        );
        self.check(status, "fmi2GetDirectionalDerivative", unknowns)
    }

    fn state(&self, id: StateId) -> Result<sys::fmi2FMUstate, UnitError> {
        match self.states.get(id.0) {
            Some(state) if !state.is_null() => Ok(*state),
            _ => fail(UnitFault::NoState { instance: self.name.clone() }),
        }
    }

    pub(super) fn free_states(&mut self) {
        let Some(free) = self.functions.free_fmu_state else { return };
        for mut state in self.states.drain(..).filter(|state| !state.is_null()) {
            // SAFETY: the component is alive, the state is one of its own and freed once
            unsafe { free(self.component, &raw mut state) };
        }
    }
}
