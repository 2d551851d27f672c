//! Saved states, as `fmi2GetFMUstate` returns them, and their serialised form.

use serde::{Deserialize, Serialize};
use uuid::Uuid;

use crate::Error;
use crate::erased::SavedModelState;
use crate::instance::{ExportedInstance, InstanceProgress};
use crate::state::InstanceMode;
use crate::values::Values;

/// A saved state of an instance: everything that changes. Valid for every instance of the unit.
pub(crate) struct Snapshot {
    guid: Uuid,
    progress: InstanceProgress,
    values: Values,
    saved: SavedModelState,
    /// The serialised form, kept between the calls for its size and for its content.
    bytes: Option<Vec<u8>>,
}

/// Start of every serialised state; the last digit is the version of the layout.
const MAGIC: [u8; 8] = *b"FMI2ST01";
/// Magic, GUID and the length of what follows.
const HEADER: usize = 8 + 16 + 8;
/// Checksum at the end.
const TRAILER: usize = 8;

#[derive(Serialize, Deserialize)]
struct Payload<V> {
    progress: InstanceProgress,
    values: V,
    state: Vec<u8>,
}

impl Snapshot {
    pub(crate) fn take(instance: &mut ExportedInstance) -> Result<Self, Error> {
        instance.check_saves()?;
        let mut snapshot = Self {
            guid: instance.guid(),
            progress: instance.progress,
            values: instance.values.clone(),
            saved: None,
            bytes: None,
        };
        instance.model.save(&mut snapshot.saved)?;
        Ok(snapshot)
    }

    /// Saves the state again in the same memory.
    pub(crate) fn retake(&mut self, instance: &mut ExportedInstance) -> Result<(), Error> {
        self.guid = instance.guid();
        self.progress = instance.progress;
        self.values.clone_from(&instance.values);
        instance.model.save(&mut self.saved)?;
        self.bytes = None;
        Ok(())
    }

    pub(crate) fn restore(&self, instance: &mut ExportedInstance) -> Result<(), Error> {
        if self.guid != instance.guid() {
            return Err(Error::invalid("the saved state belongs to another unit"));
        }
        instance.model.restore(&self.saved)?;
        instance.values.clone_from(&self.values);
        instance.progress = self.progress;
        let restored = instance.model.restored(&mut instance.values);
        if restored.is_err() {
            instance.progress.mode = InstanceMode::Error;
        }
        restored
    }

    /// The state as bytes, valid in another process with the same unit.
    pub(crate) fn serialize(&mut self, instance: &ExportedInstance) -> Result<&[u8], Error> {
        if self.guid != instance.guid() {
            return Err(Error::invalid("the saved state belongs to another unit"));
        }
        if self.bytes.is_none() {
            self.bytes = Some(self.to_bytes(instance)?);
        }
        Ok(self.bytes.as_deref().unwrap_or_default())
    }

    fn to_bytes(&self, instance: &ExportedInstance) -> Result<Vec<u8>, Error> {
        let state = instance.model.serialize(&self.saved)?;
        let payload = Payload { progress: self.progress, values: &self.values, state };
        let payload = postcard::to_stdvec(&payload)
            .map_err(|error| Error::caused(&error).context("serialising"))?;
        let mut bytes = Vec::with_capacity(HEADER + payload.len() + TRAILER);
        bytes.extend_from_slice(&MAGIC);
        bytes.extend_from_slice(self.guid.as_bytes());
        bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
        bytes.extend_from_slice(&payload);
        bytes.extend_from_slice(&checksum(&bytes).to_le_bytes());
        Ok(bytes)
    }

    pub(crate) fn deserialize(bytes: &[u8], instance: &ExportedInstance) -> Result<Self, Error> {
        instance.check_saves()?;
        let payload = payload(bytes, &instance.guid())?;
        let payload: Payload<Values> = postcard::from_bytes(payload)
            .map_err(|error| Error::caused(&error).context("the serialised state is damaged"))?;
        let Payload { progress, values, state } = payload;
        if !instance.table.fits(&values) || progress.mode == InstanceMode::Poisoned {
            return Err(Error::invalid("the serialised state does not fit the unit's variables"));
        }
        let saved = instance.model.deserialize(&state)?;
        Ok(Self { guid: instance.guid(), progress, values, saved, bytes: None })
    }
}

/// Checks header and checksum and returns the payload.
fn payload<'b>(bytes: &'b [u8], guid: &Uuid) -> Result<&'b [u8], Error> {
    let damaged = |what| Err(Error::invalid(format!("the serialised state is damaged: {what}")));
    if bytes.len() < HEADER + TRAILER {
        return damaged("it is too short");
    }
    if bytes[..7] != MAGIC[..7] {
        return damaged("its header is wrong");
    }
    if bytes[7] != MAGIC[7] {
        let text = "the serialised state was written by another version of the unit";
        return Err(Error::invalid(text));
    }
    if bytes[8..24] != *guid.as_bytes() {
        return Err(Error::invalid("the serialised state belongs to another unit"));
    }
    let length = u64_at(bytes, 24);
    if length != (bytes.len() - HEADER - TRAILER) as u64 {
        return damaged("its length is wrong");
    }
    let end = bytes.len() - TRAILER;
    if u64_at(bytes, end) != checksum(&bytes[..end]) {
        return damaged("its checksum is wrong");
    }
    Ok(&bytes[HEADER..end])
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

/// FNV-1a with 64 bits: detects damage, not manipulation.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
