//! An instance as coupling algorithms see it: fixed lists of what is sent and read in each step.

mod derivatives;
mod equal;
mod odd;
mod offers;
mod rate;
mod retry;
mod slow;
mod stall;
mod timing;

use std::collections::{HashMap, HashSet};
use std::ffi::{CStr, CString};
use std::sync::Arc;

use crate::coupling::signal::Taylor;
use crate::coupling::{Capabilities, Inputs, Outputs, PLACES, Unit};
use equal::Equal;

use fmi2_import::description::{Causality, Type};
use fmi2_import::exchange::{Received, Sent, StepLayout};
use fmi2_import::instance::{FmuError, Instance, StateId};
use fmi2_import::per_type::PerType;
pub use odd::OddValue;
use rate::Rate;
use retry::Retry;
pub use retry::{MAX_PARTS, Rejection};
pub use slow::Between;
use slow::Slow;
use stall::Watch;
pub use stall::{STALLED, Stall};
pub use timing::Timing;

/// What one instance exchanges; variables by their index in the description.
#[derive(Debug, Clone, Default)]
pub struct Traffic {
    /// Connected Real inputs, and the highest derivative to send for each.
    pub real_inputs: Vec<(usize, usize)>,
    /// Connected Integer and Enumeration inputs.
    pub integer_inputs: Vec<usize>,
    /// Connected Boolean inputs.
    pub boolean_inputs: Vec<usize>,
    /// Connected String inputs.
    pub string_inputs: Vec<usize>,
    /// Whether derivatives of all orders go to the unit in one call.
    pub one_call: bool,
    /// Highest derivative that the signals of its Real inputs have to give.
    pub wanted_order: usize,
    /// Real outputs that feed inputs, and the highest derivative to read of each.
    pub real_outputs: Vec<(usize, usize)>,
    /// Integer and Enumeration outputs that feed inputs.
    pub integer_outputs: Vec<usize>,
    /// Boolean outputs that feed inputs.
    pub boolean_outputs: Vec<usize>,
    /// String outputs that feed inputs.
    pub string_outputs: Vec<usize>,
    /// Variables to read besides, for recording.
    pub watched: Vec<usize>,
    /// What Integer outputs may be, for the Enumerations that take them.
    pub items: Vec<ItemCheck>,
}

/// The values that an Enumeration takes from an Integer output.
#[derive(Debug, Clone)]
pub struct ItemCheck {
    /// Which of the Integer outputs.
    pub output: usize,
    /// The same by its index in the description.
    pub variable: usize,
    /// Values of the items, from output to input, sorted.
    pub items: Arc<[(i32, i32)]>,
    /// `instance.variable` of the input.
    pub target: String,
}

/// An instance with its traffic laid out flat.
pub struct Participant {
    instance: Instance,
    traffic: Traffic,
    timing: Timing,
    capabilities: Capabilities,
    states: [Option<StateId>; PLACES],
    layout: StepLayout,
    /// whether the instance knows the layout
    laid_out: bool,
    sent: Buffers,
    received: Buffers,
    string_inputs: Vec<u32>,
    /// Reals that are read: outputs that feed inputs come first, then what is only watched
    reals: Vec<usize>,
    /// Strings that are read, likewise
    strings: Vec<usize>,
    /// where each variable read is among those of its type
    slots: HashMap<usize, Slot>,
    /// per Real read, whether it is known to have been NaN or infinite
    known_odd: Vec<bool>,
    odd_values: Vec<OddValue>,
    rate: Option<Rate>,
    equal: Option<Equal>,
    slow: Option<Slow>,
    retry: Option<Retry>,
    rejections: Vec<Rejection>,
    watch: Watch,
    /// whether the unit has refused derivatives of inputs and gets values only
    held: bool,
    /// whether it has not given a derivative of an output that it declares
    withholds_outputs: bool,
    refusal_told: bool,
    /// per Real input, where its derivatives are among those sent
    places: Vec<[usize; 3]>,
    /// per Real input, which of the Real outputs follow it at once; made when first asked for
    feeds: Option<Vec<Vec<usize>>>,
}

/// Values of one direction.
#[derive(Debug, Default)]
struct Buffers {
    reals: Vec<f64>,
    integers: Vec<i32>,
    booleans: Vec<i32>,
    derivatives: Vec<f64>,
    strings: Vec<CString>,
}

impl Buffers {
    fn new(reals: usize, integers: usize, booleans: usize) -> Self {
        Self {
            reals: vec![0.0; reals],
            integers: vec![0; integers],
            booleans: vec![0; booleans],
            derivatives: Vec::new(),
            strings: Vec::new(),
        }
    }
}

