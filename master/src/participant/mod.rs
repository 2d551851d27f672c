//! An instance as coupling algorithms see it: fixed lists of what is sent and read in each step.

mod equal;
mod odd;
mod rate;
mod retry;
mod slow;

use std::collections::{HashMap, HashSet};
use std::ffi::{CStr, CString};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use crate::component::{Layout, Received, Sent};
use crate::coupling::signal::Taylor;
use crate::coupling::{Capabilities, Inputs, Outputs, PLACES, Unit};
use crate::description::Type;
use crate::instance::{Instance, StateId, UnitError};
use equal::Equal;
pub use odd::OddValue;
use rate::Rate;
use retry::Retry;
pub use retry::{MAX_PARTS, Rejection};
pub use slow::Between;
use slow::Slow;

/// Every so many steps are timed: reading the clock costs as much as a small unit's step. A prime,
/// so that it does not beat with a unit's own rhythm.
const TIMED: u64 = 7;

/// Wall time of an instance, extrapolated from every seventh step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Timing {
    timed: u64,
    sent: u64,
    now: bool,
    stepping: Duration,
    exchanging: Duration,
}

/// Seconds that a timed section of no content seems to take: the clock's own part.
fn clock_cost() -> f64 {
    static COST: OnceLock<f64> = OnceLock::new();
    *COST.get_or_init(|| {
        let shortest = (0..200).map(|_| Instant::now().elapsed()).min();
        shortest.unwrap_or_default().as_secs_f64()
    })
}

impl Timing {
    fn scaled(&self, time: Duration, sections: u64) -> f64 {
        if self.timed == 0 {
            return 0.0;
        }
        #[expect(clippy::cast_precision_loss, reason = "counts of steps")]
        let (timed, sent, sections) = (self.timed as f64, self.sent as f64, sections as f64);
        let net = time.as_secs_f64() - timed * sections * clock_cost();
        net.max(0.0) * sent / timed
    }

    /// Seconds in `fmi2DoStep`.
    #[must_use]
    pub fn step_seconds(&self) -> f64 {
        self.scaled(self.stepping, 1)
    }

    /// Seconds in the calls that set inputs and get outputs.
    #[must_use]
    pub fn exchange_seconds(&self) -> f64 {
        self.scaled(self.exchanging, 2)
    }

    fn begin_step(&mut self) {
        self.now = self.sent.is_multiple_of(TIMED);
        self.sent += 1;
        self.timed += u64::from(self.now);
    }

