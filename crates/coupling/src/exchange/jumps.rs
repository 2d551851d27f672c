//! Inputs that are held over a step, and the effect of their changes.
//!
//! Values that are not Real are held over a step from its beginning on, like Real signals that change
//! at communication points only. When a held input changes, the outputs of its unit jump or kink at the
//! beginning of the step ([`Effect`]), and so do those of the units that it feeds.

use super::Exchange;
use super::layout::Source;
use crate::index::{InputIndex, UnitIndex};
use crate::links::{Input, Links, WholeOutput};
use crate::signal::Effect;

/// Whether jumps can reach each unit: those with held inputs, and all that they feed in turn.
pub(super) fn reachable(links: &[Links]) -> Vec<bool> {
    let mut targets: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
    for (target, unit) in links.iter().enumerate() {
        for link in &unit.reals {
            targets[link.unit].push(target);
        }
    }
    let mut reachable = vec![false; links.len()];
    let mut new: Vec<usize> = (0..links.len()).filter(|&k| links[k].holds()).collect();
    while let Some(k) = new.pop() {
        if !std::mem::replace(&mut reachable[k], true) {
            new.extend(&targets[k]);
        }
    }
    reachable
}

impl Exchange {
    /// Computes the inputs that come from values that are not Real.
    pub(super) fn fill_held(&mut self, k: UnitIndex) {
        let (inputs, links, begin) = (&mut self.inputs[k], &self.links[k], &self.now.begin);
        for &input in &self.whole_inputs[k] {
            inputs.reals[input][0] = 0.0;
        }
        for link in &links.wholes {
            let value = f64::from(link.from.value(begin));
            inputs.reals[link.input][0] += link.factor * value + link.offset;
        }
        for (input, link) in inputs.integers.iter_mut().zip(&links.integers) {
            *input = link.convert(link.from.value(begin));
        }
        for (input, link) in inputs.booleans.iter_mut().zip(&links.booleans) {
            *input = link.value(begin);
        }
        for (input, link) in inputs.strings.iter_mut().zip(&links.strings) {
            input.clone_from(&begin[link.unit].strings[link.output]);
        }
    }

    /// Finds the effect on a unit's outputs of jumps of its inputs at the beginning of the step.
    pub(super) fn find_effects(&mut self, k: UnitIndex) {
        let Self { now, sources, links, jumped, .. } = self;
        let (begin, before) = (&now.begin, &now.before);
        let links = &links[k];
        jumped.clear();
        let real = |source: &Source| {
            (Input::Real(source.input), now.signals[source.signal].effect_on_targets())
        };
        jumped.extend(sources[k].iter().map(real));
        let whole = |it: WholeOutput| Effect::jump_if(it.value(begin) != it.value(before));
        jumped.extend(links.wholes.iter().map(|link| (Input::Real(link.input), whole(link.from))));
        for (k, link) in links.integers.iter().enumerate() {
            jumped.push((Input::Integer(InputIndex(k)), whole(link.from)));
        }
        for (k, link) in links.booleans.iter().enumerate() {
            let changed = link.value(begin) != link.value(before);
            jumped.push((Input::Boolean(InputIndex(k)), Effect::jump_if(changed)));
        }
        for (k, link) in links.strings.iter().enumerate() {
            let (new, old) = (&begin[link.unit].strings, &before[link.unit].strings);
            let changed = new[link.output] != old[link.output];
            jumped.push((Input::String(InputIndex(k)), Effect::jump_if(changed)));
        }
        jumped.retain(|(_, effect)| *effect != Effect::None);
        let mine = self.first[k.0]..self.first[k.0 + 1];
        for (signal, origin) in now.signals[mine.clone()].iter_mut().zip(&self.origins[mine]) {
            let effect_on_output = |&(input, effect): &(Input, Effect)| match effect {
                effect if links.is_direct(origin.output, input) => effect,
                Effect::Jump => Effect::Kink,
                _ => Effect::None,
            };
            let mut worst = origin.always;
            for effect in jumped.iter().map(effect_on_output) {
                worst = worst.max(effect);
                if worst == Effect::Jump {
                    break;
                }
            }
            signal.set_effect(worst);
        }
    }
}
