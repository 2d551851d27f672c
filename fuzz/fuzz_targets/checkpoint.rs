//! Any bytes as a checkpoint, and as the content of one whose checksum is right: a sound one or a named
//! error.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use maglev::run::{CHECKPOINT_VERSION, Checkpoint};

fuzz_target!(|bytes: &[u8]| {
    let _ = Checkpoint::decode(bytes);
    let mut framed = b"maglev checkpoint\n".to_vec();
    framed.extend_from_slice(&CHECKPOINT_VERSION.to_le_bytes());
    framed.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
    framed.extend_from_slice(&crc32fast::hash(bytes).to_le_bytes());
    framed.extend_from_slice(bytes);
    if let Ok(checkpoint) = Checkpoint::decode(&framed) {
        let _ = checkpoint.scenario(Path::new("results"));
    }
});