/// Where a watched variable is found in its participant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// Position among the Reals.
    Real(usize),
    /// Position among the Integers.
    Integer(usize),
    /// Position among the Booleans.
    Boolean(usize),
    /// Position among the Strings.
    String(usize),
}

impl Participant {
    /// Lays out the traffic of an instance.
    #[must_use]
    pub fn new(instance: Instance, traffic: Traffic) -> Self {
        let variables = &instance.package().description().variables;
        let reference = |&variable: &usize| variables[variable].value_reference;
        let references = |list: &[usize]| -> Vec<u32> { list.iter().map(reference).collect() };
        let with_watched = |outputs: Vec<usize>, kinds: &[Type]| {
            let mut list = outputs;
            let mut known: HashSet<usize> = list.iter().copied().collect();
            for &variable in &traffic.watched {
                if kinds.contains(&variables[variable].kind) && known.insert(variable) {
                    list.push(variable);
                }
            }
            list
        };
        let feeding = traffic.real_outputs.iter().map(|&(variable, _)| variable).collect();
        let reals = with_watched(feeding, &[Type::Real]);
        let integers =
            with_watched(traffic.integer_outputs.clone(), &[Type::Integer, Type::Enumeration]);
        let booleans = with_watched(traffic.boolean_outputs.clone(), &[Type::Boolean]);
        let strings = with_watched(traffic.string_outputs.clone(), &[Type::String]);
        let is_computed = |&place: &usize| {
            let causality = variables[reals[place]].causality;
            matches!(causality, Causality::Output | Causality::Local)
        };
        let computed = (0..reals.len()).filter(is_computed).collect();
        let layout = StepLayout {
            set: PerType {
                reals: traffic
                    .real_inputs
                    .iter()
                    .map(|(variable, _)| reference(variable))
                    .collect(),
                integers: references(&traffic.integer_inputs),
                booleans: references(&traffic.boolean_inputs),
                strings: (),
            },
            get: PerType {
                reals: references(&reals),
                integers: references(&integers),
                booleans: references(&booleans),
                strings: (),
            },
            ..StepLayout::default()
        };
        let set = &layout.set;
        let mut participant = Self {
            sent: Buffers::new(set.reals.len(), set.integers.len(), set.booleans.len()),
            received: Buffers {
                strings: vec![CString::default(); strings.len()],
                ..Buffers::new(reals.len(), integers.len(), booleans.len())
            },
            string_inputs: references(&traffic.string_inputs),
            layout,
            laid_out: false,
            slots: slots(&reals, &integers, &booleans, &strings),
            known_odd: vec![false; reals.len()],
            odd_values: Vec::new(),
            reals,
            strings,
            capabilities: offers::capabilities(&instance),
            states: [None; PLACES],
            instance,
            traffic,
            timing: Timing::default(),
            rate: None,
            equal: None,
            slow: None,
            retry: None,
            rejections: Vec::new(),
            watch: Watch::new(computed),
            held: false,
            withholds_outputs: false,
            refusal_told: false,
            places: Vec::new(),
            feeds: None,
        };
        participant.lay_out_derivatives();
        participant
    }

    /// Whether Real inputs are connected.
    #[must_use]
    pub fn takes_reals(&self) -> bool {
        !self.traffic.real_inputs.is_empty()
    }

    /// Whether Real outputs feed inputs.
    #[must_use]
    pub fn gives_reals(&self) -> bool {
        !self.traffic.real_outputs.is_empty()
    }

    /// Position of a variable among the Real outputs that feed inputs.
    #[must_use]
    pub fn output(&self, variable: usize) -> Option<usize> {
        match self.slots.get(&variable) {
            Some(&Slot::Real(k)) => Some(k).filter(|&k| k < self.traffic.real_outputs.len()),
            _ => None,
        }
    }

    /// Latest value of a Real output that feeds inputs.
    #[must_use]
    pub fn real_output(&self, variable: usize) -> Option<f64> {
        self.output(variable).map(|k| self.received.reals[k])
    }

    /// Highest derivative that the signals of its Real inputs have to give.
    #[must_use]
    pub fn wanted_order(&self) -> usize {
        self.traffic.wanted_order
    }

    /// The Real inputs and the Real outputs that it exchanges, by index in the description.
    #[must_use]
    pub fn exchanged_reals(&self) -> (Vec<usize>, Vec<usize>) {
        let variables = |list: &[(usize, usize)]| list.iter().map(|(it, _)| *it).collect();
        (variables(&self.traffic.real_inputs), variables(&self.traffic.real_outputs))
    }

    /// Where its wall time went.
    #[must_use]
    pub fn timing(&self) -> &Timing {
        &self.timing
    }

    /// The instance itself.
    #[must_use]
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// The instance itself.
    pub fn instance_mut(&mut self) -> &mut Instance {
        &mut self.instance
    }

