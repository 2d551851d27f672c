//! Saving, restoring and serialising of states.

use core::ffi::c_char;

use super::instance::TestInstance;
use super::log::CallFailure;
use crate::ffi;

impl TestInstance {
    /// Saves the state for [`TestInstance::restore`].
    ///
    /// # Errors
    /// The call fails.
    pub fn save(&mut self) -> Result<(), CallFailure> {
        // SAFETY: the place holds null or the state saved before.
        let status = unsafe { ffi::get_fmu_state(self.component, &raw mut self.saved) };
        self.check("fmi2GetFMUstate", status)
    }

    /// Restores the state that was saved last.
    ///
    /// # Errors
    /// Nothing was saved, or the call fails.
    pub fn restore(&mut self) -> Result<(), CallFailure> {
        // SAFETY: null or the state saved last.
        let status = unsafe { ffi::set_fmu_state(self.component, self.saved) };
        self.check("fmi2SetFMUstate", status)
    }

    /// The serialised state.
    ///
    /// # Errors
    /// One of the calls fails.
    pub fn serialize(&mut self) -> Result<Vec<u8>, CallFailure> {
        self.save()?;
        let mut size = 0;
        // SAFETY: the state saved last, and a place for a number.
        let status =
            unsafe { ffi::serialized_fmu_state_size(self.component, self.saved, &raw mut size) };
        self.check("fmi2SerializedFMUstateSize", status)?;
        let mut bytes = vec![0_u8; size];
        let out = bytes.as_mut_ptr().cast::<c_char>();
        // SAFETY: the array has the size stated.
        let status = unsafe { ffi::serialize_fmu_state(self.component, self.saved, out, size) };
        self.check("fmi2SerializeFMUstate", status).map(|()| bytes)
    }

    /// Restores a serialised state.
    ///
    /// # Errors
    /// The bytes are not a state of this unit.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result<(), CallFailure> {
        let (pointer, size) = (bytes.as_ptr().cast::<c_char>(), bytes.len());
        // SAFETY: the array has the size stated; the place holds null or the state saved before.
        let status = unsafe {
            ffi::deserialize_fmu_state(self.component, pointer, size, &raw mut self.saved)
        };
        self.check("fmi2DeSerializeFMUstate", status)?;
        self.restore()
    }
}
