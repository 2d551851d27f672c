//! How the links of all units are laid out in an exchange: signals, their places, who feels jumps.

use std::collections::{HashMap, HashSet};

use super::exchange::SignalId;
use super::links::{Links, RealLink};

/// One Real source of a Real input.
pub(super) struct Source {
    pub(super) signal: SignalId,
    pub(super) input: usize,
    /// whether it is the first of its input: others are added
    pub(super) first: bool,
    pub(super) limit: usize,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

/// Which output a signal is, and how it is represented.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Form {
    pub(super) output: usize,
    pub(super) degree: usize,
    pub(super) held: bool,
}

impl Form {
    pub(super) fn of(link: &RealLink, degree: usize) -> Self {
        let degree = if link.held { 0 } else { link.degree.unwrap_or(degree) };
        Self { output: link.output, degree, held: link.held }
    }
}

/// The signals of each unit: its outputs with the general degree, then in the other forms asked for,
/// and the place of each among them.
pub(super) type Forms = (Vec<Vec<Form>>, HashMap<(usize, Form), usize>);

pub(super) fn lay_out(links: &[Links], degree: usize) -> Forms {
    let general = |unit: &Links| {
        (0..unit.offered.len()).map(|output| Form { output, degree, held: false }).collect()
    };
    let mut forms: Vec<Vec<Form>> = links.iter().map(general).collect();
    let mut places: HashMap<(usize, Form), usize> = HashMap::new();
    for (unit, forms) in forms.iter().enumerate() {
        places.extend(forms.iter().enumerate().map(|(place, &form)| ((unit, form), place)));
    }
    for link in links.iter().flat_map(|unit| &unit.reals) {
        let form = Form::of(link, degree);
        places.entry((link.unit, form)).or_insert_with(|| {
            forms[link.unit].push(form);
            forms[link.unit].len() - 1
        });
    }
    (forms, places)
}

/// The units that feel jumps: those with held inputs, and all that they feed in turn.
pub(super) fn feels(links: &[Links]) -> Vec<bool> {
    let mut targets: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
    for (target, unit) in links.iter().enumerate() {
        for link in &unit.reals {
            targets[link.unit].push(target);
        }
    }
    let mut feels = vec![false; links.len()];
    let mut new: Vec<usize> = (0..links.len()).filter(|&k| links[k].holds()).collect();
    while let Some(k) = new.pop() {
        if !std::mem::replace(&mut feels[k], true) {
            new.extend(&targets[k]);
        }
    }
    feels
}

/// Most inputs of a unit, each source of a sum counted.
pub(super) fn most_inputs(links: &[Links]) -> usize {
    links.iter().map(|unit| unit.units().count()).max().unwrap_or(0)
}

/// The Real inputs that only Integers and Booleans feed.
pub(super) fn whole_inputs(links: &Links) -> Vec<usize> {
    let real: HashSet<usize> = links.reals.iter().map(|link| link.input).collect();
    links.wholes.iter().map(|link| link.input).filter(|input| !real.contains(input)).collect()
}

/// The Real sources of a unit's inputs.
pub(super) fn sources(links: &Links, signal_of: impl Fn(&RealLink) -> SignalId) -> Vec<Source> {
    let mut fed = vec![false; links.real_inputs()];
    let source = |link: &RealLink| Source {
        signal: signal_of(link),
        input: link.input,
        first: !std::mem::replace(&mut fed[link.input], true),
        limit: link.limit,
        factor: link.factor,
        offset: link.offset,
    };
    links.reals.iter().map(source).collect()
}
