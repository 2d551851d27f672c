//! Saved states.

use std::ptr::null_mut;

use fmi2_sys as sys;

use super::Component;
use crate::answer::Answer;
use crate::functions::Call;
use crate::request::{Data, Reply, Request};

impl Component {
    /// Saves the state into a slot, whose memory the FMU can reuse, or into a new slot at the end.
    pub(crate) fn save_state(&mut self, slot: usize) -> Answer {
        let mut state = self.states.get(slot).copied().unwrap_or(null_mut());
        let answer =
            request!(self, get_fmu_state, fmi2GetFMUstate, ["state {slot}"], &raw mut state);
        if answer.can_continue() {
            self.put_state(slot, state);
        }
        answer
    }

    fn put_state(&mut self, slot: usize, state: sys::fmi2FMUstate) {
        match self.states.get_mut(slot) {
            Some(place) => *place = state,
            None => self.states.push(state),
        }
    }

    fn free_slot(&self) -> usize {
        self.states.iter().position(|it| it.is_null()).unwrap_or(self.states.len())
    }

    /// Requests about saved states.
    pub(super) fn state(&mut self, request: &Request) -> Reply {
        let held = |slot: usize| self.states.get(slot).copied().filter(|state| !state.is_null());
        match *request {
            Request::SaveState(into) => {
                let slot = into.unwrap_or_else(|| self.free_slot());
                Reply { answer: self.save_state(slot), data: Data::Slot(slot) }
            }
            Request::DeserializeState(ref bytes) => {
                let mut state = null_mut();
                let answer = request!(
                    self,
                    deserialize_fmu_state,
                    fmi2DeSerializeFMUstate,
                    ["{} bytes", bytes.len()],
                    bytes.as_ptr().cast(),
                    bytes.len(),
                    &raw mut state
                );
                let slot = self.free_slot();
                if answer.can_continue() {
                    self.put_state(slot, state);
                }
                Reply { answer, data: Data::Slot(slot) }
            }
            Request::RestoreState(slot) => match held(slot) {
                Some(state) => {
                    let answer =
                        request!(self, set_fmu_state, fmi2SetFMUstate, ["state {slot}"], state);
                    Reply { answer, data: Data::None }
                }
                None => no_state(Call::fmi2SetFMUstate),
            },
            Request::FreeState(slot) => match held(slot) {
                Some(mut state) => {
                    self.states[slot] = null_mut();
                    let answer = request!(
                        self,
                        free_fmu_state,
                        fmi2FreeFMUstate,
                        ["state {slot}"],
                        &raw mut state
                    );
                    Reply { answer, data: Data::None }
                }
                None => no_state(Call::fmi2FreeFMUstate),
            },
            Request::SerializeState(slot) => match held(slot) {
                Some(state) => self.serialize(state),
                None => no_state(Call::fmi2SerializeFMUstate),
            },
            _ => no_state(Call::fmi2SetFMUstate),
        }
    }

    fn serialize(&mut self, state: sys::fmi2FMUstate) -> Reply {
        let mut size = 0;
        let answer = traced!(
            self,
            Call::fmi2SerializedFMUstateSize,
            |_| {},
            invoke!(
                self,
                serialized_fmu_state_size,
                fmi2SerializedFMUstateSize,
                state,
                &raw mut size
            ),
            |it| it.item(format_args!("{size} bytes"))
        );
        if !answer.can_continue() {
            return Reply { answer, data: Data::None };
        }
        let mut bytes = Vec::new();
        if bytes.try_reserve_exact(size).is_err() {
            return Reply { answer, data: Data::TooLarge(size) };
        }
        bytes.resize(size, 0_u8);
        let place = bytes.as_mut_ptr().cast();
        let written = request!(
            self,
            serialize_fmu_state,
            fmi2SerializeFMUstate,
            ["{size} bytes"],
            state,
            place,
            size
        );
        Reply { answer: answer.or_worse(written), data: Data::Bytes(bytes) }
    }
}

fn no_state(call: Call) -> Reply {
    Reply { answer: Answer::good(call), data: Data::NoState }
}
