//! Messages between master and worker outside of steps: frames of bytes over a socket.

use std::io::{self, Read, Write};
use std::path::PathBuf;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::exchange::StepLayout;
use crate::request::{Identity, Reply, Request};

/// From the master.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Order {
    /// First: load the library and create the instance.
    Start {
        /// the .fmu file, for messages
        unit: PathBuf,
        binary: PathBuf,
        identity: Identity,
        /// bytes of address space
        memory: Option<u64>,
    },
    /// What steps send and receive from now on.
    LayOut(StepLayout),
    /// Anything else.
    Perform(Request),
    /// Last: free the instance and end.
    Free,
}

/// From the worker, one for each order.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Report {
    /// Done.
    Done,
    /// The library cannot be loaded: messages of the error and its causes.
    Unloadable(Vec<String>),
    /// The FMU refused to be instantiated.
    Refused,
    /// The answer to a request.
    Reply(Reply),
}

/// Writes a frame: its length and its bytes.
pub(super) fn write_frame(to: &mut impl Write, frame: &impl Serialize) -> io::Result<()> {
    let mut bytes = vec![0; 8];
    bytes.extend(postcard::to_stdvec(frame).map_err(io::Error::other)?);
    let length = (bytes.len() - 8) as u64;
    bytes[..8].copy_from_slice(&length.to_le_bytes());
    to.write_all(&bytes)
}

/// Reads a frame.
pub(super) fn read_frame<T: DeserializeOwned>(from: &mut impl Read) -> io::Result<T> {
    let mut length = [0; 8];
    from.read_exact(&mut length)?;
    let length = u64::from_le_bytes(length);
    let mut bytes = Vec::new();
    from.take(length).read_to_end(&mut bytes)?;
    postcard::from_bytes(&bytes).map_err(io::Error::other)
}
