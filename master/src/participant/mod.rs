//! An instance as coupling algorithms see it: fixed lists of variables to send and to read in each step.

mod calls;
mod derivatives;
mod equal;
mod odd;
mod offers;
mod rate;
mod retry;
mod slow;
mod stall;
mod stepping;
mod timing;
mod variables;

use std::collections::HashMap;
use std::ffi::CStr;

use self::equal::Equal;
pub use self::odd::OddValue;
use self::rate::Rate;
use self::retry::Retry;
pub use self::retry::{MAX_PARTS, Rejection};
pub use self::slow::Between;
use self::slow::Slow;
use self::stall::Watch;
pub use self::stall::{STALLED, Stall};
pub use self::timing::Timing;
use self::variables::{Buffers, slots};
pub use self::variables::{ExchangedVariables, ItemCheck, Slot, VariableLists};
use crate::system::VariableIndex;
use coupling::{Capabilities, OutputIndex, PLACES};
use fmi2_import::description::Causality;
use fmi2_import::exchange::StepLayout;
use fmi2_import::instance::{FmuError, Instance, StateId};
use fmi2_import::per_type::PerType;

/// An instance with the variables that it exchanges.
pub struct Participant {
    instance: Instance,
    variables: ExchangedVariables,
    timing: Timing,
    capabilities: Capabilities,
    states: [Option<StateId>; PLACES],
    layout: StepLayout,
    /// whether the instance knows the layout
    laid_out: bool,
    sent: Buffers,
    received: Buffers,
    /// value references of the String inputs
    string_inputs: Vec<u32>,
    /// variables that are read: outputs that feed inputs come first, then those that are only watched
    read: PerType<Vec<VariableIndex>>,
    slots: HashMap<VariableIndex, Slot>,
    /// per Real that is read, whether it has been reported as NaN or infinite
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
    /// whether it has not returned a derivative of an output that it declares
    withholds_outputs: bool,
    refusal_reported: bool,
    /// per Real input, the places of its derivatives among those sent
    places: Vec<[usize; 5]>,
    /// per Real input, the Real outputs that depend on it directly; computed when first needed
    feeds: Option<Vec<Vec<usize>>>,
}

impl Participant {
    /// Prepares an instance to exchange these variables.
    #[must_use]
    pub fn new(instance: Instance, exchanged: ExchangedVariables) -> Self {
        let variables = &instance.package().description().variables;
        let reference = |&variable: &VariableIndex| variables[variable].value_reference;
        let references =
            |list: &[VariableIndex]| -> Vec<u32> { list.iter().map(reference).collect() };
        let read = exchanged.read(variables);
        let is_computed = |&place: &usize| {
            let causality = variables[read.reals[place]].causality;
            matches!(causality, Causality::Output | Causality::Local)
        };
        let computed = (0..read.reals.len()).filter(is_computed).collect();
        let inputs = &exchanged.inputs;
        let layout = StepLayout {
            set: PerType {
                reals: inputs.reals.iter().map(|(variable, _)| reference(variable)).collect(),
                integers: references(&inputs.integers),
                booleans: references(&inputs.booleans),
                strings: (),
            },
            get: PerType {
                reals: references(&read.reals),
                integers: references(&read.integers),
                booleans: references(&read.booleans),
                strings: (),
            },
            ..StepLayout::default()
        };
        let mut participant = Self {
            sent: Buffers::new(&PerType { strings: 0, ..inputs.lengths() }),
            received: Buffers::new(&read.lengths()),
            string_inputs: references(&inputs.strings),
            layout,
            laid_out: false,
            slots: slots(&read),
            known_odd: vec![false; read.reals.len()],
            odd_values: Vec::new(),
            read,
            capabilities: offers::capabilities(&instance),
            states: [None; PLACES],
            instance,
            variables: exchanged,
            timing: Timing::default(),
            rate: None,
            equal: None,
            slow: None,
            retry: None,
            rejections: Vec::new(),
            watch: Watch::new(computed),
            held: false,
            withholds_outputs: false,
            refusal_reported: false,
            places: Vec::new(),
            feeds: None,
        };
        participant.lay_out_derivatives();
        participant
    }

    /// The instance, without the states that this participant has saved.
    ///
    /// # Errors
    /// A saved state cannot be freed.
    pub fn release(mut self) -> Result<Instance, FmuError> {
        for state in self.states.into_iter().flatten() {
            self.instance.free_state(state)?;
        }
        Ok(self.instance)
    }

    /// Whether Real inputs are connected.
    #[must_use]
    pub fn takes_reals(&self) -> bool {
        !self.variables.inputs.reals.is_empty()
    }

    /// Whether Real outputs feed inputs.
    #[must_use]
    pub fn gives_reals(&self) -> bool {
        !self.variables.outputs.reals.is_empty()
    }

    /// Position of a variable among the Real outputs that feed inputs.
    #[must_use]
    pub fn output(&self, variable: VariableIndex) -> Option<OutputIndex> {
        match self.slots.get(&variable) {
            Some(&Slot::Real(k)) if k < self.variables.outputs.reals.len() => Some(OutputIndex(k)),
            _ => None,
        }
    }

    /// Latest value of a Real output that feeds inputs.
    #[must_use]
    pub fn real_output(&self, variable: VariableIndex) -> Option<f64> {
        self.output(variable).map(|output| self.received.values.reals[output])
    }

    /// Highest derivative that the signals of its Real inputs provide where an input does not take it.
    #[must_use]
    pub fn wanted_order(&self) -> usize {
        self.variables.wanted_order
    }

    /// The variables that it exchanges.
    #[must_use]
    pub fn variables(&self) -> &ExchangedVariables {
        &self.variables
    }

    /// Wall time of its calls.
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

    /// The place of a variable that is read.
    #[must_use]
    pub fn slot(&self, variable: VariableIndex) -> Option<Slot> {
        self.slots.get(&variable).copied()
    }

    /// Latest value of a String that is read.
    #[must_use]
    pub fn text(&self, slot: Slot) -> Option<&CStr> {
        match slot {
            Slot::String(k) => Some(&self.received.values.strings[k]),
            _ => None,
        }
    }

    /// Latest value of a variable that is read; true is 1, and a String is NaN.
    #[inline]
    #[must_use]
    pub fn value(&self, slot: Slot) -> f64 {
        let values = &self.received.values;
        match slot {
            Slot::Real(k) => values.reals[k],
            Slot::Integer(k) => f64::from(values.integers[k]),
            Slot::Boolean(k) => f64::from(u8::from(values.booleans[k] != 0)),
            Slot::String(_) => f64::NAN,
        }
    }
}