    /// Where a watched variable's value is found.
    #[must_use]
    pub fn slot(&self, variable: usize) -> Option<Slot> {
        self.slots.get(&variable).copied()
    }

    /// A watched String's latest value.
    #[must_use]
    pub fn text(&self, slot: Slot) -> Option<&CStr> {
        match slot {
            Slot::String(k) => Some(&self.received.strings[k]),
            _ => None,
        }
    }

    /// A watched variable's latest value; true counts as 1, and a text is not a number.
    #[inline]
    #[must_use]
    pub fn value(&self, slot: Slot) -> f64 {
        match slot {
            Slot::Real(k) => self.received.reals[k],
            Slot::Integer(k) => f64::from(self.received.integers[k]),
            Slot::Boolean(k) => f64::from(u8::from(self.received.booleans[k] != 0)),
            Slot::String(_) => f64::NAN,
        }
    }
}

/// Where each variable is found.
fn slots(
    reals: &[usize],
    integers: &[usize],
    booleans: &[usize],
    strings: &[usize],
) -> HashMap<usize, Slot> {
    fn entries(list: &[usize], slot: fn(usize) -> Slot) -> impl Iterator<Item = (usize, Slot)> {
        list.iter().enumerate().map(move |(k, &variable)| (variable, slot(k)))
    }
    entries(reals, Slot::Real)
        .chain(entries(integers, Slot::Integer))
        .chain(entries(booleans, Slot::Boolean))
        .chain(entries(strings, Slot::String))
        .collect()
}

impl Unit for Participant {
    type Error = FmuError;

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn save(&mut self, place: usize) -> Result<(), FmuError> {
        self.states[place] = Some(self.instance.save_state(self.states[place])?);
        if let Some(slow) = &mut self.slow {
            slow.save(place);
        }
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), FmuError> {
        if let Some(slow) = &mut self.slow {
            slow.restore(place);
        }
        match self.states[place] {
            Some(state) => self.instance.restore_state(state),
            None => Ok(()),
        }
    }

    fn directional(&mut self, input: usize, column: &mut [f64]) -> Result<(), FmuError> {
        self.column(input, column)
    }

    fn preset(&mut self, inputs: &Inputs) -> Result<(), FmuError> {
        let set = &self.layout.set;
        let reals: Vec<f64> = inputs.reals.iter().map(|p| p[0]).collect();
        self.instance.set_real(&set.reals, &reals)?;
        self.instance.set_integer(&set.integers, &inputs.integers)?;
        self.instance.set_boolean(&set.booleans, &inputs.booleans)?;
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            self.instance.set_string(reference, text)?;
        }
        self.show_inputs(inputs);
        Ok(())
    }

    fn send(&mut self, inputs: &Inputs) -> Result<(), FmuError> {
        self.timing.begin_step();
        match &mut self.slow {
            Some(slow) => {
                slow.take(inputs);
                Ok(())
            }
            None => self.send_inputs(inputs),
        }
    }

    fn begin_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        if self.slow.is_some() {
            return self.begin_slow_step(time, size);
        }
        match self.rate {
            // its own steps need inputs in between
            Some(_) => Ok(()),
            None => self.instance.begin_step(time, self.own_size(time, size)),
        }
    }

    fn step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let begin = self.timing.begin();
        if self.slow.is_some() {
            self.slow_step(time, size)?;
        } else if self.rate.is_some() {
            self.own_steps(time, size)?;
        } else {
            self.one_step(time, size)?;
        }
        if let Some(begin) = begin {
            self.timing.stepping += begin.elapsed();
        }
        Ok(())
    }

    fn receive(&mut self, time: f64, outputs: &mut Outputs) -> Result<(), FmuError> {
        let begin = self.timing.begin();
        // between its own points, a slow unit's outputs are held
        if !self.slow.as_ref().is_some_and(Slow::waits) {
            self.receive_values(time)?;
            self.receive_strings()?;
        }
        for (text, received) in outputs.strings.iter_mut().zip(&self.received.strings) {
            text.clone_from(received);
        }
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        // 0·x is zero unless x is NaN or infinite: one sum tells of all values
        let suspicious: f64 = self.received.reals.iter().map(|x| x * 0.0).sum();
        if suspicious != 0.0 {
            self.judge_odd_values(time)?;
        }
        if self.instance.warnings().steps() != self.watch.seen() {
            self.watch_out(time);
        }
        let mut derivatives = self.received.derivatives.iter();
        for (k, &(variable, highest)) in self.traffic.real_outputs.iter().enumerate() {
            let point = &mut outputs.reals[k];
            point[0] = self.received.reals[k];
            for (place, &value) in point[1..=highest].iter_mut().zip(&mut derivatives) {
                if !value.is_finite() {
                    return Err(self.instance.not_finite(variable, value, time).into());
                }
                *place = value;
            }
        }
        let feeding = outputs.integers.len();
        outputs.integers.copy_from_slice(&self.received.integers[..feeding]);
        for check in &self.traffic.items {
            let value = outputs.integers[check.output];
            if check.items.binary_search_by_key(&value, |item| item.0).is_err() {
                return Err(self.instance.no_item(check.variable, value, &check.target, time));
            }
        }
        let feeding = outputs.booleans.len();
        outputs.booleans.copy_from_slice(&self.received.booleans[..feeding]);
        Ok(())
    }
}

