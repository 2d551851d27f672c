//! Any text as a modelDescription.xml: read, and asked what a run asks.
#![no_main]

use libfuzzer_sys::fuzz_target;
use fmi2_import::description::ModelDescription;

fuzz_target!(|text: &str| {
    let Ok(description) = ModelDescription::parse(text) else { return };
    for index in 0..description.variables.len() {
        let _ = description.unit_of(index);
        let _ = description.enumeration_of(index);
        let _ = description.step_dependencies(index);
        let _ = description.initial_dependencies(index);
    }
});
