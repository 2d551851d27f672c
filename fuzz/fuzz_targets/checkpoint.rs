//! Any bytes as a checkpoint: a sound one or a named error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use master::run::Checkpoint;

fuzz_target!(|bytes: &[u8]| {
    let _ = Checkpoint::decode(bytes);
});
