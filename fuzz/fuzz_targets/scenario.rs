//! Any text as a scenario: read, checked, its patterns expanded, printed and read again.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use master::pattern;
use master::scenario::Scenario;

fuzz_target!(|text: &str| {
    let path = Path::new("scenario.json");
    let Ok(scenario) = Scenario::parse(text, path) else { return };
    let _ = scenario.check();
    for name in scenario.instances.keys().chain(&scenario.record.signals) {
        let _ = pattern::is_pattern(name);
    }
    for connection in &scenario.connections {
        for target in connection.to.as_slice() {
            let _ = pattern::matches(&connection.from, target);
        }
    }
});
