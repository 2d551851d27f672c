//! The fixed layout of an exchange: the signals of each unit, and the sources of each input.

use std::collections::{HashMap, HashSet};

use crate::index::{InputIndex, OutputIndex, SignalIndex, UnitIndex};
use crate::links::{Links, RealLink};

/// One Real source of a Real input.
pub(super) struct Source {
    pub(super) signal: SignalIndex,
    pub(super) input: InputIndex,
    /// whether it is the first of its input; others are added
    pub(super) first: bool,
    pub(super) limit: usize,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

/// An output and the way to represent it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Form {
    pub(super) output: OutputIndex,
    pub(super) degree: usize,
    pub(super) held: bool,
    pub(super) kinks: bool,
}

impl Form {
    pub(super) fn of(link: &RealLink, degree: usize) -> Self {
        let degree = if link.held { 0 } else { link.degree.unwrap_or(degree) };
        Self { output: link.output, degree, held: link.held, kinks: link.kinks }
    }
}

/// The signals of each unit: its outputs with the general degree, then in the other forms that links
/// ask for. Also the position of each among the unit's signals.
pub(super) type Forms = (Vec<Vec<Form>>, HashMap<(UnitIndex, Form), usize>);

pub(super) fn lay_out(links: &[Links], degree: usize) -> Forms {
    let general = |unit: &Links| {
        let outputs = (0..unit.offered.len()).map(OutputIndex);
        outputs.map(|output| Form { output, degree, held: false, kinks: false }).collect()
    };
    let mut forms: Vec<Vec<Form>> = links.iter().map(general).collect();
    let mut places: HashMap<(UnitIndex, Form), usize> = HashMap::new();
    for (unit, forms) in forms.iter().enumerate() {
        let keys = forms.iter().enumerate();
        places.extend(keys.map(|(place, &form)| ((UnitIndex(unit), form), place)));
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

/// Largest number of inputs of a unit. Each source of a sum counts.
pub(super) fn most_inputs(links: &[Links]) -> usize {
    links.iter().map(|unit| unit.units().count()).max().unwrap_or(0)
}

/// The Real inputs that only Integers and Booleans feed.
pub(super) fn whole_inputs(links: &Links) -> Vec<InputIndex> {
    let real: HashSet<InputIndex> = links.reals.iter().map(|link| link.input).collect();
    links.wholes.iter().map(|link| link.input).filter(|input| !real.contains(input)).collect()
}

/// The Real sources of a unit's inputs.
pub(super) fn sources(links: &Links, signal_of: impl Fn(&RealLink) -> SignalIndex) -> Vec<Source> {
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
