//! The interface table in the form that the C functions use: flat arrays by value reference.

use std::ops::Range;

use uuid::Uuid;

use crate::interface::{Data, Interface, Role, Type};
use crate::state::Mode;
use crate::values::{CText, NO_SLOT, Values};
use crate::{Error, Model, Resources};

/// What setting a real variable has to know, in one cache line with its neighbours.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RealRule {
    /// Smallest and largest value to be set; finite, so that NaN and Inf fall out as well.
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Place among the Taylor coefficients, or [`NO_SLOT`].
    pub(crate) slot: u32,
    /// Modes in which it may be set, as bits of [`Mode`].
    pub(crate) settable: u8,
    /// Has a Taylor polynomial that the importer may set.
    pub(crate) continuous: bool,
    /// Setting it may change the state before the first step, or outputs afterwards.
    pub(crate) tunable: bool,
    /// Is an output.
    pub(crate) output: bool,
}

/// What setting an integer, boolean or string variable has to know.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rule {
    pub(crate) low: i32,
    pub(crate) high: i32,
    pub(crate) settable: u8,
    pub(crate) tunable: bool,
}

/// The compiled table of one instance; never changes.
#[derive(Debug)]
pub(crate) struct Table {
    pub(crate) interface: Interface,
    pub(crate) guid: Uuid,
    pub(crate) reals: Vec<RealRule>,
    /// Highest order of time derivatives on offer, by value reference of the reals.
    pub(crate) derivatives: Vec<u32>,
    /// Rules of the other types, by `Type as usize - 1`.
    pub(crate) others: [Vec<Rule>; 3],
    /// Value references of the real inputs, by slot.
    pub(crate) real_inputs: Vec<u32>,
    /// Value references of everything real that the model computes, as ranges.
    pub(crate) computed: Vec<Range<usize>>,
    pub(crate) start: Values,
}

impl Table {
    /// Lets `M` declare itself and compiles what it declared.
    pub(crate) fn declare<M: Model>(resources: &Resources) -> Result<(M, Self), Error> {
        let mut interface = Interface::new();
        let model = M::declare(resources, &mut interface)?;
        let interface = interface.finish()?;
        let guid = crate::description::guid(&interface, resources);
        Ok((model, Self::compile(interface, guid)))
    }

    fn compile(interface: Interface, guid: Uuid) -> Self {
        let mut table = Self {
            guid,
            reals: Vec::with_capacity(interface.by_type[0].len()),
            derivatives: Vec::with_capacity(interface.by_type[0].len()),
            others: Default::default(),
            real_inputs: Vec::with_capacity(interface.real_inputs as usize),
            computed: Vec::new(),
            start: Values {
                reals: Vec::new(),
                integers: Vec::new(),
                booleans: Vec::new(),
                strings: Vec::new(),
                taylor: Vec::new(),
            },
            interface,
        };
        let interface = std::mem::replace(&mut table.interface, Interface::new());
        for variable in &interface.variables {
            let settable = settable(variable.role);
            let tunable = variable.role == Role::Tunable;
            let bounded = matches!(variable.role, Role::Parameter | Role::Tunable);
            match &variable.data {
                Data::Real { start, min, max, .. } => {
                    let is_input = variable.role == Role::Input;
                    let rule = RealRule {
                        low: min.filter(|_| bounded).unwrap_or(f64::MIN),
                        high: max.filter(|_| bounded).unwrap_or(f64::MAX),
                        slot: if is_input { table.real_inputs.len() as u32 } else { NO_SLOT },
                        settable,
                        continuous: is_input && !variable.discrete,
                        tunable,
                        output: variable.role == Role::Output,
                    };
                    table.derivatives.push(variable.derivatives);
                    table.push_real(rule, start.unwrap_or(0.0), settable == 0 && start.is_none());
                }
                Data::Integer { start, min, max } => {
                    let low = min.filter(|_| bounded).unwrap_or(i32::MIN);
                    let high = max.filter(|_| bounded).unwrap_or(i32::MAX);
                    table.others[0].push(Rule { low, high, settable, tunable });
                    table.start.integers.push(start.unwrap_or(0));
                }
                Data::Boolean { start } => {
                    table.others[1].push(Rule { low: 0, high: 0, settable, tunable });
                    table.start.booleans.push(start.unwrap_or(false));
                }
                Data::Text { start } => {
                    table.others[2].push(Rule { low: 0, high: 0, settable, tunable });
                    let text = start.as_deref().and_then(CText::new);
                    table.start.strings.push(text.unwrap_or_else(CText::empty));
                }
            }
        }
        table.interface = interface;
        table
    }

    fn push_real(&mut self, rule: RealRule, start: f64, computed: bool) {
        let reference = self.reals.len();
        if rule.slot != NO_SLOT {
            self.real_inputs.push(reference as u32);
            self.start.taylor.push([start, 0.0, 0.0, 0.0]);
        }
        if computed {
            match self.computed.last_mut() {
                Some(last) if last.end == reference => last.end += 1,
                _ => self.computed.push(reference..reference + 1),
            }
        }
        self.reals.push(rule);
        self.start.reals.push(start);
    }

    /// Name of a variable, for messages.
    pub(crate) fn name(&self, kind: Type, reference: usize) -> &str {
        self.interface.by_type[kind as usize]
            .get(reference)
            .map_or("(no such variable)", |&index| &self.interface.variables[index].name)
    }

    /// What a variable is, for messages.
    pub(crate) fn role(&self, kind: Type, reference: usize) -> Option<Role> {
        let index = *self.interface.by_type[kind as usize].get(reference)?;
        Some(self.interface.variables[index].role)
    }

    /// Usual size of a real variable, 1 where none is declared.
    pub(crate) fn nominal(&self, reference: usize) -> f64 {
        let index = self.interface.by_type[Type::Real as usize][reference];
        match self.interface.variables[index].data {
            Data::Real { nominal: Some(nominal), .. } => nominal,
            _ => 1.0,
        }
    }

    /// The first computed value that is not finite.
    #[inline]
    pub(crate) fn not_finite(&self, values: &Values) -> Option<usize> {
        for range in &self.computed {
            // v·0 is NaN exactly for what is not finite, and a sum of zeros vectorises.
            let sum = values.reals[range.clone()].iter().fold(0.0, |sum, v| sum + v * 0.0);
            if sum != 0.0 {
                return range.clone().find(|&k| !values.reals[k].is_finite());
            }
        }
        None
    }

    /// Whether deserialized values have this table's shape.
    pub(crate) fn fits(&self, values: &Values) -> bool {
        let start = &self.start;
        values.reals.len() == start.reals.len()
            && values.integers.len() == start.integers.len()
            && values.booleans.len() == start.booleans.len()
            && values.strings.len() == start.strings.len()
            && values.taylor.len() == start.taylor.len()
            && values.strings.iter().all(CText::is_well_formed)
    }
}

/// Modes in which a variable may be set. Inputs already while instantiated, as FMPy and fmuCheck
/// do, and everything that has a start value before the experiment is set up, as OMSimulator does.
fn settable(role: Role) -> u8 {
    let before = Mode::Instantiated.bit() | Mode::Initialization.bit();
    match role {
        Role::Input | Role::Tunable => before | Mode::Step.bit(),
        Role::Parameter => before,
        Role::CalculatedParameter | Role::Output | Role::Local | Role::Constant => 0,
    }
}
