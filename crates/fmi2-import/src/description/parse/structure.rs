//! ModelStructure: what outputs and initial unknowns depend on.

use std::collections::HashSet;

use roxmltree::Node;

use crate::xml::{self, Plain as _};

use super::{Reader, Result, child, children};
use crate::description::{Causality, Initial, Severity, Unknown, Variable};

impl<'a> Reader<'a> {
    pub(super) fn structure(
        &mut self,
        root: Node<'a, 'a>,
        variables: &[Variable],
    ) -> Result<(Vec<Unknown>, Vec<Unknown>)> {
        let Some(node) = child(root, "ModelStructure") else {
            self.note(
                "model-structure",
                Severity::Error,
                "<ModelStructure> is missing: every output is assumed to depend on every input"
                    .to_owned(),
            );
            return Ok((Vec::new(), Vec::new()));
        };
        let outputs = self.unknowns(node, "Outputs", variables.len())?;
        let initial = self.unknowns(node, "InitialUnknowns", variables.len())?;
        self.complete("Outputs", &outputs, variables, |variable| {
            variable.causality == Causality::Output
        });
        self.complete("InitialUnknowns", &initial, variables, |variable| {
            matches!(variable.initial, Some(Initial::Calculated | Initial::Approx))
                && matches!(variable.causality, Causality::Output | Causality::CalculatedParameter)
        });
        if !initial.is_sorted_by_key(|unknown| unknown.variable) {
            let message = "InitialUnknowns is not sorted by index".to_owned();
            self.note("structure-order", Severity::Warning, message);
        }
        Ok((outputs, initial))
    }

    /// Reports variables that are missing in a list.
    fn complete(
        &mut self,
        list: &'static str,
        unknowns: &[Unknown],
        variables: &[Variable],
        belongs: impl Fn(&Variable) -> bool,
    ) {
        let listed: HashSet<usize> = unknowns.iter().map(|unknown| unknown.variable).collect();
        let mut missing = (0..variables.len())
            .filter(|index| belongs(&variables[*index]) && !listed.contains(index));
        if let Some(first) = missing.next() {
            let (name, more) = (&variables[first].name, missing.count());
            let more = if more == 0 { String::new() } else { format!(" and {more} more") };
            let message =
                format!("{list} lacks \"{name}\"{more}, assumed to depend on every input");
            self.note("structure-incomplete", Severity::Warning, message);
        }
    }

    fn unknowns(
        &mut self,
        structure: Node<'a, 'a>,
        list: &'static str,
        count: usize,
    ) -> Result<Vec<Unknown>> {
        let mut unknowns = Vec::new();
        for node in children(structure, list, "Unknown") {
            let index: usize = self
                .number(node, "index", "the index of a variable")?
                .ok_or_else(|| self.missing(node, "index"))?;
            let Some(variable) = self.position(list, index, count) else { continue };
            let dependencies = self.dependencies(node, list, count);
            unknowns.push(Unknown { variable, dependencies });
        }
        Ok(unknowns)
    }

    /// Indices of the variables that an unknown depends on; `None` if they are missing or cannot be read.
    fn dependencies(
        &mut self,
        node: Node<'a, 'a>,
        list: &'static str,
        count: usize,
    ) -> Option<Vec<usize>> {
        let mut indices = Vec::new();
        for word in xml::words(node.attr("dependencies")?) {
            let Some(index) = xml::number::<usize>(word) else {
                let error = self.invalid(node, "dependencies", "a list of indices");
                return self.ignored(&error);
            };
            indices.extend(self.position(list, index, count));
        }
        Some(indices)
    }

    /// Position of the variable with an index counted from 1, if there is one.
    fn position(&mut self, list: &'static str, index: usize, count: usize) -> Option<usize> {
        if !(1..=count).contains(&index) {
            self.note(
                "structure-index",
                Severity::Error,
                format!("{list} refers to variable {index}, but the variables are 1 to {count}"),
            );
            return None;
        }
        Some(index - 1)
    }
}