    #[inline]
    fn begin(&self) -> Option<Instant> {
        self.now.then(Instant::now)
    }
}

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
    layout: Layout,
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
        let layout = Layout {
            set_reals: traffic
                .real_inputs
                .iter()
                .map(|(variable, _)| reference(variable))
                .collect(),
            set_integers: references(&traffic.integer_inputs),
            set_booleans: references(&traffic.boolean_inputs),
            get_reals: references(&reals),
            get_integers: references(&integers),
            get_booleans: references(&booleans),
            ..Layout::default()
        };
        let mut participant = Self {
            sent: Buffers::new(
                layout.set_reals.len(),
                layout.set_integers.len(),
                layout.set_booleans.len(),
            ),
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
            capabilities: declared(&instance),
            states: [None; PLACES],
            instance,
            traffic,
            timing: Timing::default(),
            rate: None,
            equal: None,
            slow: None,
            retry: None,
            rejections: Vec::new(),
        };
        participant.lay_out_derivatives();
        participant
    }

    fn lay_out_derivatives(&mut self) {
        let variables = &self.instance.package().description().variables;
        let flat = |list: &[(usize, usize)]| -> (Vec<u32>, Vec<i32>) {
            list.iter()
                .flat_map(|&(variable, highest)| {
                    let reference = variables[variable].value_reference;
                    (1..=3).take(highest).map(move |order| (reference, order))
                })
                .unzip()
        };
        let layout = &mut self.layout;
        (layout.set_derivatives, layout.set_orders) = flat(&self.traffic.real_inputs);
        (layout.get_derivatives, layout.get_orders) = flat(&self.traffic.real_outputs);
        self.sent.derivatives = vec![0.0; layout.set_derivatives.len()];
        self.received.derivatives = vec![0.0; layout.get_derivatives.len()];
        self.laid_out = false;
    }

    /// Finds out which output derivatives the unit gives, up to those wanted, and keeps to them.
    /// Call at the start of stepping. Returns the orders on offer per Real output.
    ///
    /// # Errors
    /// Only a fatal one: an output whose derivative is refused is taken from history instead.
    pub fn probe_outputs(&mut self) -> Result<Vec<usize>, UnitError> {
        let mut outputs = std::mem::take(&mut self.traffic.real_outputs);
        for (variable, highest) in &mut outputs {
            let reference =
                self.instance.package().description().variables[*variable].value_reference;
            let wanted = std::mem::take(highest);
            for order in (1..=3).take(wanted) {
                let mut value = [f64::NAN];
                let answer =
                    self.instance.get_real_output_derivatives(&[reference], &[order], &mut value);
                self.instance.still_alive()?;
                if answer.is_err() || !value[0].is_finite() {
                    break;
                }
                *highest += 1;
            }
        }
        let offered = outputs.iter().map(|(_, highest)| *highest).collect();
        self.traffic.real_outputs = outputs;
        self.lay_out_derivatives();
        Ok(offered)
    }

    /// Finds out up to which order the unit takes input derivatives, by sending zeros, and keeps
    /// to it. Call after the outputs at the start have been read. Returns the order per Real input.
    ///
    /// # Errors
    /// Only a fatal one.
    pub fn probe_inputs(&mut self) -> Result<Vec<usize>, UnitError> {
        let wanted = self.traffic.real_inputs.iter().map(|(_, highest)| *highest).max();
        let mut accepted = 0;
        for order in (1..=3).take(wanted.unwrap_or(0)) {
            let references: Vec<u32> = self
                .traffic
                .real_inputs
                .iter()
                .zip(&self.layout.set_reals)
                .filter(|((_, highest), _)| i32::try_from(*highest).is_ok_and(|h| h >= order))
                .map(|(_, &reference)| reference)
                .collect();
            let orders = vec![order; references.len()];
            let zeros = vec![0.0; references.len()];
            let answer = self.instance.set_real_input_derivatives(&references, &orders, &zeros);
            self.instance.still_alive()?;
            if answer.is_err() {
                break;
            }
            accepted += 1;
        }
        for (_, highest) in &mut self.traffic.real_inputs {
            *highest = (*highest).min(accepted);
        }
        self.lay_out_derivatives();
        Ok(self.traffic.real_inputs.iter().map(|(_, highest)| *highest).collect())
    }

    /// Highest derivative to send per Real input.
    #[must_use]
    pub fn input_orders(&self) -> Vec<usize> {
        self.traffic.real_inputs.iter().map(|(_, highest)| *highest).collect()
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

    /// Finds out whether the unit can do what it says: saves and restores its state, and asks for a
    /// directional derivative. Call before the first step.
    ///
    /// # Errors
    /// Only a fatal one.
    pub fn probe_capabilities(&mut self) -> Result<(), UnitError> {
        if self.capabilities.restore {
            let saved = self.save(0).and_then(|()| self.restore(0));
            self.instance.still_alive()?;
            self.capabilities.restore = saved.is_ok();
        }
        if self.capabilities.directional && !self.traffic.real_inputs.is_empty() {
            let mut column = vec![0.0; self.traffic.real_outputs.len()];
            let given = self.directional(0, &mut column);
            self.instance.still_alive()?;
            self.capabilities.directional = given.is_ok();
        }
        Ok(())
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

/// What the unit's description says that it can.
fn declared(instance: &Instance) -> Capabilities {
    let unit = &instance.package().description().co_simulation;
    Capabilities {
        restore: unit.can_get_and_set_fmu_state,
        variable_step: unit.can_handle_variable_communication_step_size,
        directional: unit.provides_directional_derivative,
    }
}

impl Unit for Participant {
    type Error = UnitError;

    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn save(&mut self, place: usize) -> Result<(), UnitError> {
        self.states[place] = Some(self.instance.save_state(self.states[place])?);
        if let Some(slow) = &mut self.slow {
            slow.save(place);
        }
        Ok(())
    }

    fn restore(&mut self, place: usize) -> Result<(), UnitError> {
        if let Some(slow) = &mut self.slow {
            slow.restore(place);
        }
        match self.states[place] {
            Some(state) => self.instance.restore_state(state),
            None => Ok(()),
        }
    }

    fn directional(&mut self, input: usize, column: &mut [f64]) -> Result<(), UnitError> {
        let known = self.layout.set_reals[input];
        // outputs that feed inputs come first
        let unknowns = &self.layout.get_reals[..column.len()];
        self.instance.get_directional_derivative(unknowns, &[known], &[1.0], column)
    }

    fn preset(&mut self, inputs: &Inputs) -> Result<(), UnitError> {
        let Layout { set_reals, set_integers, set_booleans, .. } = &self.layout;
        let reals: Vec<f64> = inputs.reals.iter().map(|p| p[0]).collect();
        self.instance.set_real(set_reals, &reals)?;
        self.instance.set_integer(set_integers, &inputs.integers)?;
        self.instance.set_boolean(set_booleans, &inputs.booleans)?;
        for (&reference, text) in self.string_inputs.iter().zip(&inputs.strings) {
            self.instance.set_string(reference, text)?;
        }
        self.show_inputs(inputs);
        Ok(())
    }

    fn send(&mut self, inputs: &Inputs) -> Result<(), UnitError> {
        self.timing.begin_step();
        match &mut self.slow {
            Some(slow) => {
                slow.take(inputs);
                Ok(())
            }
            None => self.send_inputs(inputs),
        }
    }

    fn begin_step(&mut self, time: f64, size: f64) -> Result<(), UnitError> {
        if self.slow.is_some() {
            return self.begin_slow_step(time, size);
        }
        match self.rate {
            // its own steps need inputs in between
            Some(_) => Ok(()),
            None => self.instance.begin_step(time, self.own_size(time, size)),
        }
    }

    fn step(&mut self, time: f64, size: f64) -> Result<(), UnitError> {
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

    fn receive(&mut self, time: f64, outputs: &mut Outputs) -> Result<(), UnitError> {
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
    fn send_inputs(&mut self, inputs: &Inputs) -> Result<(), UnitError> {
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
    fn one_step(&mut self, time: f64, size: f64) -> Result<(), UnitError> {
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
        let mut at = 0;
        for (k, (_, highest)) in self.traffic.real_inputs.iter().enumerate() {
            let p = polynomial(k, *highest);
            self.sent.reals[k] = p[0];
            // at most three: a loop is faster than a call to copy memory
            let derivatives = &mut self.sent.derivatives[at..];
            for (value, derivative) in derivatives.iter_mut().zip(&p[1..=*highest]) {
                *value = *derivative;
            }
            at += highest;
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

    fn tell_layout(&mut self) -> Result<(), UnitError> {
        self.instance.lay_out(&self.layout)?;
        self.laid_out = true;
        Ok(())
    }

    #[inline]
    fn send_values(&mut self) -> Result<(), UnitError> {
        if !self.laid_out {
            self.tell_layout()?;
        }
        let Buffers { reals, integers, booleans, derivatives, .. } = &self.sent;
        self.instance.send(&self.layout, &Sent { reals, integers, booleans, derivatives })
    }

    #[inline]
    fn receive_values(&mut self, time: f64) -> Result<(), UnitError> {
        if !self.laid_out {
            self.tell_layout()?;
        }
        let Buffers { reals, integers, booleans, derivatives, .. } = &mut self.received;
        let mut received = Received { reals, integers, booleans, derivatives };
        self.instance.receive(&self.layout, &mut received, time)
    }

    /// Strings one by one, as a unit may use the memory of one for the next.
    #[inline]
    fn receive_strings(&mut self) -> Result<(), UnitError> {
        for (text, &variable) in self.received.strings.iter_mut().zip(&self.strings) {
            let variables = &self.instance.package().description().variables;
            *text = self.instance.get_string(variables[variable].value_reference)?;
        }
        Ok(())
    }
}
