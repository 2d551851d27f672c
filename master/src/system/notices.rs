//! Defects of the units that a run tolerates, as notices. A strict run refuses what the standard forbids.

use std::collections::HashSet;

use super::System;
use fmi2_import::description::Finding;
use fmi2_import::package::Package;

/// A notice if a unit cannot vary its step and this one is not a multiple of its own.
fn unfit_step(package: &Package, step: f64) -> Option<String> {
    let description = package.description();
    if description.co_simulation.can_handle_variable_communication_step_size {
        return None;
    }
    let own = description.default_experiment.step_size.filter(|own| *own > 0.0)?;
    let ratio = step / own;
    let multiple = ratio.round().max(1.0);
    ((ratio - multiple).abs() > 1e-9 * multiple).then(|| {
        format!(
            "the unit cannot vary its step (canHandleVariableCommunicationStepSize is false) and \
             declares {own} s: a step of {step} s, which is not a multiple of it, may fail"
        )
    })
}

/// One line per rule: the first message, and how many more there are.
fn grouped(findings: &[Finding]) -> Vec<String> {
    let mut rules: Vec<(&str, &str, usize)> = Vec::new();
    for finding in findings {
        match rules.iter_mut().find(|(rule, ..)| *rule == finding.rule) {
            Some(known) => known.2 += 1,
            None => rules.push((finding.rule, &finding.message, 0)),
        }
    }
    let more = |n: usize| if n == 0 { String::new() } else { format!(" (and {n} more like it)") };
    rules.into_iter().map(|(_, message, n)| format!("{message}{}", more(n))).collect()
}

impl System {
    /// Defects of units and scenario that are tolerated: one line per unit and rule.
    #[must_use]
    pub fn notices(&self, step: f64) -> Vec<String> {
        let mut seen = HashSet::new();
        let mut notices = self.notes.clone();
        for instance in &self.instances {
            let path = instance.package.path();
            if !seen.insert(path) {
                continue;
            }
            let mut texts = grouped(instance.package.findings());
            texts.extend(unfit_step(&instance.package, step));
            notices.extend(texts.into_iter().map(|text| format!("{}: {text}", path.display())));
        }
        notices
    }
}