impl Participant {
    #[inline]
    fn send_inputs(&mut self, inputs: &Inputs) -> Result<(), FmuError> {
        self.sent.integers.copy_from_slice(&inputs.integers);
        self.sent.booleans.copy_from_slice(&inputs.booleans);
        match &mut self.rate {
            Some(rate) => rate.take(&inputs.reals),
            None => self.fill(|k, _| inputs.reals[k]),
        }
        if let Some(retry) = &mut self.retry {
            retry.inputs.copy_from_slice(&inputs.reals);
        }
        let begin = self.timing.begin();
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            self.instance.set_string(reference, text)?;
        }
        if self.rate.is_none() {
            self.send_values()?;
        }
        if let Some(begin) = begin {
            self.timing.exchanging += begin.elapsed();
        }
        Ok(())
    }

    #[inline]
    fn one_step(&mut self, time: f64, size: f64) -> Result<(), FmuError> {
        let size = self.own_size(time, size);
        match self.instance.do_step(time, size) {
            Err(error) => self.step_in_parts(time, size, error),
            Ok(()) => Ok(()),
        }
    }

    /// Puts the Real inputs into what is sent next: from an input's position and the highest
    /// derivative that it takes to the polynomial that stands for it.
    #[inline]
    fn fill(&mut self, polynomial: impl Fn(usize, usize) -> Taylor) {
        for (k, (_, highest)) in self.traffic.real_inputs.iter().enumerate() {
            let p = polynomial(k, *highest);
            self.sent.reals[k] = p[0];
            for (place, derivative) in self.places[k].iter().zip(&p[1..=*highest]) {
                self.sent.derivatives[*place] = *derivative;
            }
        }
    }

    /// Puts inputs in the place of what was read of them, as they cannot be read again before a step.
    fn show_inputs(&mut self, inputs: &Inputs) {
        let Self { traffic, slots, received, .. } = self;
        for ((variable, _), p) in traffic.real_inputs.iter().zip(&inputs.reals) {
            if let Some(&Slot::Real(k)) = slots.get(variable) {
                received.reals[k] = p[0];
            }
        }
        for (variable, value) in traffic.integer_inputs.iter().zip(&inputs.integers) {
            if let Some(&Slot::Integer(k)) = slots.get(variable) {
                received.integers[k] = *value;
            }
        }
        for (variable, value) in traffic.boolean_inputs.iter().zip(&inputs.booleans) {
            if let Some(&Slot::Boolean(k)) = slots.get(variable) {
                received.booleans[k] = *value;
            }
        }
        for (variable, value) in traffic.string_inputs.iter().zip(&inputs.strings) {
            if let Some(&Slot::String(k)) = slots.get(variable) {
                received.strings[k].clone_from(value);
            }
        }
    }

    fn tell_layout(&mut self) -> Result<(), FmuError> {
        self.instance.lay_out(&self.layout)?;
        self.laid_out = true;
        Ok(())
    }

    #[inline]
    fn send_values(&mut self) -> Result<(), FmuError> {
        if !self.laid_out {
            self.tell_layout()?;
        }
        let Buffers { reals, integers, booleans, derivatives, .. } = &self.sent;
        let values =
            PerType { reals: &**reals, integers: &**integers, booleans: &**booleans, strings: () };
        self.instance.send(&self.layout, &Sent { values, derivatives })
    }

    #[inline]
    fn receive_values(&mut self, time: f64) -> Result<(), FmuError> {
        if !self.laid_out {
            self.tell_layout()?;
        }
        let Buffers { reals, integers, booleans, derivatives, .. } = &mut self.received;
        let values = PerType {
            reals: &mut **reals,
            integers: &mut **integers,
            booleans: &mut **booleans,
            strings: (),
        };
        self.instance.receive(&self.layout, &mut Received { values, derivatives }, time)
    }

    /// Strings one by one, as a unit may use the memory of one for the next.
    #[inline]
    fn receive_strings(&mut self) -> Result<(), FmuError> {
        for (text, &variable) in self.received.strings.iter_mut().zip(&self.strings) {
            let variables = &self.instance.package().description().variables;
            *text = self.instance.get_string(variables[variable].value_reference)?;
        }
        Ok(())
    }
}
