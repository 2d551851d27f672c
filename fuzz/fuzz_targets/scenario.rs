//! Any text as a scenario: read, checked, its patterns expanded, printed and read again.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use patterns;
use scenario::{Recorded, Scenario};

fuzz_target!(|text: &str| {
    let path = Path::new("scenario.json");
    let Ok(scenario) = Scenario::parse(text, path) else { return };
    let _ = scenario.check();
    let signals = scenario.record.signals.iter().flat_map(|recorded| match recorded {
        Recorded::Signal(signal) => std::slice::from_ref(signal),
        Recorded::Group(group) => &group.signals,
    });
    for name in scenario.instances.keys().chain(signals) {
        let _ = pattern::expand(name);
    }
    for connection in &scenario.connections {
        for target in connection.to.as_slice() {
            let _ = pattern::matches(&connection.from, target);
        }
    }
});
